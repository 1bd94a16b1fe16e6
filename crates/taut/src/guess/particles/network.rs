//! Algorithm 1: particles leave the sources until their trajectories join them all, and guesses run
//! along the trajectories.

use rayon::prelude::*;

use crate::Vector;
use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::graph::Graph;
use crate::guess::particles::Settings;
use crate::guess::particles::sampling::{crowding, fill};
use crate::guess::particles::sources::Sources;
use crate::guess::particles::swarm::{Swarm, neighbour_count};
use crate::guess::particles::walk::walks;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::{Geometry, Node, Surface};

/// A surface with the network of trajectories that particles left on it.
pub struct Network<const D: usize, S: Surface<D>> {
    surface: S,
    sources: Vec<Node<D, S::Place>>,
    classes: Vec<u32>,
    trajectories: Vec<Vec<Node<D, S::Place>>>,
    /// The particles where they came to rest, and their node in the graph and spacing.
    rest: Tree<D>,
    rest_nodes: Vec<(u32, Node<D, S::Place>, f64)>,
    steps: usize,
}

/// What the loop ends with.
struct Drifted<'a, const D: usize, S: Surface<D>> {
    swarm: Swarm<'a, D, S>,
    joined: Sources,
    meetings: Vec<Meeting>,
    steps: usize,
    /// Whether it ended because there was no room left.
    covered: bool,
}

/// A meeting of two particles: each with the number of locations recorded by then.
struct Meeting([(u32, usize); 2]);

/// Particles born at a source at a time, per dimension of the surface and one more: the paper's 5 on
/// surfaces.
const LITTER: usize = 2;
/// How far from its source a particle is born, in spacings.
const BIRTH: f64 = 0.3;
/// Particles that tell the surface's extent beforehand, and how many more for each source.
const SCOUTS: usize = 300;
const SCOUTS_PER_SOURCE: usize = 2;
/// Steps after which the scouts are well enough spread for that.
const SCOUT_STEPS: usize = 8;
/// Epsilon is made this much larger than that tells, so that births end before the particles do.
const SPARING: f64 = 1.1;
/// Largest mean turning of the surface between neighbours, radians.
const TURNING: f64 = 0.6;
/// A loop looks back so many steps: it ends if there was no room for a birth and no meeting, ...
const RECENT: usize = 20;
/// ... or, with all sources joined, for no more than this share of the particles.
const FULL: f64 = 0.02;
/// How much larger epsilon is made where the particles do not cover the surface, and how often.
const WIDENING: f64 = 1.25;
const MOST_BEGINNINGS: usize = 6;
/// Particles at rest up to this many spacings apart are joined.
const REACH: f64 = 1.9;

impl<const D: usize, S: Surface<D>> Geodesics<D, Network<D, S>> {
    /// Makes a surface ready for paths between `sources` by Algorithm 1: particles born at the sources
    /// drift over the surface until all sources are joined by their trajectories and the surface is
    /// covered by about `count` particles, or their number is reached. Sources that cannot be joined
    /// are told by [`Network::classes`].
    ///
    /// epsilon, the distance at which particles meet, is the spacing of `count` particles, but small
    /// enough for the surface's mean curvature. The same bits on any number of threads.
    ///
    /// # Errors
    /// [`Error::NoSources`] without a source, [`Error::NoFoot`] for a source where the surface has no
    /// tangent space, [`Error::Endless`] where the surface has no end and no region is given.
    pub fn of_particles(
        surface: S,
        sources: &[Node<D, S::Place>],
        count: usize,
        settings: &Settings<D>,
    ) -> Result<Self, Error> {
        let epsilon = epsilon(&surface, sources, count, settings)?;
        let mut drifted = drift(&surface, sources, count, epsilon, settings)?;
        let (graph, rest_nodes) = connect(&mut drifted);
        let Drifted {
            swarm,
            joined,
            steps,
            ..
        } = drifted;
        let points: Vec<Vector<D>> = rest_nodes.iter().map(|(_, node, _)| node.point).collect();
        let trajectories = swarm.particles.into_iter().map(|p| p.trajectory).collect();
        let network = Network {
            surface,
            sources: sources.to_vec(),
            classes: joined.class_of_each(),
            trajectories,
            rest: Tree::new(&points),
            rest_nodes,
            steps,
        };
        Ok(Self::with_graph(network, graph))
    }
}

/// The spacing of `count` particles that cover the components that hold the sources.
fn epsilon<const D: usize, S: Surface<D>>(
    surface: &S,
    sources: &[Node<D, S::Place>],
    count: usize,
    settings: &Settings<D>,
) -> Result<f64, Error> {
    let mut scouts = Swarm::new(surface, sources, false, settings.size, settings)?;
    let enough = SCOUTS + SCOUTS_PER_SOURCE * sources.len();
    fill(&mut scouts, enough, settings)?;
    for _ in 0..SCOUT_STEPS {
        scouts.step(|_, _| true);
    }
    scouts.refresh();
    let spacing = scouts.epsilon * crowding(&scouts);
    let ratio = enough as f64 / count.max(1) as f64;
    let wanted = SPARING * spacing * ratio.powf(1.0 / surface.intrinsic_dimension() as f64);
    Ok(wanted.min(TURNING / scouts.mean_curvature()))
}

