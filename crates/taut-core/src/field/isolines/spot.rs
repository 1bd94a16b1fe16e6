//! Places on an isoline, found from beside it by steps along the gradient.

use crate::Vector;
use crate::field::evaluate::NEAREST_POINTS;
use crate::field::rays::frame::{Frame, ON_SURFACE};
use crate::field::rays::ray;
use crate::field::{Field, Fields, Other};
use crate::guess::Guide;
use crate::surface::Geometry;

/// A place on an isoline, or near it.
#[derive(Clone, Copy)]
pub(super) struct Spot<const D: usize, P> {
    pub point: Vector<D>,
    pub place: P,
    /// The nearest node of the graph.
    pub near: u32,
    /// The distance at the place, in the input's units.
    pub distance: f64,
    /// The unit vector along the gradient.
    pub ahead: Vector<D>,
    /// The derivative of the distance along `ahead`: 1 except with costs.
    slope: f64,
    pub frame: Frame<D>,
}

/// Most corrections of a place.
const CORRECTIONS: usize = 8;
/// Largest difference of the distance from the level, as a share of the mean edge, where the field
/// jumps.
const MOST_OFF: f64 = 0.02;
/// Difference of the distance from the level, as a share of the mean edge, at which corrections
/// end.
const LEAST_OFF: f64 = 1e-10;
/// How far a line may lie beyond a rim, as a share of the mean edge.
const LINE_OVER_RIM: f64 = 0.03;

/// Finds places on one isoline of a field.
pub(super) struct Follower<'a, const D: usize, S: Guide<D>> {
    pub fields: &'a Fields<'a, D, S>,
    pub level: f64,
    field: &'a Field<D>,
    geometry: Geometry<D>,
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The distance at a point of the surface near a node of the graph, and its gradient.
    pub(super) fn sloped(
        &self,
        field: &Field<D>,
        near: u32,
        x: &Vector<D>,
    ) -> Option<(f64, Vector<D>)> {
        if let (Some(Other::Cost(found)), Some(net)) = (&field.other, &self.ground.net) {
            let points = net.nearest(x, near, NEAREST_POINTS);
            return found.smooth(net, x, &points);
        }
        let value = self.at_node(field, near, x, ON_SURFACE);
        value
            .distance
            .is_finite()
            .then_some((value.distance, value.direction))
    }
}

impl<'a, const D: usize, S: Guide<D>> Follower<'a, D, S> {
    pub fn new(fields: &'a Fields<'a, D, S>, field: &'a Field<D>, level: f64) -> Self {
        let codimension = D - fields.geodesics.surface().intrinsic_dimension();
        Self {
            fields,
            level,
            field,
            geometry: Geometry::new(codimension),
        }
    }

    /// The place at the foot of a point; `None` beyond rims and where the field does not reach.
    pub fn spot(
        &mut self,
        x: &Vector<D>,
        (mut place, near): (S::Place, u32),
    ) -> Option<Spot<D, S::Place>> {
        let surface = self.fields.geodesics.surface();
        let point = surface.foot(x, &mut place, &mut self.geometry)?;
        let near = ray::nearest(self.fields.geodesics.graph(), &point, near);
        let rim = surface.beyond_rim(&point, place);
        if rim.is_some_and(|(depth, _)| depth > LINE_OVER_RIM * self.fields.mean_edge(near)) {
            return None;
        }
        let (distance, gradient) = self.fields.sloped(self.field, near, &point)?;
        if !surface.cheap_geometry(&point, place, &mut self.geometry) {
            return None;
        }
        let gradient = self.geometry.project(&gradient);
        let slope = gradient.norm();
        (slope > 0.0 && slope.is_finite()).then(|| Spot {
            point,
            place,
            near,
            distance,
            ahead: gradient / slope,
            slope,
            frame: Frame::new(point, &self.geometry),
        })
    }

    /// The place on the isoline near `x`, not farther from it than `farthest`.
    pub fn on_level(
        &mut self,
        x: &Vector<D>,
        place: (S::Place, u32),
        farthest: f64,
    ) -> Option<Spot<D, S::Place>> {
        let off = |spot: &Spot<D, S::Place>, level: f64| (spot.distance - level).abs();
        let mut best = self.spot(x, place)?;
        let mean = self.fields.mean_edge(best.near);
        for _ in 0..CORRECTIONS {
            let left = off(&best, self.level);
            if left <= LEAST_OFF * mean {
                break;
            }
            let step = best.ahead * ((self.level - best.distance) / best.slope);
            let length = step.norm();
            if length.is_nan() || length > farthest {
                return None;
            }
            let next = self.spot(&(best.point + step), (best.place, best.near))?;
            if off(&next, self.level) >= left {
                // Fronts meet between the two places, or the field jumps there.
                if left > MOST_OFF * mean * best.slope {
                    best = next;
                    continue;
                }
                break;
            }
            best = next;
        }
        let is_near = (best.point - x).norm() <= farthest;
        (is_near && off(&best, self.level) <= MOST_OFF * mean * best.slope).then_some(best)
    }
}
