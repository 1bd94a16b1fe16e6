//! Paths for many pairs of nodes at a time, and the first guess of a pair before it is corrected.

use crate::correction::Settings;
use crate::geodesics::{DETOUR_ROUND, GUESSES, Geodesics, Sought};
use crate::guess::Guide;
use crate::guess::routes::{DETOUR, Ways};
use crate::parallel;
use crate::result::Path;
use crate::surface::{Geometry, Node};

/// A first guess: a curve on the surface through nodes of the graph.
#[derive(Clone, Debug)]
pub struct Guess<const D: usize, P> {
    /// The nodes of the guess, from end to end.
    pub nodes: Vec<Node<D, P>>,
    /// Length, in the input's units, of the curve on the surface over the chords between the nodes;
    /// no geodesic is longer.
    pub length: f64,
}

/// Number of pieces that a chord is cut into to measure the curve over it.
const PIECES: usize = 16;
/// Number of nodes that are looked at together when those near a route are searched for.
const BLOCK: usize = 16;
/// Most that the way along the graph, less the steps onto it, may be longer than the geodesic, as a
/// factor.
const STRETCH: f32 = 1.25;

impl<const D: usize, S: Guide<D>> Geodesics<D, S> {
    /// The shortest way along the graph; `None` where there is none.
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

    /// What `keep` makes of the shortest geodesic found from one node to each of the others, in
    /// their order. The paths are independent of each other and found in parallel.
    pub fn from_one<T: Send>(
        &self,
        from: &Node<D, S::Place>,
        to: &[Node<D, S::Place>],
        settings: &Settings,
        keep: impl Fn(usize, Path<D>) -> T + Sync,
    ) -> Vec<T> {
        parallel::map(to.len(), |i| keep(i, self.path(from, &to[i], settings)))
    }

    /// What `keep` makes of the shortest geodesic found between any two of n nodes: for i < j, pair
    /// (i, j) comes after all (i', j) with i' < i and all (., j') with j' < j. In parallel.
    ///
    /// This takes n spreads of distances over the whole graph, each kept in 8 bytes a node of it,
    /// and then n (n - 1) / 2 corrections as in [`path`](Self::path). [`origin`](Self::origin) and
    /// [`path_between`](Self::path_between) do the same for any part of the pairs.
    pub fn all_pairs<T: Send>(
        &self,
        nodes: &[Node<D, S::Place>],
        settings: &Settings,
        keep: impl Fn([usize; 2], Path<D>) -> T + Sync,
    ) -> Vec<T> {
        let origins = parallel::map(nodes.len(), |i| self.origin(&nodes[i]));
        let pairs: Vec<[usize; 2]> = (0..nodes.len())
            .flat_map(|j| (0..j).map(move |i| [i, j]))
            .collect();
        parallel::map(pairs.len(), |pair| {
            let [i, j] = pairs[pair];
            let path = self.path_between(&origins[i], &origins[j], settings);
            keep([i, j], path)
        })
    }

    /// Spreads the distances along the graph from a node, for paths to many others. It takes about
    /// O(n) in the nodes of the graph, and 8 bytes for each of them.
    #[must_use]
    pub fn origin(&self, node: &Node<D, S::Place>) -> Origin<D, S::Place> {
        let entrances = self.entrances(node);
        let mut workspace = self.take_workspace();
        let found = &mut workspace.search.forward;
        found.clear();
        found.search(&self.graph, &entrances, |_| 0.0, |_, _| f32::INFINITY);
        let count = self.graph.nodes.len() as u32;
        let origin = Origin {
            node: *node,
            entrances,
            lengths: (0..count).map(|v| found.distance(v)).collect(),
            previous: (0..count).map(|v| found.previous(v)).collect(),
        };
        self.put_back(workspace);
        origin
    }

