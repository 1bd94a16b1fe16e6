//! Least costs at all points. A first march goes in the order of cost, with a linear cost on
//! segments; sweeps in that order follow, with a cubic cost.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashSet};

use crate::Vector;
use crate::correction::length::HeightErrors;
use crate::error::Error;
use crate::field::Value;
use crate::field::cost::Slope;
use crate::field::cost::net::{Net, Rings, Spoke};
use crate::field::cost::update::{Known, Way, through};
use crate::field::rays::frame::Frame;
use crate::order::sort_by_number;
use crate::parallel;

/// Number of points nearest to a source that take the straight way from it.
const POINTS_AT_SOURCE: usize = 30;
/// Number of points nearest to a source by which its neighbourhood is judged.
const NEAR_SOURCE: usize = 60;
/// Least share of the cost by which an improvement must lower it to be made.
const LEAST_IMPROVEMENT: f64 = 1e-10;
/// Number of sweeps with cubic segments where costs do not depend on the direction.
const SWEEPS: usize = 2;
/// Number of sweeps with cubic segments where costs depend on the direction, as least ways need not
/// come in order there.
const SWEEPS_OF_SLOPES: usize = 4;
/// How uncertain the place of a corner is that a way turns round, in spacings of the points.
const CORNER_DOUBT: f64 = 1.0;
/// Least turn of a way at a point for it to count as a corner, as the length of the difference of
/// the unit steps.
const LEAST_TURN: f64 = 0.2;
/// Distance, in spacings of the points, whose cost is more than the change that cubic segments make
/// at the farthest point that is asked for.
const MARCH_MARGIN: f64 = 2.0;
/// Share of a jump of the cost by which the last step of a way may cost more or less.
const JUMP_SHARE: f64 = 0.5;

/// Factor of the estimated errors of the points' places in the error of a cost.
const PLACES: f64 = 2.0;
/// Error of a step, as a share of the spacing.
const FLOOR: f64 = 1e-3;

/// A place of a source: where it lies, a node of the graph beside it, its start value, and the
/// index of the source.
#[derive(Clone, Debug)]
pub(crate) struct SourcePlace<const D: usize> {
    pub point: Vector<D>,
    pub near: Option<u32>,
    pub start: f64,
    pub source: u32,
    /// The distance to the next places of the same source, in the input's units; 0 where there are
    /// none.
    pub gap: f64,
    /// The frame with the second fundamental form at the place, where it is known.
    pub frame: Option<Frame<D>>,
}

/// The least cost at each point of the net.
#[derive(Clone, Debug)]
pub(crate) struct Marched<const D: usize> {
    pub values: Vec<Value<D>>,
    /// The gradient of the cost at each point.
    pub(super) gradients: Vec<Vector<D>>,
    /// The places of the sources.
    pub(super) origins: Vec<SourcePlace<D>>,
    /// For each point the place that it is reached straight from, if any.
    pub(super) straight: Vec<Option<u32>>,
}

/// The least cost found so far at a point, and the way that it comes by.
#[derive(Clone, Copy, Debug)]
struct Label<const D: usize> {
    cost: f64,
    gradient: Vector<D>,
    /// The last step of the way to the point.
    step: Vector<D>,
    source: u32,
    /// Estimated error by what is not known along the way; it is a cost.
    doubt: f64,
    /// The place of a source that the point is reached straight from, if any.
    origin: Option<u32>,
    /// What errors of the surface's height along the way do to its length.
    heights: HeightErrors,
}

impl<const D: usize> Label<D> {
    fn none() -> Self {
        Self {
            cost: f64::INFINITY,
            gradient: Vector::zeros(),
            step: Vector::zeros(),
            source: u32::MAX,
            doubt: 0.0,
            origin: None,
            heights: HeightErrors::default(),
        }
    }
}

/// A point whose cost its neighbours may make use of; in a heap the least cost comes first.
#[derive(PartialEq)]
struct Waiting {
    cost: f64,
    point: u32,
}

impl Eq for Waiting {}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        let order = other.cost.total_cmp(&self.cost);
        order.then(other.point.cmp(&self.point))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// How far costs are looked for.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    /// The largest cost that is looked for.
    pub longest: f64,
    /// The number of points after which, once they are reached, the march may end.
    pub enough: usize,
}

