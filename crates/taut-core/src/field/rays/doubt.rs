//! Doubtful jets and their proof. Jets are doubtful beside caustics, where rays draw together, and
//! where the nodes around a place disagree. What the jets say there is tested by shooting
//! geodesics, and the shortest geodesic that arrives is believed.

use crate::Vector;
use crate::field::evaluate::{Taken, Value};
use crate::field::plane::turned_by;
use crate::field::rays::aim::{Gun, Hit};
use crate::field::rays::branches::{Branch, MOST_BRANCHES};
use crate::field::rays::frame::ON_SURFACE;
use crate::field::rays::jet::direction_at;
use crate::field::rays::piece::Piece;
use crate::field::{Field, Fields};
use crate::guess::Guide;
use crate::order::sort_by_number;
use crate::parallel;
use crate::surface::{Geometry, Node};

/// Relative error of a distance above which it is doubtful.
pub(in crate::field) const DOUBTFUL_DISTANCE: f64 = 1e-3;
/// Largest distance, in spacings of the graph's nodes, and largest angle, in radians at the source,
/// between rays of one source whose claims are about one ray.
const SAME_RAY: f64 = 0.3;

/// The least relative error of what is proven: a shorter geodesic may lie between those that were
/// tried.
const UNSEEN: f64 = 1e-4;
/// Largest distance from a point, in spacings of the graph's nodes, of the nodes that are asked
/// about it.
const ASKED_NODES: f64 = 1.2;

/// A ray, named by its source and its angle at the source.
#[derive(Clone, Copy)]
struct RayName {
    source: u32,
    angle: f64,
}

impl RayName {
    /// Whether both rays leave the same source at angles that differ by less than `apart`, in
    /// radians.
    fn is(&self, other: &Self, apart: f64) -> bool {
        self.source == other.source && turned_by(self.angle, other.angle).abs() < apart
    }
}

/// The angle below which two rays are the same, where the angle changes by `turn` per length along
/// the front.
fn same_ray(turn: f64, spacing: f64) -> f64 {
    SAME_RAY * (spacing * turn.abs()).min(1.0)
}

/// What a jet says about a point: a distance, and the ray that brings it.
struct Claim {
    /// The distance at the point, in the input's units.
    distance: f64,
    /// Estimated error of the distance, in the input's units.
    error: f64,
    ray: RayName,
    /// The derivative of the ray's angle along the front, in radians per length.
    turn: f64,
    /// The node whose jet makes the claim.
    node: u32,
    /// The index of the jet's branch among the branches of the node.
    branch: usize,
}

/// A geodesic that arrives at the point, with its ray.
struct Proven<const D: usize, P> {
    ray: RayName,
    hit: Hit<D, P>,
}

/// The sources of a field, made ready to shoot geodesics from.
pub(in crate::field) struct Sight<'a, const D: usize, S: Guide<D>> {
    fields: &'a Fields<'a, D, S>,
    pieces: &'a [Piece<D>],
    nodes: &'a [Option<u32>],
    tolerance: f64,
}

impl<'a, const D: usize, S: Guide<D>> Sight<'a, D, S> {
    /// Prepares to shoot from sources. `None` for curves, because rays leave them at right angles
    /// and none may lead from where they left to a point beside. Also `None` where the surface errs
    /// here and there, because geodesics shot on it prove nothing.
    pub fn new(
        fields: &'a Fields<'a, D, S>,
        pieces: &'a [Piece<D>],
        nodes: &'a [Option<u32>],
        tolerance: f64,
    ) -> Option<Self> {
        (fields.ground.is_smooth && pieces.iter().all(Piece::is_point)).then_some(Self {
            fields,
            pieces,
            nodes,
            tolerance,
        })
    }

