//! Distinct routes between two points: the shortest on the graph, and others that could still win.
//!
//! A route through an edge that both the tree from the start and the tree from the end use is locally
//! shortest along it. The chains of such edges, *plateaus*, mark the different ways round an
//! obstacle, a handle or a bulge (Abraham, Delling, Goldberg, Werneck, "Alternative Routes in Road
//! Networks", SEA 2010).

use crate::guess::dijkstra::{Distances, NONE};
use crate::guess::graph::Graph;

/// A way along the graph, its nodes from start to end (the end points themselves excluded).
#[derive(Clone, Debug)]
pub(crate) struct Route {
    pub nodes: Vec<u32>,
}

/// Routes longer than the shortest by more than this are not looked at unless asked for: zigzags make
/// graph distances a few per cent too long.
pub(crate) const DETOUR: f32 = 1.2;
/// A plateau shorter than this share of its route is a wiggle, not a way of its own.
const PLATEAU: f32 = 0.1;
/// Two routes that share more than this much of their nodes' surroundings are one.
const SHARED: f64 = 0.75;

/// Up to `most` distinct routes, shortest first, at most `detour` times as long as the shortest.
pub(crate) fn routes<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    from: &Distances,
    to: &Distances,
    most: usize,
    detour: f32,
) -> Vec<Route> {
    let through = |v: usize| from.distance[v] + to.distance[v];
    let Some(best) = (0..graph.nodes.len()).min_by(|a, b| through(*a).total_cmp(&through(*b)))
    else {
        return Vec::new();
    };
    let shortest = through(best);
    if !shortest.is_finite() {
        return Vec::new();
    }
    let mut chosen = vec![Route {
        nodes: route(from, to, best as u32),
    }];
    if most == 1 {
        return chosen;
    }
    let mut candidates = plateaus(from, to, shortest * detour);
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut near = vec![false; graph.nodes.len()];
    mark(graph, &chosen[0], &mut near);
    for (_, middle) in candidates {
        if near[middle as usize] {
            continue;
        }
        let nodes = route(from, to, middle);
        let shared = nodes.iter().filter(|v| near[**v as usize]).count();
        if shared as f64 > SHARED * nodes.len() as f64 {
            continue;
        }
        let next = Route { nodes };
        mark(graph, &next, &mut near);
        chosen.push(next);
        if chosen.len() == most {
            break;
        }
    }
    chosen
}

/// The route through `middle`.
fn route(from: &Distances, to: &Distances, middle: u32) -> Vec<u32> {
    let mut nodes = Vec::new();
    let mut v = middle;
    while v != NONE {
        nodes.push(v);
        v = from.previous[v as usize];
    }
    nodes.reverse();
    v = to.previous[middle as usize];
    while v != NONE {
        nodes.push(v);
        v = to.previous[v as usize];
    }
    nodes
}

/// Marks the nodes of a route and their neighbours.
fn mark<const D: usize, P: Copy>(graph: &Graph<D, P>, route: &Route, near: &mut [bool]) {
    for v in &route.nodes {
        near[*v as usize] = true;
        for edge in graph.edges(*v) {
            near[edge.to as usize] = true;
        }
    }
}

/// (length of the route, its middle node) for every plateau long enough.
fn plateaus(from: &Distances, to: &Distances, longest: f32) -> Vec<(f32, u32)> {
    let count = from.distance.len();
    let after = |v: usize| {
        let next = to.previous[v];
        (next != NONE && from.previous[next as usize] == v as u32).then_some(next as usize)
    };
    let mut found = Vec::new();
    for start in 0..count {
        let length = from.distance[start] + to.distance[start];
        if !(length <= longest) {
            continue;
        }
        let before = from.previous[start];
        if before != NONE && to.previous[before as usize] == start as u32 {
            continue;
        }
        let mut chain = vec![start];
        let mut last = start;
        while let Some(next) = after(last) {
            chain.push(next);
            last = next;
        }
        let extent = from.distance[last] - from.distance[start];
        if extent >= PLATEAU * length {
            found.push((length, chain[chain.len() / 2] as u32));
        }
    }
    found
}