/// The least costs from sources within limits; `coordinates` is the origin of the input's
/// coordinates, for messages.
pub(crate) fn find<const D: usize>(
    net: &Net<D>,
    sources: Vec<SourcePlace<D>>,
    limits: Limits,
    coordinates: &Vector<D>,
) -> Result<Marched<D>, Error> {
    let start = beside(net, &sources, coordinates)?;
    let (first, longest) = in_order(net, start, limits);
    let mut order: Vec<u32> = (0..first.len() as u32)
        .filter(|i| first[*i as usize].cost.is_finite())
        .collect();
    sort_by_number(&mut order, |i| first[*i as usize].cost);
    // Rings of two sizes err by different multiples of the same power of their size.
    let rings = [&net.inner, &net.outer];
    let swept = parallel::map(rings.len(), |i| swept(net, rings[i], &first, &order));
    let (inner, outer) = (&swept[0], &swept[1]);
    let differ = |i: usize| {
        let (inner, outer) = (&inner[i], &outer[i]);
        let differ = (inner.cost - outer.cost).abs();
        if net.slope == Slope::Level {
            differ
        } else {
            // Ways may go to and fro between two directions, and no order of the error is known
            // where they do.
            differ.max((inner.cost - first[i].cost).abs())
        }
    };
    let differ = parallel::map(inner.len(), differ);
    let starts = sources.iter().filter_map(|origin| {
        let near = net.nearest(&origin.point, origin.near?, 1);
        Some(net.place_error(*near.first()?))
    });
    let start = starts.fold(0.0, f64::max);
    let value = |i: usize| {
        let label = &inner[i];
        if !label.cost.is_finite() || label.cost > longest {
            return Value::unreached();
        }
        // The two rings agree by chance at some points, so the differences at neighbouring points
        // count as well.
        let ring = net.inner.of(i as u32).iter();
        let around = ring.map(|spoke| differ[spoke.to as usize]);
        let around = around.filter(|differ| differ.is_finite());
        let rate = if net.costs[i].is_finite() {
            net.costs[i]
        } else {
            1.0
        };
        let places = (start + net.place_error(i as u32)) * rate;
        let at_source = label.origin.is_some() && label.step.norm() == 0.0;
        let ahead = if net.is_length {
            label.gradient
        } else {
            label.step
        };
        Value {
            distance: label.cost,
            error: if at_source {
                0.0
            } else {
                around.fold(differ[i], f64::max)
                    + label.doubt
                    + rate
                        * (label.heights.length_error()
                            + FLOOR * net.spacing[i].min(label.step.norm()))
                    + PLACES * places
            },
            source: label.source,
            direction: ahead.try_normalize(0.0).unwrap_or_else(Vector::zeros),
        }
    };
    Ok(Marched {
        values: parallel::map(inner.len(), value),
        gradients: inner.iter().map(|label| label.gradient).collect(),
        straight: inner.iter().map(|label| label.origin).collect(),
        origins: sources,
    })
}

/// Labels the points beside the sources, which are reached straight from them.
fn beside<const D: usize>(
    net: &Net<D>,
    sources: &[SourcePlace<D>],
    coordinates: &Vector<D>,
) -> Result<Vec<Label<D>>, Error> {
    let mut labels = vec![Label::none(); net.points.len()];
    for (index, origin) in (0..).zip(sources) {
        let Some(chart) = origin.near else { continue };
        let near = net.nearest(&origin.point, chart, NEAR_SOURCE);
        let outside = |i: &&u32| !net.is_held(&net.points[**i as usize]);
        let rate = near.iter().find(outside);
        let rate = rate.map_or(f64::INFINITY, |i| net.costs[*i as usize]);
        if net.is_held(&origin.point) || !rate.is_finite() {
            return Err(Error::NoFoot {
                point: format!("{:?}", (origin.point + coordinates).as_slice()),
                reason: "a source lies where the cost is infinite",
            });
        }
        for point in near.iter().take(POINTS_AT_SOURCE) {
            let x = &net.points[*point as usize];
            let there = net.costs[*point as usize];
            if !there.is_finite() || !net.is_open(&origin.point, x, &near) {
                continue;
            }
            let source_itself = Known {
                point: origin.point,
                frame: None,
                rate,
                cost: origin.start,
                gradient: None,
            };
            let way = through(&net.target(*point), [&source_itself; 2]);
            let label = &mut labels[*point as usize];
            let length = way.step.norm();
            let mut heights = HeightErrors::default();
            net.add_errors(*point, &way.step, &mut heights);
            // Halfway to the next place, the source may be nearer than this place is.
            let nearer = length
                - (length * length - 0.25 * origin.gap * origin.gap)
                    .max(0.0)
                    .sqrt();
            let astray = match (&origin.frame, net.frame(*point)) {
                (Some(from), Some(to)) if net.is_length => from.disagreement(to),
                _ => 0.0,
            };
            if way.cost < label.cost {
                *label = Label {
                    cost: way.cost,
                    gradient: way.gradient,
                    step: way.step,
                    source: origin.source,
                    doubt: 0.25 * (there - rate).abs() * length + rate * nearer + astray,
                    origin: Some(index),
                    heights,
                };
            }
        }
    }
    Ok(labels)
}

