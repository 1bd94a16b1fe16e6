//! Fields of geodesic distances: from one or several sources, or from a curve, to everywhere on a two-dimensional surface.
//!
//! Rays leave the sources, geodesics that carry their Jacobi fields; the nodes of the graph take distance,
//! gradient and front curvature from the rays near them, and points from their nearest node. This takes the
//! place of correcting the path to every node [3.2, 3.3].
//!
//! ```
//! use taut_core::field::{Fields, Settings, Source};
//! use taut_core::{Vector, cloud::Cloud, geodesics::Geodesics, surface::atlas::Atlas};
//!
//! // 2000 points of the unit sphere, on a spiral.
//! let rows: Vec<f64> = (0..2000)
//!     .flat_map(|i| {
//!         let z: f64 = 1.0 - (2 * i + 1) as f64 / 2000.0;
//!         let (sin, cos) = (2.399963 * i as f64).sin_cos();
//!         let radius = (1.0 - z * z).sqrt();
//!         [radius * cos, radius * sin, z]
//!     })
//!     .collect();
//! let geodesics = Geodesics::of_atlas(Atlas::new(Cloud::<3>::new(&rows, 3)?, 2)?);
//! let fields = Fields::of_cloud(&geodesics)?;
//! let node = geodesics.surface().node_near(&Vector::<3>::new(0.0, 0.0, 1.0))?;
//! let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default())?;
//! let values = fields.at_points(&field);
//! let farthest = values.iter().map(|value| value.distance).fold(0.0, f64::max);
//! assert!((farthest - (1.0 / 2000.0 - 1.0_f64).acos()).abs() < 1e-3);
//! # Ok::<(), taut_core::error::Error>(())
//! ```

mod aim;
mod bend;
mod branches;
mod cost;
mod curve;
mod dents;
mod doubt;
mod evaluate;
mod exponential;
mod fan;
mod farthest;
mod frame;
mod isolines;
mod jet;
mod knot;
mod logarithm;
mod manifold;
mod march;
mod nearest;
mod piece;
mod ray;
mod rays;
mod sides;
mod sources;

pub use cost::{Cost, Slope};
pub use curve::Curve;
pub use evaluate::Value;
pub use exponential::Shot;
pub use farthest::Farthest;
pub use isolines::Isoline;
pub use logarithm::Logarithm;
pub use nearest::least;
pub use sources::Sources;

use std::sync::{Arc, OnceLock};

use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::graph::{Edge, Graph};
use crate::parallel;
use crate::surface::atlas::{Atlas, Lists};
use crate::surface::{Geometry, Node, Surface};
use bend::Rims;
use branches::Branch;
use frame::Frame;
use piece::Piece;

/// A point that distances are measured from.
#[derive(Clone, Copy, Debug)]
pub struct Source<const D: usize, P> {
    /// Where it lies.
    pub node: Node<D, P>,
    /// The distance there, in the input's units.
    pub start: f64,
}

/// How accurate a field is to be and how far it goes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Relative error of the rays that carry the distances. What lies between rays is interpolated.
    pub tolerance: f64,
    /// Distances beyond this, in the input's units, are not looked for.
    pub max_distance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            max_distance: f64::INFINITY,
        }
    }
}

/// A surface made ready for fields from many sources.
pub struct Fields<'a, const D: usize, S: Guide<D>> {
    geodesics: &'a Geodesics<D, S>,
    ground: Arc<Ground<D, S::Place>>,
}

/// What every field of a surface starts from. It can be kept beside the surface, see [`Fields::on`].
pub struct Ground<const D: usize, P> {
    /// Of the graph's nodes; `None` where the surface has no foot or no tangent plane.
    frames: Vec<Option<Frame<D>>>,
    /// The same on surfaces of other dimensions than 2.
    any_frames: Vec<Option<manifold::frame::Frame<D>>>,
    /// The points with their costs, where there are any.
    net: Option<cost::Net<D>>,
    /// Distance from each node of the graph to its nearest ones, or nearly that around it if that is more.
    spacing: Vec<f64>,
    /// The surface errs nowhere by much of a spacing, as it does beside outliers.
    is_smooth: bool,
    rims: Rims<D, P>,
    /// The node nearest to each point of a cloud, once they have been asked for.
    places: OnceLock<Vec<u32>>,
}

