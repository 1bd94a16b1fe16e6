//! Surfaces given by equations F(x) = 0.

use crate::{Matrix, Vector};

/// m equations F: R^D -> R^m whose common zeros are a surface of dimension D - m.
///
/// Derivatives must be exact to rounding: the correction is only as good as they are.
pub trait Equations<const D: usize>: Send + Sync {
    /// The number of equations m, the codimension of the surface.
    fn count(&self) -> usize;

    /// Values and gradients at `x`; both slices have length [`count`](Self::count).
    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]);

    /// Values, gradients and (symmetric) Hessians at `x`; slices of length [`count`](Self::count).
    fn hessians(
        &self,
        x: &Vector<D>,
        values: &mut [f64],
        gradients: &mut [Vector<D>],
        hessians: &mut [Matrix<D>],
    );
}
