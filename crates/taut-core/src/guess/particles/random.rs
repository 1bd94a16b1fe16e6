//! Random tangent directions that depend on a seed and a number alone: SplitMix64 (Steele, Lea,
//! Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).

use crate::{Matrix, Vector};

/// A stream of random numbers.
pub(super) struct Random {
    state: u64,
}

const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

impl Random {
    /// The stream of a seed for the event with a number.
    pub fn new(seed: u64, number: u64) -> Self {
        let mut start = Self {
            state: seed ^ GOLDEN,
        };
        Self {
            state: start
                .bits()
                .wrapping_add(number.wrapping_mul(GOLDEN << 1 | 1)),
        }
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A uniform random number above 0 and below 1.
    fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// A normal random number, by the method of Box and Muller.
    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    /// A random unit tangent vector, all directions being equally likely; columns `m`..D of the
    /// basis are tangent.
    pub fn tangent<const D: usize>(&mut self, basis: &Matrix<D>, m: usize) -> Vector<D> {
        let along = |sum: Vector<D>, j: usize| sum + basis.column(j) * self.normal();
        (m..D).fold(Vector::zeros(), along).normalize()
    }
}
