//! Where jets are doubtful: beside caustics, where rays draw together, and where the nodes around a place disagree. What the
//! jets there speak of is put to the proof by shooting, and the shortest geodesic that arrives is believed.

use crate::Vector;
use crate::field::aim::{Gun, Hit};
use crate::field::branches::{Branch, MOST_BRANCHES};
use crate::field::evaluate::{Taken, Value};
use crate::field::frame::ON_SURFACE;
use crate::field::jet::{direction_at, turned_by};
use crate::field::piece::Piece;
use crate::field::{Field, Fields};
use crate::guess::Guide;
use crate::parallel;
use crate::surface::Geometry;

/// Distances with a larger relative error are doubtful.
pub(super) const DOUBTFUL: f64 = 1e-3;
/// Claims of one source whose rays are nearer to each other than so many spacings, and than this angle in radians, are of one ray.
const SAME_RAY: f64 = 0.3;

/// The nodes around a point that are asked lie no farther from it than so many spacings.
const CLOSE: f64 = 1.2;

/// What a jet says of a point.
struct Claim {
    /// The distance and its estimated error.
    distance: f64,
    error: f64,
    /// At the source.
    angle: f64,
    /// The change of the angle along the front.
    turn: f64,
    source: u32,
    /// Whose jet it is.
    node: u32,
    branch: usize,
}

/// The sources of a field, to shoot from.
pub(super) struct Sight<'a, const D: usize, S: Guide<D>> {
    fields: &'a Fields<'a, D, S>,
    pieces: &'a [Piece<D>],
    nodes: &'a [Option<u32>],
    tolerance: f64,
}

impl<'a, const D: usize, S: Guide<D>> Sight<'a, D, S> {
    /// `None` for curves: rays leave them square, and none may lead from where they left to a point beside.
    pub fn new(
        fields: &'a Fields<'a, D, S>,
        pieces: &'a [Piece<D>],
        nodes: &'a [Option<u32>],
        tolerance: f64,
    ) -> Option<Self> {
        let of_points = pieces.iter().all(Piece::is_point);
        of_points.then_some(Self {
            fields,
            pieces,
            nodes,
            tolerance,
        })
    }

