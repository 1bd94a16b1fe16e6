//! Distinct routes between two points: the shortest on the graph, and others that could still win.
//!
//! The length of the shortest route through a node, d(start, v) + d(v, end), is lowest along the
//! shortest route and rises away from it. Every other valley of it marks another way round an
//! obstacle, a handle or a bulge (via nodes: Abraham, Delling, Goldberg, Werneck, "Alternative
//! Routes in Road Networks", SEA 2010).

use crate::guess::dijkstra::NONE;
use crate::guess::graph::{Edge, Graph};

/// A way along the graph: its nodes from start to end, without the end points themselves.
#[derive(Clone, Debug)]
pub(crate) struct Route {
    pub nodes: Vec<u32>,
}

/// Largest length of a route, as a multiple of the shortest, that is looked at unless longer ones
/// are asked for: zigzags make graph distances a few per cent too long.
pub(crate) const DETOUR: f32 = 1.1;
/// Share of their nodes' surroundings above which two routes that share it are one.
const SHARED_ROUTE: f64 = 0.85;

/// What is known of the ways between two points.
pub(crate) struct Ways<'a, const D: usize, P, T, B, A> {
    pub graph: &'a Graph<D, P>,
    /// Length of the shortest route through a node.
    pub through: T,
    /// The node before a node on the shortest way from the start; [`NONE`] at the start.
    pub before: B,
    /// The node after a node on the shortest way to the end; [`NONE`] at the end.
    pub after: A,
}

impl<const D: usize, P, T, B, A> Ways<'_, D, P, T, B, A>
where
    P: Copy,
    T: Fn(u32) -> f32,
    B: Fn(u32) -> u32,
    A: Fn(u32) -> u32,
{
    /// Up to `most` distinct routes through some of the `candidates`, shortest first, at most
    /// `longest`.
    pub fn routes(&self, candidates: &[u32], most: usize, longest: f32) -> Vec<Route> {
        let lengths = candidates.iter().map(|v| ((self.through)(*v), *v));
        let shorter = |a: (f32, u32), b: (f32, u32)| if b < a { b } else { a };
        let Some((_, best)) = lengths.reduce(shorter) else {
            return Vec::new();
        };
        let mut chosen = vec![self.route(best)];
        if most == 1 {
            return chosen;
        }
        let mut bottoms = self.valleys(candidates, longest);
        bottoms.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut near = vec![false; self.graph.nodes.len()];
        self.mark(&chosen[0], &mut near);
        for (_, bottom) in bottoms {
            if near[bottom as usize] {
                continue;
            }
            let next = self.route(bottom);
            let shared = next.nodes.iter().filter(|v| near[**v as usize]).count();
            if shared as f64 > SHARED_ROUTE * next.nodes.len() as f64 {
                continue;
            }
            self.mark(&next, &mut near);
            chosen.push(next);
            if chosen.len() == most {
                break;
            }
        }
        chosen
    }

    /// The shortest route through `middle`.
    fn route(&self, middle: u32) -> Route {
        let mut nodes = Vec::new();
        let mut v = middle;
        while v != NONE {
            nodes.push(v);
            v = (self.before)(v);
        }
        nodes.reverse();
        v = (self.after)(middle);
        while v != NONE {
            nodes.push(v);
            v = (self.after)(v);
        }
        Route { nodes }
    }

    /// Marks the nodes of a route and their nearer neighbours.
    fn mark(&self, route: &Route, near: &mut [bool]) {
        for v in &route.nodes {
            near[*v as usize] = true;
            let edges = self.graph.edges(*v);
            let mean = edges.iter().map(|e| e.length).sum::<f32>() / edges.len().max(1) as f32;
            for edge in edges.iter().filter(|e| e.length <= mean) {
                near[edge.to as usize] = true;
            }
        }
    }

    /// The bottoms of the valleys of the length through a node: the candidates that no neighbour
    /// undercuts, each with the length of the route through it.
    fn valleys(&self, candidates: &[u32], longest: f32) -> Vec<(f32, u32)> {
        let bottom = |v: &u32| {
            let length = (self.through)(*v);
            // Sums of the same edges in another order differ by rounding.
            let lowest = |edge: &Edge| (self.through)(edge.to) >= length * (1.0 - 1e-5);
            let is_bottom = length <= longest && self.graph.edges(*v).iter().all(lowest);
            is_bottom.then_some((length, *v))
        };
        candidates.iter().filter_map(bottom).collect()
    }
}
