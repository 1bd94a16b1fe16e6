//! Fields on surfaces of dimension 2. Rays leave the sources, the nodes of the graph take branches
//! from the rays near them, and what the branches may be wrong by is estimated.

pub(in crate::field) mod aim;
pub(in crate::field) mod branches;
pub(in crate::field) mod carry;
pub(in crate::field) mod dents;
pub(in crate::field) mod diffraction;
pub(in crate::field) mod doubt;
pub(in crate::field) mod fan;
pub(in crate::field) mod frame;
pub(in crate::field) mod jet;
pub(in crate::field) mod knot;
pub(in crate::field) mod piece;
pub(in crate::field) mod ray;
pub(in crate::field) mod sides;

use crate::error::Error;
use crate::field::plane::norm;
use crate::field::rays::branches::Branch;
use crate::field::rays::diffraction::Grazed;
use crate::field::rays::doubt::Sight;
use crate::field::rays::fan::{Bundle, Fan, Sample};
use crate::field::rays::frame::{Frame, ON_SURFACE};
use crate::field::rays::jet::Jet;
use crate::field::rays::piece::Piece;
use crate::field::rays::ray::Limits;
use crate::field::sources::Prepared;
use crate::field::{Field, Fields, Settings, Sources, by_node, frame};
use crate::guess::Guide;
use crate::guess::dijkstra::Distances;
use crate::parallel;
use crate::surface::atlas::Lists;

/// Factor of the penalty on a branch that rests on jets one spacing away: this times the surface's
/// error over the spacing, at most 1. The penalty is in spacings; a branch must be shorter than
/// others by more than its penalty to be believed.
const LONE_JET_DOUBT: f64 = 30.0;

/// What is said for a branch whose jet is not known as far as a neighbouring node.
#[derive(Clone, Copy)]
enum Unknown {
    /// The branch says nothing.
    LeftOut,
    /// The branch says that the way there is no longer than along the step.
    AsLong,
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The field of some sources, by rays.
    pub(crate) fn by_rays(
        &self,
        given: Sources<'_, D, S::Place>,
        settings: &Settings,
    ) -> Result<Field<D>, Error> {
        match given {
            Sources::Points(points) => {
                let sources = self.prepared(points, settings, frame)?;
                let piece = |(i, frame): (usize, &Frame<D>)| Piece {
                    frame: *frame,
                    half: 0.0,
                    start: points[i].start,
                    source: i as u32,
                };
                let pieces = sources.frames.iter().enumerate().map(piece).collect();
                let origins = sources.origins();
                let bundles = origins.map(|(i, origin)| (Bundle::of_point(&origin, None), i));
                Ok(self.of_pieces(pieces, &sources, &bundles.collect::<Vec<_>>(), settings))
            }
            Sources::Curve(curve) => {
                let (middles, pieces) = self.pieces(curve);
                let sources = self.prepared(&middles, settings, frame)?;
                let bundles = self.bundles(curve).into_iter().map(|bundle| (bundle, 0));
                Ok(self.of_pieces(pieces, &sources, &bundles.collect::<Vec<_>>(), settings))
            }
        }
    }

