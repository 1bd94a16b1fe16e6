//! Continuous Dijkstra over cells, Algorithm 2: distances spread outwards from the source's cell,
//! the shortest edge to the visited set first. With lower bounds of what is left to a goal added
//! (A*), only the nodes of routes near the shortest are visited.

use crate::guess::graph::Graph;
use crate::guess::landmarks::{Goal, Landmarks};
use crate::guess::queue::Queue;

/// Width of a bucket of the queue, in mean edges.
const BUCKET: f32 = 0.25;

/// The index that stands for no node.
pub(crate) const NONE: u32 = u32::MAX;

/// Distances from a source along the graph; the memory is kept between searches.
#[derive(Clone, Debug)]
pub(crate) struct Distances {
    labels: Vec<Label>,
    reached: Vec<u32>,
    queue: Queue,
}

/// What is known of a node during a search.
#[derive(Clone, Copy, Debug)]
struct Label {
    distance: f32,
    /// A lower bound of the distance left to the goal.
    left: f32,
    /// The distance that the neighbours know.
    spread: f32,
    previous: u32,
}

const UNREACHED: Label = Label {
    distance: f32::INFINITY,
    left: f32::INFINITY,
    spread: f32::INFINITY,
    previous: NONE,
};

impl Distances {
    pub fn new<const D: usize, P: Copy>(graph: &Graph<D, P>) -> Self {
        Self {
            labels: vec![UNREACHED; graph.nodes.len()],
            reached: Vec::new(),
            queue: Queue::new(BUCKET * graph.mean_edge()),
        }
    }

    /// Distance of a node; infinite where it is unreached.
    pub fn distance(&self, node: u32) -> f32 {
        self.labels[node as usize].distance
    }

    /// The node before a node on the shortest way; [`NONE`] for nodes that were entered from the
    /// source itself.
    pub fn previous(&self, node: u32) -> u32 {
        self.labels[node as usize].previous
    }

    /// The nodes with a finite distance.
    pub fn reached(&self) -> &[u32] {
        &self.reached
    }

    pub fn clear(&mut self) {
        for node in self.reached.drain(..) {
            self.labels[node as usize] = UNREACHED;
        }
    }

    /// Spreads distances from a source that reaches each entrance over the given length. Nodes are
    /// visited about in the order of their distance plus `left`, which never overestimates what is
    /// left to the goal. `longest` is told each node with its distance, and says how long a whole
    /// route may be from then on.
    ///
    /// Distances are right where they and what is left stay below that length, and elsewhere not
    /// too short. About O(n) in the nodes visited.
    pub fn search<const D: usize, P: Copy>(
        &mut self,
        graph: &Graph<D, P>,
        entrances: &[(u32, f32)],
        left: impl Fn(u32) -> f32,
        mut longest: impl FnMut(u32, f32) -> f32,
    ) {
        let mut most = f32::INFINITY;
        let wholes = entrances.iter().map(|(node, length)| length + left(*node));
        self.queue.restart(wholes.fold(f32::INFINITY, f32::min));
        for (node, length) in entrances {
            if *length < self.distance(*node) {
                self.improve(*node, *length, NONE, most, &left);
            }
        }
        while let Some(node) = self.queue.pop() {
            let label = &mut self.labels[node as usize];
            let distance = label.distance;
            if distance >= label.spread || distance + label.left > most {
                continue;
            }
            label.spread = distance;
            most = longest(node, distance);
            for edge in graph.edges(node) {
                let there = distance + edge.length;
                if there < self.distance(edge.to) {
                    self.improve(edge.to, there, node, most, &left);
                }
            }
        }
    }

    fn improve(
        &mut self,
        node: u32,
        distance: f32,
        previous: u32,
        most: f32,
        left: impl Fn(u32) -> f32,
    ) {
        let label = &mut self.labels[node as usize];
        if label.distance == f32::INFINITY {
            label.left = left(node);
            self.reached.push(node);
        }
        label.distance = distance;
        label.previous = previous;
        let whole = distance + label.left;
        if whole <= most {
            self.queue.push(whole, node);
        }
    }
}

/// Distances from both ends of a query.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    /// The distances from the start.
    pub forward: Distances,
    /// The distances from the end.
    pub backward: Distances,
    /// The start from which `forward` knows the distances of all nodes; empty where it does not.
    whole_from: Vec<(u32, f32)>,
}

impl Search {
    pub fn new<const D: usize, P: Copy>(graph: &Graph<D, P>) -> Self {
        Self {
            forward: Distances::new(graph),
            backward: Distances::new(graph),
            whole_from: Vec::new(),
        }
    }

