//! The part of space that a sampling covers.

use crate::Vector;

/// A box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region<const D: usize> {
    pub low: Vector<D>,
    pub high: Vector<D>,
}

impl<const D: usize> Region<D> {
    /// A box about points, wider than their span on each side by that span or `size`, whichever is
    /// more.
    pub fn around(points: &[Vector<D>], size: f64) -> Self {
        let low = points
            .iter()
            .fold(Vector::<D>::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = points
            .iter()
            .fold(Vector::<D>::repeat(f64::NEG_INFINITY), |high, p| {
                high.sup(p)
            });
        let margin = Vector::repeat((high - low).norm().max(size));
        Self {
            low: low - margin,
            high: high + margin,
        }
    }

    /// The spacing that samples of a surface that fills the box may have at first.
    pub fn first_spacing(&self) -> f64 {
        (self.high - self.low).amax() / 16.0
    }

    /// The box with the same centre and twice the extent.
    pub fn doubled(&self) -> Self {
        let half = (self.high - self.low) * 0.5;
        Self {
            low: self.low - half,
            high: self.high + half,
        }
    }

    /// Whether a point lies inside the box or on its boundary.
    pub fn holds(&self, x: &Vector<D>) -> bool {
        (0..D).all(|i| self.low[i] <= x[i] && x[i] <= self.high[i])
    }
}
