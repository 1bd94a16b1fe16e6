//! A graph of nodes on a surface, whose edges are weighted by their length.

use crate::surface::Node;

/// Nodes on a surface, and edges between those that are a straight step apart.
#[derive(Clone, Debug)]
pub struct Graph<const D: usize, P> {
    /// The nodes.
    pub(crate) nodes: Vec<Node<D, P>>,
    /// Where the edges of each node begin in `edges`; one entry more than there are nodes.
    starts: Vec<u32>,
    /// The edges of all nodes, one node after the other.
    edges: Vec<Edge>,
}

/// An edge to a node, with its length in the input's units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub to: u32,
    pub length: f32,
}

impl<const D: usize, P: Copy> Graph<D, P> {
    /// Connects `nodes` by adjacency lists, which must be symmetric; an edge is as long as the
    /// distance of its ends.
    pub(crate) fn new<'a>(
        nodes: Vec<Node<D, P>>,
        neighbours: impl Iterator<Item = &'a [u32]>,
    ) -> Self {
        Self::with_lengths(nodes, neighbours, |_, _, chord| chord)
    }

    /// Connects `nodes` by adjacency lists, which must be symmetric; `length` gives the length of
    /// an edge from its ends and the distance between them.
    pub(crate) fn with_lengths<'a>(
        nodes: Vec<Node<D, P>>,
        neighbours: impl Iterator<Item = &'a [u32]>,
        length: impl Fn(usize, usize, f64) -> f64,
    ) -> Self {
        let mut starts = vec![0];
        let mut edges = Vec::new();
        for (i, list) in neighbours.enumerate() {
            for j in list.iter().filter(|j| **j as usize != i) {
                let chord = (nodes[*j as usize].point - nodes[i].point).norm();
                edges.push(Edge {
                    to: *j,
                    length: length(i, *j as usize, chord) as f32,
                });
            }
            starts.push(edges.len() as u32);
        }
        Self {
            nodes,
            starts,
            edges,
        }
    }

    /// The same graph on a surface whose places are of another type.
    pub(crate) fn into_kind<Q: From<P>>(self) -> Graph<D, Q> {
        Graph {
            nodes: self.nodes.into_iter().map(Node::into_kind).collect(),
            starts: self.starts,
            edges: self.edges,
        }
    }

    /// The mean length of the edges; 0 where there are none.
    pub(crate) fn mean_edge(&self) -> f32 {
        let sum: f32 = self.edges.iter().map(|edge| edge.length).sum();
        sum / self.edges.len().max(1) as f32
    }

    /// The edges of a node.
    pub(crate) fn edges(&self, node: u32) -> &[Edge] {
        let i = node as usize;
        &self.edges[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// The component of each node, numbered by descending size (ties by first node), and the sizes.
    pub(crate) fn components(&self) -> (Vec<u32>, Vec<usize>) {
        let mut component = vec![u32::MAX; self.nodes.len()];
        let mut sizes = Vec::new();
        let mut stack = Vec::new();
        for start in 0..self.nodes.len() {
            if component[start] != u32::MAX {
                continue;
            }
            let number = sizes.len() as u32;
            let mut size = 0;
            component[start] = number;
            stack.push(start as u32);
            while let Some(node) = stack.pop() {
                size += 1;
                for edge in self.edges(node) {
                    if component[edge.to as usize] == u32::MAX {
                        component[edge.to as usize] = number;
                        stack.push(edge.to);
                    }
                }
            }
            sizes.push(size);
        }
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_unstable_by_key(|i| (std::cmp::Reverse(sizes[*i]), *i));
        let mut rank = vec![0; sizes.len()];
        for (new, old) in order.iter().enumerate() {
            rank[*old] = new as u32;
        }
        for c in &mut component {
            *c = rank[*c as usize];
        }
        (component, order.iter().map(|i| sizes[*i]).collect())
    }
}
