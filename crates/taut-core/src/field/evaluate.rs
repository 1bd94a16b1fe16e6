//! The distance at a point, from the jets of the point's nearest node: the branch with the least
//! distance is taken.

use crate::Vector;
use crate::field::manifold::Aimed;
use crate::field::plane::norm;
use crate::field::rays::branches::{Branch, SAME_DIRECTION};
use crate::field::rays::doubt::DOUBTFUL_DISTANCE;
use crate::field::rays::frame::{Frame, OFF_SURFACE, ON_SURFACE};
use crate::field::rays::jet::direction_at;
use crate::field::rays::ray;
use crate::field::sources::nearest_entrance;
use crate::field::{Field, Fields, Other, frame, manifold};
use crate::guess::Guide;
use crate::parallel;
use crate::surface::atlas::{Atlas, ChartIndex};
use crate::surface::{Geometry, Node};

/// How uncertain the place of a rim that rays graze is, in spacings of the graph's nodes.
const SHADOW_EDGE: f64 = 0.3;

/// Number of points around a place that are looked at, on a cloud with costs.
pub(crate) const NEAREST_POINTS: usize = 20;

/// A distance with its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value<const D: usize> {
    /// The distance from the nearest source, in the input's units, with the source's start value
    /// added; infinite where unreached, not a number where it is not known.
    pub distance: f64,
    /// Estimated absolute error of the distance, in the input's units; not a number where the
    /// distance is not.
    pub error: f64,
    /// The index of the nearest source; `u32::MAX` where unreached.
    pub source: u32,
    /// The gradient of the distance, which is the unit tangent of the geodesic where it arrives;
    /// zero where unreached and at a source.
    pub direction: Vector<D>,
}

impl<const D: usize> Value<D> {
    /// The value at a place that nothing leads to.
    pub(crate) fn unreached() -> Self {
        Self {
            distance: f64::INFINITY,
            error: 0.0,
            source: u32::MAX,
            direction: Vector::zeros(),
        }
    }

    /// The value where it is not known whether anything leads there.
    pub(crate) fn unknown() -> Self {
        Self {
            distance: f64::NAN,
            error: f64::NAN,
            ..Self::unreached()
        }
    }

    fn is_unreached(&self) -> bool {
        self.source == u32::MAX
    }
}

/// A value with the node and the branch that it was taken from.
pub(crate) struct Taken<const D: usize> {
    /// The value; its error is that of the branch alone.
    pub value: Value<D>,
    /// The distance plus doubts by which this value is compared with others.
    pub believed: f64,
    /// By how much the node's branches miss the distances of the node's neighbours.
    pub missed: f64,
    /// How much shorter another way may be, whose jet is not known as far as the point.
    pub unknown: f64,
    /// The node that the value was taken from.
    pub node: u32,
    /// The index of the branch among the branches of the node.
    pub branch: usize,
    /// Distance of the point beyond the last of the rays that the branch rests on, in the input's
    /// units.
    pub(super) beyond: f64,
}

impl<const D: usize> Taken<D> {
    /// Whether the node's branches agree with those of its neighbours, within a small share of the
    /// distance.
    pub(super) fn is_certain(&self) -> bool {
        self.value.error + self.missed.max(self.unknown) <= DOUBTFUL_DISTANCE * self.value.distance
    }

    /// The value with what the node's branches miss added to its error.
    pub(super) fn with_missed(mut self) -> Self {
        self.value.error += self.missed.max(self.unknown);
        self
    }
}