/// The distance from one or several sources, all over a surface.
#[derive(Clone, Debug)]
pub struct Field<const D: usize> {
    /// Of the rays.
    tolerance: f64,
    /// At each node of the graph, least distance first.
    starts: Vec<u32>,
    branches: Vec<Branch>,
    /// A source each, or all of one curve.
    pieces: Vec<Piece<D>>,
    /// The nodes of the graph nearest to them.
    piece_nodes: Vec<Option<u32>>,
    max_distance: f64,
    /// All there is on surfaces of other dimensions than 2 and with costs.
    other: Option<Other<D>>,
}

/// Fields that are not found by rays between rays.
#[derive(Clone, Debug)]
enum Other<const D: usize> {
    Manifold(manifold::Found<D>),
    Cost(cost::Found<D>),
}

impl<const D: usize> Field<D> {
    fn of_other(other: Other<D>, max_distance: f64) -> Self {
        Self {
            tolerance: 0.0,
            starts: Vec::new(),
            branches: Vec::new(),
            pieces: Vec::new(),
            piece_nodes: Vec::new(),
            max_distance,
            other: Some(other),
        }
    }
}

/// Rays on a noisy surface need not be more accurate.
const NOISY_TOLERANCE: f64 = 1e-4;
/// Median error of the surface's height, in spacings of the graph's nodes, above which rays scatter.
const ROUGH: f64 = 1e-4;
/// Charts of a model may be so large that rays say nothing of what lies between: they serve where there are so many, and the
/// surface turns by no more radians than this over the spacing of so large a share of them.
const FEWEST: usize = 64;
const RESOLVED: f64 = 0.3;
const MOST: f64 = 0.95;
/// Error of the surface's height at any node, in spacings, above which geodesics prove nothing of distances.
const TORN: f64 = 1e-2;
/// Neighbours of a node whose mean distance is its spacing.
const NEAREST: usize = 4;
/// Nodes right beside each other are at most this many spacings apart.
const ADJACENT: f64 = 1.5;
/// The spacing of a node is at least this share of its neighbours' mean.
const CROWDED: f64 = 0.8;
/// Jets near neighbours so many spacings away are looked at.
const BESIDE: f64 = 2.6;

impl<'a, const D: usize, S: Guide<D>> Fields<'a, D, S> {
    /// Finds the tangent spaces and curvatures at the nodes of the surface's graph, which every field uses.
    ///
    /// O(n) in the nodes of the graph, in parallel.
    #[must_use]
    pub fn new(geodesics: &'a Geodesics<D, S>) -> Self {
        Self::with_spacing(geodesics, spacing(geodesics.graph()))
    }

    fn with_spacing(geodesics: &'a Geodesics<D, S>, spacing: Vec<f64>) -> Self {
        let surface = geodesics.surface();
        let nodes = &geodesics.graph().nodes;
        let scratch = || Geometry::new(D - surface.intrinsic_dimension());
        let mut ground = Ground {
            frames: Vec::new(),
            any_frames: Vec::new(),
            net: None,
            is_smooth: is_smooth(surface, nodes, &spacing),
            spacing,
            rims: Rims::none(),
            places: OnceLock::new(),
        };
        if surface.intrinsic_dimension() == 2 {
            let frame = |geometry: &mut _, i: usize| frame(surface, &nodes[i], geometry);
            ground.frames = parallel::map_with(nodes.len(), scratch, frame);
            ground.rims = Rims::new(geodesics, &ground.spacing);
        } else {
            let frame = |geometry: &mut _, i: usize| manifold::frame(surface, &nodes[i], geometry);
            ground.any_frames = parallel::map_with(nodes.len(), scratch, frame);
        }
        Self::on(geodesics, Arc::new(ground))
    }

    /// Fields on a surface whose ground was made before.
    #[must_use]
    pub fn on(geodesics: &'a Geodesics<D, S>, ground: Arc<Ground<D, S::Place>>) -> Self {
        Self { geodesics, ground }
    }

    /// What the fields start from, to be kept beside the surface.
    #[must_use]
    pub fn ground(&self) -> &Arc<Ground<D, S::Place>> {
        &self.ground
    }

