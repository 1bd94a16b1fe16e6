//! First guesses: paths across the surface on a graph, to be pulled taut by the correction.

pub(crate) mod dijkstra;
pub(crate) mod graph;
pub(crate) mod landmarks;
pub mod particles;
pub(crate) mod queue;
pub(crate) mod routes;
pub mod sampling;

use crate::surface::{Node, Surface};

/// A surface with a graph of nodes across it.
pub trait Guide<const D: usize>: Surface<D> {
    /// Calls `visit` with the graph nodes that a straight step on the surface from `node` reaches.
    fn entrances(&self, node: &Node<D, Self::Place>, visit: &mut dyn FnMut(u32));
}
