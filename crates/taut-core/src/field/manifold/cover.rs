//! Rays of a source in any dimension, until every node of the graph within reach has a jet near it.
//!
//! Nodes that have none are aimed at by the Jacobi fields of the rays nearest to them. Those
//! farthest along come first, as their rays come by others.

use crate::field::manifold::frame::{Frame, axis};
use crate::field::manifold::jet::Jet;
use crate::field::manifold::ray::{self, Knot};
use crate::field::rays::fan::samples::USELESS_FOCUS;
use crate::field::rays::frame::ON_SURFACE;
use crate::field::rays::ray::Limits;
use crate::field::sources;
use crate::parallel;
use crate::surface::Surface;
use crate::{Matrix, Vector};

/// Largest distance from the source, in spacings of the graph's nodes, of the nodes towards which
/// the first rays leave.
const BEGIN: f64 = 3.0;
/// Least angle between the first rays, in radians.
const FIRST_APART: f64 = 0.35;
/// Largest distance, in spacings of the graph's nodes, at which a jet covers a node.
const COVERED: f64 = 0.9;
/// Largest distance, in spacings of the graph's nodes, of a jet from which a node is aimed at.
const AIM: f64 = 2.2;
/// Largest share of the way to where rays meet within which a jet covers a node.
const COVERED_DRAWN: f64 = 0.4;
/// Distance, in spacings of the graph's nodes, within which a jet covers a node even where rays
/// soon meet.
const LEAST_COVERED: f64 = 0.3;
/// Largest angle at the source, in radians, between a ray and one that is aimed from it.
const WIDEST_AIM: f64 = 0.5;
/// Most by which the distance that a covering jet says at a node may exceed the least one there, in
/// spacings of the graph's nodes.
const COVERED_LONGER: f64 = 0.1;
/// Most times that a node is aimed at.
const ATTEMPTS: u8 = 3;
/// Largest distance, in spacings of the graph's nodes, between nodes of which only one is aimed at
/// in one generation.
const AIMED_APART: f64 = 1.6;
/// Most jets for each node that a source may reach.
const MOST_AIMED_JETS: usize = 24;

/// A jet on a ray.
#[derive(Clone, Debug)]
pub(crate) struct Sample<const D: usize> {
    /// The frame at the jet; its first tangent is the ray's.
    pub frame: Frame<D>,
    pub jet: Jet<D>,
    /// Length of the ray from the source, in the input's units.
    length: f64,
    /// The nearest node of the graph.
    pub near: u32,
    /// Estimated error of the distance because of the surface's own error, in the input's units.
    pub surface_error: f64,
    /// The matrix from offsets to the side here to angles at the source.
    inverse: Matrix<D>,
    /// The tangents of the ray at the source, in the coordinates of the source's frame.
    start: Matrix<D>,
}

impl<const D: usize> Sample<D> {
    /// The distance at a point nearby, to second order.
    fn estimate(&self, x: &Vector<D>) -> f64 {
        let v = self.frame.coordinates(&(x - self.frame.point));
        self.jet.distance + v[0] + 0.5 * v.dot(&(self.jet.shape * v))
    }

    /// The jet carried to another frame, unless that frame lies behind the source.
    pub fn carried(&self, to: &Frame<D>) -> Option<Jet<D>> {
        let jet = self.jet.carried(&self.frame, to)?;
        (jet.distance >= self.jet.distance - self.length).then_some(jet)
    }

    /// The direction at the source of the ray through a point nearby.
    fn aimed(&self, x: &Vector<D>) -> Option<Vector<D>> {
        let mut v = self.frame.log(x, ON_SURFACE);
        v[0] = 0.0;
        let turn = self.inverse * v;
        let ahead = self.start.column(0);
        let aimed = ahead + self.start * turn;
        (turn.norm() <= WIDEST_AIM)
            .then(|| aimed.try_normalize(0.0))
            .flatten()
    }
}

type RayOrigin<'a, const D: usize, P> = sources::RayOrigin<'a, D, P, Frame<D>>;

/// The jets found so far, also listed by the node that they are nearest to.
struct Cover<'a, const D: usize, S: Surface<D>> {
    surface: &'a S,
    origin: &'a RayOrigin<'a, D, S::Place>,
    limits: &'a Limits<'a, D, S::Place>,
    samples: Vec<Sample<D>>,
    by_node: Vec<Vec<u32>>,
}

/// The jets along rays of a source that cover the nodes in `wanted`.
pub(crate) fn cover<const D: usize, S: Surface<D>>(
    surface: &S,
    origin: &RayOrigin<D, S::Place>,
    wanted: &[u32],
    limits: &Limits<D, S::Place>,
) -> Vec<Sample<D>> {
    let nodes = limits.graph.nodes.len();
    let mut cover = Cover {
        surface,
        origin,
        limits,
        samples: Vec::new(),
        by_node: vec![Vec::new(); nodes],
    };
    cover.shoot(&cover.first_directions());
    let mut attempts = vec![(0, u32::MAX); nodes];
    let mut open = wanted.to_vec();
    let mut looked_at_all = true;
    // Each generation aims at nodes that no jet covers yet, and ends when none can be aimed at any
    // more.
    while cover.samples.len() <= MOST_AIMED_JETS * wanted.len() {
        let aims = parallel::map(open.len(), |i| Some((open[i], cover.aim(open[i])?)));
        let aims: Vec<(u32, Option<u32>)> = aims.into_iter().flatten().collect();
        let targets = cover.farthest(&aims, &attempts);
        if targets.is_empty() {
            if looked_at_all {
                break;
            }
            // A way found since then may be shorter than the one that covers a node.
            (open, looked_at_all) = (wanted.to_vec(), true);
            continue;
        }
        open = aims.iter().map(|aim| aim.0).collect();
        looked_at_all = false;
        let mut directions = Vec::new();
        for (node, from) in targets {
            let (times, last) = &mut attempts[node as usize];
            (*times, *last) = (*times + 1, from);
            let x = &limits.graph.nodes[node as usize].point;
            directions.extend(cover.samples[from as usize].aimed(x));
        }
        cover.shoot(&directions);
    }
    cover.samples
}

