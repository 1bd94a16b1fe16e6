//! Continuous Dijkstra over cells, Algorithm 2: distances spread outwards from the source's cell, the
//! shortest edge to the visited set first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::Vector;
use crate::guess::graph::Graph;

/// No node.
pub(crate) const NONE: u32 = u32::MAX;

/// Distances from a source along the graph.
#[derive(Clone, Debug, Default)]
pub(crate) struct Distances {
    /// Distance of each node; infinite where unreached.
    pub distance: Vec<f32>,
    /// The node before on the shortest way, [`NONE`] for those entered from the source itself.
    pub previous: Vec<u32>,
}

/// Orders non-negative finite floats like their bits.
fn key(distance: f32, node: u32) -> Reverse<(u32, u32)> {
    Reverse((distance.to_bits(), node))
}

/// The part of the graph worth visiting: nodes from which the straight line to the other end still
/// allows a route of the longest length of interest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach<const D: usize> {
    /// The other end.
    pub target: Vector<D>,
    /// Longest route of interest.
    pub longest: f32,
}

/// Distances from a source that reaches each entrance over the given length, within `reach`.
/// O(n log n) in the nodes visited.
pub(crate) fn distances<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    entrances: &[(u32, f32)],
    reach: Reach<D>,
) -> Distances {
    let count = graph.nodes.len();
    let mut found = Distances {
        distance: vec![f32::INFINITY; count],
        previous: vec![NONE; count],
    };
    let mut heap = BinaryHeap::new();
    for (node, length) in entrances {
        if *length < found.distance[*node as usize] {
            found.distance[*node as usize] = *length;
            heap.push(key(*length, *node));
        }
    }
    while let Some(Reverse((bits, node))) = heap.pop() {
        let distance = f32::from_bits(bits);
        let left = (graph.nodes[node as usize].point - reach.target).norm() as f32;
        if distance > found.distance[node as usize] || distance + left > reach.longest {
            continue;
        }
        for edge in graph.edges(node) {
            let there = distance + edge.length;
            if there < found.distance[edge.to as usize] {
                found.distance[edge.to as usize] = there;
                found.previous[edge.to as usize] = node;
                heap.push(key(there, edge.to));
            }
        }
    }
    found
}

/// Length of the shortest route from the entrances to the exits, by A*: the straight line to the
/// target never overestimates. Infinite where there is none.
pub(crate) fn shortest<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    entrances: &[(u32, f32)],
    exits: &[(u32, f32)],
    target: &Vector<D>,
) -> f32 {
    let left = |node: u32| (graph.nodes[node as usize].point - target).norm() as f32;
    let mut distance = vec![f32::INFINITY; graph.nodes.len()];
    let mut heap = BinaryHeap::new();
    for (node, length) in entrances {
        if *length < distance[*node as usize] {
            distance[*node as usize] = *length;
            heap.push(key(length + left(*node), *node));
        }
    }
    let mut best = f32::INFINITY;
    while let Some(Reverse((bits, node))) = heap.pop() {
        let estimate = f32::from_bits(bits);
        if estimate >= best {
            break;
        }
        let here = distance[node as usize];
        // An entry made before a shorter way was found; rounding of the sum is allowed for.
        if estimate > (here + left(node)) * (1.0 + 1e-6) {
            continue;
        }
        if let Some((_, length)) = exits.iter().find(|exit| exit.0 == node) {
            best = best.min(here + length);
        }
        for edge in graph.edges(node) {
            let there = here + edge.length;
            if there < distance[edge.to as usize] {
                distance[edge.to as usize] = there;
                heap.push(key(there + left(edge.to), edge.to));
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Node;

    /// A grid of n x n nodes of step 1 with its eight directions; column n / 2 is a wall with a gap.
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
    fn goes_round_a_wall_and_astar_agrees() {
        let graph = grid(11);
        let target = graph.nodes[10].point;
        let everywhere = Reach {
            target,
            longest: f32::INFINITY,
        };
        let found = distances(&graph, &[(0, 0.0)], everywhere);
        // Up the diagonal to the gap at (5, 10) and down again: 5 diagonal and 5 straight steps each way.
        let truth = 2.0 * (5.0 * 2.0_f32.sqrt() + 5.0);
        assert!((found.distance[10] - truth).abs() < 1e-4);
        assert_eq!(
            shortest(&graph, &[(0, 0.0)], &[(10, 0.0)], &target),
            found.distance[10]
        );
        // A reach too short for the detour leaves the target unreached.
        let near = Reach {
            target,
            longest: 12.0,
        };
        assert!(distances(&graph, &[(0, 0.0)], near).distance[10].is_infinite());
    }
}
