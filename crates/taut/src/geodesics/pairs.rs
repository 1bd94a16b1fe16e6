//! Many pairs at a time, and what a guess is worth before it is corrected.

use rayon::prelude::*;

use crate::correction::Settings;
use crate::geodesics::{CLOSE, GUESSES, Geodesics};
use crate::guess::Guide;
use crate::guess::dijkstra::Distances;
use crate::guess::routes::{self, DETOUR};
use crate::result::Path;
use crate::surface::{Geometry, Node};

/// A first guess: a curve on the surface through nodes of the graph.
#[derive(Clone, Debug)]
pub struct Guess<const D: usize, P> {
    /// From end to end.
    pub nodes: Vec<Node<D, P>>,
    /// Length of the curve on the surface over the chords between them, which no geodesic exceeds.
    pub length: f64,
}

/// Pieces that a chord is cut into to measure the curve over it.
const PIECES: usize = 16;
/// Nodes looked at together for those near a route.
const BLOCK: usize = 16;

impl<const D: usize, S: Guide<D>> Geodesics<D, S> {
    /// The shortest way along the graph, `None` where there is none.
    #[must_use]
    pub fn guess(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
    ) -> Option<Guess<D, S::Place>> {
        let mut workspace = self.take_workspace();
        let mut guesses = self.guesses(from, to, 1, 1.0, &mut workspace.search);
        self.put_back(workspace);
        let nodes = guesses.pop()?;
        let mut scratch = Geometry::new(D - self.surface.intrinsic_dimension());
        let mut length = 0.0;
        for pair in nodes.windows(2) {
            length += over_chord(&self.surface, &pair[0], &pair[1], &mut scratch)?;
        }
        Some(Guess { nodes, length })
    }

    /// What `keep` makes of the shortest geodesic found from one node to each of others, in their order.
    /// Independent of each other and in parallel.
    pub fn from_one<T: Send>(
        &self,
        from: &Node<D, S::Place>,
        to: &[Node<D, S::Place>],
        settings: &Settings,
        keep: impl Fn(usize, Path<D>) -> T + Sync,
    ) -> Vec<T> {
        to.par_iter()
            .enumerate()
            .map(|(i, end)| keep(i, self.path(from, end, settings)))
            .collect()
    }

    /// What `keep` makes of the shortest geodesic found between any two of n nodes: for i < j, pair
    /// (i, j) comes after all (i', j) with i' < i and all (., j') with j' < j. In parallel.
    ///
    /// n spreads of distances over the whole graph, each kept in 24 bytes a node of it, and then
    /// n (n - 1) / 2 corrections as in [`path`](Self::path).
    pub fn all_pairs<T: Send>(
        &self,
        nodes: &[Node<D, S::Place>],
        settings: &Settings,
        keep: impl Fn([usize; 2], Path<D>) -> T + Sync,
    ) -> Vec<T> {
        let from_each: Vec<End> = nodes.par_iter().map(|node| self.spread(node)).collect();
        let pairs: Vec<[usize; 2]> = (0..nodes.len())
            .flat_map(|j| (0..j).map(move |i| [i, j]))
            .collect();
        pairs
            .into_par_iter()
            .map(|pair| {
                let [start, end] = pair.map(|i| &from_each[i]);
                let longest = DETOUR * start.distance(end);
                let both = (&start.distances, &end.distances);
                let near = start.between(end, longest);
                let through = |v| start.lengths[v as usize] + end.lengths[v as usize];
                let routes = routes::routes(&self.graph, both, through, &near, GUESSES, longest);
                let guesses = self.along(&nodes[pair[0]], &nodes[pair[1]], routes);
                let mut workspace = self.take_workspace();
                let paths = self.pull_taut(&guesses, settings, CLOSE, &mut workspace.solver);
                self.put_back(workspace);
                keep(pair, paths.into_iter().next().unwrap_or_else(Path::none))
            })
            .collect()
    }

    fn spread(&self, node: &Node<D, S::Place>) -> End {
        let entrances = self.entrances(node);
        let mut distances = Distances::new(&self.graph);
        distances.search(&self.graph, &entrances, |_| 0.0, |_, _| f32::INFINITY);
        let lengths = (0..self.graph.nodes.len() as u32).map(|v| distances.distance(v));
        End {
            entrances,
            lengths: lengths.collect(),
            distances,
        }
    }
}

/// An end of many pairs, with the distances of the whole graph from it.
struct End {
    entrances: Vec<(u32, f32)>,
    distances: Distances,
    /// The distances alone, close together.
    lengths: Vec<f32>,
}

impl End {
    /// The nodes on routes at most so long.
    fn between(&self, other: &Self, longest: f32) -> Vec<u32> {
        let mut near = Vec::new();
        let blocks = self.lengths.chunks(BLOCK).zip(other.lengths.chunks(BLOCK));
        for (first, (from, to)) in (0_u32..).step_by(BLOCK).zip(blocks) {
            let within = || from.iter().zip(to).map(|(a, b)| a + b <= longest);
            // Most blocks hold none, which is found out without a branch a node.
            if within().fold(false, |any, near| any | near) {
                near.extend(
                    (first..)
                        .zip(within())
                        .filter_map(|(v, near)| near.then_some(v)),
                );
            }
        }
        near
    }

    /// Distance along the graph, infinite where there is none.
    fn distance(&self, other: &Self) -> f32 {
        let ways = other.entrances.iter();
        ways.map(|(node, length)| self.distances.distance(*node) + length)
            .fold(f32::INFINITY, f32::min)
    }
}

/// Length of the curve of feet of a chord: chord sums, extrapolated by Romberg's scheme.
fn over_chord<const D: usize, S: Guide<D>>(
    surface: &S,
    from: &Node<D, S::Place>,
    to: &Node<D, S::Place>,
    scratch: &mut Geometry<D>,
) -> Option<f64> {
    let chord = to.point - from.point;
    let mut points = Vec::with_capacity(PIECES + 1);
    let mut place = from.place;
    for i in 0..=PIECES {
        let share = i as f64 / PIECES as f64;
        points.push(surface.foot(&(from.point + chord * share), &mut place, scratch)?);
    }
    let sum = |stride: usize| -> f64 {
        let corners: Vec<_> = points.iter().step_by(stride).collect();
        let chords = corners.windows(2).map(|pair| (pair[1] - pair[0]).norm());
        chords.sum()
    };
    let mut sums = [1, 2, 4, 8].map(sum);
    for level in 1..sums.len() {
        let factor = 4_f64.powi(level as i32) - 1.0;
        for i in 0..sums.len() - level {
            sums[i] += (sums[i] - sums[i + 1]) / factor;
        }
    }
    Some(sums[0])
}