/// The procedure of sampling, begun anew with a larger epsilon if `count` particles do not cover the
/// surface.
fn drift<'a, const D: usize, S: Surface<D>>(
    surface: &'a S,
    sources: &[Node<D, S::Place>],
    count: usize,
    mut epsilon: f64,
    settings: &Settings<D>,
) -> Result<Drifted<'a, D, S>, Error> {
    let mut beginnings = 1;
    loop {
        let swarm = Swarm::new(surface, sources, true, epsilon, settings)?;
        let drifted = drift_once(swarm, sources.len(), count);
        if drifted.covered || beginnings == MOST_BEGINNINGS {
            return Ok(drifted);
        }
        epsilon *= WIDENING;
        beginnings += 1;
    }
}

/// Its loop: births (a), moves (b), meetings (c), records (d).
fn drift_once<const D: usize, S: Surface<D>>(
    mut swarm: Swarm<'_, D, S>,
    sources: usize,
    count: usize,
) -> Drifted<'_, D, S> {
    swarm.records = true;
    let mut joined = Sources::new(sources);
    let mut meetings = Vec::new();
    let mut recent = [usize::MAX; RECENT];
    let mut full = 0;
    let mut steps = 0;
    while !settled(&swarm, &joined, &recent) && full < RECENT {
        let wanted = give_births(&mut swarm, sources, count);
        full += usize::from(wanted > 0 && swarm.particles.len() >= count);
        let classes = joined.class_of_each();
        swarm.step(|a, b| classes[a as usize] == classes[b as usize]);
        let met = meet(&mut swarm, &mut joined, &mut meetings);
        recent.rotate_right(1);
        recent[0] = wanted + met;
        steps += 1;
    }
    swarm.refresh();
    Drifted {
        covered: settled(&swarm, &joined, &recent),
        swarm,
        joined,
        meetings,
        steps,
    }
}

/// Whether nothing happened for a while, or, once all sources are joined, little.
fn settled<const D: usize, S: Surface<D>>(
    swarm: &Swarm<'_, D, S>,
    joined: &Sources,
    recent: &[usize; RECENT],
) -> bool {
    let happened = recent.iter().fold(0_usize, |sum, r| sum.saturating_add(*r));
    let little = FULL * swarm.particles.len() as f64;
    happened == 0 || (joined.classes() == 1 && happened as f64 <= little)
}

/// Births where the nearest neighbour is farther than epsilon, up to `count` particles: a litter at
/// sources, one at particles on their way. Returns how many had room.
fn give_births<const D: usize, S: Surface<D>>(
    swarm: &mut Swarm<'_, D, S>,
    sources: usize,
    count: usize,
) -> usize {
    swarm.refresh();
    let litter = LITTER * swarm.intrinsic_dimension() + 1;
    let roomy: Vec<u32> = (0..swarm.particles.len() as u32)
        .filter(|i| swarm.room(*i) > 1.0)
        .collect();
    for i in &roomy {
        if swarm.particles.len() >= count {
            break;
        }
        let children = if (*i as usize) < sources { litter } else { 1 };
        swarm.give_birth(*i, children, BIRTH);
    }
    roomy.len()
}

/// Joins the sources whose particles have come within epsilon; returns how many joined.
fn meet<const D: usize, S: Surface<D>>(
    swarm: &mut Swarm<'_, D, S>,
    joined: &mut Sources,
    meetings: &mut Vec<Meeting>,
) -> usize {
    let before = joined.classes();
    if before == 1 {
        return 0;
    }
    let classes = joined.class_of_each();
    let of = |swarm: &Swarm<'_, D, S>, i: u32| swarm.particles[i as usize].source as usize;
    let count = swarm.particles.len() as u32;
    let mut near: Vec<[u32; 2]> = Vec::new();
    for i in 0..count {
        let others = swarm.neighbours(i).iter();
        near.extend(others.filter_map(|&j| {
            let apart = classes[of(swarm, i)] != classes[of(swarm, j)];
            (apart && i < j && swarm.distance(i, j) < swarm.mean_spacing(i, j)).then_some([i, j])
        }));
    }
    for [i, j] in near {
        let (a, b) = (of(swarm, i) as u32, of(swarm, j) as u32);
        if swarm.walkable(i, j) && joined.join(a, b) {
            meetings.push(Meeting([i, j].map(|i| (i, swarm.record(i)))));
        }
    }
    before - joined.classes()
}

type Rest<const D: usize, P> = Vec<(u32, Node<D, P>, f64)>;