    fn gun(&self, source: u32) -> Option<Gun<'_, D, S>> {
        let (piece, near) = (&self.pieces[source as usize], self.nodes[source as usize]?);
        Gun::new(self.fields, piece, near, self.tolerance)
    }

    /// What the jets at a node and beside it say of a point near it, shortest first; `None` where some came round a rim, which
    /// no shot does.
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
            let Some(frame) = &fields.frames[near as usize] else {
                continue;
            };
            let v = frame.log(x, ON_SURFACE);
            for (index, branch) in branches(near).iter().enumerate() {
                if branch.piece.is_some() {
                    continue;
                }
                if branch.jet.heading.is_bent() {
                    return None;
                }
                let carried = branch.jet.distance_at(v, frame.gauss);
                let (distance, step_error) =
                    carried.unwrap_or((branch.jet.distance, fields.spacing[near as usize]));
                claims.push(Claim {
                    distance,
                    error: branch.error + step_error,
                    angle: branch.jet.angle_at(v, frame.gauss),
                    turn: branch.jet.heading.turn,
                    source: branch.source,
                    node: near,
                    branch: index,
                });
            }
        }
        claims.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        Some(claims)
    }

    /// The geodesics that claims speak of and that arrive, but for those longer than the shortest by more than a slack.
    fn proven(
        &self,
        claims: Vec<Claim>,
        x: &Vector<D>,
        spacing: f64,
        slack: f64,
    ) -> Vec<(Claim, Hit<D, S::Place>)> {
        let mut tried: Vec<(u32, f64)> = Vec::new();
        let mut arrived: Vec<(u32, f64)> = Vec::new();
        let mut found: Vec<(Claim, Hit<D, S::Place>)> = Vec::new();
        let mut least = f64::INFINITY;
        for claim in claims {
            let same = SAME_RAY * (spacing * claim.turn.abs()).min(1.0);
            let is_same = |(source, angle): &(u32, f64)| {
                *source == claim.source && turned_by(*angle, claim.angle).abs() < same
            };
            if claim.distance - claim.error > least + slack || tried.iter().any(is_same) {
                continue;
            }
            tried.push((claim.source, claim.angle));
            let length = claim.distance - self.pieces[claim.source as usize].start;
            let gun = self.gun(claim.source);
            let hit = gun.and_then(|gun| gun.hit((claim.angle, length), x, spacing));
            let Some(hit) = hit else {
                continue;
            };
            let v = hit.knot.frame.log(x, ON_SURFACE);
            let angle = hit.jet.angle_at(v, hit.knot.frame.gauss);
            let is_known = |(source, known): &(u32, f64)| {
                *source == claim.source && turned_by(*known, angle).abs() < same
            };
            let is_new = !arrived.iter().any(is_known);
            tried.push((claim.source, angle));
            arrived.push((claim.source, angle));
            least = least.min(hit.jet.distance);
            if is_new {
                found.push((claim, hit));
            }
        }
        found
    }

    /// The branches of a node by the geodesics that arrive at it; `None` where none does.
    fn branches(&self, lists: &[Vec<Branch>], node: u32) -> Option<Vec<Branch>> {
        let fields = self.fields;
        let frame = fields.frames[node as usize].as_ref()?;
        let spacing = fields.spacing[node as usize];
        let claims = self.claims(|near| &lists[near as usize], node, &frame.point)?;
        let proven = self.proven(claims, &frame.point, spacing, spacing);
        let of_hit = |(claim, mut hit): (Claim, Hit<D, S::Place>)| {
            self.gun(claim.source)?.look_aside(&mut hit, spacing);
            Some(Branch {
                jet: hit.jet.carried(&hit.knot.frame, frame)?,
                error: hit.surface_error,
                missed: 0.0,
                angle_error: self.tolerance,
                doubt: 0.0,
                piece: None,
                carried: false,
                source: claim.source,
            })
        };
        let mut found: Vec<Branch> = proven.into_iter().filter_map(of_hit).collect();
        found.sort_by(|a, b| a.jet.distance.total_cmp(&b.jet.distance));
        found.truncate(MOST_BRANCHES);
        (!found.is_empty()).then_some(found)
    }

    /// Replaces the branches of nodes by proven ones where one of them is doubtful, and none is carried or of a source near by.
    pub fn prove(
        &self,
        lists: &mut [Vec<Branch>],
        is_doubtful: impl Fn(u32, &Branch) -> bool + Sync,
    ) {
        let of_rays = |branch: &Branch| branch.piece.is_none() && !branch.carried;
        let doubtful: Vec<u32> = (0..)
            .zip(lists.iter())
            .filter(|(_, branches)| branches.iter().all(of_rays))
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

/// A branch whose jets scatter.
pub(super) fn is_scattered(branch: &Branch) -> bool {
    branch.error + branch.doubt > DOUBTFUL * branch.jet.distance
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The value at a point near a node whose jets are doubtful: by the node or those beside it where they agree, else by the
    /// geodesics that they speak of.
    pub(super) fn second_opinion(
        &self,
        field: &Field<D>,
        node: u32,
        x: &Vector<D>,
        share: f64,
        first: Option<Taken<D>>,
    ) -> Option<Taken<D>> {
        let around = |node: u32| {
            let beside = self.adjacent(node).map(|edge| edge.to);
            std::iter::once(node).chain(beside)
        };
        // Round rims each node knows of other corners.
        let is_round_rim = |branch: &Branch| branch.jet.heading.is_bent() && branch.piece.is_none();
        if around(node).any(|near| field.branches(near).iter().any(is_round_rim)) {
            return first.map(Taken::with_missed);
        }
        let most = first.as_ref().map_or(f64::INFINITY, |taken| taken.beyond);
        let others = around(node).skip(1).filter_map(|other| {
            let frame = self.frames[other as usize].as_ref()?;
            let close = (frame.point - x).norm() <= CLOSE * self.spacing[node as usize];
            close
                .then(|| field.at(other, frame, x, share, most))
                .flatten()
        });
        let all: Vec<Taken<D>> = first.into_iter().chain(others).collect();
        let least = all
            .iter()
            .min_by(|a, b| a.believed.total_cmp(&b.believed))?;
        let distance = least.value.distance;
        let off = |other: &Taken<D>| (other.value.distance - distance).abs();
        let doubt = |other: &Taken<D>| other.believed - other.value.distance;
        // Another node that says the same bears it out against those that know of longer ways alone.
        let slack = DOUBTFUL * distance;
        let agrees = |other: &&Taken<D>| off(other) + doubt(other) <= slack;
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
        let taken = Taken {
            missed: misses.fold(0.0, f64::max),
            ..*least
        };
        if taken.is_certain() {
            return Some(taken.with_missed());
        }
        let proven = self.proven(field, node, x);
        Some(proven.unwrap_or_else(|| taken.with_missed()))
    }

    /// The value of the shortest geodesic to a point that the jets around it speak of.
    fn proven(&self, field: &Field<D>, node: u32, x: &Vector<D>) -> Option<Taken<D>> {
        let sight = Sight::new(self, &field.pieces, &field.piece_nodes, field.tolerance)?;
        let mut place = self.geodesics.graph().nodes[node as usize].place;
        let surface = self.geodesics.surface();
        let x = surface.foot(x, &mut place, &mut Geometry::new(D - 2))?;
        let claims = sight.claims(|near| field.branches(near), node, &x)?;
        let proven = sight.proven(claims, &x, self.spacing[node as usize], 0.0);
        let distance = |hit: &Hit<D, S::Place>| {
            let v = hit.knot.frame.log(&x, ON_SURFACE);
            Some((hit.jet.distance_at(v, hit.knot.frame.gauss)?.0, v))
        };
        let found = proven.into_iter().filter_map(|(claim, hit)| {
            let (distance, v) = distance(&hit)?;
            Some((distance, v, claim, hit))
        });
        let (distance, v, claim, hit) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Taken {
            value: Value {
                distance,
                error: hit.surface_error + field.tolerance * hit.knot.length,
                source: claim.source,
                direction: direction_at(&hit.knot.frame, &hit.jet, v),
            },
            believed: distance,
            missed: 0.0,
            node: claim.node,
            branch: claim.branch,
            beyond: 0.0,
        })
    }
}
