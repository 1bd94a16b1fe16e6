//! Fields on surfaces of dimension 2: rays leave the sources, the nodes of the graph take branches from the rays near
//! them, and say what these may be wrong by.

use rayon::prelude::*;

use crate::error::Error;
use crate::field::bend::Grazed;
use crate::field::branches::{self, Branch};
use crate::field::fan::{self, Sample};
use crate::field::frame::{Frame, ON_SURFACE};
use crate::field::jet::norm;
use crate::field::ray::Limits;
use crate::field::{BESIDE, Field, Fields, Settings, Source, by_node, frame, march};
use crate::guess::Guide;
use crate::guess::dijkstra::Distances;
use crate::surface::Geometry;
use crate::surface::atlas::Lists;

/// How much shorter, in spacings, a branch must be to be believed that rests on jets a spacing away: the
/// surface's own error in spacings times this, and at most 1.
const DOUBT: f64 = 30.0;

/// Sources with what rays and nodes need of them.
struct Sources<'s, const D: usize, P> {
    given: &'s [Source<D, P>],
    frames: Vec<Frame<D>>,
    /// The nodes of the graph nearest to them.
    nodes: Vec<Option<u32>>,
    /// Distances along the graph, which are never too short.
    bound: Distances,
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The field of some sources.
    pub(crate) fn by_rays(
        &self,
        given: &[Source<D, S::Place>],
        settings: &Settings,
    ) -> Result<Field<D>, Error> {
        let sources = self.prepared(given, settings)?;
        let (samples, bent) = self.cast(&sources, settings);
        let mut lists = self.branches_at_nodes(&sources, &samples);
        let graph = self.geodesics.graph();
        march::carry_on(graph, &self.frames, &sources.bound, bent, &mut lists);
        self.add_errors(&mut lists, self.tolerance(settings));
        let mut starts = vec![0];
        let mut flat = Vec::new();
        for list in lists {
            flat.extend(list);
            starts.push(flat.len() as u32);
        }
        Ok(Field {
            starts,
            branches: flat,
            sources: sources.frames,
            source_nodes: sources.nodes,
            source_starts: given.iter().map(|source| source.start).collect(),
            max_distance: settings.max_distance,
            other: None,
        })
    }

    fn prepared<'s>(
        &self,
        given: &'s [Source<D, S::Place>],
        settings: &Settings,
    ) -> Result<Sources<'s, D, S::Place>, Error> {
        let mut geometry = Geometry::new(D - 2);
        let frames: Vec<Frame<D>> = given
            .iter()
            .map(|source| {
                let found = frame(self.geodesics.surface(), &source.node, &mut geometry);
                found.ok_or_else(|| Error::NoFoot {
                    point: format!("{:?}", source.node.point.as_slice()),
                    reason: "a source has no tangent plane there",
                })
            })
            .collect::<Result<_, _>>()?;
        let entrances = given.iter().map(|s| self.geodesics.entrances(&s.node));
        let entrances: Vec<Vec<(u32, f32)>> = entrances.collect();
        let nearest = |list: &Vec<(u32, f32)>| {
            let nearest = list.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
            Some(nearest.0)
        };
        Ok(Sources {
            given,
            frames,
            nodes: entrances.iter().map(nearest).collect(),
            bound: self.bounds(given, &entrances, settings.max_distance),
        })
    }

    /// The jets along all rays, each with its source; whether some bend round rims.
    fn cast(
        &self,
        sources: &Sources<'_, D, S::Place>,
        settings: &Settings,
    ) -> (Vec<(Sample<D>, u32)>, bool) {
        let (surface, graph) = (self.geodesics.surface(), self.geodesics.graph());
        let limits = |start: f64, along: bool| Limits {
            graph,
            spacing: &self.spacing,
            bound: (&sources.bound, start),
            longest: settings.max_distance - start,
            detail: surface.detail(),
            tolerance: self.tolerance(settings),
            past_conjugate: false,
            rim: &self.rims.nodes,
            along,
        };
        let reachable = sources.bound.reached().len();
        let mut samples: Vec<(Sample<D>, u32)> = Vec::new();
        let mut grazed = Vec::new();
        for (i, (source, near)) in (0..).zip(sources.given.iter().zip(&sources.nodes)) {
            let Some(near) = near else { continue };
            let at = (&source.node, &sources.frames[i as usize], *near);
            let fan = |along: bool| {
                let limits = limits(source.start, along);
                fan::fan(surface, at, None, source.start, reachable, &limits)
            };
            samples.extend(fan(false).0.into_iter().map(|sample| (sample, i)));
            // Rays that jump the dents of a rough edge reach more, those that do not find where it is grazed.
            if !self.rims.nodes.is_empty() {
                grazed.extend(fan(true).1.into_iter().map(|graze| Grazed {
                    graze,
                    doubt: 0.0,
                    source: i,
                }));
            }
        }
        let bent = !grazed.is_empty();
        if bent {
            let lit = by_node(samples.iter().map(|s| s.0.near), graph.nodes.len());
            let lit = |frame: &Frame<D>, near: u32| self.by_samples(frame, near, &samples, &lit);
            let limits = |start| limits(start, true);
            let found = self.rims.bent(surface, grazed, lit, reachable, limits);
            samples.extend(found);
        }
        (samples, bent)
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

    /// The branches of all nodes, each one's least distance first.
    fn branches_at_nodes(
        &self,
        sources: &Sources<'_, D, S::Place>,
        samples: &[(Sample<D>, u32)],
    ) -> Vec<Vec<Branch>> {
        let graph = self.geodesics.graph();
        let source_nodes = sources.nodes.iter().map(|near| near.unwrap_or(u32::MAX));
        let sources_by_node = by_node(source_nodes, graph.nodes.len());
        let samples_by_node = by_node(samples.iter().map(|s| s.0.near), graph.nodes.len());
        let of_node = |node: u32| {
            let reached = sources.bound.distance(node).is_finite();
            let frame = self.frames[node as usize].filter(|_| reached)?;
            let spacing = self.spacing[node as usize];
            let place = graph.nodes[node as usize].place;
            let height_error = self.geodesics.surface().height_error(place);
            let doubt = (DOUBT * height_error / spacing).min(1.0);
            let edges = graph.edges(node).iter();
            let close = edges.filter(|edge| f64::from(edge.length) <= BESIDE * spacing);
            let around: Vec<u32> = std::iter::once(node)
                .chain(close.map(|edge| edge.to))
                .collect();
            let near = around.iter().flat_map(|n| samples_by_node.of(*n));
            let near = near.map(|i| {
                let (sample, source) = &samples[*i as usize];
                (sample, *source)
            });
            let beside = around.iter().flat_map(|n| sources_by_node.of(*n));
            let beside = beside.map(|i| {
                let source = *i as usize;
                (&sources.frames[source], sources.given[source].start, *i)
            });
            let mut found = branches::branches(&frame, spacing, doubt, near, beside);
            for branch in &mut found {
                let source = branch.source as usize;
                let chord = (sources.frames[source].point - frame.point).norm();
                let short = sources.given[source].start + chord - branch.jet.distance;
                if short > 0.0 {
                    branch.jet.distance += short;
                    branch.error += short;
                }
            }
            Some(found)
        };
        (0..graph.nodes.len() as u32)
            .into_par_iter()
            .map(|node| of_node(node).unwrap_or_default())
            .collect()
    }

    /// Adds what lies between nodes and the tolerance of rays to the errors.
    fn add_errors(&self, lists: &mut [Vec<Branch>], tolerance: f64) {
        let errors: Vec<f64> = (0..lists.len() as u32)
            .into_par_iter()
            .map(|node| self.disagreement(lists, node))
            .collect();
        for (list, disagreement) in lists.iter_mut().zip(errors) {
            for branch in list {
                branch.error += disagreement + tolerance * branch.jet.distance.abs();
            }
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
                carried.unwrap_or(branch.jet.distance + norm(v))
            });
            Some((found.fold(f64::INFINITY, f64::min) - there).abs())
        });
        nearest
            .filter(|error| error.is_finite())
            .fold(0.0, f64::max)
    }
}
