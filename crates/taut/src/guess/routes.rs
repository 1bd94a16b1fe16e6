//! Distinct routes between two points: the shortest on the graph, and others that could still win.
//!
//! The length of the shortest route through a node, d(start, v) + d(v, end), is lowest along the
//! shortest route and rises away from it; every other valley of it marks another way round an
//! obstacle, a handle or a bulge (via nodes: Abraham, Delling, Goldberg, Werneck, "Alternative Routes
//! in Road Networks", SEA 2010).

use crate::guess::dijkstra::{Distances, NONE};
use crate::guess::graph::{Edge, Graph};

/// A way along the graph, its nodes from start to end (the end points themselves excluded).
#[derive(Clone, Debug)]
pub(crate) struct Route {
    pub nodes: Vec<u32>,
}

/// Routes longer than the shortest by more than this are not looked at unless asked for: zigzags make
/// graph distances a few per cent too long.
pub(crate) const DETOUR: f32 = 1.1;
/// Two routes that share more than this much of their nodes' surroundings are one.
const SHARED: f64 = 0.85;

/// Up to `most` distinct routes through some of the `candidates`, shortest first, at most `longest`, by
/// the ways from both ends and the length of the shortest route `through` a node.
pub(crate) fn routes<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    (from, to): (&Distances, &Distances),
    through: impl Fn(u32) -> f32,
    candidates: &[u32],
    most: usize,
    longest: f32,
) -> Vec<Route> {
    let lengths = candidates.iter().map(|v| (through(*v), *v));
    let shorter = |a: (f32, u32), b: (f32, u32)| if b < a { b } else { a };
    let Some((_, best)) = lengths.reduce(shorter) else {
        return Vec::new();
    };
    let mut chosen = vec![Route {
        nodes: route(from, to, best),
    }];
    if most == 1 {
        return chosen;
    }
    let mut bottoms = valleys(graph, candidates, through, longest);
    bottoms.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut near = vec![false; graph.nodes.len()];
    mark(graph, &chosen[0], &mut near);
    for (_, bottom) in bottoms {
        if near[bottom as usize] {
            continue;
        }
        let nodes = route(from, to, bottom);
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
        v = from.previous(v);
    }
    nodes.reverse();
    v = to.previous(middle);
    while v != NONE {
        nodes.push(v);
        v = to.previous(v);
    }
    nodes
}

/// Marks the nodes of a route and their nearer neighbours.
fn mark<const D: usize, P: Copy>(graph: &Graph<D, P>, route: &Route, near: &mut [bool]) {
    for v in &route.nodes {
        near[*v as usize] = true;
        let edges = graph.edges(*v);
        let mean = edges.iter().map(|e| e.length).sum::<f32>() / edges.len().max(1) as f32;
        for edge in edges.iter().filter(|e| e.length <= mean) {
            near[edge.to as usize] = true;
        }
    }
}

/// (length of the route through it, node) for every one of the candidates that no neighbour undercuts:
/// the bottoms of the valleys of the length through a node.
fn valleys<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    candidates: &[u32],
    through: impl Fn(u32) -> f32,
    longest: f32,
) -> Vec<(f32, u32)> {
    candidates
        .iter()
        .filter_map(|&v| {
            let length = through(v);
            // Sums of the same edges in another order differ by rounding.
            let lowest = |edge: &Edge| through(edge.to) >= length * (1.0 - 1e-5);
            (length <= longest && graph.edges(v).iter().all(lowest)).then_some((length, v))
        })
        .collect()
}