    /// The distance from the nearest of the sources, each with its start value added: from points, or from a curve.
    ///
    /// Unreached parts of the surface, and those beyond the largest distance, are infinitely far.
    ///
    /// # Errors
    /// [`Error::NoSources`] without any, [`Error::NoFoot`] where a source has no tangent plane.
    pub fn from<'s>(
        &self,
        sources: impl Into<Sources<'s, D, S::Place>>,
        settings: &Settings,
    ) -> Result<Field<D>, Error>
    where
        S::Place: 's,
    {
        self.found(sources.into().simplified(), settings)
    }

    fn found(
        &self,
        sources: Sources<'_, D, S::Place>,
        settings: &Settings,
    ) -> Result<Field<D>, Error> {
        if let Some(net) = &self.ground.net {
            return self.by_cost(net, sources, usize::MAX, settings);
        }
        match sources {
            Sources::Points([]) => Err(Error::NoSources),
            Sources::Points(points) if !self.ground.any_frames.is_empty() => {
                let found = manifold::find(self, points, settings)?;
                let other = Other::Manifold(found);
                let nodes = points.iter().map(|point| self.nearest_node(&point.node));
                Ok(Field {
                    piece_nodes: nodes.collect(),
                    ..Field::of_other(other, settings.max_distance)
                })
            }
            _ => self.by_rays(sources, settings),
        }
    }

    fn tolerance(&self, settings: &Settings) -> f64 {
        if self.geodesics.surface().detail() > 0.0 {
            settings.tolerance.max(NOISY_TOLERANCE)
        } else {
            settings.tolerance
        }
    }

    /// The edges from a node to those right beside it.
    fn adjacent(&self, node: u32) -> impl Iterator<Item = &Edge> {
        let farthest = ADJACENT * self.ground.spacing[node as usize];
        let edges = self.geodesics.graph().edges(node).iter();
        edges.filter(move |edge| f64::from(edge.length) <= farthest)
    }

    /// A node of the graph and those beside it whose jets are looked at.
    fn around(&self, node: u32) -> Vec<u32> {
        let farthest = BESIDE * self.ground.spacing[node as usize];
        let edges = self.geodesics.graph().edges(node).iter();
        let close = edges.filter(|edge| f64::from(edge.length) <= farthest);
        std::iter::once(node)
            .chain(close.map(|edge| edge.to))
            .collect()
    }
}

impl<'a, const D: usize> Fields<'a, D, Atlas<D>> {
    /// Fields on a cloud or a model, by what suits it: rays where its surface is smooth, and where it is rough, so that rays
    /// scatter, a march over its points, as with a cost of 1. A model keeps no points: some are put all over it.
    ///
    /// # Errors
    /// As [`with_cost`](Self::with_cost).
    ///
    /// O(n) in the points of the cloud, in parallel.
    pub fn of_cloud(geodesics: &'a Geodesics<D, Atlas<D>>) -> Result<Self, Error> {
        let atlas = geodesics.surface();
        let spacing = spacing(geodesics.graph());
        if atlas.intrinsic_dimension() != 2 {
            return Ok(Self::with_spacing(geodesics, spacing));
        }
        let errors = (0..).zip(&spacing);
        let errors = errors.map(|(chart, spacing)| atlas.height_error(chart) / spacing);
        let is_rough = quantile(errors, 0.5) > ROUGH;
        if atlas.has_points() {
            return if is_rough {
                Self::with_cost(geodesics, &Cost::default())
            } else {
                Ok(Self::with_spacing(geodesics, spacing))
            };
        }
        if !is_rough && spacing.len() >= FEWEST {
            let fields = Self::with_spacing(geodesics, spacing);
            if fields.turning() <= RESOLVED {
                return Ok(fields);
            }
        }
        let net = cost::Net::of_nodes(atlas, &atlas.spread(), &Cost::default())?;
        Ok(Self::with_net(geodesics, net))
    }

    /// By how many radians the surface turns over the spacing of most of the graph's nodes at most.
    fn turning(&self) -> f64 {
        let frames = self.ground.frames.iter().zip(&self.ground.spacing);
        let turns = frames.map(|(frame, spacing)| {
            let bent = frame.as_ref().map_or(f64::INFINITY, Frame::curvature);
            bent * spacing
        });
        quantile(turns, MOST)
    }

    /// Fields of least cost: distances are integrals of the cost per length, directions those of travel. Tolerances
    /// mean nothing to them.
    ///
    /// # Errors
    /// [`Error::NoCosts`] on surfaces of more than two dimensions, [`Error::WrongCosts`], [`Error::BadCost`] and
    /// [`Error::BadSlope`] where costs are not what [`Cost`] says.
    ///
    /// O(n) in the points of the cloud, in parallel.
    pub fn with_cost(geodesics: &'a Geodesics<D, Atlas<D>>, cost: &Cost) -> Result<Self, Error> {
        let net = cost::Net::new(geodesics.surface(), cost)?;
        Ok(Self::with_net(geodesics, net))
    }

