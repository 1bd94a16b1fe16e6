//! Whether two near points are a step along the surface apart.

use crate::Vector;
use crate::surface::{Geometry, Node, Surface};

/// Number of steps over a chord.
const STEPS: f64 = 3.0;
/// Number of further steps in which the walk may arrive.
const SPARE_STEPS: usize = 4;
/// Distance from the goal at which it is reached, as a share of the chord.
const ARRIVED_CHORD: f64 = 1e-3;

/// Walks along the surface towards a point; `false` where the walk leads past it, to another sheet
/// or over a rim (the boundary of the surface).
pub(super) fn walks<const D: usize, S: Surface<D>>(
    surface: &S,
    from: &Node<D, S::Place>,
    to: &Vector<D>,
    scratch: &mut Geometry<D>,
) -> bool {
    let mut at = *from;
    let chord = (to - at.point).norm();
    for _ in 0..STEPS as usize + SPARE_STEPS {
        let left = to - at.point;
        let distance = left.norm();
        if distance <= ARRIVED_CHORD * chord {
            return true;
        }
        if !surface.geometry(&at.point, at.place, scratch) {
            return false;
        }
        let step = scratch.project(&left) * (chord / (STEPS * distance)).min(1.0);
        let Some(point) = surface.foot(&(at.point + step), &mut at.place, scratch) else {
            return false;
        };
        at.point = point;
        if surface.beyond_rim(&point, at.place).is_some() {
            return false;
        }
    }
    false
}