    /// The field of sources in pieces, by rays. Each piece lies beside one of the prepared points;
    /// each bundle of rays has the index of its source.
    fn of_pieces(
        &self,
        pieces: Vec<Piece<D>>,
        sources: &Prepared<'_, D, S::Place, Frame<D>>,
        bundles: &[(Bundle<'_, D, S::Place>, u32)],
        settings: &Settings,
    ) -> Field<D> {
        let (samples, is_diffracted) = self.cast(bundles, &sources.bound, settings);
        let mut lists = self.branches_at_nodes(&pieces, sources, &samples);
        let graph = self.geodesics.graph();
        carry::carry_on(
            graph,
            &self.ground.frames,
            &sources.bound,
            is_diffracted,
            &mut lists,
        );
        let tolerance = self.tolerance(settings);
        if let Some(sight) = Sight::new(self, &pieces, &sources.nodes, tolerance) {
            sight.prove(&mut lists, |_, branch| doubt::is_scattered(branch));
            let missed = self.disagreements(&pieces, &lists, Unknown::LeftOut);
            sight.prove(&mut lists, |node, branch| {
                missed[node as usize] > doubt::DOUBTFUL_DISTANCE * branch.jet.distance
            });
        }
        self.add_errors(&pieces, &mut lists, tolerance);
        let mut starts = vec![0];
        let mut flat = Vec::new();
        for list in lists {
            flat.extend(list);
            starts.push(flat.len() as u32);
        }
        Field {
            tolerance,
            starts,
            branches: flat,
            pieces,
            piece_nodes: sources.nodes.clone(),
            max_distance: settings.max_distance,
            other: None,
        }
    }

    /// The jets along all rays, each with its source, and whether some rays are diffracted at rims.
    fn cast(
        &self,
        bundles: &[(Bundle<'_, D, S::Place>, u32)],
        bound: &Distances,
        settings: &Settings,
    ) -> (Vec<(Sample<D>, u32)>, bool) {
        let (surface, graph) = (self.geodesics.surface(), self.geodesics.graph());
        let limits = |start: f64, along: bool| Limits {
            rim: &self.ground.rims.nodes,
            along,
            ..self.limits(bound, start, settings)
        };
        let reachable = bound.reached().len();
        let found = parallel::map(bundles.len(), |i| {
            let (bundle, source) = &bundles[i];
            let jumping = limits(bundle.start, false);
            let samples = Fan::new(surface, bundle, reachable, &jumping).samples();
            let samples: Vec<_> = samples.into_iter().map(|s| (s, *source)).collect();
            // Rays that jump the dents of a rough rim reach more places; rays that do not jump them
            // find where the rim is grazed.
            let mut grazed = Vec::new();
            if !self.ground.rims.nodes.is_empty() {
                let along = limits(bundle.start, true);
                let found = Fan::new(surface, bundle, reachable, &along).grazes();
                grazed.extend(found.into_iter().map(|graze| Grazed {
                    graze,
                    doubt: 0.0,
                    source: *source,
                }));
            }
            (samples, grazed)
        });
        let (mut samples, mut grazed) = (Vec::new(), Vec::new());
        for (more, others) in found {
            samples.extend(more);
            grazed.extend(others);
        }
        let is_diffracted = !grazed.is_empty();
        if is_diffracted {
            let lit = by_node(samples.iter().map(|s| s.0.near), graph.nodes.len());
            let lit = |frame: &Frame<D>, near: u32| self.by_samples(frame, near, &samples, &lit);
            let limits = |start| limits(start, true);
            let found = self
                .ground
                .rims
                .diffracted(surface, grazed, lit, reachable, limits);
            samples.extend(found);
        }
        (samples, is_diffracted)
    }

    /// How far rays say that a place near a node is.
    fn by_samples(
        &self,
        frame: &Frame<D>,
        near: u32,
        samples: &[(Sample<D>, u32)],
        by_node: &Lists,
    ) -> f64 {
        let reach = branches::JET_REACH * self.ground.spacing[near as usize];
        let edges = self.geodesics.graph().edges(near).iter();
        let around = std::iter::once(near).chain(edges.map(|edge| edge.to));
        let close = around.flat_map(|n| by_node.of(n)).filter_map(|i| {
            let sample = &samples[*i as usize].0;
            let close = (sample.frame.point - frame.point).norm() <= reach;
            let carried = sample.jet.carried(&sample.frame, frame);
            let near = branches::BEYOND * self.ground.spacing[near as usize];
            let known = carried.filter(|jet| close && jet.heading.beyond() <= near);
            known.map(|jet| jet.distance)
        });
        close.fold(f64::INFINITY, f64::min)
    }

    /// The branches of all nodes, at each the shortest to be believed first.
    fn branches_at_nodes(
        &self,
        pieces: &[Piece<D>],
        sources: &Prepared<'_, D, S::Place, Frame<D>>,
        samples: &[(Sample<D>, u32)],
    ) -> Vec<Vec<Branch>> {
        let graph = self.geodesics.graph();
        let source_nodes = sources.nodes.iter().map(|near| near.unwrap_or(u32::MAX));
        let sources_by_node = by_node(source_nodes, graph.nodes.len());
        let samples_by_node = by_node(samples.iter().map(|s| s.0.near), graph.nodes.len());
        let of_node = |node: u32| {
            let reached = sources.bound.distance(node).is_finite();
            let frame = self.ground.frames[node as usize].filter(|_| reached)?;
            let spacing = self.ground.spacing[node as usize];
            let place = graph.nodes[node as usize].place;
            let height_error = self.geodesics.surface().height_error(place);
            let doubt = (LONE_JET_DOUBT * height_error / spacing).min(1.0);
            let around = self.around(node);
            let near = around.iter().flat_map(|n| samples_by_node.of(*n));
            let near = near.map(|i| {
                let (sample, source) = &samples[*i as usize];
                (sample, *source)
            });
            let is_seen = |from: &Frame<D>| !(self.ground.has_creases && frame.is_creased(from));
            let near = near.filter(|(sample, _)| is_seen(&sample.frame));
            let beside = around.iter().flat_map(|n| sources_by_node.of(*n));
            let beside = beside.map(|i| (&pieces[*i as usize], *i));
            let beside = beside.filter(|(piece, _)| is_seen(&piece.frame));
            let admits = |jet: &Jet, source: u32| pieces[source as usize].admits(jet.distance);
            let mut found = branches::branches(&frame, spacing, doubt, near, admits, beside);
            for branch in &mut found {
                let least = pieces[branch.source as usize].least(&frame.point);
                let short = (least - branch.jet.distance).max(0.0);
                branch.jet.distance += short;
                branch.error += short;
            }
            Some(found)
        };
        parallel::map(graph.nodes.len(), |i| of_node(i as u32).unwrap_or_default())
    }

    /// Adds the tolerance of the rays to the errors of the branches, and notes what lies between
    /// the nodes.
    fn add_errors(&self, pieces: &[Piece<D>], lists: &mut [Vec<Branch>], tolerance: f64) {
        let missed = self.disagreements(pieces, lists, Unknown::AsLong);
        for (list, missed) in lists.iter_mut().zip(missed) {
            for branch in list {
                branch.error += tolerance * branch.jet.distance.abs();
                if branch.carried && self.ground.has_creases {
                    branch.error = f64::INFINITY;
                }
                branch.missed = missed;
            }
        }
    }

    /// The disagreement of each node with its neighbours.
    fn disagreements(
        &self,
        pieces: &[Piece<D>],
        lists: &[Vec<Branch>],
        unknown: Unknown,
    ) -> Vec<f64> {
        parallel::map(lists.len(), |i| {
            self.disagreement(pieces, lists, i as u32, unknown)
        })
    }

    /// The most by which the jets of a node miss the distances of its adjacent nodes: this is what
    /// they may be wrong by in between.
    fn disagreement(
        &self,
        pieces: &[Piece<D>],
        lists: &[Vec<Branch>],
        node: u32,
        unknown: Unknown,
    ) -> f64 {
        let Some(frame) = &self.ground.frames[node as usize] else {
            return 0.0;
        };
        let nearest = self.adjacent(node).filter_map(|edge| {
            let there = lists[edge.to as usize].first()?.jet.distance;
            let other = self.ground.frames[edge.to as usize].as_ref()?;
            let v = frame.log(&other.point, ON_SURFACE);
            let found = lists[node as usize].iter().filter_map(|branch| {
                if let Some(piece) = branch.piece.map(|i| &pieces[i as usize]) {
                    return Some(piece.start + piece.way(&other.point, ON_SURFACE).length);
                }
                let gauss = 0.5 * (frame.gauss + other.gauss);
                let carried = match (branch.jet.distance_at(v, gauss), unknown) {
                    (Some((distance, _)), _) => distance,
                    (None, Unknown::LeftOut) => return None,
                    (None, Unknown::AsLong) => branch.jet.distance + norm(v),
                };
                // Rays of other kinds, and rays from the other side of a curve, are not meant.
                let most = branches::BEYOND * self.ground.spacing[node as usize];
                let is_known = branch.jet.beyond_at(v, gauss) <= most
                    && pieces[branch.source as usize].admits(carried);
                is_known.then_some(carried)
            });
            Some((found.fold(f64::INFINITY, f64::min) - there).abs())
        });
        nearest
            .filter(|error| error.is_finite())
            .fold(0.0, f64::max)
    }
}