    /// The gun at a source.
    fn gun(&self, source: u32) -> Option<Gun<'_, D, S>> {
        let (piece, near) = (&self.pieces[source as usize], self.nodes[source as usize]?);
        Gun::new(self.fields, piece, near, self.tolerance)
    }

    /// The geodesics to a place that guesses on the graph lead to, where the graph's nodes lie
    /// `spacing` apart.
    fn hits_by_guesses(
        &self,
        source: u32,
        end: &Node<D, S::Place>,
        spacing: f64,
    ) -> Vec<Hit<D, S::Place>> {
        let geodesics = self.fields.geodesics;
        let frame = &self.pieces[source as usize].frame;
        let Some((gun, near)) = self.gun(source).zip(self.nodes[source as usize]) else {
            return Vec::new();
        };
        let start = Node {
            point: frame.point,
            ..geodesics.graph().nodes[near as usize]
        };
        let paths = geodesics.rough_paths(&start, end);
        let hits = paths.iter().filter_map(|path| {
            let [ahead, left] = frame.log(&path.curve.nodes.get(1)?.point, ON_SURFACE);
            gun.hit((left.atan2(ahead), path.length()), &end.point, spacing)
        });
        hits.collect()
    }

    /// What the jets at a node and at the adjacent nodes say about a point near it, shortest first.
    /// `None` beside a source, which is measured from directly, and where some jets came round a
    /// rim, which no shot does.
    fn claims<'b>(
        &self,
        branches: impl Fn(u32) -> &'b [Branch],
        node: u32,
        x: &Vector<D>,
    ) -> Option<Vec<Claim>> {
        let fields = self.fields;
        let beside = fields.adjacent(node).map(|edge| edge.to);
        let mut claims = Vec::new();
        for near in std::iter::once(node).chain(beside) {
            let Some(frame) = &fields.ground.frames[near as usize] else {
                continue;
            };
            let v = frame.log(x, ON_SURFACE);
            for (index, branch) in branches(near).iter().enumerate() {
                if is_fixed(branch) {
                    return None;
                }
                // What was carried along the graph tells nothing about a ray.
                if branch.carried {
                    continue;
                }
                let carried = branch.jet.distance_at(v, frame.gauss);
                let (distance, step_error) =
                    carried.unwrap_or((branch.jet.distance, fields.ground.spacing[near as usize]));
                claims.push(Claim {
                    distance,
                    error: branch.error + step_error,
                    ray: RayName {
                        source: branch.source,
                        angle: branch.jet.angle_at(v, frame.gauss),
                    },
                    turn: branch.jet.heading.turn,
                    node: near,
                    branch: index,
                });
            }
        }
        sort_by_number(&mut claims, |claim| claim.distance);
        Some(claims)
    }

    /// The geodesics to a place that claims speak of and that arrive, without those longer than the
    /// shortest by more than `slack`. Geodesics that guesses lead to are added where a claim of a
    /// shorter way does not arrive, or where the nodes around disagree (`is_torn`).
    fn proven(
        &self,
        claims: &[Claim],
        end: &Node<D, S::Place>,
        spacing: f64,
        (slack, is_torn): (f64, bool),
    ) -> Vec<Proven<D, S::Place>> {
        let mut tried: Vec<RayName> = Vec::new();
        let mut found: Vec<Proven<D, S::Place>> = Vec::new();
        let mut least = f64::INFINITY;
        for claim in claims {
            let apart = same_ray(claim.turn, spacing);
            let is_tried = tried.iter().any(|ray| ray.is(&claim.ray, apart));
            if claim.distance - claim.error > least + slack || is_tried {
                continue;
            }
            tried.push(claim.ray);
            let RayName { source, angle } = claim.ray;
            let length = claim.distance - self.pieces[source as usize].start;
            let gun = self.gun(source);
            if let Some(hit) = gun.and_then(|gun| gun.hit((angle, length), &end.point, spacing)) {
                least = least.min(hit.jet.distance);
                tried.push(add(&mut found, source, hit, &end.point, spacing));
            }
        }
        // There may be rays between those that the claims tell of.
        let is_short = |claim: &&Claim| least - claim.distance > DOUBTFUL_DISTANCE * least.abs();
        let untold = claims.first().filter(|first| is_torn || is_short(first));
        let is_focused = found.iter().any(|proven| proven.hit.is_focused());
        if let Some(first) = untold.filter(|_| !is_focused) {
            let source = first.ray.source;
            for hit in self.hits_by_guesses(source, end, spacing) {
                add(&mut found, source, hit, &end.point, spacing);
            }
        }
        found
    }

    /// The branches of a node by the geodesics that arrive at it; `None` where none arrives.
    fn branches(&self, lists: &[Vec<Branch>], node: u32) -> Option<Vec<Branch>> {
        let fields = self.fields;
        let frame = fields.ground.frames[node as usize].as_ref()?;
        let spacing = fields.ground.spacing[node as usize];
        let claims = self.claims(|near| &lists[near as usize], node, &frame.point)?;
        let end = fields.geodesics.graph().nodes[node as usize];
        let of_proven = |proven: Proven<D, S::Place>| {
            let (source, mut hit) = (proven.ray.source, proven.hit);
            self.gun(source)?.look_aside(&mut hit, spacing);
            Some(Branch {
                jet: hit.jet.carried(&hit.knot.frame, frame)?,
                error: hit.surface_error + UNSEEN * hit.knot.length,
                missed: 0.0,
                angle_error: self.tolerance,
                doubt: 0.0,
                piece: None,
                carried: false,
                source,
            })
        };
        let proven = self.proven(&claims, &end, spacing, (spacing, false));
        let mut found: Vec<Branch> = proven.into_iter().filter_map(of_proven).collect();
        sort_by_number(&mut found, |branch| branch.jet.distance);
        found.truncate(MOST_BRANCHES);
        (!found.is_empty()).then_some(found)
    }

    /// The value at a point by the shortest geodesic to it among those that the jets around it
    /// speak of.
    fn proven_at(&self, field: &Field<D>, node: u32, x: &Vector<D>) -> Option<Taken<D>> {
        let fields = self.fields;
        let mut place = fields.geodesics.graph().nodes[node as usize].place;
        let surface = fields.geodesics.surface();
        let point = surface.foot(x, &mut place, &mut Geometry::new(D - 2))?;
        let claims = self.claims(|near| field.branches(near), node, &point)?;
        let end = Node { point, place };
        let torn = |branch: &Branch| branch.missed > DOUBTFUL_DISTANCE * branch.jet.distance;
        let is_torn = field.branches(node).iter().any(torn);
        let proven = self.proven(
            &claims,
            &end,
            fields.ground.spacing[node as usize],
            (0.0, is_torn),
        );
        let found = proven.into_iter().filter_map(|proven| {
            let (frame, jet) = (&proven.hit.knot.frame, &proven.hit.jet);
            let v = frame.log(&point, ON_SURFACE);
            Some((jet.distance_at(v, frame.gauss)?.0, v, proven))
        });
        let (distance, v, Proven { ray, hit }) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let of_source = claims.iter().filter(|claim| claim.ray.source == ray.source);
        let off = |claim: &Claim| turned_by(claim.ray.angle, ray.angle).abs();
        let claim = of_source.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        Some(Taken {
            value: Value {
                distance,
                error: hit.surface_error + UNSEEN * hit.knot.length,
                source: ray.source,
                direction: direction_at(&hit.knot.frame, &hit.jet, v),
            },
            believed: distance,
            missed: 0.0,
            unknown: 0.0,
            node: claim.node,
            branch: claim.branch,
            beyond: 0.0,
        })
    }

    /// Replaces the branches of nodes by proven ones where one branch is doubtful and none is
    /// measured from a source near by.
    pub fn prove(
        &self,
        lists: &mut [Vec<Branch>],
        is_doubtful: impl Fn(u32, &Branch) -> bool + Sync,
    ) {
        let doubtful: Vec<u32> = (0..)
            .zip(lists.iter())
            .filter(|(_, branches)| !branches.iter().any(is_fixed))
            .filter(|(node, branches)| branches.iter().any(|branch| is_doubtful(*node, branch)))
            .map(|(node, _)| node)
            .collect();
        let proven = parallel::map(doubtful.len(), |i| self.branches(lists, doubtful[i]));
        for (node, branches) in doubtful.into_iter().zip(proven) {
            if let Some(branches) = branches {
                lists[node as usize] = branches;
            }
        }
    }
}