/// What is known at a point for a way through it; with its gradient if the segments are to be
/// cubic.
fn known<'a, const D: usize>(
    net: &'a Net<D>,
    labels: &[Label<D>],
    point: u32,
    cubic: bool,
) -> Known<'a, D> {
    let i = point as usize;
    Known {
        point: net.points[i],
        frame: net.frame(point),
        rate: net.costs[i],
        cost: labels[i].cost,
        gradient: cubic.then_some(labels[i].gradient),
    }
}

/// The label at a point by a way through the segment between two other points.
fn label<const D: usize>(
    net: &Net<D>,
    labels: &[Label<D>],
    way: &Way<D>,
    point: u32,
    ends: [u32; 2],
) -> Label<D> {
    let [a, b] = ends.map(|end| &labels[end as usize]);
    let (from, end) = if way.share <= 0.5 {
        (a, ends[0] as usize)
    } else {
        (b, ends[1] as usize)
    };
    let mut doubt = a.doubt + way.share * (b.doubt - a.doubt);
    let [before, after] = [from.step, way.step].map(|s| s.try_normalize(0.0));
    if let (Some(before), Some(after)) = (before, after) {
        let turn = (after - before).norm();
        if turn > LEAST_TURN && net.slope == Slope::Level {
            doubt += CORNER_DOUBT * net.spacing[end] * net.costs[end] * turn;
        }
    }
    doubt += JUMP_SHARE * net.jumps[point as usize] * way.step.norm();
    let mut heights = from.heights;
    net.add_errors(point, &way.step, &mut heights);
    Label {
        cost: way.cost,
        gradient: way.gradient,
        step: way.step,
        source: from.source,
        doubt,
        origin: None,
        heights,
    }
}

/// The labels corrected until none changes, with straight segments, and the largest cost up to
/// which they were looked for. The costs are never too low.
fn in_order<const D: usize>(
    net: &Net<D>,
    mut labels: Vec<Label<D>>,
    limits: Limits,
) -> (Vec<Label<D>>, f64) {
    let mut longest = limits.longest;
    let is_limited = limits.enough < labels.len();
    let mut missing = if is_limited { limits.enough } else { 0 };
    let mut passed = HashSet::new();
    let mut farthest = f64::NEG_INFINITY;
    let users = users(&net.inner, labels.len());
    let mut heap: BinaryHeap<Waiting> = (0..)
        .zip(&labels)
        .filter(|(_, label)| label.cost.is_finite() && label.cost <= longest)
        .map(|(point, label)| Waiting {
            cost: label.cost,
            point,
        })
        .collect();
    while let Some(Waiting { cost, point }) = heap.pop() {
        if cost > labels[point as usize].cost || cost > longest {
            continue;
        }
        // Where only some points are asked for, the march goes a little beyond the last of them,
        // because the sweeps still change costs.
        if missing > 0 && passed.insert(point) {
            let i = point as usize;
            farthest = farthest.max(cost + MARCH_MARGIN * net.spacing[i] * net.costs[i]);
            missing -= 1;
            if missing == 0 {
                longest = longest.min(farthest);
            }
        }
        for (user, place) in users.of(point) {
            let ring = net.inner.of(*user);
            let i = *place as usize;
            let before = &ring[(i + ring.len() - 1) % ring.len()];
            let after = &ring[(i + 1) % ring.len()];
            let sides = [(before, before.joined), (after, ring[i].joined)];
            let mut alone = true;
            for (other, joined) in sides {
                if !joined || !labels[other.to as usize].cost.is_finite() {
                    continue;
                }
                alone = false;
                improve(
                    net,
                    &mut labels,
                    &mut heap,
                    *user,
                    [point, other.to],
                    longest,
                );
            }
            if alone {
                improve(net, &mut labels, &mut heap, *user, [point; 2], longest);
            }
        }
    }
    (labels, longest)
}

