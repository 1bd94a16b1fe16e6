//! Fields of geodesic distances from one or several points, or from a curve, to everywhere on a
//! surface.
//!
//! On smooth two-dimensional surfaces, rays leave the sources: geodesics that carry their Jacobi
//! fields. The nodes of the graph take distance, gradient and front curvature (the geodesic
//! curvature of a distance front) from the rays near them, and points take them from their nearest
//! node. This takes the place of correcting the path to every node [3.2, 3.3]. Surfaces of other
//! dimensions use rays with matrices of Jacobi fields (`manifold`); rough clouds and costs use a
//! march over points (`cost`). A rim is a part of the boundary of the surface.
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

mod cost;
mod curve;
mod evaluate;
mod exponential;
mod farthest;
mod isolines;
mod logarithm;
mod manifold;
mod nearest;
mod plane;
mod rays;
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
use crate::surface::atlas::Lists;
use crate::surface::{Geometry, Node, Surface};
use rays::branches::Branch;
use rays::diffraction::Rims;
use rays::frame::Frame;
use rays::piece::Piece;

/// A point that distances are measured from.
#[derive(Clone, Copy, Debug)]
pub struct Source<const D: usize, P> {
    /// The source's node on the surface.
    pub node: Node<D, P>,
    /// The distance at the source itself, in the input's units; it is added to all distances from
    /// there.
    pub start: f64,
}

/// How accurate a field is to be and how far it goes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Relative error that is allowed in the rays that carry the distances. What lies between rays
    /// is interpolated.
    pub tolerance: f64,
    /// The largest distance, in the input's units, that is looked for.
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

/// What every field of a surface starts from. It can be kept beside the surface, see
/// [`Fields::on`].
pub struct Ground<const D: usize, P> {
    /// The frame at each node of the graph, on surfaces of dimension 2; `None` where the surface
    /// has no foot or no tangent plane.
    frames: Vec<Option<Frame<D>>>,
    /// The frame at each node of the graph, on surfaces of other dimensions than 2; `None` where
    /// the surface has no foot or no tangent space.
    any_frames: Vec<Option<manifold::frame::Frame<D>>>,
    /// The points with their costs, where fields are marched over points.
    net: Option<cost::Net<D>>,
    /// The spacing at each node of the graph, in the input's units: the mean distance to its
    /// nearest neighbours, or nearly the mean around it if that is more.
    spacing: Vec<f64>,
    /// Whether the surface errs nowhere by much of a spacing, as it does beside outliers.
    is_smooth: bool,
    /// Whether the graph has edges across creases, which rays do not cross.
    has_creases: bool,
    /// The corners on the rims of the surface, for diffraction round them.
    rims: Rims<D, P>,
    /// The node nearest to each point of a cloud, once it has been asked for.
    places: OnceLock<Vec<u32>>,
}

/// The distance from one or several sources, all over a surface.
#[derive(Clone, Debug)]
pub struct Field<const D: usize> {
    /// Relative error that was allowed in the rays.
    tolerance: f64,
    /// Where the branches of each node of the graph begin in `branches`; one entry more than there
    /// are nodes.
    starts: Vec<u32>,
    /// The branches of all nodes, one node after the other, the shortest to be believed first at
    /// each.
    branches: Vec<Branch>,
    /// What distances are measured from near a source: one piece a point source, or the pieces of
    /// the one curve.
    pieces: Vec<Piece<D>>,
    /// The node of the graph nearest to each piece.
    piece_nodes: Vec<Option<u32>>,
    /// The largest distance, in the input's units, that was looked for.
    max_distance: f64,
    /// The whole field on surfaces of other dimensions than 2 and where it was marched over points.
    other: Option<Other<D>>,
}