/// Adds a geodesic to those that arrive at a point, unless it is one of them, and returns its ray.
fn add<const D: usize, P>(
    found: &mut Vec<Proven<D, P>>,
    source: u32,
    hit: Hit<D, P>,
    x: &Vector<D>,
    spacing: f64,
) -> RayName {
    let v = hit.knot.frame.log(x, ON_SURFACE);
    let angle = hit.jet.angle_at(v, hit.knot.frame.gauss);
    let apart = same_ray(hit.jet.heading.turn, spacing);
    let ray = RayName { source, angle };
    if !found.iter().any(|other| other.ray.is(&ray, apart)) {
        found.push(Proven { ray, hit });
    }
    ray
}

/// What several nodes, the nearest first, say about a point together. The value is the least one,
/// or that of the nearest node that agrees with it; its `missed` is by how much it may be wrong
/// according to the other nodes.
fn heard<const D: usize>(all: &[Taken<D>]) -> Option<Taken<D>> {
    let least = all
        .iter()
        .min_by(|a, b| a.believed.total_cmp(&b.believed))?;
    let distance = least.value.distance;
    let off = |other: &Taken<D>| (other.value.distance - distance).abs();
    let doubt = |other: &Taken<D>| other.believed - other.value.distance;
    // A second node that says the same confirms the value against nodes that know longer ways only.
    let agrees = |other: &&Taken<D>| off(other) + doubt(other) <= DOUBTFUL_DISTANCE * distance;
    let borne_out = all.iter().filter(agrees).count() > 1;
    let misses = all.iter().map(|other| {
        if other.value.distance < distance {
            off(other) + doubt(other)
        } else if borne_out {
            0.0
        } else {
            off(other) - doubt(other)
        }
    });
    let missed = misses.fold(0.0, f64::max);
    let nearest = all.iter().find(agrees).unwrap_or(least);
    let shortest = all.iter().map(|other| other.value.distance - other.unknown);
    let shortest = shortest.fold(f64::INFINITY, f64::min);
    Some(Taken {
        missed: missed.max(nearest.value.distance - distance),
        unknown: (nearest.value.distance - shortest).max(0.0),
        ..*nearest
    })
}

