//! Bundles: rays side by side as they leave a source.

use std::f64::consts::TAU;

use crate::field::rays::frame::Frame;
use crate::field::rays::knot::Knot;
use crate::field::sources::RayOrigin;

/// Number of rays that first leave every source.
const FIRST_FIELD_RAYS: usize = 32;

/// What rays leave side by side. They leave a point in directions told apart by their angle, or a
/// curve, at right angles to it, from places told apart by their arc length. These numbers grow to
/// the left, as seen along the rays.
pub(crate) struct Bundle<'a, const D: usize, P> {
    /// The distance where the rays start, in the input's units.
    pub start: f64,
    /// The angles or places of the first rays.
    pub first: Vec<f64>,
    /// Whether the rays go all round, so that the last ray has the first one to its left.
    pub is_round: bool,
    /// Makes the start of the ray with an angle or place.
    pub knot: Box<dyn Fn(f64) -> Knot<D, P> + Sync + 'a>,
}

impl<'a, const D: usize, P: Copy + Sync> Bundle<'a, D, P> {
    /// The rays that leave a point, all round or between two angles.
    pub fn of_point(origin: &RayOrigin<'_, D, P, Frame<D>>, angles: Option<[f64; 2]>) -> Self
    where
        P: 'a,
    {
        let (frame, place, near) = (*origin.frame, origin.node.place, origin.near);
        Self {
            start: origin.start,
            first: first_angles(angles),
            is_round: angles.is_none(),
            knot: Box::new(move |angle| Knot::leaving(&frame, angle, place, near)),
        }
    }

    /// The range of the numbers that tell the rays apart, if it has ends.
    pub fn range(&self) -> Option<[f64; 2]> {
        let [from, .., to] = self.first[..] else {
            return None;
        };
        (!self.is_round).then_some([from, to])
    }
}

/// The angles of the first rays, all round or between two angles.
fn first_angles(between: Option<[f64; 2]>) -> Vec<f64> {
    let apart = TAU / FIRST_FIELD_RAYS as f64;
    match between {
        None => (0..FIRST_FIELD_RAYS).map(|i| apart * i as f64).collect(),
        Some([from, to]) => {
            let steps = ((to - from) / apart).ceil().max(1.0);
            let angle = |i: usize| from + (to - from) * i as f64 / steps;
            (0..=steps as usize).map(angle).collect()
        }
    }
}
