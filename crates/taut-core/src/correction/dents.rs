//! The dents of rough rims (the boundary of the surface). Where a cloud ends is known to about a
//! spacing only, and paths jump what may be no surface.

use crate::correction::length;
use crate::surface::{Geometry, Node, Surface};

/// Distance between the places at which a path is looked at for rims, in chart radii.
const DENT_LOOK: f64 = 0.125;
/// Most places between two nodes at which a path is looked at for rims.
const MOST_DENT_LOOKS: f64 = 256.0;

/// How much longer the way round the dents of rough rims that a path jumps may be than the path.
pub(super) fn detour<const D: usize, S: Surface<D>>(
    surface: &S,
    nodes: &[Node<D, S::Place>],
    arc_length: &[f64],
    scratch: &mut Geometry<D>,
) -> f64 {
    let mut longest = 0.0_f64;
    if !surface.has_rims() {
        return longest;
    }
    let whole = arc_length.last().copied().unwrap_or(0.0);
    for (pair, lengths) in nodes.windows(2).zip(arc_length.windows(2)) {
        let chord = pair[1].point - pair[0].point;
        let step = DENT_LOOK * surface.resolution(pair[0].place);
        let pieces = (chord.norm() / step).ceil().clamp(1.0, MOST_DENT_LOOKS);
        let mut place = pair[0].place;
        for i in 0..pieces as usize {
            let share = i as f64 / pieces;
            let x = pair[0].point + chord * share;
            if !surface.find_place(&x, &mut place, scratch) {
                break;
            }
            if let Some((depth, _)) = surface.beyond_rim(&x, place) {
                let before = lengths[0] + share * (lengths[1] - lengths[0]);
                longest = longest.max(length::detour([before, whole - before], depth));
            }
        }
    }
    longest
}