/// The graph of the joined trajectories: its nodes are the sources and all locations recorded, its
/// edges the pieces of the trajectories, the meetings, and the joins of particles at rest.
fn connect<const D: usize, S: Surface<D>>(
    drifted: &mut Drifted<'_, D, S>,
) -> (Graph<D, S::Place>, Rest<D, S::Place>) {
    let swarm = &drifted.swarm;
    let mut nodes = Vec::new();
    let mut firsts = Vec::new();
    for particle in &swarm.particles {
        firsts.push(nodes.len() as u32);
        // A trajectory begins at the source, which is a node of its own, and ends at rest.
        nodes.extend(particle.trajectory.iter().skip(1).copied());
        nodes.push(particle.node);
    }
    let recorded = |i: u32, records: usize| firsts[i as usize] + records as u32 - 2;
    let at_rest = |i: u32| {
        let next = firsts.get(i as usize + 1).copied();
        next.unwrap_or(nodes.len() as u32) - 1
    };
    let mut lists = vec![Vec::new(); nodes.len()];
    let mut join = |a: u32, b: u32| {
        lists[a as usize].push(b);
        lists[b as usize].push(a);
    };
    for (i, particle) in swarm.particles.iter().enumerate().filter(|(_, p)| !p.fixed) {
        join(firsts[particle.source as usize], firsts[i]);
        for node in firsts[i]..at_rest(i as u32) {
            join(node, node + 1);
        }
    }
    for Meeting(both) in &drifted.meetings {
        let [a, b] = both.map(|(i, records)| {
            if records < 2 {
                at_rest(i)
            } else {
                recorded(i, records)
            }
        });
        join(a, b);
    }
    for (i, j) in joins(swarm) {
        let [a, b] = [i, j].map(|i: u32| swarm.particles[i as usize].source);
        drifted.joined.join(a, b);
        join(at_rest(i), at_rest(j));
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

/// The pairs of particles at rest a step along the surface apart.
fn joins<const D: usize, S: Surface<D>>(swarm: &Swarm<'_, D, S>) -> Vec<(u32, u32)> {
    let of = |i: u32| {
        let near = |j: &u32| {
            let others = swarm.neighbours(*j);
            // Of two that are each other's neighbours the first looks.
            (i < *j || !others.contains(&i))
                && swarm.distance(i, *j) < REACH * swarm.mean_spacing(i, *j)
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
    (0..swarm.particles.len() as u32)
        .into_par_iter()
        .flat_map_iter(of)
        .collect()
}

impl<const D: usize, S: Surface<D>> Network<D, S> {
    /// The sources.
    #[must_use]
    pub fn sources(&self) -> &[Node<D, S::Place>] {
        &self.sources
    }

    /// For each source the first source that it is joined to, directly or through others: all 0 if the
    /// network is connected.
    #[must_use]
    pub fn classes(&self) -> &[u32] {
        &self.classes
    }

    /// The locations recorded of each particle, its source first; a source's own is itself alone.
    #[must_use]
    pub fn trajectories(&self) -> &[Vec<Node<D, S::Place>>] {
        &self.trajectories
    }

    /// The particles where they came to rest, the sources first.
    pub fn particles(&self) -> impl Iterator<Item = Vector<D>> + '_ {
        self.rest_nodes.iter().map(|(_, node, _)| node.point)
    }

    /// Steps of the particle system.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps
    }
}

impl<const D: usize, S: Surface<D>> Surface<D> for Network<D, S> {
    type Place = S::Place;

    fn intrinsic_dimension(&self) -> usize {
        self.surface.intrinsic_dimension()
    }

    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut S::Place,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        self.surface.foot(x, place, scratch)
    }

    fn geometry(&self, x: &Vector<D>, place: S::Place, out: &mut Geometry<D>) -> bool {
        self.surface.geometry(x, place, out)
    }

    fn beyond_rim(&self, x: &Vector<D>, place: S::Place) -> Option<(f64, Vector<D>)> {
        self.surface.beyond_rim(x, place)
    }

    fn detail(&self) -> f64 {
        self.surface.detail()
    }

    fn height_error(&self, place: S::Place) -> f64 {
        self.surface.height_error(place)
    }

    fn resolution(&self, place: S::Place) -> f64 {
        self.surface.resolution(place)
    }
}

impl<const D: usize, S: Surface<D>> Guide<D> for Network<D, S> {
    /// A source is a node of the network; other points enter it at the particles at rest near them.
    fn entrances(&self, node: &Node<D, S::Place>, visit: &mut dyn FnMut(u32)) {
        let mut found: Vec<Neighbour> = Vec::new();
        let count = neighbour_count(self.intrinsic_dimension());
        self.rest.nearest(&node.point, count, &mut found);
        let mut scratch = Geometry::new(D - self.intrinsic_dimension());
        for neighbour in &found {
            let index = self.rest.order[neighbour.index as usize];
            let (graph_node, there, spacing) = &self.rest_nodes[index as usize];
            if neighbour.squared == 0.0 {
                visit(*graph_node);
                return;
            }
            if neighbour.squared.sqrt() < REACH * spacing
                && walks(&self.surface, node, &there.point, &mut scratch)
            {
                visit(*graph_node);
            }
        }
    }
}
