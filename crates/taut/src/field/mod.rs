//! Fields of geodesic distances: from one or several sources to everywhere on a two-dimensional surface.
//!
//! Rays leave the sources, geodesics that carry their Jacobi fields; the nodes of the graph take distance,
//! gradient and front curvature from the rays near them, and points from their nearest node. This takes the
//! place of correcting the path to every node [3.2, 3.3].
//!
//! ```
//! use taut::field::{Fields, Settings, Source};
//! use taut::{Vector, cloud::Cloud, geodesics::Geodesics, surface::atlas::Atlas};
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
//! # Ok::<(), taut::error::Error>(())
//! ```

mod bend;
mod branches;
mod cost;
mod evaluate;
mod exponential;
mod fan;
mod farthest;
mod frame;
mod isolines;
mod jet;
mod logarithm;
mod manifold;
mod march;
mod nearest;
mod ray;

pub use cost::{Cost, Slope};
pub use evaluate::Value;
pub use exponential::Shot;
pub use farthest::Farthest;
pub use isolines::Isoline;
pub use logarithm::Logarithm;
pub use nearest::least;

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::dijkstra::Distances;
use crate::guess::graph::Edge;
use crate::surface::atlas::{Atlas, Lists};
use crate::surface::{Geometry, Node, Surface};
use bend::{Grazed, Rims};
use branches::Branch;
use fan::Sample;
use frame::{Frame, ON_SURFACE};
use ray::Limits;

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
    /// Of the graph's nodes; `None` where the surface has no foot or no tangent plane.
    frames: Vec<Option<Frame<D>>>,
    /// The same on surfaces of other dimensions than 2.
    any_frames: Vec<Option<manifold::frame::Frame<D>>>,
    /// The points with their costs, where there are any.
    net: Option<cost::Net<D>>,
    /// Distance from each node of the graph to its nearest ones, or nearly that around it if that is more.
    spacing: Vec<f64>,
    rims: Rims<D, S::Place>,
    /// The node nearest to each point of a cloud, once they have been asked for.
    places: OnceLock<Vec<u32>>,
}

/// The distance from one or several sources, all over a surface.
#[derive(Clone, Debug)]
pub struct Field<const D: usize> {
    /// At each node of the graph, least distance first.
    starts: Vec<u32>,
    branches: Vec<Branch>,
    sources: Vec<Frame<D>>,
    /// The nodes of the graph nearest to them.
    source_nodes: Vec<Option<u32>>,
    source_starts: Vec<f64>,
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
            starts: Vec::new(),
            branches: Vec::new(),
            sources: Vec::new(),
            source_nodes: Vec::new(),
            source_starts: Vec::new(),
            max_distance,
            other: Some(other),
        }
    }
}

