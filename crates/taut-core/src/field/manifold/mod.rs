//! Fields on surfaces of any dimension: rays with all their Jacobi fields are aimed at the nodes of
//! the graph, and the jets near each node are averaged there.

mod branches;
mod cover;
pub(crate) mod frame;
pub(crate) mod jet;
pub(crate) mod ray;

use crate::Vector;
use crate::error::Error;
use crate::field::evaluate::Value;
use crate::field::rays::branches::FOCUSED_RAYS;
use crate::field::rays::frame::ON_SURFACE;
use crate::field::{Fields, Settings, Source, by_node};
use crate::guess::Guide;
use crate::parallel;
use crate::surface::{Geometry, Node};
use branches::Branch;
use cover::Sample;
use frame::Frame;
use jet::transported;

/// The distances from sources at the nodes of the graph.
#[derive(Clone, Debug)]
pub(crate) struct Aimed<const D: usize> {
    /// The branches at each node of the graph, least distance first.
    pub branches: Vec<Vec<Branch<D>>>,
    /// For each node of the graph, whether the graph leads there and no ray does.
    unknown: Vec<bool>,
    /// The frame at each source, and the distance there.
    sources: Vec<(Frame<D>, f64)>,
    /// The largest distance, in the input's units, that was looked for.
    max_distance: f64,
}

/// The frame at a node; `None` where the surface has none.
pub(crate) fn frame<const D: usize, S: Guide<D>>(
    surface: &S,
    node: &Node<D, S::Place>,
    geometry: &mut Geometry<D>,
) -> Option<Frame<D>> {
    let known = surface.cheap_geometry(&node.point, node.place, geometry);
    known.then(|| Frame::new(node.point, geometry))
}

/// Finds the distances from sources at the nodes of the graph.
pub(crate) fn find<const D: usize, S: Guide<D>>(
    fields: &Fields<D, S>,
    given: &[Source<D, S::Place>],
    settings: &Settings,
) -> Result<Aimed<D>, Error> {
    let (surface, graph) = (fields.geodesics.surface(), fields.geodesics.graph());
    let frames = &fields.ground.any_frames;
    let sources = fields.prepared(given, settings, frame)?;
    let mut wanted: Vec<u32> = sources.bound.reached().to_vec();
    wanted.retain(|node| frames[*node as usize].is_some());
    wanted.sort_unstable();
    let tolerance = fields.tolerance(settings);
    let mut samples: Vec<(Sample<D>, u32)> = Vec::new();
    for (i, origin) in sources.origins() {
        let limits = fields.limits(&sources.bound, origin.start, settings);
        let jets = cover::cover(surface, &origin, &wanted, &limits);
        samples.extend(jets.into_iter().map(|sample| (sample, i)));
    }
    let source_nodes = sources.nodes.iter().map(|near| near.unwrap_or(u32::MAX));
    let sources_by_node = by_node(source_nodes, graph.nodes.len());
    let samples_by_node = by_node(
        samples.iter().map(|sample| sample.0.near),
        graph.nodes.len(),
    );
    let of_node = |i: usize| {
        let reached = sources.bound.distance(i as u32).is_finite();
        let frame = frames[i].as_ref().filter(|_| reached)?;
        let is_seen = |from: &Frame<D>| !(fields.ground.has_creases && frame.is_creased(from));
        let around = fields.around(i as u32);
        let jets = around.iter().flat_map(|n| samples_by_node.of(*n));
        let jets = jets.map(|i| (&samples[*i as usize].0, samples[*i as usize].1));
        let jets = jets.filter(|(sample, _)| is_seen(&sample.frame));
        let beside = around.iter().flat_map(|n| sources_by_node.of(*n));
        let beside = beside.map(|i| {
            let source = *i as usize;
            (&sources.frames[source], given[source].start, *i)
        });
        let beside = beside.filter(|(source, ..)| is_seen(source));
        let mut found = branches::branches(frame, fields.ground.spacing[i], jets, beside);
        // No distance is shorter than straight through space; what a jet says less is an error.
        for branch in &mut found {
            let short = sources.shortfall(branch.source, &frame.point, branch.jet.distance);
            branch.jet.distance += short;
            branch.error += short;
        }
        Some(found)
    };
    let mut lists = parallel::map(frames.len(), |i| of_node(i).unwrap_or_default());
    let errors = parallel::map(lists.len(), |i| disagreement(fields, &lists, i as u32));
    for (list, disagreement) in lists.iter_mut().zip(errors) {
        for branch in list {
            branch.error += disagreement + tolerance * branch.jet.distance.abs();
        }
    }
    let is_within = |i: u32| {
        sources.bound.distance(i).is_finite()
            && f64::from(sources.bound.distance(i)) <= settings.max_distance
    };
    let unknown = (0..)
        .zip(&lists)
        .map(|(i, list)| list.is_empty() && is_within(i));
    Ok(Aimed {
        unknown: unknown.collect(),
        branches: lists,
        sources: sources
            .frames
            .into_iter()
            .zip(given.iter().map(|source| source.start))
            .collect(),
        max_distance: settings.max_distance,
    })
}