impl<const D: usize, S: Surface<D>> Cover<'_, D, S> {
    /// The directions of the first rays: towards nodes near the source, apart from each other.
    fn first_directions(&self) -> Vec<Vector<D>> {
        let (origin, graph) = (self.origin, self.limits.graph);
        let mut directions: Vec<Vector<D>> = Vec::new();
        let reach = BEGIN * self.limits.spacing[origin.near as usize];
        for edge in graph.edges(origin.near) {
            let x = &graph.nodes[edge.to as usize].point;
            let v = origin.frame.log(x, ON_SURFACE);
            let Some(direction) = v.try_normalize(0.0).filter(|_| v.norm() <= reach) else {
                continue;
            };
            let apart = |other: &Vector<D>| other.dot(&direction) <= FIRST_APART.cos();
            if directions.iter().all(apart) {
                directions.push(direction);
            }
        }
        directions
    }

    /// Shoots rays in these directions and notes the jets along them.
    fn shoot(&mut self, directions: &[Vector<D>]) {
        let this = &*self;
        let found = parallel::map(directions.len(), |i| {
            let origin = this.origin;
            let place = origin.node.place;
            let first = Knot::first(origin.frame, &directions[i], place, origin.near);
            let start = first.frame.tangents;
            let start = origin.frame.tangents.tr_mul(&start);
            let knots = ray::shoot(this.surface, first, this.limits);
            this.samples_of(&knots, start)
        });
        for sample in found.into_iter().flatten() {
            self.by_node[sample.near as usize].push(self.samples.len() as u32);
            self.samples.push(sample);
        }
    }

    /// The jets at the knots of a ray, up to where rays beside it come too near.
    fn samples_of(&self, knots: &[Knot<D, S::Place>], start: Matrix<D>) -> Vec<Sample<D>> {
        let jets = knots.iter().map_while(|knot| {
            if knot.length == 0.0 {
                return Some(None);
            }
            let inverse = knot.jacobi[0].try_inverse()?;
            let shape = knot.jacobi[1] * inverse;
            let jet = Jet {
                distance: self.origin.start + knot.length,
                gradient: axis(0),
                shape: (shape + shape.transpose()) * 0.5,
            };
            let spacing = self.limits.spacing[knot.near as usize];
            jet.spreads_faster(-USELESS_FOCUS / spacing)
                .then_some(Some((knot, jet, inverse)))
        });
        let samples = jets.flatten().map(|(knot, jet, inverse)| Sample {
            frame: knot.frame.clone(),
            jet,
            length: knot.length,
            near: knot.near,
            surface_error: knot.heights.length_error(),
            inverse,
            start,
        });
        samples.collect()
    }

    /// The jet from which a node that no jet covers is to be aimed at, if there is one; the outer
    /// `None` is for covered nodes.
    fn aim(&self, node: u32) -> Option<Option<u32>> {
        let (graph, spacing) = (self.limits.graph, self.limits.spacing[node as usize]);
        let x = &graph.nodes[node as usize].point;
        let around = std::iter::once(node).chain(graph.edges(node).iter().map(|edge| edge.to));
        let near: Vec<(f64, f64, u32)> = around
            .flat_map(|n| &self.by_node[n as usize])
            .filter_map(|index| {
                let sample = &self.samples[*index as usize];
                let off = (sample.frame.point - x).norm();
                (off <= AIM * spacing).then(|| (off, sample.estimate(x), *index))
            })
            .collect();
        let least = near.iter().map(|n| n.1).fold(f64::INFINITY, f64::min);
        let short = near
            .iter()
            .filter(|n| n.1 <= least + COVERED_LONGER * spacing)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        let covers = |off: f64, index: u32| {
            let jet = &self.samples[index as usize].jet;
            let fully = off <= COVERED * spacing && jet.spreads_faster(-COVERED_DRAWN / off);
            fully || off <= LEAST_COVERED * spacing
        };
        match short {
            Some((off, _, index)) if covers(*off, *index) => None,
            short => Some(short.map(|s| s.2)),
        }
    }

    /// The nodes that can be aimed at from another jet than last time and that have no such node
    /// farther along beside them.
    fn farthest(&self, aims: &[(u32, Option<u32>)], attempts: &[(u8, u32)]) -> Vec<(u32, u32)> {
        let mut rank = vec![f64::NEG_INFINITY; self.by_node.len()];
        let possible = || {
            aims.iter().filter_map(|(node, from)| {
                let (times, last) = attempts[*node as usize];
                let from = from.filter(|from| times < ATTEMPTS && *from != last)?;
                Some((*node, from))
            })
        };
        for (node, _) in possible() {
            rank[node as usize] = self.limits.bound(node);
        }
        let first = |node: u32| {
            let reach = AIMED_APART * self.limits.spacing[node as usize];
            let edges = self.limits.graph.edges(node).iter();
            let mut close = edges.filter(|edge| f64::from(edge.length) <= reach);
            close.all(|edge| {
                let (own, other) = (rank[node as usize], rank[edge.to as usize]);
                (other, edge.to) < (own, node)
            })
        };
        possible().filter(|(node, _)| first(*node)).collect()
    }
}
