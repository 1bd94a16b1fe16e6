//! Isolines of fields, as polylines on the surface.
//!
//! The line of each component is begun where two neighbouring nodes of the graph lie on both sides
//! of the level. It is followed by steps across the gradient, each corrected along the gradient
//! (predictor and corrector: E. L. Allgower, K. Georg, "Numerical Continuation Methods", 1990). It
//! ends where it began, at a rim (the boundary of the surface), or where the field ends.

mod spot;
mod walk;

use crate::Vector;
use crate::error::Error;
use crate::field::rays::ray;
use crate::field::{Field, Fields};
use crate::guess::Guide;
use crate::parallel;
use crate::surface::atlas::Lists;
use spot::{Follower, Spot};

/// A connected piece of the set of points at one distance from the sources.
#[derive(Clone, Debug)]
pub struct Isoline<const D: usize> {
    /// The distance of the points, in the input's units.
    pub level: f64,
    /// Whether the line runs back into itself; its first vertex is then repeated at its end.
    pub closed: bool,
    /// Vertices on the surface, in order; what is nearer to the sources lies to the same side all
    /// along. Kinks, where fronts from two sides meet, are rounded by a hundredth of the graph's
    /// spacing.
    pub points: Vec<Vector<D>>,
    /// The largest difference of the field at a vertex from the level, in the input's units.
    pub miss: f64,
}

/// Largest distance at which a line passes a seed, in mean edges of the graph.
const PASSED: f64 = 0.02;
/// Largest distance at which a line passes a seed where their gradients agree, in mean edges of the
/// graph.
const PASSED_ALIKE: f64 = 0.15;
/// Least cosine between gradients that agree.
const GRADIENTS_ALIKE: f64 = 0.3;
/// Largest distance between a source and an isoline, in mean edges of the graph, at which the line
/// is looked for about the source: there may be no node between.
const LINE_ABOUT_SOURCE: f64 = 2.0;

/// Number of vertices above which a line with a small gap between its ends is closed.
const SHORT_LINE: usize = 8;
/// Largest gap between the ends of a line that is closed, in mean edges of the graph: what parted
/// them is the tip between two fronts that have just met.
const GAP: f64 = 0.25;

/// Places on a level that lines have to pass.
struct Seeds<const D: usize, P> {
    spots: Vec<Spot<D, P>>,
    /// For each node of the graph, the seeds whose nearest node it is.
    by_node: Lists,
    /// Whether each seed still waits for a line to pass it.
    is_waiting: Vec<bool>,
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The isolines of a field on a two-dimensional surface, at levels in their order; with costs
    /// they are lines of equal cost. Lines end at rims and where the field does. A closed line that
    /// no two neighbouring nodes of the graph lie on both sides of is seen about sources only.
    ///
    /// # Errors
    /// [`Error::NoIsolines`] on surfaces of other dimensions.
    ///
    /// About O(n) in the nodes of the graph and in the length of the lines over their spacing;
    /// levels are found in parallel.
    pub fn isolines(&self, field: &Field<D>, levels: &[f64]) -> Result<Vec<Isoline<D>>, Error> {
        let dimension = self.geodesics.surface().intrinsic_dimension();
        if dimension != 2 {
            return Err(Error::NoIsolines { dimension });
        }
        let graph = self.geodesics.graph();
        let distances = parallel::map(graph.nodes.len(), |i| {
            let known = self.sloped(field, i as u32, &graph.nodes[i].point);
            known.map_or(f64::INFINITY, |known| known.0)
        });
        let nodes = 0..graph.nodes.len() as u32;
        let widest = nodes.map(|node| self.mean_edge(node)).fold(0.0, f64::max);
        let at_level = |i: usize| {
            let mut follower = Follower::new(self, field, levels[i]);
            let mut spots = self.crossings(&distances, &mut follower);
            spots.extend(self.beside_sources(field, widest, &mut follower));
            let by_node = super::by_node(spots.iter().map(|spot| spot.near), graph.nodes.len());
            let mut seeds = Seeds {
                is_waiting: vec![true; spots.len()],
                spots,
                by_node,
            };
            self.lines(&mut seeds, &mut follower)
        };
        Ok(parallel::map(levels.len(), at_level)
            .into_iter()
            .flatten()
            .collect())
    }

    /// The places where edges of the graph cross the level.
    fn crossings(
        &self,
        distances: &[f64],
        follower: &mut Follower<'_, D, S>,
    ) -> Vec<Spot<D, S::Place>> {
        let graph = self.geodesics.graph();
        let level = follower.level;
        let mut spots = Vec::new();
        for (node, here) in (0..).zip(distances) {
            if *here >= level {
                continue;
            }
            let from = &graph.nodes[node as usize];
            let longest = self.mean_edge(node);
            for edge in graph.edges(node) {
                let there = distances[edge.to as usize];
                let is_short = f64::from(edge.length) <= longest;
                if there >= level && there.is_finite() && is_short {
                    let step = graph.nodes[edge.to as usize].point - from.point;
                    let x = from.point + step * ((level - here) / (there - here));
                    let place = (from.place, node);
                    spots.extend(follower.on_level(&x, place, f64::from(edge.length)));
                }
            }
        }
        spots
    }