/// The most by which the jets of a node miss the distances of its adjacent nodes: this is what they
/// may be wrong by in between.
fn disagreement<const D: usize, S: Guide<D>>(
    fields: &Fields<D, S>,
    lists: &[Vec<Branch<D>>],
    node: u32,
) -> f64 {
    let frames = &fields.ground.any_frames;
    let Some(frame) = &frames[node as usize] else {
        return 0.0;
    };
    let nearest = fields.adjacent(node).filter_map(|edge| {
        let there = lists[edge.to as usize].first()?.jet.distance;
        let v = frame.log(&frames[edge.to as usize].as_ref()?.point, ON_SURFACE);
        let found = lists[node as usize].iter().map(|branch| {
            let carried = branch.jet.distance_at(frame, &v);
            carried.unwrap_or(branch.jet.distance + v.norm())
        });
        Some((found.fold(f64::INFINITY, f64::min) - there).abs())
    });
    nearest
        .filter(|error| error.is_finite())
        .fold(0.0, f64::max)
}

impl<const D: usize> Aimed<D> {
    /// The value at a point whose nearest node, with its frame, is given.
    pub fn at(&self, node: u32, frame: &Frame<D>, x: &Vector<D>, share: f64) -> Value<D> {
        if self.unknown[node as usize] {
            return Value::unknown();
        }
        let mut value = Value::unreached();
        let v = frame.log(x, share);
        for branch in &self.branches[node as usize] {
            let (source, start) = &self.sources[branch.source as usize];
            if branch.at_source {
                let v = source.log(x, share);
                let distance = start + v.norm();
                if distance < value.distance {
                    value = Value {
                        distance,
                        error: branch.error,
                        source: branch.source,
                        direction: transported(source, &v, &v),
                    };
                }
                continue;
            }
            let carried = branch.jet.distance_at(frame, &v);
            // No branch is longer than along the step, or shorter than straight through space.
            let bound = branch.jet.distance + v.norm();
            let least = start + (source.point - x).norm();
            let free = carried.map_or(bound, |carried| carried.min(bound));
            let distance = free.max(least);
            if distance < value.distance {
                value = Value {
                    distance,
                    error: branch.error + (distance - free) + carried.map_or(v.norm(), |_| 0.0),
                    source: branch.source,
                    direction: branch.jet.direction_at(frame, &v),
                };
            }
        }
        if value.distance > self.max_distance {
            return Value::unreached();
        }
        value
    }

    /// Whether rays draw together so much at a node that its neighbours may know better.
    pub fn is_focused(&self, node: u32, spacing: f64) -> bool {
        let mut branches = self.branches[node as usize].iter();
        branches.any(|branch| !branch.jet.spreads_faster(-FOCUSED_RAYS / spacing))
    }
}
