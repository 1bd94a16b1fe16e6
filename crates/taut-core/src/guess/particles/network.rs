//! Algorithm 1: particles leave the sources until their trajectories join them all, and guesses run
//! along the trajectories.

use crate::Vector;
use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::particles::Settings;
use crate::guess::particles::drift::{Drifted, drift};
use crate::guess::particles::joining::connect;
use crate::guess::particles::sampling::{crowding, fill};
use crate::guess::particles::swarm::{Swarm, neighbour_count};
use crate::guess::particles::walk::walks;
use crate::guess::{Guide, JOINED};
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::{Geometry, Node, Surface};

/// A surface with the network of trajectories that particles left on it.
pub struct Network<const D: usize, S: Surface<D>> {
    surface: S,
    sources: Vec<Node<D, S::Place>>,
    /// For each source the first source that it is joined to.
    classes: Vec<u32>,
    trajectories: Vec<Vec<Node<D, S::Place>>>,
    /// A tree of the particles where they came to rest.
    rest: Tree<D>,
    /// For each particle, its node in the graph, its node on the surface, and its spacing.
    rest_nodes: Vec<(u32, Node<D, S::Place>, f64)>,
    steps: usize,
}

/// Number of particles that tell the surface's extent beforehand.
const SCOUTS: usize = 300;
/// Number of further such particles for each source.
const SCOUTS_PER_SOURCE: usize = 2;
/// Number of steps after which the scouts are spread well enough to tell the surface's extent.
const SCOUT_STEPS: usize = 8;
/// Factor by which epsilon is larger than the scouts tell, so that births end before the particles
/// do.
const SPARING: f64 = 1.1;
/// Largest mean turning of the surface between neighbours, in radians.
const MEAN_TURNING: f64 = 0.6;

impl<const D: usize, S: Surface<D>> Geodesics<D, Network<D, S>> {
    /// Makes a surface ready for paths between `sources` by Algorithm 1. Particles born at the
    /// sources drift over the surface until all sources are joined by their trajectories and the
    /// surface is covered by about `count` particles, or until there are that many.
    /// [`Network::classes`] tells which sources cannot be joined.
    ///
    /// epsilon, the distance at which particles meet, is the spacing of `count` particles, but
    /// small enough for the surface's mean curvature. The result has the same bits on any number of
    /// threads.
    ///
    /// # Errors
    /// [`Error::NoSources`] without a source, [`Error::NoFoot`] for a source where the surface has
    /// no tangent space, [`Error::Endless`] where the surface has no end and no region is given.
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
    Ok(wanted.min(MEAN_TURNING / scouts.mean_curvature()))
}

impl<const D: usize, S: Surface<D>> Network<D, S> {
    /// The sources.
    #[must_use]
    pub fn sources(&self) -> &[Node<D, S::Place>] {
        &self.sources
    }

    /// For each source, the first source that it is joined to, directly or through others: all 0 if
    /// the network is connected.
    #[must_use]
    pub fn classes(&self) -> &[u32] {
        &self.classes
    }

    /// The locations recorded of each particle. The first is its birthplace, which is a source or
    /// lies on the trajectory of another particle; a source's trajectory is itself alone.
    #[must_use]
    pub fn trajectories(&self) -> &[Vec<Node<D, S::Place>>] {
        &self.trajectories
    }

    /// The particles where they came to rest, the sources first.
    pub fn particles(&self) -> impl Iterator<Item = Vector<D>> + '_ {
        self.rest_nodes.iter().map(|(_, node, _)| node.point)
    }

    /// The number of steps of the particle system.
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

    fn origin(&self) -> Vector<D> {
        self.surface.origin()
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

    fn find_place(&self, x: &Vector<D>, place: &mut S::Place, scratch: &mut Geometry<D>) -> bool {
        self.surface.find_place(x, place, scratch)
    }

    fn cheap_geometry(&self, x: &Vector<D>, place: S::Place, out: &mut Geometry<D>) -> bool {
        self.surface.cheap_geometry(x, place, out)
    }

    fn cheap_foot(
        &self,
        x: &Vector<D>,
        place: &mut S::Place,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        self.surface.cheap_foot(x, place, scratch)
    }

    fn has_cheap_view(&self) -> bool {
        self.surface.has_cheap_view()
    }

    fn beyond_rim(&self, x: &Vector<D>, place: S::Place) -> Option<(f64, Vector<D>)> {
        self.surface.beyond_rim(x, place)
    }

    fn rim(&self) -> Vec<(Node<D, S::Place>, Vector<D>, f64)> {
        self.surface.rim()
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
            if neighbour.squared.sqrt() < JOINED * spacing
                && walks(&self.surface, node, &there.point, &mut scratch)
            {
                visit(*graph_node);
            }
        }
    }
}
