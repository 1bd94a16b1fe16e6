//! The distance at points: from the jets of the nearest node, the least branch.

use rayon::prelude::*;

use crate::Vector;
use crate::field::branches::Branch;
use crate::field::frame::{Frame, OFF_SURFACE, ON_SURFACE};
use crate::field::jet::{bent, direction_at, norm};
use crate::field::manifold::Found;
use crate::field::{Field, Fields, Other, ray};
use crate::guess::Guide;
use crate::surface::Node;
use crate::surface::atlas::Atlas;

/// Where rays meet within a spacing over this, jets of neighbouring nodes are looked at too.
pub(crate) const FOCUSED: f64 = 0.3;

/// Points of a cloud with costs that are looked at round a place.
pub(crate) const NEAREST_POINTS: usize = 20;

/// A distance with its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value<const D: usize> {
    /// From the nearest source, its start value added; infinite where unreached.
    pub distance: f64,
    /// Estimated absolute error.
    pub error: f64,
    /// The nearest source; `u32::MAX` where unreached.
    pub source: u32,
    /// The gradient: the unit tangent of the geodesic where it arrives. Zero where unreached and at a source.
    pub direction: Vector<D>,
}

impl<const D: usize> Value<D> {
    pub(crate) fn unreached() -> Self {
        Self {
            distance: f64::INFINITY,
            error: 0.0,
            source: u32::MAX,
            direction: Vector::zeros(),
        }
    }
}

impl<const D: usize> Field<D> {
    /// The value at a point whose nearest node, with its frame, is given.
    fn at(&self, node: u32, frame: &Frame<D>, x: &Vector<D>, share: f64) -> Value<D> {
        let mut value = Value::unreached();
        let mut believed = f64::INFINITY;
        let v = frame.log(x, share);
        for branch in self.branches(node) {
            if branch.at_source {
                let source = &self.sources[branch.source as usize];
                let v = source.log(x, share);
                let distance = self.source_starts[branch.source as usize] + norm(v);
                if distance < believed {
                    believed = distance;
                    value = Value {
                        distance,
                        error: branch.error.max(source.log_error(norm(v))),
                        source: branch.source,
                        direction: bent(source, v, v),
                    };
                }
                continue;
            }
            let carried = branch.jet.distance_at(v, frame.gauss);
            // No branch is longer than along the step, or shorter than straight through space.
            let bound = branch.jet.distance + norm(v);
            let chord = self.sources[branch.source as usize].point - x;
            let least = self.source_starts[branch.source as usize] + chord.norm();
            let free = carried.map_or(bound, |carried| carried.min(bound));
            let distance = free.max(least);
            if distance + branch.doubt < believed {
                believed = distance + branch.doubt;
                value = Value {
                    distance,
                    error: branch.error + (distance - free) + carried.map_or(norm(v), |_| 0.0),
                    source: branch.source,
                    direction: direction_at(frame, &branch.jet, v),
                };
            }
        }
        if value.distance > self.max_distance {
            return Value::unreached();
        }
        value
    }
}

impl<const D: usize> Fields<'_, D, Atlas<D>> {
    /// The node of the graph nearest to each point of the cloud, on the point's sheet. Charts may own points
    /// far from them on noisy clouds.
    fn places(&self) -> &[u32] {
        self.places.get_or_init(|| {
            let atlas = self.geodesics.surface();
            let points = atlas.cloud().points.par_iter().enumerate();
            points
                .map(|(i, x)| ray::nearest(self.geodesics.graph(), x, atlas.owner(i)))
                .collect()
        })
    }

    /// The field at the points of the cloud, in the order of [`Cloud::points`](crate::cloud::Cloud::points).
    ///
    /// O(n), in parallel.
    #[must_use]
    pub fn at_points(&self, field: &Field<D>) -> Vec<Value<D>> {
        if let Some(Other::Cost(found)) = &field.other {
            return found.values.clone();
        }
        let atlas = self.geodesics.surface();
        let share = if atlas.is_noisy() {
            OFF_SURFACE
        } else {
            ON_SURFACE
        };
        let points = atlas.cloud().points.par_iter().zip(self.places());
        points
            .map(|(x, place)| self.at_node(field, *place, x, share))
            .collect()
    }
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The field at a node of the surface; unreached where the graph has no node near it.
    #[must_use]
    pub fn at(&self, field: &Field<D>, node: &Node<D, S::Place>) -> Value<D> {
        let entrances = self.geodesics.entrances(node);
        let nearest = entrances.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.map_or_else(Value::unreached, |(near, _)| {
            if let (Some(Other::Cost(found)), Some(net)) = (&field.other, &self.net) {
                let points = net.nearest(&node.point, *near, NEAREST_POINTS);
                return found.at(net, &node.point, &points);
            }
            let near = ray::nearest(self.geodesics.graph(), &node.point, *near);
            self.at_node(field, near, &node.point, ON_SURFACE)
        })
    }

    pub(crate) fn at_node(
        &self,
        field: &Field<D>,
        node: u32,
        x: &Vector<D>,
        share: f64,
    ) -> Value<D> {
        if let Some(Other::Manifold(found)) = &field.other {
            return self.at_any(found, node, x, share);
        }
        let Some(frame) = &self.frames[node as usize] else {
            return Value::unreached();
        };
        let mut value = field.at(node, frame, x, share);
        let focused =
            |branch: &Branch| branch.jet.curvature * self.spacing[node as usize] < -FOCUSED;
        if field.branches(node).iter().any(focused) {
            for edge in self.adjacent(node) {
                if let Some(frame) = &self.frames[edge.to as usize] {
                    let other = field.at(edge.to, frame, x, share);
                    if other.distance < value.distance {
                        value = other;
                    }
                }
            }
        }
        value
    }

    fn at_any(&self, found: &Found<D>, node: u32, x: &Vector<D>, share: f64) -> Value<D> {
        let at = |node: u32| {
            let frame = self.any_frames[node as usize].as_ref()?;
            Some(found.at(node, frame, x, share))
        };
        let Some(mut value) = at(node) else {
            return Value::unreached();
        };
        if found.is_focused(node, self.spacing[node as usize]) {
            for other in self.adjacent(node).filter_map(|edge| at(edge.to)) {
                if other.distance < value.distance {
                    value = other;
                }
            }
        }
        value
    }
}