    fn with_net(geodesics: &'a Geodesics<D, Atlas<D>>, net: cost::Net<D>) -> Self {
        let ground = Ground {
            frames: Vec::new(),
            any_frames: Vec::new(),
            net: Some(net),
            spacing: Vec::new(),
            is_smooth: false,
            rims: Rims::none(),
            places: OnceLock::new(),
        };
        Self::on(geodesics, Arc::new(ground))
    }
}

/// The value that a share of some lies below; infinite where it is not a number, 0 of none.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = values
        .map(|value| if value.is_nan() { f64::INFINITY } else { value })
        .collect();
    sorted.sort_by(f64::total_cmp);
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place).copied().unwrap_or(0.0)
}

/// The spacing of the graph's nodes, of each.
fn spacing<const D: usize, P: Copy + Sync>(graph: &Graph<D, P>) -> Vec<f64> {
    let nearest = parallel::map(graph.nodes.len(), |i| {
        let edges = graph.edges(i as u32).iter();
        let mut lengths: Vec<f64> = edges.map(|edge| f64::from(edge.length)).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.truncate(NEAREST);
        lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
    });
    // Rays are as far apart as the nodes around are: those that happen to crowd must look as far.
    parallel::map(graph.nodes.len(), |i| {
        let edges = graph.edges(i as u32);
        let around = edges.iter().map(|edge| nearest[edge.to as usize]);
        let mean = around.sum::<f64>() / edges.len().max(1) as f64;
        nearest[i].max(CROWDED * mean)
    })
}

/// Whether the surface's height errs by no more than a small share of the spacing at any node.
fn is_smooth<const D: usize, S: Guide<D>>(
    surface: &S,
    nodes: &[Node<D, S::Place>],
    spacing: &[f64],
) -> bool {
    let mut errors = nodes.iter().map(|node| surface.height_error(node.place));
    let mut spacing = spacing.iter();
    errors.all(|error| spacing.next().is_none_or(|s| error <= TORN * s))
}

/// The frame at a node.
fn frame<const D: usize, S: Guide<D>>(
    surface: &S,
    node: &Node<D, S::Place>,
    geometry: &mut Geometry<D>,
) -> Option<Frame<D>> {
    let known = surface.cheap_geometry(&node.point, node.place, geometry);
    known.then(|| Frame::new(node.point, geometry))
}

/// For each node the indices of the items that lie nearest to it.
fn by_node(near: impl Iterator<Item = u32>, nodes: usize) -> Lists {
    let mut placed: Vec<(u32, u32)> = near.zip(0..).filter(|item| item.0 != u32::MAX).collect();
    placed.sort_unstable();
    let mut rest = &placed[..];
    Lists::new((0..nodes as u32).map(|node| {
        let count = rest.partition_point(|item| item.0 <= node);
        let (here, after) = rest.split_at(count);
        rest = after;
        here.iter().map(|item| item.1)
    }))
}

impl<const D: usize> Field<D> {
    fn is_of_curve(&self) -> bool {
        self.pieces.first().is_some_and(|piece| !piece.is_point())
    }

    /// The branches at a node of the graph, least distance first.
    pub(crate) fn branches(&self, node: u32) -> &[Branch] {
        let i = node as usize;
        &self.branches[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// The number of graph nodes without a distance; with costs, of points.
    #[must_use]
    pub fn unreached_nodes(&self) -> usize {
        if let Some(other) = &self.other {
            return match other {
                Other::Manifold(found) => found.branches.iter().filter(|b| b.is_empty()).count(),
                Other::Cost(found) => found.unreached(),
            };
        }
        self.starts
            .windows(2)
            .filter(|pair| pair[0] == pair[1])
            .count()
    }

    /// The number of graph nodes that no ray came by, whose distances were carried on along the graph.
    #[must_use]
    pub fn carried_nodes(&self) -> usize {
        let starts = self.starts.windows(2).filter(|pair| pair[0] < pair[1]);
        starts
            .filter(|pair| self.branches[pair[0] as usize].carried)
            .count()
    }
}
