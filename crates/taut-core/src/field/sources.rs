//! What distances are measured from, and the points of it made ready for rays.

use crate::Vector;
use crate::error::Error;
use crate::field::rays::ray::Limits;
use crate::field::{Curve, Fields, Settings, Source};
use crate::guess::Guide;
use crate::guess::dijkstra::Distances;
use crate::surface::{Geometry, Node, named};

/// What distances are measured from: points or a curve.
#[derive(Clone, Copy, Debug)]
pub enum Sources<'s, const D: usize, P> {
    /// Distances are from the nearest of some points, each with its start value.
    Points(&'s [Source<D, P>]),
    /// Distances are from the nearest point of a curve, which is one source.
    Curve(&'s Curve<D, P>),
}

impl<'s, const D: usize, P> From<&'s [Source<D, P>]> for Sources<'s, D, P> {
    fn from(points: &'s [Source<D, P>]) -> Self {
        Self::Points(points)
    }
}

impl<'s, const D: usize, P, const N: usize> From<&'s [Source<D, P>; N]> for Sources<'s, D, P> {
    fn from(points: &'s [Source<D, P>; N]) -> Self {
        Self::Points(points)
    }
}

impl<'s, const D: usize, P> From<&'s Vec<Source<D, P>>> for Sources<'s, D, P> {
    fn from(points: &'s Vec<Source<D, P>>) -> Self {
        Self::Points(points)
    }
}

impl<'s, const D: usize, P> From<&'s Curve<D, P>> for Sources<'s, D, P> {
    fn from(curve: &'s Curve<D, P>) -> Self {
        Self::Curve(curve)
    }
}

impl<const D: usize, P> Sources<'_, D, P> {
    /// Replaces a curve that is a single point by that point.
    pub(crate) fn simplified(self) -> Self {
        match self {
            Self::Curve(curve) => curve
                .as_point()
                .map_or(self, |point| Self::Points(std::slice::from_ref(point))),
            Self::Points(_) => self,
        }
    }
}

/// Point sources with what rays and nodes need to know about them.
pub(crate) struct Prepared<'s, const D: usize, P, F> {
    pub given: &'s [Source<D, P>],
    /// The frame at each source.
    pub frames: Vec<F>,
    /// The node of the graph nearest to each source.
    pub nodes: Vec<Option<u32>>,
    /// Distances along the graph from the sources, which are never too short. They are known at all
    /// nodes that are not farther than the largest distance.
    pub bound: Distances,
}

/// A place that rays leave from.
pub(crate) struct RayOrigin<'a, const D: usize, P, F> {
    pub node: &'a Node<D, P>,
    pub frame: &'a F,
    /// The nearest node of the graph.
    pub near: u32,
    /// The distance at the place itself, in the input's units.
    pub start: f64,
}

impl<const D: usize, P, F> Prepared<'_, D, P, F> {
    /// The sources near a node of the graph, with their indices.
    pub fn origins(&self) -> impl Iterator<Item = (u32, RayOrigin<'_, D, P, F>)> {
        (0..self.given.len()).filter_map(|i| {
            let origin = RayOrigin {
                node: &self.given[i].node,
                frame: &self.frames[i],
                near: self.nodes[i]?,
                start: self.given[i].start,
            };
            Some((i as u32, origin))
        })
    }

    /// How much shorter a distance from a source is than straight through space; 0 where it is not
    /// shorter.
    pub fn shortfall(&self, source: u32, x: &Vector<D>, distance: f64) -> f64 {
        let source = &self.given[source as usize];
        let chord = (source.node.point - x).norm();
        (source.start + chord - distance).max(0.0)
    }
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// Prepares sources for rays, with their frames, which `frame` finds.
    pub(crate) fn prepared<'s, F>(
        &self,
        given: &'s [Source<D, S::Place>],
        settings: &Settings,
        frame: impl Fn(&S, &Node<D, S::Place>, &mut Geometry<D>) -> Option<F>,
    ) -> Result<Prepared<'s, D, S::Place, F>, Error> {
        let surface = self.geodesics.surface();
        let mut geometry = Geometry::new(D - surface.intrinsic_dimension());
        let mut frame_of = |source: &Source<D, S::Place>| {
            let found = frame(surface, &source.node, &mut geometry);
            found.ok_or_else(|| Error::NoFoot {
                point: named(surface, &source.node.point),
                reason: "a source has no tangent space there",
            })
        };
        let frames = given.iter().map(&mut frame_of);
        let frames: Vec<F> = frames.collect::<Result<_, _>>()?;
        let mut nodes = Vec::with_capacity(given.len());
        let mut ways: Vec<(u32, f32)> = Vec::new();
        for source in given {
            let entrances = self.geodesics.entrances(&source.node);
            nodes.push(nearest_entrance(&entrances).map(|nearest| nearest.0));
            let start = source.start as f32;
            ways.extend(entrances.iter().map(|(node, way)| (*node, way + start)));
        }
        let graph = self.geodesics.graph();
        let mut bound = Distances::new(graph);
        // A route along the graph is a few hundredths longer than the geodesic.
        let longest = (1.2 * settings.max_distance) as f32;
        bound.search(graph, &ways, |_| 0.0, |_, _| longest);
        Ok(Prepared {
            given,
            frames,
            nodes,
            bound,
        })
    }

    /// The limits of rays whose first point already has a distance, given by `start`.
    pub(crate) fn limits<'l>(
        &'l self,
        bound: &'l Distances,
        start: f64,
        settings: &Settings,
    ) -> Limits<'l, D, S::Place> {
        Limits {
            bound: Some((bound, start)),
            ..self.unbounded(settings.max_distance - start, settings)
        }
    }

    /// The limits of rays that end at a length.
    pub(crate) fn unbounded(&self, longest: f64, settings: &Settings) -> Limits<'_, D, S::Place> {
        Limits {
            graph: self.geodesics.graph(),
            spacing: &self.ground.spacing,
            bound: None,
            longest,
            detail: self.geodesics.surface().detail(),
            tolerance: self.tolerance(settings),
            past_conjugate: false,
            rim: &[],
            along: false,
        }
    }
}

/// The nearest of the graph nodes by which a place is entered, with its distance.
pub(crate) fn nearest_entrance(entrances: &[(u32, f32)]) -> Option<(u32, f32)> {
    let nearest = entrances.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.copied()
}
