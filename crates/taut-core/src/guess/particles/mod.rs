//! Particles that float on a surface [3.1]: samplings of it, and the guesses of Algorithm 1.
//!
//! Particles of the same source repel each other, those of different sources attract (1)-(4); the
//! spacing that they strive for is smaller where the surface curves. Everything is measured in
//! spacings, so that the unit of length changes nothing.

mod drift;
mod joining;
mod network;
mod particle;
mod quality;
mod random;
mod sampling;
mod sources;
mod swarm;
mod walk;

pub use network::Network;
pub use quality::Quality;
pub use sampling::{Sampling, sample};

use crate::Vector;

/// How densely particles settle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spread {
    /// Denser where the surface curves more (figure 6). The spacing h follows the curvature
    /// kappa = (sum kappa_j^2)^(1/2) as h ~ (1/4 + (kappa / mean kappa)^2)^(-1/2), at most 16 to 1.
    #[default]
    Curvature,
    /// Equally densely everywhere.
    Even,
}

/// A box of R^D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region<const D: usize> {
    /// Lowest coordinates.
    pub low: Vector<D>,
    /// Highest coordinates.
    pub high: Vector<D>,
}

impl<const D: usize> Region<D> {
    /// Whether a point lies inside the box or on its boundary.
    #[must_use]
    pub fn holds(&self, x: &Vector<D>) -> bool {
        (0..D).all(|i| self.low[i] <= x[i] && x[i] <= self.high[i])
    }
}

/// Where particles may go, and how they spread.
#[derive(Clone, Copy, Debug)]
pub struct Settings<const D: usize> {
    /// A length of the order of the surface's extent, in the input's units; the first spacing.
    pub size: f64,
    /// The part of space that particles keep to; all of it if `None`.
    pub region: Option<Region<D>>,
    /// How densely the particles settle.
    pub spread: Spread,
    /// The seed of the random directions that particles are born in.
    pub seed: u64,
}

impl<const D: usize> Settings<D> {
    /// Settings for particles anywhere on a surface of the given extent, denser where it curves.
    #[must_use]
    pub fn new(size: f64) -> Self {
        Self {
            size,
            region: None,
            spread: Spread::Curvature,
            seed: 0,
        }
    }
}