/// A field that is not interpolated between rays on a two-dimensional surface.
#[derive(Clone, Debug)]
enum Other<const D: usize> {
    Manifold(manifold::Aimed<D>),
    Cost(cost::Marched<D>),
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

/// Least relative error that is asked of rays on a surface with detail or noise, where more
/// accuracy is of no use.
const NOISY_TOLERANCE: f64 = 1e-4;
/// Median error of the surface's height, in spacings of the graph's nodes, above which rays
/// scatter.
const ROUGH_HEIGHT: f64 = 1e-4;
/// Least number of charts of a model for which rays serve: the charts may be so large that rays say
/// nothing of what lies between them.
const FEWEST_CHARTS: usize = 64;
/// Most radians that the surface may turn over the spacing of the graph's nodes, at the share
/// [`MOST_CHARTS`] of a model's charts, for rays to serve.
const RESOLVED_TURNING: f64 = 0.3;
/// Share of a model's charts at which the surface must turn by at most [`RESOLVED_TURNING`] for
/// rays to serve.
const MOST_CHARTS: f64 = 0.95;
/// Error of the surface's height at any node, in spacings, above which geodesics prove nothing
/// about distances.
const TORN: f64 = 1e-2;
/// Number of nearest neighbours of a node whose mean distance is its spacing.
const NEAREST_NODES: usize = 4;
/// Most distance, in spacings, between nodes that count as adjacent.
const ADJACENT: f64 = 1.5;
/// Least spacing of a node, as a share of its neighbours' mean spacing.
const CROWDED_NODE: f64 = 0.8;
/// Largest distance, in spacings, of the neighbouring nodes whose jets a node takes into account.
const JETS_BESIDE: f64 = 2.6;

impl<'a, const D: usize, S: Guide<D>> Fields<'a, D, S> {
    /// Finds the tangent spaces and curvatures at the nodes of the surface's graph, which every
    /// field uses.
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
            has_creases: false,
            rims: Rims::none(),
            places: OnceLock::new(),
        };
        if surface.intrinsic_dimension() == 2 {
            let frame = |geometry: &mut _, i: usize| frame(surface, &nodes[i], geometry);
            ground.frames = parallel::map_with(nodes.len(), scratch, frame);
            ground.has_creases = has_creases(geodesics, &ground.frames, Frame::is_creased);
            ground.rims = Rims::new(geodesics, &ground.spacing);
        } else {
            let frame = |geometry: &mut _, i: usize| manifold::frame(surface, &nodes[i], geometry);
            ground.any_frames = parallel::map_with(nodes.len(), scratch, frame);
            ground.has_creases = has_creases(
                geodesics,
                &ground.any_frames,
                manifold::frame::Frame::is_creased,
            );
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

    /// The distance from the nearest of the sources, which are points or a curve; each source's
    /// start value is added.
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

    /// The edges from a node to the nodes adjacent to it.
    fn adjacent(&self, node: u32) -> impl Iterator<Item = &Edge> {
        let farthest = ADJACENT * self.ground.spacing[node as usize];
        let edges = self.geodesics.graph().edges(node).iter();
        edges.filter(move |edge| f64::from(edge.length) <= farthest)
    }

    /// A node of the graph and the neighbours whose jets it takes into account.
    fn around(&self, node: u32) -> Vec<u32> {
        let farthest = JETS_BESIDE * self.ground.spacing[node as usize];
        let edges = self.geodesics.graph().edges(node).iter();
        let close = edges.filter(|edge| f64::from(edge.length) <= farthest);
        std::iter::once(node)
            .chain(close.map(|edge| edge.to))
            .collect()
    }
}

impl<'a, const D: usize, S: Guide<D>> Fields<'a, D, S> {
    /// A field on a cloud or a model, found by what suits its surface. Where the surface is smooth,
    /// rays are used. Where it is rough, so that rays scatter, the distance is marched over its
    /// points with a cost of 1. A model keeps no points, so points are put all over it. A surface
    /// that is no atlas has the field of [`new`](Self::new).
    ///
    /// # Errors
    /// The same errors as [`with_cost`](Self::with_cost).
    ///
    /// O(n) in the points of the cloud, in parallel.
    pub fn of_cloud(geodesics: &'a Geodesics<D, S>) -> Result<Self, Error> {
        let Some(atlas) = geodesics.surface().atlas() else {
            return Ok(Self::new(geodesics));
        };
        let spacing = spacing(geodesics.graph());
        if atlas.intrinsic_dimension() != 2 {
            return Ok(Self::with_spacing(geodesics, spacing));
        }
        let errors = (0..).zip(&spacing);
        let errors = errors.map(|(chart, spacing)| atlas.height_error(chart) / spacing);
        let is_rough = quantile(errors, 0.5) > ROUGH_HEIGHT;
        if atlas.has_points() {
            return if is_rough {
                Self::with_cost(geodesics, &Cost::default())
            } else {
                Ok(Self::with_spacing(geodesics, spacing))
            };
        }
        if !is_rough && spacing.len() >= FEWEST_CHARTS {
            let fields = Self::with_spacing(geodesics, spacing);
            if fields.turning() <= RESOLVED_TURNING {
                return Ok(fields);
            }
        }
        let net = cost::Net::of_nodes(atlas, &atlas.spread(), &Cost::default())?;
        Ok(Self::with_net(geodesics, net))
    }

    /// The number of radians by which the surface turns over one spacing, at a node that turns more
    /// than the share [`MOST_CHARTS`] of the graph's nodes does.
    fn turning(&self) -> f64 {
        let frames = self.ground.frames.iter().zip(&self.ground.spacing);
        let turns = frames.map(|(frame, spacing)| {
            let curvature = frame.as_ref().map_or(f64::INFINITY, Frame::curvature);
            curvature * spacing
        });
        quantile(turns, MOST_CHARTS)
    }