/// Whether no shot can prove a branch: it is measured from a source near by, or came round a rim.
fn is_fixed(branch: &Branch) -> bool {
    branch.piece.is_some() || (branch.jet.heading.is_diffracted() && !branch.carried)
}

/// Whether no ray brought a branch, or its jets scatter.
pub(in crate::field) fn is_scattered(branch: &Branch) -> bool {
    branch.carried || branch.error + branch.doubt > DOUBTFUL_DISTANCE * branch.jet.distance
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The value at a point near a node whose jets are doubtful. It is what the node and the
    /// adjacent nodes say where they agree, else what the geodesics that they speak of prove.
    pub(in crate::field) fn second_opinion(
        &self,
        field: &Field<D>,
        node: u32,
        x: &Vector<D>,
        share: f64,
        first: Option<Taken<D>>,
    ) -> Option<Taken<D>> {
        let beside: Vec<u32> = self.adjacent(node).map(|edge| edge.to).collect();
        let is_aside = |near: u32| field.branches(near).iter().any(is_fixed);
        let is_proper = !is_aside(node) && !beside.iter().any(|near| is_aside(*near));
        let sight = Sight::new(self, &field.pieces, &field.piece_nodes, field.tolerance);
        let Some(sight) = sight.filter(|_| is_proper) else {
            return self.shortest_beside(field, node, x, share, first);
        };
        let most = first.as_ref().map_or(f64::INFINITY, |taken| taken.beyond);
        let others = beside.into_iter().filter_map(|other| {
            let frame = self.ground.frames[other as usize].as_ref()?;
            let close =
                (frame.point - x).norm() <= ASKED_NODES * self.ground.spacing[node as usize];
            close
                .then(|| self.said(field, other, x, share, most))
                .flatten()
        });
        let taken = heard(&first.into_iter().chain(others).collect::<Vec<_>>())?;
        if taken.is_certain() {
            return Some(taken.with_missed());
        }
        let Some(mut proven) = sight.proven_at(field, node, x) else {
            return Some(taken.with_missed());
        };
        // A claim of a shorter way that no shot confirms may be true nonetheless.
        let shorter = proven.value.distance - taken.value.distance * (1.0 + DOUBTFUL_DISTANCE);
        proven.value.error += shorter.max(0.0);
        Some(proven)
    }

    /// The value that the node says. Where rays draw together, it is the value of an adjacent node
    /// that says a way shorter by more than its error.
    fn shortest_beside(
        &self,
        field: &Field<D>,
        node: u32,
        x: &Vector<D>,
        share: f64,
        first: Option<Taken<D>>,
    ) -> Option<Taken<D>> {
        let mut taken = first.map(Taken::with_missed);
        let spacing = self.ground.spacing[node as usize];
        if !field
            .branches(node)
            .iter()
            .any(|branch| branch.is_focused(spacing))
        {
            return taken;
        }
        let most = taken.as_ref().map_or(f64::INFINITY, |taken| taken.beyond);
        for other in self.adjacent(node).map(|edge| edge.to) {
            let other = self.said(field, other, x, share, most);
            let other = other.map(Taken::with_missed);
            let least = taken.as_ref().map_or(f64::INFINITY, |t| t.value.distance);
            if other
                .as_ref()
                .is_some_and(|other| other.value.distance + other.value.error < least)
            {
                taken = other;
            }
        }
        taken
    }
}