/// Takes a way through a segment to a point if it costs less than the way that the point holds.
fn improve<const D: usize>(
    net: &Net<D>,
    labels: &mut [Label<D>],
    heap: &mut BinaryHeap<Waiting>,
    point: u32,
    ends: [u32; 2],
    longest: f64,
) {
    let least = ends.map(|end| labels[end as usize].cost);
    let held = labels[point as usize].cost;
    if least[0].min(least[1]) >= held {
        return;
    }
    let from = ends.map(|end| known(net, labels, end, false));
    let way = through(&net.target(point), [&from[0], &from[1]]);
    if way.cost < held * (1.0 - LEAST_IMPROVEMENT) && way.cost <= longest {
        labels[point as usize] = label(net, labels, &way, point, ends);
        heap.push(Waiting {
            cost: way.cost,
            point,
        });
    }
}

/// For each point, the rings that it is in and its place in them.
struct Users {
    starts: Vec<u32>,
    places: Vec<(u32, u32)>,
}

impl Users {
    fn of(&self, point: u32) -> &[(u32, u32)] {
        let i = point as usize;
        &self.places[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// Finds the users of all points by counting sort.
fn users(rings: &Rings, count: usize) -> Users {
    let spokes = |point: u32| rings.of(point).iter().zip(0..);
    let mut starts = vec![0_u32; count + 2];
    for point in 0..count as u32 {
        for (spoke, _) in spokes(point) {
            starts[spoke.to as usize + 2] += 1;
        }
    }
    for i in 2..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut places = vec![(0, 0); starts[count + 1] as usize];
    for point in 0..count as u32 {
        for (spoke, place) in spokes(point) {
            let next = &mut starts[spoke.to as usize + 1];
            places[*next as usize] = (point, place);
            *next += 1;
        }
    }
    Users { starts, places }
}

/// The labels found again with cubic segments through rings, point by point in an order of cost.
fn swept<const D: usize>(
    net: &Net<D>,
    rings: &Rings,
    first: &[Label<D>],
    order: &[u32],
) -> Vec<Label<D>> {
    let mut labels = first.to_vec();
    let sweeps = if net.slope == Slope::Level {
        SWEEPS
    } else {
        SWEEPS_OF_SLOPES
    };
    for _ in 0..sweeps {
        for point in order
            .iter()
            .filter(|i| first[**i as usize].origin.is_none())
        {
            if let Some(label) = least(net, rings.of(*point), &labels, first, *point) {
                labels[*point as usize] = label;
            }
        }
    }
    labels
}

/// The least way to a point through its ring, from neighbours whose first label says that they are
/// nearer.
fn least<const D: usize>(
    net: &Net<D>,
    ring: &[Spoke],
    labels: &[Label<D>],
    first: &[Label<D>],
    point: u32,
) -> Option<Label<D>> {
    let nearer = |i: u32| first[i as usize].cost < first[point as usize].cost;
    let mut best: Option<(Way<D>, [u32; 2])> = None;
    let mut consider = |ends: [u32; 2]| {
        let from = ends.map(|end| known(net, labels, end, true));
        let way = through(&net.target(point), [&from[0], &from[1]]);
        if best.is_none_or(|b| way.cost < b.0.cost) {
            best = Some((way, ends));
        }
    };
    for (i, spoke) in ring.iter().enumerate() {
        let next = ring[(i + 1) % ring.len()].to;
        let known = |i: u32| first[i as usize].cost.is_finite();
        if spoke.joined && known(spoke.to) && known(next) && (nearer(spoke.to) || nearer(next)) {
            consider([spoke.to, next]);
        } else if nearer(spoke.to) {
            consider([spoke.to; 2]);
        }
    }
    best.map(|(way, ends)| label(net, labels, &way, point, ends))
}
