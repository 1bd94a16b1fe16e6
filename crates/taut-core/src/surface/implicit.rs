//! Surfaces given by equations F(x) = 0.

use crate::surface::level_set::{self, LevelSet};
use crate::surface::{Geometry, Surface};
use crate::{Matrix, Vector};

/// m equations F: R^D -> R^m whose common zeros are a surface of dimension D - m.
///
/// Derivatives must be exact to rounding: the correction is only as good as they are.
pub trait Equations<const D: usize>: Send + Sync {
    /// The number of equations m, which is the codimension of the surface.
    fn count(&self) -> usize;

    /// Computes values and gradients at `x`; both slices have length [`count`](Self::count).
    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]);

    /// Computes values, gradients and (symmetric) Hessians at `x`; the slices have length
    /// [`count`](Self::count).
    fn hessians(
        &self,
        x: &Vector<D>,
        values: &mut [f64],
        gradients: &mut [Vector<D>],
        hessians: &mut [Matrix<D>],
    );
}

/// One equation from a Rust closure that returns value, gradient and Hessian.
///
/// ```
/// use taut_core::{Matrix, Vector, surface::implicit::{Equation, Equations}};
/// let sphere = Equation(|x: &Vector<3>| (x.dot(x) - 1.0, x * 2.0, Matrix::<3>::identity() * 2.0));
/// assert_eq!(Equations::<3>::count(&sphere), 1);
/// ```
pub struct Equation<F>(pub F);

impl<const D: usize, F> Equations<D> for Equation<F>
where
    F: Fn(&Vector<D>) -> (f64, Vector<D>, Matrix<D>) + Send + Sync,
{
    fn count(&self) -> usize {
        1
    }

    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]) {
        (values[0], gradients[0], _) = (self.0)(x);
    }

    fn hessians(
        &self,
        x: &Vector<D>,
        values: &mut [f64],
        gradients: &mut [Vector<D>],
        hessians: &mut [Matrix<D>],
    ) {
        (values[0], gradients[0], hessians[0]) = (self.0)(x);
    }
}

/// The surface F(x) = 0.
pub struct ImplicitSurface<const D: usize, E> {
    equations: E,
    size: f64,
}

impl<const D: usize, E: Equations<D>> ImplicitSurface<D, E> {
    /// The surface of zeros of `equations`; `size` is a length of the order of the surface's
    /// extent. A pull-back never steps farther than `size` at once.
    #[must_use]
    pub fn new(equations: E, size: f64) -> Self {
        Self { equations, size }
    }

    /// The equations whose zeros are the surface.
    #[must_use]
    pub fn equations(&self) -> &E {
        &self.equations
    }

    /// A length of the order of the surface's extent.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size
    }
}

impl<const D: usize, E: Equations<D>> LevelSet<D> for ImplicitSurface<D, E> {
    type Place = ();

    fn locate(&self, _x: &Vector<D>, _place: &mut ()) -> bool {
        true
    }

    fn gradients(&self, x: &Vector<D>, _place: (), out: &mut Geometry<D>) {
        self.equations
            .gradients(x, &mut out.values, &mut out.gradients);
    }

    fn reach(&self, _place: ()) -> f64 {
        self.size
    }
}

impl<const D: usize, E: Equations<D>> Surface<D> for ImplicitSurface<D, E> {
    type Place = ();

    fn intrinsic_dimension(&self) -> usize {
        D - self.equations.count()
    }

    fn foot(&self, x: &Vector<D>, place: &mut (), scratch: &mut Geometry<D>) -> Option<Vector<D>> {
        level_set::foot(self, x, place, scratch)
    }

    fn find_place(&self, _x: &Vector<D>, _place: &mut (), _scratch: &mut Geometry<D>) -> bool {
        true
    }

    fn geometry(&self, x: &Vector<D>, _place: (), out: &mut Geometry<D>) -> bool {
        self.equations
            .hessians(x, &mut out.values, &mut out.gradients, &mut out.hessians);
        out.factor()
    }
}
