//! Continuous Dijkstra over cells, Algorithm 2: distances spread outwards from the source's cell, the
//! shortest edge to the visited set first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

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

/// Distances from a source that reaches each `entrance` over the given length. O(n log n).
pub(crate) fn distances<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    entrances: &[(u32, f32)],
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
        if distance > found.distance[node as usize] {
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
