//! The graph of the joined trajectories.

use crate::guess::JOINED;
use crate::guess::graph::Graph;
use crate::guess::particles::drift::{Drifted, Meeting};
use crate::guess::particles::swarm::{Swarm, neighbour_count};
use crate::spatial::tree::Tree;
use crate::surface::{Node, Surface};
use crate::{Vector, parallel};

/// For each particle at rest, its node in the graph, its node on the surface, and its spacing.
pub(super) type Rest<const D: usize, P> = Vec<(u32, Node<D, P>, f64)>;

/// The graph of the joined trajectories. Its nodes are the sources and all locations recorded; its
/// edges are the pieces of the trajectories, the meetings, and the joins of particles at rest.
pub(super) fn connect<const D: usize, S: Surface<D>>(
    drifted: &mut Drifted<'_, D, S>,
) -> (Graph<D, S::Place>, Rest<D, S::Place>) {
    let swarm = &drifted.swarm;
    let mut nodes = Vec::new();
    let mut firsts = Vec::new();
    for particle in &swarm.particles {
        firsts.push(nodes.len() as u32);
        // A trajectory begins at a node of another trajectory and ends at rest.
        nodes.extend(particle.trajectory.iter().skip(1).copied());
        nodes.push(particle.node);
    }
    let at_rest = |i: u32| {
        let next = firsts.get(i as usize + 1).copied();
        next.unwrap_or(nodes.len() as u32) - 1
    };
    // This is the node where a particle was at the last of a number of records; a source has only
    // one.
    let recorded = |(i, records): (u32, usize)| firsts[i as usize] + records.max(2) as u32 - 2;
    let mut lists = vec![Vec::new(); nodes.len()];
    let mut join = |a: u32, b: u32| {
        lists[a as usize].push(b);
        lists[b as usize].push(a);
    };
    for (i, particle) in swarm.particles.iter().enumerate().filter(|(_, p)| !p.fixed) {
        join(recorded(particle.birthplace), firsts[i]);
        for node in firsts[i]..at_rest(i as u32) {
            join(node, node + 1);
        }
    }
    for Meeting(both) in &drifted.meetings {
        let [a, b] = both.map(recorded);
        join(a, b);
    }
    for (i, j) in joins(swarm) {
        let [a, b] = [i, j].map(|i: u32| swarm.particles[i as usize].source);
        drifted.joined.join(a, b);
        join(at_rest(i), at_rest(j));
    }
    for (node, i) in beside(swarm, &nodes) {
        join(node, at_rest(i));
    }
    for list in &mut lists {
        list.sort_unstable();
        list.dedup();
    }
    let rest = (0..swarm.particles.len() as u32)
        .map(|i| {
            (
                at_rest(i),
                swarm.particles[i as usize].node,
                swarm.spacing(i),
            )
        })
        .collect();
    (Graph::new(nodes, lists.iter().map(Vec::as_slice)), rest)
}

/// The particles at rest that are a step away from each node. Without these joins, the way along a
/// trajectory would differ from the way beside it and pass for another way round.
fn beside<const D: usize, S: Surface<D>>(
    swarm: &Swarm<'_, D, S>,
    nodes: &[Node<D, S::Place>],
) -> Vec<(u32, u32)> {
    let points: Vec<Vector<D>> = swarm.particles.iter().map(|p| p.node.point).collect();
    let tree = Tree::new(&points);
    let count = neighbour_count(swarm.intrinsic_dimension()) / 3;
    let of = |index: usize| {
        let node = &nodes[index];
        let mut found = Vec::new();
        tree.nearest(&node.point, count, &mut found);
        let near = found.into_iter().filter_map(|neighbour| {
            let i = tree.order[neighbour.index as usize];
            let distance = neighbour.squared.sqrt();
            let beside = distance > 0.0 && distance < swarm.spacing(i) && swarm.leads_to(node, i);
            beside.then_some((index as u32, i))
        });
        near.collect::<Vec<_>>()
    };
    parallel::map(nodes.len(), of).concat()
}

/// The pairs of particles at rest that are a step along the surface apart.
fn joins<const D: usize, S: Surface<D>>(swarm: &Swarm<'_, D, S>) -> Vec<(u32, u32)> {
    let of = |i: usize| {
        let i = i as u32;
        let near = |j: &u32| {
            let others = swarm.neighbours(*j);
            // If two particles are each other's neighbours, only the first one looks.
            (i < *j || !others.contains(&i))
                && swarm.distance(i, *j) < JOINED * swarm.mean_spacing(i, *j)
                && swarm.walkable(i, *j)
        };
        let found: Vec<(u32, u32)> = swarm
            .neighbours(i)
            .iter()
            .copied()
            .filter(near)
            .map(|j| (i, j))
            .collect();
        found
    };
    parallel::map(swarm.particles.len(), of).concat()
}