    /// The shortest geodesic found between two origins, as [`path`](Self::path) finds it.
    #[must_use]
    pub fn path_between(
        &self,
        from: &Origin<D, S::Place>,
        to: &Origin<D, S::Place>,
        settings: &Settings,
    ) -> Path<D> {
        if let Some(path) = self.straight(&from.node, &to.node) {
            return path;
        }
        let longest = DETOUR * from.distance(to);
        // What the graph does not join may still be connected where the surface was not sampled.
        if longest == f32::INFINITY {
            let [start, end] = [from, to].map(|origin| origin.entrances.first().map(|e| e.0));
            if self.is_unknown(start, end) {
                return self.path(&from.node, &to.node, settings);
            }
            return Path::none();
        }
        let guesses = |longest: f32| {
            let near = from.between(to, longest);
            let ways = Ways {
                graph: &self.graph,
                through: |v| from.lengths[v as usize] + to.lengths[v as usize],
                before: |v| from.previous[v as usize],
                after: |v| to.previous[v as usize],
            };
            let routes = ways.routes(&near, GUESSES, longest);
            self.along(&from.node, &to.node, routes)
        };
        let mut first = guesses(longest);
        first.extend(self.surface.ways(&from.node, &to.node, true));
        let more = || guesses(DETOUR_ROUND * from.distance(to));
        let mut workspace = self.take_workspace();
        let paths = self.pull_taut(
            first,
            more,
            settings,
            Sought::Shortest,
            &mut workspace.solver,
        );
        self.put_back(workspace);
        paths.into_iter().next().unwrap_or_else(Path::none)
    }

    /// The indices, ascending, of the nodes that may be within a geodesic distance from a node, in
    /// the input's units. They are all that are within it, and few others. No node is left out
    /// unless the way along the graph, less the steps onto it, is longer than 1.25 times the
    /// geodesic.
    ///
    /// O(n) in the number of nodes and in the number of the graph's nodes within the distance.
    #[must_use]
    pub fn maybe_within(
        &self,
        from: &Node<D, S::Place>,
        nodes: &[Node<D, S::Place>],
        distance: f64,
    ) -> Vec<usize> {
        let longest_of = |entrances: &[(u32, f32)]| {
            let lengths = entrances.iter().map(|entrance| entrance.1);
            lengths.fold(0.0, f32::max)
        };
        let along_graph = STRETCH * distance as f32;
        let start = self.entrances(from);
        let first = longest_of(&start);
        let mut workspace = self.take_workspace();
        let found = &mut workspace.search.forward;
        found.clear();
        // From the last node of the way along the graph there is one more step.
        let most = along_graph + first;
        found.search(&self.graph, &start, |_| 0.0, |_, _| most);
        let near = |node: &Node<D, S::Place>| {
            if (node.point - from.point).norm() > distance {
                return false;
            }
            let end = self.entrances(node);
            let ways = end.iter().map(|(v, length)| found.distance(*v) + length);
            ways.fold(f32::INFINITY, f32::min) <= most + longest_of(&end)
        };
        let chosen = nodes.iter().enumerate().filter(|(_, node)| near(node));
        let chosen = chosen.map(|(i, _)| i).collect();
        self.put_back(workspace);
        chosen
    }
}

/// A node with the distances of the whole graph from it.
#[derive(Clone, Debug)]
pub struct Origin<const D: usize, P> {
    node: Node<D, P>,
    /// Distance of each node of the graph along it, in the input's units.
    entrances: Vec<(u32, f32)>,
    lengths: Vec<f32>,
    /// For each node of the graph, the node before it on the shortest way.
    previous: Vec<u32>,
}

impl<const D: usize, P> Origin<D, P> {
    /// The graph nodes on routes to another origin that are at most `longest`.
    fn between(&self, other: &Self, longest: f32) -> Vec<u32> {
        let mut near = Vec::new();
        let blocks = self.lengths.chunks(BLOCK).zip(other.lengths.chunks(BLOCK));
        for (first, (from, to)) in (0_u32..).step_by(BLOCK).zip(blocks) {
            let within = || from.iter().zip(to).map(|(a, b)| a + b <= longest);
            // Most blocks hold no such node, and this is found out without a branch for each node.
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

    /// Distance to another origin along the graph; infinite where there is no way.
    fn distance(&self, other: &Self) -> f32 {
        let ways = other.entrances.iter();
        ways.map(|(node, length)| self.lengths[*node as usize] + length)
            .fold(f32::INFINITY, f32::min)
    }
}

/// Length of the curve of feet over a chord: sums of chords, extrapolated by Romberg's scheme.
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