    /// Finds the distances of all nodes on routes at most `detour` times as long as the shortest.
    /// Returns the length of the shortest route; infinite where there is none.
    pub fn both_ways<const D: usize, P: Copy>(
        &mut self,
        graph: &Graph<D, P>,
        landmarks: &Landmarks,
        start: &[(u32, f32)],
        end: &[(u32, f32)],
        detour: f32,
    ) -> f32 {
        self.forward.clear();
        self.whole_from.clear();
        let goal = landmarks.goal(end);
        let mut shortest = f32::INFINITY;
        let left = |node| Goal::bound(&goal, node);
        self.forward.search(graph, start, left, |node, distance| {
            if let Some((_, length)) = end.iter().find(|exit| exit.0 == node) {
                shortest = shortest.min(distance + length);
            }
            shortest * detour
        });
        self.back(graph, end, shortest, shortest * detour);
        shortest
    }

    /// Finds the same as [`both_ways`](Self::both_ways) from the distances of all nodes from the
    /// start, which are kept for other ends. It is meant for one start and many ends, where no
    /// landmarks are known.
    pub fn one_to_many<const D: usize, P: Copy>(
        &mut self,
        graph: &Graph<D, P>,
        start: &[(u32, f32)],
        end: &[(u32, f32)],
        detour: f32,
    ) -> f32 {
        if self.whole_from != start {
            self.forward.clear();
            let everywhere = |_, _| f32::INFINITY;
            self.forward.search(graph, start, |_| 0.0, everywhere);
            self.whole_from = start.to_vec();
        }
        let through = |exit: &(u32, f32)| self.forward.distance(exit.0) + exit.1;
        let shortest = end.iter().map(through).fold(f32::INFINITY, f32::min);
        self.back(graph, end, shortest, shortest * detour);
        shortest
    }

    /// Finds the distances from the end of all nodes on routes at most `longest`.
    fn back<const D: usize, P: Copy>(
        &mut self,
        graph: &Graph<D, P>,
        end: &[(u32, f32)],
        shortest: f32,
        longest: f32,
    ) {
        self.backward.clear();
        if shortest.is_finite() {
            let left = |node| self.forward.distance(node);
            self.backward.search(graph, end, left, |_, _| longest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vector;
    use crate::surface::Node;

    /// A grid of n x n nodes of step 1 with its eight directions; column n / 2 is a wall with a
    /// gap.
    fn grid(n: u32) -> Graph<2, ()> {
        let nodes = (0..n * n)
            .map(|i| Node {
                point: Vector::<2>::new(f64::from(i % n), f64::from(i / n)),
                place: (),
            })
            .collect();
        let wall = |i: u32| i % n == n / 2 && i / n != n - 1;
        let lists: Vec<Vec<u32>> = (0..n * n)
            .map(|i| {
                let near = |j: &u32| {
                    let (dx, dy) = ((i % n).abs_diff(j % n), (i / n).abs_diff(j / n));
                    *j != i && dx <= 1 && dy <= 1 && !wall(i) && !wall(*j)
                };
                (0..n * n).filter(near).collect()
            })
            .collect();
        Graph::new(nodes, lists.iter().map(Vec::as_slice))
    }

    #[test]
    fn goes_round_a_wall_and_both_ways_agree() {
        let graph = grid(11);
        let mut found = Distances::new(&graph);
        found.search(&graph, &[(0, 0.0)], |_| 0.0, |_, _| f32::INFINITY);
        // The way leads up the diagonal to the gap at (5, 10) and down again: 5 diagonal and 5
        // straight steps each way.
        let truth = 2.0 * (5.0 * 2.0_f32.sqrt() + 5.0);
        assert!((found.distance(10) - truth).abs() < 1e-4);
        let (components, sizes) = graph.components();
        let landmarks = Landmarks::new(&graph, &components, &sizes);
        let ends = [[(0, 0.5), (1, 1.0)], [(10, 0.0), (9, 1.1)]];
        let all = ends.map(|end| {
            let mut found = Distances::new(&graph);
            found.search(&graph, &end, |_| 0.0, |_, _| f32::INFINITY);
            found
        });
        let mut search = Search::new(&graph);
        for detour in [1.1, 10.0, 1.0] {
            for to_many in [true, false] {
                let shortest = if to_many {
                    search.one_to_many(&graph, &ends[0], &ends[1], detour)
                } else {
                    search.both_ways(&graph, &landmarks, &ends[0], &ends[1], detour)
                };
                assert!((shortest - truth - 0.5).abs() < 1e-4);
                for v in 0..graph.nodes.len() as u32 {
                    let (there, back) = (all[0].distance(v), all[1].distance(v));
                    if there + back <= detour * shortest * (1.0 - 1e-5) {
                        assert!((search.forward.distance(v) - there).abs() < 1e-4);
                        assert!((search.backward.distance(v) - back).abs() < 1e-4);
                    }
                }
            }
        }
        assert!(search.backward.reached().len() < sizes[0] / 2);
    }
}
