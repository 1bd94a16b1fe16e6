//! First guesses: paths across the surface on a graph, to be pulled taut by the correction.
//!
//! Points that are to be joined enter the graph at nodes near them. Distances spread along it from
//! one end or from both (`dijkstra`), and distinct short routes are picked (`routes`). The graph
//! joins the charts of a cloud, the samples of an equation (`sampling`), or the trajectories of
//! particles (`particles`).

pub(crate) mod dijkstra;
pub(crate) mod graph;
pub(crate) mod landmarks;
pub mod particles;
pub(crate) mod queue;
pub(crate) mod routes;
pub mod sampling;

use crate::surface::atlas::Atlas;
use crate::surface::{Node, Surface};

/// Largest distance between samples, or between particles at rest, that may be joined, in spacings.
const JOINED: f64 = 1.9;
/// Largest sine of the angle at which the chord to a neighbour may leave the tangent plane.
const STEEPEST_CHORD: f64 = 0.6;

/// A surface with a graph of nodes across it.
pub trait Guide<const D: usize>: Surface<D> {
    /// Calls `visit` with the graph nodes that a straight step on the surface from `node` reaches.
    fn entrances(&self, node: &Node<D, Self::Place>, visit: &mut dyn FnMut(u32));

    /// Ways across the surface besides those along the graph; `_is_joined` tells whether the graph
    /// joins the two nodes. There are none as a rule, because a graph that covers its surface knows
    /// them all.
    fn ways(
        &self,
        _from: &Node<D, Self::Place>,
        _to: &Node<D, Self::Place>,
        _is_joined: bool,
    ) -> Vec<Vec<Node<D, Self::Place>>> {
        Vec::new()
    }

    /// Whether a way on the graph, given by its nodes, passes a tip, such as that of a cone, so that
    /// the graph may not tell the ways on both sides of it apart.
    fn passes_tip(&self, _way: &[Node<D, Self::Place>]) -> bool {
        false
    }

    /// Whether nothing can connect two parts of the surface that the graph does not join. Each part
    /// is given by a graph node, or by `None` where the graph has no node there. `false` where
    /// parts of the surface are missing from the graph.
    fn apart(&self, _from: Option<u32>, _to: Option<u32>) -> bool {
        true
    }

    /// The atlas that the surface is, which knows the points that it was put through; `None` for a
    /// surface of another kind.
    fn atlas(&self) -> Option<&Atlas<D>> {
        None
    }
}