/// Rays on a noisy surface need not be more accurate.
const NOISY_TOLERANCE: f64 = 1e-4;
/// Median error of the surface's height, in spacings of the graph's nodes, above which rays scatter.
const ROUGH: f64 = 1e-4;
/// How much shorter, in spacings, a branch must be to be believed that rests on jets a spacing away: the
/// surface's own error in spacings times this, and at most 1.
const DOUBT: f64 = 30.0;
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
        let surface = geodesics.surface();
        let graph = geodesics.graph();
        let codimension = D - surface.intrinsic_dimension();
        let (mut frames, mut any_frames) = (Vec::new(), Vec::new());
        let nodes = graph.nodes.par_iter();
        if surface.intrinsic_dimension() == 2 {
            frames = nodes
                .map_init(
                    || Geometry::new(codimension),
                    |geometry, node| frame(surface, node, geometry),
                )
                .collect();
        } else {
            any_frames = nodes
                .map_init(
                    || Geometry::new(codimension),
                    |geometry, node| manifold::frame(surface, node, geometry),
                )
                .collect();
        }
        let nearest: Vec<f64> = (0..graph.nodes.len() as u32)
            .into_par_iter()
            .map(|node| {
                let lengths = graph.edges(node).iter().map(|edge| f64::from(edge.length));
                let mut lengths: Vec<f64> = lengths.collect();
                lengths.sort_by(f64::total_cmp);
                lengths.truncate(NEAREST);
                lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
            })
            .collect();
        // Rays are as far apart as the nodes around are: those that happen to crowd must look as far.
        let spacing = (0..graph.nodes.len() as u32)
            .into_par_iter()
            .map(|node| {
                let edges = graph.edges(node);
                let around = edges.iter().map(|edge| nearest[edge.to as usize]);
                let mean = around.sum::<f64>() / edges.len().max(1) as f64;
                nearest[node as usize].max(CROWDED * mean)
            })
            .collect::<Vec<f64>>();
        let rims = if frames.is_empty() {
            Rims::none()
        } else {
            Rims::new(geodesics, &spacing)
        };
        Self {
            geodesics,
            frames,
            any_frames,
            net: None,
            spacing,
            rims,
            places: OnceLock::new(),
        }
    }

    /// The distance from the nearest of the sources, each with its start value added.
    ///
    /// Unreached parts of the surface, and those beyond the largest distance, are infinitely far.
    ///
    /// # Errors
    /// [`Error::NoSources`] without any, [`Error::NoFoot`] where a source has no tangent plane.
    pub fn from(
        &self,
        sources: &[Source<D, S::Place>],
        settings: &Settings,
    ) -> Result<Field<D>, Error> {
        if sources.is_empty() {
            return Err(Error::NoSources);
        }
        if let Some(net) = &self.net {
            let limits = cost::Limits {
                longest: settings.max_distance,
                enough: usize::MAX,
            };
            let found = cost::find(net, &self.origins(sources), limits)?;
            return Ok(Field::of_other(Other::Cost(found), settings.max_distance));
        }
        if !self.any_frames.is_empty() {
            let found = manifold::find(self, &self.any_frames, sources, settings)?;
            return Ok(Field::of_other(
                Other::Manifold(found),
                settings.max_distance,
            ));
        }
        let (surface, graph) = (self.geodesics.surface(), self.geodesics.graph());
        let mut geometry = Geometry::new(D - 2);
        let source_frames: Vec<Frame<D>> = sources
            .iter()
            .map(|source| {
                frame(surface, &source.node, &mut geometry).ok_or_else(|| Error::NoFoot {
                    point: format!("{:?}", source.node.point.as_slice()),
                    reason: "a source has no tangent plane there",
                })
            })
            .collect::<Result<_, _>>()?;
        let entrances: Vec<Vec<(u32, f32)>> = sources
            .iter()
            .map(|source| self.geodesics.entrances(&source.node))
            .collect();
        let bound = self.bounds(sources, &entrances, settings.max_distance);
        let reachable = bound.reached().len();
        let near: Vec<Option<u32>> = entrances
            .iter()
            .map(|list| {
                let nearest = list.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
                Some(nearest.0)
            })
            .collect();
        let limits = |start: f64, along: bool| Limits {
            graph,
            spacing: &self.spacing,
            bound: (&bound, start),
            longest: settings.max_distance - start,
            detail: surface.detail(),
            tolerance: self.tolerance(settings),
            past_conjugate: false,
            rim: &self.rims.nodes,
            along,
        };
        let mut samples: Vec<(Sample<D>, u32)> = Vec::new();
        let mut grazed = Vec::new();
        for (i, source) in sources.iter().enumerate() {
            let Some(near) = near[i] else { continue };
            let at = (&source.node, &source_frames[i], near);
            let fan = |along: bool| {
                let limits = limits(source.start, along);
                fan::fan(surface, at, None, source.start, reachable, &limits)
            };
            let (found, _) = fan(false);
            // Rays that jump the dents of a rough edge reach more, those that do not find where it is grazed.
            let grazes = if self.rims.nodes.is_empty() {
                Vec::new()
            } else {
                fan(true).1
            };
            let source = i as u32;
            samples.extend(found.into_iter().map(|sample| (sample, source)));
            grazed.extend(grazes.into_iter().map(|graze| Grazed {
                graze,
                doubt: 0.0,
                source,
            }));
        }
        let bends = !grazed.is_empty();
        if bends {
            let lit = by_node(samples.iter().map(|s| s.0.near), graph.nodes.len());
            let lit = |frame: &Frame<D>, near: u32| self.by_samples(frame, near, &samples, &lit);
            let bent = self
                .rims
                .bent(surface, grazed, lit, reachable, |start| limits(start, true));
            samples.extend(bent);
        }
        let source_starts: Vec<f64> = sources.iter().map(|source| source.start).collect();
        let near_node = near.iter().map(|near| near.unwrap_or(u32::MAX));
        let sources_by_node = by_node(near_node, graph.nodes.len());
        let by_node = by_node(
            samples.iter().map(|sample| sample.0.near),
            graph.nodes.len(),
        );
        let mut lists: Vec<Vec<Branch>> = (0..graph.nodes.len() as u32)
            .into_par_iter()
            .map(|node| {
                let reached = bound.distance(node).is_finite();
                let Some(frame) = self.frames[node as usize].filter(|_| reached) else {
                    return Vec::new();
                };
                let spacing = self.spacing[node as usize];
                let place = graph.nodes[node as usize].place;
                let doubt = (DOUBT * surface.height_error(place) / spacing).min(1.0);
                let edges = graph.edges(node).iter();
                let close = edges.filter(|edge| f64::from(edge.length) <= BESIDE * spacing);
                let around: Vec<u32> = std::iter::once(node)
                    .chain(close.map(|edge| edge.to))
                    .collect();
                let samples = around.iter().flat_map(|n| by_node.of(*n)).map(|i| {
                    let (sample, source) = &samples[*i as usize];
                    (sample, *source)
                });
                let beside = around
                    .iter()
                    .flat_map(|n| sources_by_node.of(*n))
                    .map(|i| (&source_frames[*i as usize], source_starts[*i as usize], *i));
                let mut found = branches::branches(&frame, spacing, doubt, samples, beside);
                for branch in &mut found {
                    let source = branch.source as usize;
                    let chord = (source_frames[source].point - frame.point).norm();
                    let short = source_starts[source] + chord - branch.jet.distance;
                    if short > 0.0 {
                        branch.jet.distance += short;
                        branch.error += short;
                    }
                }
                found
            })
            .collect();
        march::carry_on(graph, &self.frames, &bound, bends, &mut lists);
        let tolerance = self.tolerance(settings);
        let errors: Vec<f64> = (0..lists.len() as u32)
            .into_par_iter()
            .map(|node| self.disagreement(&lists, node))
            .collect();
        for (list, disagreement) in lists.iter_mut().zip(errors) {
            for branch in list {
                branch.error += disagreement + tolerance * branch.jet.distance.abs();
            }
        }
        let mut starts = vec![0];
        let mut flat = Vec::new();
        for list in lists {
            flat.extend(list);
            starts.push(flat.len() as u32);
        }
        Ok(Field {
            starts,
            branches: flat,
            sources: source_frames,
            source_nodes: near,
            source_starts,
            max_distance: settings.max_distance,
            other: None,
        })
    }

    /// The sources as the march of costs needs them.
    fn origins(&self, sources: &[Source<D, S::Place>]) -> Vec<cost::Origin<D>> {
        let origin = |source: &Source<D, S::Place>| {
            let entrances = self.geodesics.entrances(&source.node);
            let nearest = entrances.iter().min_by(|a, b| a.1.total_cmp(&b.1));
            cost::Origin {
                point: source.node.point,
                near: nearest.map(|n| n.0),
                start: source.start,
            }
        };
        sources.iter().map(origin).collect()
    }

    /// How far rays say that a place near a node is.
    fn by_samples(
        &self,
        frame: &Frame<D>,
        near: u32,
        samples: &[(Sample<D>, u32)],
        by_node: &Lists,
    ) -> f64 {
        let reach = branches::REACH * self.spacing[near as usize];
        let edges = self.geodesics.graph().edges(near).iter();
        let around = std::iter::once(near).chain(edges.map(|edge| edge.to));
        let close = around.flat_map(|n| by_node.of(n)).filter_map(|i| {
            let sample = &samples[*i as usize].0;
            let close = (sample.frame.point - frame.point).norm() <= reach;
            let carried = sample.jet.carried(&sample.frame, frame);
            carried.filter(|_| close).map(|jet| jet.distance)
        });
        close.fold(f64::INFINITY, f64::min)
    }

    fn tolerance(&self, settings: &Settings) -> f64 {
        if self.geodesics.surface().detail() > 0.0 {
            settings.tolerance.max(NOISY_TOLERANCE)
        } else {
            settings.tolerance
        }
    }

    /// By how much the jets of a node miss the distances of its nearest neighbours at most: what they may be
    /// wrong by in between.
    fn disagreement(&self, lists: &[Vec<Branch>], node: u32) -> f64 {
        let Some(frame) = &self.frames[node as usize] else {
            return 0.0;
        };
        let nearest = self.adjacent(node).filter_map(|edge| {
            let there = lists[edge.to as usize].first()?.jet.distance;
            let other = self.frames[edge.to as usize].as_ref()?;
            let v = frame.log(&other.point, ON_SURFACE);
            let found = lists[node as usize].iter().map(|branch| {
                let carried = branch.jet.distance_at(v, 0.5 * (frame.gauss + other.gauss));
                carried.unwrap_or(branch.jet.distance + jet::norm(v))
            });
            Some((found.fold(f64::INFINITY, f64::min) - there).abs())
        });
        nearest
            .filter(|error| error.is_finite())
            .fold(0.0, f64::max)
    }

    /// The edges from a node to those right beside it.
    fn adjacent(&self, node: u32) -> impl Iterator<Item = &Edge> {
        let farthest = ADJACENT * self.spacing[node as usize];
        let edges = self.geodesics.graph().edges(node).iter();
        edges.filter(move |edge| f64::from(edge.length) <= farthest)
    }

    /// Distances along the graph, which are never too short: of all nodes not farther than the largest.
    fn bounds(
        &self,
        sources: &[Source<D, S::Place>],
        entrances: &[Vec<(u32, f32)>],
        max_distance: f64,
    ) -> Distances {
        let graph = self.geodesics.graph();
        let mut bound = Distances::new(graph);
        let ways: Vec<(u32, f32)> = sources
            .iter()
            .zip(entrances)
            .flat_map(|(source, list)| {
                list.iter()
                    .map(|(node, length)| (*node, length + source.start as f32))
            })
            .collect();
        // A route along the graph is a few hundredths longer than the geodesic.
        let longest = (1.2 * max_distance) as f32;
        bound.search(graph, &ways, |_| 0.0, |_, _| longest);
        bound
    }
}