impl<const D: usize> Field<D> {
    /// The value at a point near a node with its frame; `None` where unreached. Branches are left
    /// out if the point lies farther than `most` beyond the rays that they rest on.
    fn at(
        &self,
        node: u32,
        frame: &Frame<D>,
        x: &Vector<D>,
        share: f64,
        most: f64,
    ) -> Option<Taken<D>> {
        let v = frame.log(x, share);
        let mut least: Option<Taken<D>> = None;
        let mut shortest = f64::INFINITY;
        for (index, branch) in self.branches(node).iter().enumerate() {
            let (value, beyond) = match branch.piece {
                Some(piece) => (self.by_piece(piece, branch, x, share), 0.0),
                None => {
                    let carried = branch.jet.distance_at(v, frame.gauss);
                    // A branch that is less sure, or is not known as far as the point, may lead
                    // there by a shorter way.
                    let way = match carried {
                        Some((distance, error)) => distance - error,
                        None => branch.jet.distance + branch.jet.ahead(v),
                    };
                    shortest = shortest.min(way);
                    let beyond = branch.jet.beyond_at(v, frame.gauss);
                    (self.by_branch(branch, frame, x, v, carried), beyond)
                }
            };
            let believed = value.distance + branch.doubt + value.error - branch.error;
            if beyond > most || least.as_ref().is_some_and(|l| l.believed <= believed) {
                continue;
            }
            least = Some(Taken {
                value,
                believed,
                missed: branch.missed,
                unknown: 0.0,
                node,
                branch: index,
                beyond,
            });
        }
        let mut least = least?;
        least.unknown = (least.value.distance - shortest).max(0.0);
        (least.value.distance <= self.max_distance).then_some(least)
    }

    /// How much longer the way to a point may be round a rim than straight past it, where the node
    /// also knows rays that are diffracted round the rim. It follows from how far the point lies in
    /// the shadow by these rays and how far the rim may lie elsewhere. `v` leads from the node to
    /// the point.
    fn shade(&self, taken: &Taken<D>, frame: &Frame<D>, v: [f64; 2], spacing: f64) -> f64 {
        let branches = self.branches(taken.node);
        let jet = &branches[taken.branch].jet;
        if jet.heading.is_diffracted() {
            return 0.0;
        }
        let [a, b] = jet.gradient;
        let others = branches.iter().map(|branch| &branch.jet).filter(|other| {
            let [c, d] = other.gradient;
            other.heading.is_diffracted() && a * c + b * d >= SAME_DIRECTION
        });
        let longer = others.filter_map(|other| {
            let (distance, _) = other.distance_at(v, frame.gauss)?;
            let sharper = (other.curvature - jet.curvature).max(0.0);
            let longer = (distance - taken.value.distance).max(0.0);
            let inside = (2.0 * longer).sqrt() + SHADOW_EDGE * spacing * sharper.sqrt();
            Some(0.5 * inside * inside)
        });
        longer.reduce(f64::min).unwrap_or(0.0)
    }

    /// The value at a point by a piece of a source near it.
    fn by_piece(&self, piece: u32, branch: &Branch, x: &Vector<D>, share: f64) -> Value<D> {
        let piece = &self.pieces[piece as usize];
        let way = piece.way(x, share);
        Value {
            distance: piece.start + way.length,
            error: branch.error.max(piece.error(&way)),
            source: branch.source,
            direction: piece.direction(&way),
        }
    }

    /// The value at a point that `v` leads to from a node with its frame. `carried` is the distance
    /// with its error that the branch's jet says there, if it says one.
    fn by_branch(
        &self,
        branch: &Branch,
        frame: &Frame<D>,
        x: &Vector<D>,
        v: [f64; 2],
        carried: Option<(f64, f64)>,
    ) -> Value<D> {
        // No branch is longer than along the step, or shorter than straight through space.
        let bound = branch.jet.distance + norm(v);
        let least = self.pieces[branch.source as usize].least(x);
        let free = carried.map_or(bound, |carried| carried.0.min(bound));
        let distance = free.max(least);
        Value {
            distance,
            error: branch.error
                + frame.log_error(norm(v))
                + (distance - free)
                + carried.map_or(norm(v), |carried| carried.1),
            source: branch.source,
            direction: direction_at(frame, &branch.jet, v),
        }
    }
}