    /// Fields of least cost. Distances are integrals of the cost along the way, and directions are
    /// those of travel. The tolerance of the settings has no effect on them.
    ///
    /// # Errors
    /// [`Error::NoCloud`] on a surface that is no atlas, [`Error::NoCosts`] on one of more than two
    /// dimensions, [`Error::WrongCosts`], [`Error::BadCost`] and [`Error::BadSlope`] where costs
    /// are not what [`Cost`] says.
    ///
    /// O(n) in the points of the cloud, in parallel.
    pub fn with_cost(geodesics: &'a Geodesics<D, S>, cost: &Cost) -> Result<Self, Error> {
        let atlas = geodesics.surface().atlas().ok_or(Error::NoCloud)?;
        let net = cost::Net::new(atlas, cost)?;
        Ok(Self::with_net(geodesics, net))
    }

    fn with_net(geodesics: &'a Geodesics<D, S>, net: cost::Net<D>) -> Self {
        let ground = Ground {
            frames: Vec::new(),
            any_frames: Vec::new(),
            net: Some(net),
            spacing: Vec::new(),
            has_creases: false,
            is_smooth: false,
            rims: Rims::none(),
            places: OnceLock::new(),
        };
        Self::on(geodesics, Arc::new(ground))
    }
}

/// The quantile of some values at a share. A value that is not a number counts as infinite; the
/// quantile of no values is 0.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = values
        .map(|value| if value.is_nan() { f64::INFINITY } else { value })
        .collect();
    sorted.sort_by(f64::total_cmp);
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place).copied().unwrap_or(0.0)
}

/// The spacing of the graph's nodes, one value a node.
fn spacing<const D: usize, P: Copy + Sync>(graph: &Graph<D, P>) -> Vec<f64> {
    let nearest = parallel::map(graph.nodes.len(), |i| {
        let edges = graph.edges(i as u32).iter();
        let mut lengths: Vec<f64> = edges.map(|edge| f64::from(edge.length)).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.truncate(NEAREST_NODES);
        lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
    });
    // Rays are as far apart as the nodes around them are. A node that happens to lie close to a few
    // others must look as far as the nodes around it.
    parallel::map(graph.nodes.len(), |i| {
        let edges = graph.edges(i as u32);
        let around = edges.iter().map(|edge| nearest[edge.to as usize]);
        let mean = around.sum::<f64>() / edges.len().max(1) as f64;
        nearest[i].max(CROWDED_NODE * mean)
    })
}

/// Whether an edge of the graph leads across a crease of the surface, where `is_creased` tells this
/// from the frames at its ends. Clouds have no creases.
fn has_creases<const D: usize, S: Guide<D>, F>(
    geodesics: &Geodesics<D, S>,
    frames: &[Option<F>],
    is_creased: impl Fn(&F, &F) -> bool,
) -> bool {
    let graph = geodesics.graph();
    let is_cloud = |node: &Node<D, S::Place>| geodesics.surface().resolution(node.place) > 0.0;
    if graph.nodes.iter().any(is_cloud) {
        return false;
    }
    (0..frames.len()).any(|i| {
        let ends = |edge: &Edge| frames[i].as_ref().zip(frames[edge.to as usize].as_ref());
        let mut ends = graph.edges(i as u32).iter().filter_map(ends);
        ends.any(|(from, to)| is_creased(from, to))
    })
}

/// Whether the surface's height errs at every node by no more than a small share of the spacing.
fn is_smooth<const D: usize, S: Guide<D>>(
    surface: &S,
    nodes: &[Node<D, S::Place>],
    spacing: &[f64],
) -> bool {
    let mut errors = nodes.iter().map(|node| surface.height_error(node.place));
    let mut spacing = spacing.iter();
    errors.all(|error| spacing.next().is_none_or(|s| error <= TORN * s))
}

/// The frame at a node; `None` where the surface has none.
fn frame<const D: usize, S: Guide<D>>(
    surface: &S,
    node: &Node<D, S::Place>,
    geometry: &mut Geometry<D>,
) -> Option<Frame<D>> {
    let known = surface.cheap_geometry(&node.point, node.place, geometry);
    known.then(|| Frame::new(node.point, geometry))
}

/// For each node, the indices of the items whose nearest node it is; an item at `u32::MAX` is left
/// out.
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
    /// Whether the field is measured from a curve.
    fn is_of_curve(&self) -> bool {
        self.pieces.first().is_some_and(|piece| !piece.is_point())
    }

    /// The branches at a node of the graph, the shortest to be believed first.
    pub(crate) fn branches(&self, node: u32) -> &[Branch] {
        let i = node as usize;
        &self.branches[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// The number of graph nodes without a distance; with costs, the number of points without one.
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

    /// The number of graph nodes that no ray came by and whose distances were carried on along the
    /// graph.
    #[must_use]
    pub fn carried_nodes(&self) -> usize {
        let starts = self.starts.windows(2).filter(|pair| pair[0] < pair[1]);
        starts
            .filter(|pair| self.branches[pair[0] as usize].carried)
            .count()
    }
}
