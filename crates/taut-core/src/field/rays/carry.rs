//! Distances carried on along the graph, where no ray comes by in the shadow of holes, or only a
//! ray that goes a long way round.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::field::plane::norm;
use crate::field::rays::branches::Branch;
use crate::field::rays::frame::{Frame, ON_SURFACE};
use crate::field::rays::jet::{Heading, Jet};
use crate::guess::dijkstra::Distances;
use crate::guess::graph::Graph;

/// Least cosine between a jet's gradient and a step along which the jet may be carried: upwind only
/// and hardly to the side, as the rim of the hole may be in the way.
const UPWIND: f64 = 0.985;
/// Estimated relative error of a step: nodes lie about half a spacing off the way round a hole.
const ROUGH_CARRY: f64 = 0.02;

/// A node with a distance that neighbouring nodes may take up; in a heap the least distance comes
/// first.
#[derive(PartialEq)]
pub(crate) struct Waiting {
    pub distance: f64,
    pub node: u32,
}

impl Eq for Waiting {}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .distance
            .total_cmp(&self.distance)
            .then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Gives a branch to each node within reach that has none, from its neighbours in the order of
/// distance. The neighbour's jet is carried where the step goes along its gradient; else the
/// neighbour counts as a new source. Where rays are diffracted at rims, some may be missing: then
/// nodes whose ways are longer than this by more than the step itself get a new branch too.
pub(crate) fn carry_on<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    frames: &[Option<Frame<D>>],
    bound: &Distances,
    is_diffracted: bool,
    lists: &mut [Vec<Branch>],
) {
    let empty = |node: u32, lists: &[Vec<Branch>]| {
        let i = node as usize;
        lists[i].is_empty() && frames[i].is_some() && bound.distance(node).is_finite()
    };
    let mut heap: BinaryHeap<Waiting> = (0..lists.len() as u32)
        .filter(|node| is_diffracted || graph.edges(*node).iter().any(|edge| empty(edge.to, lists)))
        .filter_map(|node| {
            let distance = lists[node as usize].first()?.jet.distance;
            Some(Waiting { distance, node })
        })
        .collect();
    let mut best = vec![f64::INFINITY; if heap.is_empty() { 0 } else { lists.len() }];
    let mut open: Vec<bool> = (0..best.len() as u32)
        .map(|node| empty(node, lists))
        .collect();
    let is_longer = |held: &Branch, found: &Branch, step: f64| {
        found.jet.distance + found.error + step < held.jet.distance - held.error
    };
    // Nodes are taken in the order of distance, as in Dijkstra's algorithm, so that a node is
    // settled before it is carried on.
    while let Some(Waiting { distance, node }) = heap.pop() {
        let i = node as usize;
        let (Some(from), Some(branch)) = (frames[i], lists[i].first().copied()) else {
            continue;
        };
        if open[i] && distance > best[i] {
            continue;
        }
        open[i] = false;
        for edge in graph.edges(node) {
            let j = edge.to as usize;
            let Some(to) = frames[j].filter(|_| open[j] || is_diffracted) else {
                continue;
            };
            let Some(found) = step(&branch, &from, &to) else {
                continue;
            };
            let held = lists[j].first().filter(|_| !open[j]);
            if held.is_some_and(|held| !is_longer(held, &found, f64::from(edge.length))) {
                continue;
            }
            if found.jet.distance < best[j] {
                best[j] = found.jet.distance;
                lists[j] = vec![found];
                heap.push(Waiting {
                    distance: best[j],
                    node: edge.to,
                });
            }
        }
    }
}

/// A branch carried over a step to another frame.
fn step<const D: usize>(branch: &Branch, from: &Frame<D>, to: &Frame<D>) -> Option<Branch> {
    let v = from.log(&to.point, ON_SURFACE);
    let length = norm(v);
    let along = v[0] * branch.jet.gradient[0] + v[1] * branch.jet.gradient[1];
    let mut bound = Jet::of_point(from, branch.jet.distance, to)?;
    bound.heading = Heading::same(branch.jet.heading.angle);
    let carried = branch.jet.carried(from, to);
    let upwind = carried.filter(|jet| along >= UPWIND * length && jet.distance <= bound.distance);
    let jet = upwind.unwrap_or(bound);
    let least = branch.jet.distance + along.max(0.0);
    Some(Branch {
        jet,
        error: branch.error + (jet.distance - least).max(0.0) + ROUGH_CARRY * length,
        piece: None,
        carried: true,
        ..*branch
    })
}