impl<const D: usize, S: Guide<D, Place: From<ChartIndex>>> Fields<'_, D, S> {
    /// The node of the graph nearest to each point of the cloud, on the point's sheet. It is
    /// searched for because charts may own points that are far from them on noisy clouds.
    fn places(&self, atlas: &Atlas<D>) -> &[u32] {
        self.ground.places.get_or_init(|| {
            let points = &atlas.cloud().points;
            let graph = self.geodesics.graph();
            parallel::map(points.len(), |i| {
                ray::nearest(graph, &points[i], atlas.owner(i))
            })
        })
    }

    /// The field at the points of the cloud, in the order of
    /// [`Cloud::points`](crate::cloud::Cloud::points). On a model, which keeps no points, it is the
    /// field at the origins of its charts where fields are marched. An outlier has the distance of
    /// its foot on the surface, and the way there is part of its error. Where it has no foot, its
    /// distance is not a number. A surface that is no atlas has no points.
    ///
    /// O(n), in parallel.
    #[must_use]
    pub fn at_points(&self, field: &Field<D>) -> Vec<Value<D>> {
        let Some(atlas) = self.geodesics.surface().atlas() else {
            return Vec::new();
        };
        if let Some(Other::Cost(found)) = &field.other {
            if atlas.has_points() {
                return found.values.clone();
            }
            let origins = atlas.nodes();
            return parallel::map(origins.len(), |i| self.at(field, &origins[i].into_kind()));
        }
        let share = if atlas.is_noisy() {
            OFF_SURFACE
        } else {
            ON_SURFACE
        };
        let (points, places) = (&atlas.cloud().points, self.places(atlas));
        parallel::map(points.len(), |i| {
            if atlas.is_off(i) {
                self.at_outlier(field, atlas, i)
            } else {
                self.at_node(field, places[i], &points[i], share)
            }
        })
    }

    /// The field at the foot of a point that lies off the surface. How far it lies off is part of
    /// the error. Where the point has no foot its distance is not a number.
    fn at_outlier(&self, field: &Field<D>, atlas: &Atlas<D>, point: usize) -> Value<D> {
        let Ok(foot) = atlas.node_of_point(point) else {
            return Value::unknown();
        };
        let mut value = self.at(field, &foot.into_kind());
        value.error += (foot.point - atlas.cloud().points[point]).norm();
        value
    }
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The field at a node of the surface; unreached where the graph has no node near it. Where the
    /// surface goes on beyond what is known of it, so that some way may lead there, the distance is
    /// not a number.
    #[must_use]
    pub fn at(&self, field: &Field<D>, node: &Node<D, S::Place>) -> Value<D> {
        let near = self.nearest_node(node);
        let mut value = self.at_near(field, near, node);
        if near.is_some_and(|near| self.is_behind_crease(near, node)) {
            value.error = f64::INFINITY;
        }
        let may_be_reached = || {
            let sources = field.piece_nodes.iter();
            let mut unknown = sources.map(|source| self.geodesics.is_unknown(*source, near));
            unknown.any(|unknown| unknown)
        };
        if value.is_unreached() && may_be_reached() {
            return Value::unknown();
        }
        value
    }

    /// Whether a crease lies between a node of the graph and a node of the surface.
    fn is_behind_crease(&self, near: u32, node: &Node<D, S::Place>) -> bool {
        if !self.ground.has_creases {
            return false;
        }
        let surface = self.geodesics.surface();
        let mut scratch = Geometry::new(D - surface.intrinsic_dimension());
        let near = near as usize;
        if surface.intrinsic_dimension() == 2 {
            let frames = self.ground.frames[near].zip(frame(surface, node, &mut scratch));
            return frames.is_none_or(|(near, here)| near.is_creased(&here));
        }
        let here = manifold::frame(surface, node, &mut scratch);
        let frames = self.ground.any_frames[near].as_ref().zip(here);
        frames.is_none_or(|(near, here)| near.is_creased(&here))
    }

    /// The field at a node whose nearest node of the graph is given.
    fn at_near(&self, field: &Field<D>, near: Option<u32>, node: &Node<D, S::Place>) -> Value<D> {
        near.map_or_else(Value::unreached, |near| {
            if let (Some(Other::Cost(found)), Some(net)) = (&field.other, &self.ground.net) {
                let points = net.nearest(&node.point, near, NEAREST_POINTS);
                if net.is_length {
                    let value = found.by_segments(net, self.geodesics.surface(), node, &points);
                    let value = value.filter(|value| value.distance <= field.max_distance);
                    return value.unwrap_or_else(Value::unreached);
                }
                return found.at(net, &node.point, &points);
            }
            self.at_node(field, near, &node.point, ON_SURFACE)
        })
    }

    /// The node of the graph nearest to a node of the surface.
    pub(crate) fn nearest_node(&self, node: &Node<D, S::Place>) -> Option<u32> {
        let (entrance, _) = nearest_entrance(&self.geodesics.entrances(node))?;
        let graph = self.geodesics.graph();
        Some(ray::nearest(graph, &node.point, entrance))
    }

    /// The value at a point whose nearest node of the graph is given.
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
        let taken = self.taken(field, node, x, share);
        taken.map_or_else(Value::unreached, |taken| taken.value)
    }

    /// The value that a node of the graph says for a point near it; `None` where unreached.
    /// Branches are left out if the point lies farther than `most` beyond the rays that they rest
    /// on.
    pub(super) fn said(
        &self,
        field: &Field<D>,
        node: u32,
        x: &Vector<D>,
        share: f64,
        most: f64,
    ) -> Option<Taken<D>> {
        let frame = self.ground.frames[node as usize].as_ref()?;
        let mut taken = field.at(node, frame, x, share, most)?;
        if !self.ground.rims.nodes.is_empty() {
            let v = frame.log(x, share);
            taken.value.error += field.shade(&taken, frame, v, self.ground.spacing[node as usize]);
        }
        Some(taken)
    }

    /// The value at a point whose nearest node of the graph is given, with the branch that it was
    /// taken from; `None` where unreached.
    pub(crate) fn taken(
        &self,
        field: &Field<D>,
        node: u32,
        x: &Vector<D>,
        share: f64,
    ) -> Option<Taken<D>> {
        let at = |node: u32, most: f64| self.said(field, node, x, share, most);
        let beside = || self.adjacent(node).map(|edge| edge.to);
        let mut taken = at(node, f64::INFINITY);
        let spacing = self.ground.spacing[node as usize];
        if let Some(least) = taken.as_mut().filter(|taken| taken.beyond > 0.0) {
            // Rays of another kind than those that the branch rests on lead to the point, and
            // adjacent nodes may know them. No distance changes by more than the way back to where
            // both kinds lead.
            let most = least.value.distance + 2.0 * least.beyond;
            least.value.error += least.beyond;
            let others = beside().chain([node]).filter_map(|other| at(other, 0.0));
            let others = others.filter(|other| other.value.distance <= most);
            let distance = |taken: &Taken<D>| taken.value.distance;
            let other = others.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            taken = other.or(taken);
        }
        let mut branches = field.branches(node).iter();
        let is_focused = branches.any(|branch| branch.is_focused(spacing));
        if !is_focused && taken.as_ref().is_some_and(Taken::is_certain) {
            return taken.map(Taken::with_missed);
        }
        self.second_opinion(field, node, x, share, taken)
    }

    /// The value at a point near a node, on surfaces of other dimensions than 2.
    fn at_any(&self, found: &Aimed<D>, node: u32, x: &Vector<D>, share: f64) -> Value<D> {
        let at = |node: u32| {
            let frame = self.ground.any_frames[node as usize].as_ref()?;
            Some(found.at(node, frame, x, share))
        };
        let Some(mut value) = at(node) else {
            return Value::unreached();
        };
        if found.is_focused(node, self.ground.spacing[node as usize]) {
            for other in self.adjacent(node).filter_map(|edge| at(edge.to)) {
                if other.distance + other.error < value.distance {
                    value = other;
                }
            }
        }
        value
    }
}