impl<'a, const D: usize> Fields<'a, D, Atlas<D>> {
    /// Fields on a cloud, by what suits it: rays where its surface is smooth, and where it is rough, so that rays
    /// scatter, a march over its points, as with a cost of 1.
    ///
    /// # Errors
    /// As [`with_cost`](Self::with_cost).
    ///
    /// O(n) in the points of the cloud, in parallel.
    pub fn of_cloud(geodesics: &'a Geodesics<D, Atlas<D>>) -> Result<Self, Error> {
        let fields = Self::new(geodesics);
        let atlas = geodesics.surface();
        if atlas.intrinsic_dimension() != 2 || !atlas.has_points() {
            return Ok(fields);
        }
        let errors = (0..).zip(&fields.spacing);
        let mut errors: Vec<f64> = errors
            .map(|(chart, spacing)| atlas.height_error(chart) / spacing)
            .collect();
        errors.sort_by(f64::total_cmp);
        match errors.get(errors.len() / 2) {
            Some(median) if *median > ROUGH => Self::with_cost(geodesics, &Cost::default()),
            _ => Ok(fields),
        }
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
        Ok(Self {
            geodesics,
            frames: Vec::new(),
            any_frames: Vec::new(),
            net: Some(cost::Net::new(geodesics.surface(), cost)?),
            spacing: Vec::new(),
            rims: Rims::none(),
            places: OnceLock::new(),
        })
    }
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
