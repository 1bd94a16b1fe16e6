//! Values with first and, if asked for, second derivatives, in which the blend of charts is
//! computed.
//!
//! Everything is inlined, so that what is not asked for costs nothing and sums stay in registers.

use crate::{Matrix, Vector};

/// A function's value and derivatives at a point; without `HESSIAN` the Hessian stays 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet<const D: usize, const HESSIAN: bool> {
    pub value: f64,
    pub gradient: Vector<D>,
    /// Lower triangle of the Hessian.
    pub hessian: Matrix<D>,
}

impl<const D: usize, const HESSIAN: bool> Jet<D, HESSIAN> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            value: 0.0,
            gradient: Vector::zeros(),
            hessian: Matrix::zeros(),
        }
    }

    /// A chart's weight (1 - r^2/R^2)^4 at an offset from its origin, r < R, times the chart's
    /// trust.
    #[inline(always)]
    pub fn weight(offset: &Vector<D>, radius: f64, trust: f64) -> Self {
        let inverse = 1.0 / (radius * radius);
        let inside = 1.0 - offset.norm_squared() * inverse;
        let squared = inside * inside;
        let trusted = trust * squared;
        let falling = -8.0 * trusted * inside * inverse;
        let curving = offset * (48.0 * trusted * inverse * inverse);
        let mut weight = Self {
            value: trusted * squared,
            gradient: offset * falling,
            hessian: Matrix::zeros(),
        };
        weight.add_hessian(|i, j| curving[i] * offset[j] + if i == j { falling } else { 0.0 });
        weight
    }

    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        self.value += other.value;
        self.gradient += other.gradient;
        self.add_hessian(|i, j| other.hessian[(i, j)]);
    }

    /// Adds `factor` times the product of two functions.
    #[inline(always)]
    pub fn add_product(&mut self, factor: f64, f: &Self, g: &Self) {
        let (value, slope) = (factor * g.value, g.gradient * factor);
        let scale = factor * f.value;
        self.value += f.value * value;
        self.gradient += slope * f.value + f.gradient * value;
        self.add_hessian(|i, j| {
            f.hessian[(i, j)] * value
                + g.hessian[(i, j)] * scale
                + f.gradient[i] * slope[j]
                + slope[i] * f.gradient[j]
        });
    }

    #[inline(always)]
    pub fn quotient(&self, by: &Self) -> Self {
        let inverse = 1.0 / by.value;
        let value = self.value * inverse;
        let gradient = (self.gradient - by.gradient * value) * inverse;
        let mut quotient = Self {
            value,
            gradient,
            hessian: Matrix::zeros(),
        };
        quotient.add_hessian(|i, j| {
            let crossed = gradient[i] * by.gradient[j] + by.gradient[i] * gradient[j];
            (self.hessian[(i, j)] - by.hessian[(i, j)] * value - crossed) * inverse
        });
        quotient
    }

    /// Adds entries to the Hessian's lower triangle, where there is one.
    #[inline(always)]
    pub fn add_hessian(&mut self, entry: impl Fn(usize, usize) -> f64) {
        if HESSIAN {
            for j in 0..D {
                for i in j..D {
                    self.hessian[(i, j)] += entry(i, j);
                }
            }
        }
    }
}
