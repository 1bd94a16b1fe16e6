//! The zeros of equations as a surface: feet by Newton-Raphson (12).
//!
//! This is shared by surfaces given by equations and by the atlas of a point cloud, which is a
//! level set too.

use crate::Vector;
use crate::surface::Geometry;

/// Equations near a place: what [`foot`] needs.
pub(crate) trait LevelSet<const D: usize> {
    type Place: Copy;

    /// Brings `place` up to date for `x`; `false` where the equations know nothing of `x`.
    fn locate(&self, x: &Vector<D>, place: &mut Self::Place) -> bool;

    /// Puts values and gradients of the equations at `x` into `out`.
    fn gradients(&self, x: &Vector<D>, place: Self::Place, out: &mut Geometry<D>);

    /// A length of which steps beyond it mean that the iteration is lost.
    fn reach(&self, place: Self::Place) -> f64;

    /// How far from the surface a foot may be, in reaches; it is no nearer than rounding lets it
    /// be.
    fn slack(&self) -> f64 {
        0.0
    }
}

/// Most steps of Newton-Raphson to a foot.
const MOST_FOOT_STEPS: usize = 40;
/// Length of steps, as a share of the reach, below which they no longer change the place.
const SETTLED: f64 = 1e-4;
/// Curvature of a surface of unit reach that the last step allows for.
const LARGEST_CURVATURE: f64 = 16.0;

/// Newton-Raphson to the surface, x <- x - J^+ F (12). It converges quadratically, and for one
/// equation is the paper's x - F grad F / |grad F|^2. It stops when a step no longer moves `x`
/// beyond rounding, or beyond the slack allowed.
pub(crate) fn foot<const D: usize, L: LevelSet<D>>(
    level_set: &L,
    x: &Vector<D>,
    place: &mut L::Place,
    workspace: &mut Geometry<D>,
) -> Option<Vector<D>> {
    let mut x = *x;
    let mut last = f64::INFINITY;
    for _ in 0..MOST_FOOT_STEPS {
        // Near the foot the place is kept. The equations of two places differ by a little, and
        // Newton's method would go to and fro between them.
        if last > SETTLED * level_set.reach(*place) && !level_set.locate(&x, place) {
            return None;
        }
        level_set.gradients(&x, *place, workspace);
        let mut step = workspace.step_off()?;
        let length = step.norm();
        if !length.is_finite() {
            return None;
        }
        let reach = level_set.reach(*place);
        if length > reach {
            step *= reach / length;
        }
        x -= step;
        let rounding = (4.0 * f64::EPSILON * x.amax()).max(level_set.slack() * reach);
        // Convergence is quadratic: the next step is this one squared times a curvature, which is
        // the larger of the one that the last two steps show and the one that a surface of this
        // reach may have.
        let next = length * length * (length / (last * last)).max(LARGEST_CURVATURE / reach);
        if length <= rounding
            || next <= 0.25 * rounding
            || (length >= 0.5 * last && length <= 64.0 * rounding)
        {
            return Some(x);
        }
        last = length;
    }
    None
}