    /// Places on the level about the sources, where the level is so near to them that there may be
    /// no node between. With costs there are none, because nothing is known of costs nearer to a
    /// source than the points are. `widest` is the largest mean edge of any node.
    fn beside_sources(
        &self,
        field: &Field<D>,
        widest: f64,
        follower: &mut Follower<'_, D, S>,
    ) -> Vec<Spot<D, S::Place>> {
        let graph = self.geodesics.graph();
        let mut spots = Vec::new();
        for (piece, near) in field.pieces.iter().zip(&field.piece_nodes) {
            let (radius, x) = (follower.level - piece.start, &piece.frame.point);
            let Some(near) = near.filter(|_| radius > 0.0 && radius <= LINE_ABOUT_SOURCE * widest)
            else {
                continue;
            };
            let near = ray::nearest(graph, x, near);
            if radius <= LINE_ABOUT_SOURCE * self.mean_edge(near) {
                let place = (graph.nodes[near as usize].place, near);
                // A point is encircled; a curve has two sides.
                let [along, off] = piece.frame.tangents.map(|tangent| tangent * radius);
                let steps: &[Vector<D>] = if piece.is_point() {
                    &[along]
                } else {
                    &[off, -off]
                };
                for step in steps {
                    spots.extend(follower.on_level(&(x + step), place, radius));
                }
            }
        }
        spots
    }

    /// The mean length of a node's edges.
    fn mean_edge(&self, node: u32) -> f64 {
        let edges = self.geodesics.graph().edges(node);
        let sum: f64 = edges.iter().map(|edge| f64::from(edge.length)).sum();
        sum / edges.len().max(1) as f64
    }

    /// The lines through all seeds.
    fn lines(
        &self,
        seeds: &mut Seeds<D, S::Place>,
        follower: &mut Follower<'_, D, S>,
    ) -> Vec<Isoline<D>> {
        let mut lines = Vec::new();
        while let Some(first) = seeds.is_waiting.iter().position(|waiting| *waiting) {
            seeds.is_waiting[first] = false;
            let start = seeds.spots[first];
            let mut pass = |a: &Spot<D, S::Place>, b: &Spot<D, S::Place>| self.pass(seeds, a, b);
            let (ahead, mut closed) = follower.walk(&start, 1.0, &mut pass);
            let mut spots = Vec::new();
            if !closed {
                let (behind, _) = follower.walk(&start, -1.0, &mut pass);
                spots.extend(behind.into_iter().skip(1).rev());
            }
            spots.extend(ahead);
            let [Some(first), Some(last)] = [spots.first().copied(), spots.last().copied()] else {
                continue;
            };
            if spots.len() < 2 {
                continue;
            }
            let gap = (first.point - last.point).norm();
            if !closed && spots.len() > SHORT_LINE && gap <= GAP * self.mean_edge(first.near) {
                spots.push(first);
                closed = true;
            }
            let miss = |spot: &Spot<D, S::Place>| (spot.distance - follower.level).abs();
            lines.push(Isoline {
                level: follower.level,
                closed,
                points: spots.iter().map(|spot| spot.point).collect(),
                miss: spots.iter().map(miss).fold(0.0, f64::max),
            });
        }
        lines
    }

    /// Takes the seeds that a step of a line passes off the waiting ones, and tells whether there
    /// were any.
    fn pass(
        &self,
        seeds: &mut Seeds<D, S::Place>,
        from: &Spot<D, S::Place>,
        to: &Spot<D, S::Place>,
    ) -> bool {
        let near = self.mean_edge(to.near);
        let around = self.geodesics.graph().edges(to.near).iter();
        let around = around.map(|edge| edge.to).chain([to.near]);
        let mut passed = false;
        for node in around {
            for seed in seeds.by_node.of(node).iter().map(|seed| *seed as usize) {
                let spot = &seeds.spots[seed];
                let distance = walk::off(&spot.point, from, to);
                let alike =
                    |other: &Spot<D, S::Place>| spot.ahead.dot(&other.ahead) >= GRADIENTS_ALIKE;
                let is_passed = distance <= PASSED * near
                    || (distance <= PASSED_ALIKE * near && (alike(from) || alike(to)));
                if seeds.is_waiting[seed] && is_passed {
                    seeds.is_waiting[seed] = false;
                    passed = true;
                }
            }
        }
        passed
    }
}
