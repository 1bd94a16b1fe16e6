//! The net of points on which costs are marched: the points of a cloud with the segments between
//! their neighbours, through which ways of least cost come.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::Vector;
use crate::correction::length::{HeightErrors, RIPPLE};
use crate::error::Error;
use crate::field::cost::barrier::Barrier;
use crate::field::cost::update::Target;
use crate::field::cost::{Cost, Slope};
use crate::field::rays::frame::Frame;
use crate::parallel;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::atlas::CROSSING;
use crate::surface::atlas::{Atlas, ChartIndex, Lists};
use crate::surface::{Geometry, Node, Surface};

/// Ranks, by distance, of the nearest neighbours from which the inner ring round a point is made.
const INNER_RING: std::ops::Range<usize> = 0..40;
/// Ranks, by distance, of the nearest neighbours from which the outer ring round a point is made.
const OUTER_RING: std::ops::Range<usize> = 10..70;
/// Least angle between two neighbours of a ring, in radians; neighbours join the ring nearest
/// first.
const CLOSEST: f64 = 0.35;
/// Widest gap of a ring that counts as closed, in radians: neighbours join until no gap is wider.
const CLOSED: f64 = 1.05;
/// Largest angle between two successive neighbours of a ring, in radians, for a segment to join
/// them.
const WIDEST_SEGMENT: f64 = 2.0;
/// Shares of a straight step at which it is looked at, between its ends.
const STEP_LOOKS: [f64; 7] = [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875];
/// Number of points above which a chart keeps its points in a tree.
const CROWDED_CHART: usize = 512;

/// A neighbour in the ring round a point; a ring is sorted by angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spoke {
    pub to: u32,
    /// Whether ways pass straight through the segment from this neighbour to the next one of the
    /// ring.
    pub joined: bool,
}

/// The ring of neighbours round each point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rings {
    starts: Vec<u32>,
    spokes: Vec<Spoke>,
}

impl Rings {
    fn new(lists: impl Iterator<Item = Vec<Spoke>>) -> Self {
        let mut rings = Self {
            starts: vec![0],
            spokes: Vec::new(),
        };
        for list in lists {
            rings.spokes.extend(list);
            rings.starts.push(rings.spokes.len() as u32);
        }
        rings
    }

    pub fn of(&self, point: u32) -> &[Spoke] {
        let i = point as usize;
        &self.spokes[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// How far the surface errs at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointDoubt {
    /// Standard error of the surface's height, in the input's units.
    pub height: f64,
    /// Radius of the chart, in the input's units.
    pub radius: f64,
    /// How far the points lie off the surface here, in the input's units.
    pub off: f64,
}

/// Points with their costs and rings.
#[derive(Clone, Debug)]
pub(crate) struct Net<const D: usize> {
    pub points: Vec<Vector<D>>,
    /// The frame with the second fundamental form at each point; `None` where it is not known, and
    /// on curves.
    frames: Vec<Option<Frame<D>>>,
    /// The cost per length at each point.
    pub costs: Vec<f64>,
    /// How far the surface errs at each point.
    pub doubts: Vec<PointDoubt>,
    pub slope: Slope,
    /// Whether costs are lengths.
    pub is_length: bool,
    /// The rings of the nearest neighbours.
    pub inner: Rings,
    /// The rings of neighbours that are farther off.
    pub outer: Rings,
    /// The spacing at each point: the mean distance to the nearest others, in the input's units.
    pub spacing: Vec<f64>,
    /// By how much, at most, the costs in the ring of each point differ from a linear function.
    pub jumps: Vec<f64>,
    barriers: Vec<Barrier>,
    /// The indices of the barriers that change nothing.
    idle: Vec<usize>,
    /// Whether points have infinite costs in the input. Points within barriers have infinite costs
    /// too; a step past a barrier is then also tested against the infinite costs outside it.
    walls: bool,
    /// For each node of the graph, the points whose chart it is.
    by_chart: Lists,
    /// For each node of the graph, itself and the nodes beside it.
    around: Lists,
    /// Trees of the points of crowded charts: many points that no chart fits may have gone to one
    /// chart.
    crowded: HashMap<u32, Tree<D>>,
}

impl<const D: usize> Net<D> {
    /// The net of the points of a cloud.
    pub fn new(atlas: &Atlas<D>, cost: &Cost) -> Result<Self, Error> {
        let points = atlas.cloud().points.iter().enumerate();
        let node = |(i, point): (usize, &Vector<D>)| Node {
            point: *point,
            place: atlas.owner(i),
        };
        Self::of_nodes(atlas, &points.map(node).collect::<Vec<_>>(), cost)
    }

    /// The net of other points of an atlas, for which the only cost is that of length.
    pub fn of_nodes(
        atlas: &Atlas<D>,
        nodes: &[Node<D, ChartIndex>],
        cost: &Cost,
    ) -> Result<Self, Error> {
        let dimension = atlas.intrinsic_dimension();
        if dimension > 2 {
            return Err(Error::NoCosts { dimension });
        }
        cost.slope.check()?;
        let mut costs = costs_of_points(atlas, nodes.len(), &cost.at_rows)?;
        let walls = costs.iter().any(|cost| !cost.is_finite());
        let centre = &atlas.cloud().centre;
        let polygons = cost.barriers.iter();
        let barriers: Vec<Barrier> = polygons.map(|p| Barrier::new(p, centre)).collect();
        let met: Vec<AtomicBool> = barriers.iter().map(|_| AtomicBool::new(false)).collect();
        let mut owned = vec![Vec::new(); atlas.nodes().len()];
        for point in 0..costs.len() {
            owned[nodes[point].place as usize].push(point as u32);
        }
        let by_chart = Lists::new(owned.iter().map(|list| list.iter().copied()));
        let around = (0..owned.len() as u32).map(|chart| atlas.beside(chart).iter().copied());
        let around = Lists::new(around);
        // Points are put onto the surface, because steps between them follow it.
        let scratch = || Geometry::new(D - dimension);
        let put_on = |geometry: &mut Geometry<D>, i: usize| {
            let Node {
                point: x,
                mut place,
            } = nodes[i];
            let x = atlas.foot(&x, &mut place, geometry).unwrap_or(x);
            let known = dimension == 2 && atlas.cheap_geometry(&x, place, geometry);
            (x, known.then(|| Frame::new(x, geometry)))
        };
        let found = parallel::map_with(costs.len(), scratch, put_on);
        let (points, frames): (Vec<Vector<D>>, _) = found.into_iter().unzip();
        let doubt = |i: usize| {
            let (height, radius, noise) = atlas.doubt(nodes[i].place);
            let off = (points[i] - nodes[i].point).norm().max(noise);
            PointDoubt {
                height,
                radius,
                off,
            }
        };
        let doubts = parallel::map(costs.len(), doubt);
        // Points within a barrier get an infinite cost; a barrier that holds none and stops no step
        // is idle.
        for (barrier, met) in barriers.iter().zip(&met) {
            for (x, cost) in points.iter().zip(&mut costs) {
                if barrier.holds(x) {
                    *cost = f64::INFINITY;
                    met.store(true, Ordering::Relaxed);
                }
            }
        }
        let mut net = Self {
            points,
            frames,
            is_length: cost.slope == Slope::Level
                && barriers.is_empty()
                && costs.iter().all(|cost| *cost == 1.0),
            costs,
            doubts,
            slope: cost.slope,
            inner: Rings::default(),
            outer: Rings::default(),
            spacing: Vec::new(),
            jumps: Vec::new(),
            barriers,
            idle: Vec::new(),
            walls,
            by_chart,
            around,
            crowded: HashMap::new(),
        };
        for chart in 0..owned.len() as u32 {
            let points = net.by_chart.of(chart).iter();
            if points.len() > CROWDED_CHART {
                let points: Vec<_> = points.map(|j| net.points[*j as usize]).collect();
                net.crowded.insert(chart, Tree::new(&points));
            }
        }
        let rings =
            |geometry: &mut _, i: usize| net.rings(atlas, i as u32, nodes[i].place, &met, geometry);
        let found = parallel::map_with(net.points.len(), scratch, rings);
        net.spacing = found.iter().map(|f| f.2).collect();
        let (inner, outer): (Vec<_>, Vec<_>) = found.into_iter().map(|f| (f.0, f.1)).unzip();
        (net.inner, net.outer) = (Rings::new(inner.into_iter()), Rings::new(outer.into_iter()));
        net.jumps = parallel::map(net.points.len(), |i| net.jump(i as u32));
        let met = met.iter().map(|met| met.load(Ordering::Relaxed));
        net.idle = met
            .zip(0..)
            .filter(|(met, _)| !met)
            .map(|met| met.1)
            .collect();
        Ok(net)
    }

    /// A point as the steps that lead there see it.
    pub fn target(&self, point: u32) -> Target<'_, D> {
        let i = point as usize;
        Target {
            point: &self.points[i],
            rate: self.costs[i],
            frame: self.frame(point),
            slope: self.slope,
            is_length: self.is_length,
        }
    }

    /// The frame with the second fundamental form at a point, where it is known.
    pub fn frame(&self, point: u32) -> Option<&Frame<D>> {
        self.frames[point as usize].as_ref()
    }

    /// Adds what errors of the surface do to a step that ends at a point.
    pub fn add_errors(&self, point: u32, step: &Vector<D>, errors: &mut HeightErrors) {
        let i = point as usize;
        let length = step.norm();
        if length > 0.0 {
            let curvature = self.frames[i].as_ref().map_or(0.0, |frame| {
                let along = frame.coordinates(step);
                frame.second_form(along, along).norm() / (length * length)
            });
            errors.add(
                length,
                curvature,
                self.doubts[i].height,
                self.doubts[i].radius,
            );
        }
    }

    /// How far a point's place on the surface errs. The point was moved there along a normal whose
    /// direction is known as well as the slope of a ripple.
    pub fn place_error(&self, point: u32) -> f64 {
        let doubt = &self.doubts[point as usize];
        if doubt.radius > 0.0 {
            doubt.off * (RIPPLE * doubt.height / doubt.radius).min(1.0)
        } else {
            0.0
        }
    }

    /// The points of the charts beside one chart, nearest to `x` first, at most `count`.
    pub fn nearest(&self, x: &Vector<D>, chart: u32, count: usize) -> Vec<u32> {
        let mut near: Vec<(f64, u32)> = Vec::new();
        for chart in self.around.of(chart) {
            let points = self.by_chart.of(*chart);
            if let Some(tree) = self.crowded.get(chart) {
                let mut found = Vec::new();
                tree.nearest(x, count + 1, &mut found);
                let index = |n: &Neighbour| points[tree.order[n.index as usize] as usize];
                near.extend(found.iter().map(|n| (n.squared, index(n))));
            } else {
                let squared = |j: u32| (self.points[j as usize] - x).norm_squared();
                near.extend(points.iter().map(|j| (squared(*j), *j)));
            }
        }
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if near.len() > count {
            near.select_nth_unstable_by(count, order);
            near.truncate(count);
        }
        near.sort_unstable_by(order);
        near.into_iter().map(|n| n.1).collect()
    }

    /// The spacing of the points near `x`, which lies near a node of the graph.
    pub fn spacing_at(&self, x: &Vector<D>, chart: u32) -> f64 {
        let nearest = self.nearest(x, chart, 1);
        nearest.first().map_or(0.0, |i| self.spacing[*i as usize])
    }

    /// Whether a straight step from `x` stays among points that can be passed: at each place on it
    /// the nearest of `near` is looked at.
    pub fn is_open(&self, x: &Vector<D>, to: &Vector<D>, near: &[u32]) -> bool {
        if self.barriers.iter().any(|barrier| barrier.stops(x, to)) {
            return false;
        }
        // Points within barriers do not count, because the bounds of the barriers are known.
        let passable = |j: &u32| {
            let x = &self.points[*j as usize];
            self.costs[*j as usize].is_finite() || self.is_held(x)
        };
        !self.walls
            || near.iter().all(passable)
            || STEP_LOOKS.iter().all(|t| {
                let place = x + (to - x) * *t;
                let squared = |j: &u32| (self.points[*j as usize] - place).norm_squared();
                let nearest = near.iter().min_by(|a, b| squared(a).total_cmp(&squared(b)));
                nearest.is_some_and(passable)
            })
    }

    /// Whether a point lies within a barrier.
    pub fn is_held(&self, x: &Vector<D>) -> bool {
        self.barriers.iter().any(|barrier| barrier.holds(x))
    }

    /// The indices of the barriers that change nothing; see
    /// [`Fields::idle_barriers`](crate::field::Fields::idle_barriers).
    pub fn idle_barriers(&self) -> Vec<usize> {
        self.idle.clone()
    }

    /// The inner and the outer ring of a point, and its spacing.
    fn rings(
        &self,
        atlas: &Atlas<D>,
        point: u32,
        chart: ChartIndex,
        met: &[AtomicBool],
        geometry: &mut Geometry<D>,
    ) -> (Vec<Spoke>, Vec<Spoke>, f64) {
        let x = self.points[point as usize];
        let mut near = self.nearest(&x, chart, OUTER_RING.end + 1);
        let distance = |j: &u32| (self.points[*j as usize] - x).norm();
        let others = near.iter().filter(|j| **j != point).take(4);
        let spacing = others.clone().map(distance).sum::<f64>() / others.count().max(1) as f64;
        if !self.costs[point as usize].is_finite() || !atlas.cheap_geometry(&x, chart, geometry) {
            return (Vec::new(), Vec::new(), spacing);
        }
        if !near.contains(&point) {
            near.insert(0, point);
        }
        let passes = |to: &Vector<D>| {
            let over = |t: &f64| {
                let depth = atlas.beyond_rim(&(x + (to - x) * *t), chart);
                depth.is_none_or(|d| d.0 <= CROSSING * spacing)
            };
            self.is_open(&x, to, &near) && STEP_LOOKS.iter().skip(1).step_by(2).all(over)
        };
        let plane = geometry.intrinsic_dimension() == 2;
        let angle = |to: u32| {
            let v = self.points[to as usize] - x;
            let up = if plane {
                v.dot(&geometry.tangent(1))
            } else {
                0.0
            };
            up.atan2(v.dot(&geometry.tangent(0)))
        };
        // A barrier that stops any step between neighbours is not idle.
        for (barrier, met) in self.barriers.iter().zip(met) {
            let mut steps = near.iter().map(|to| &self.points[*to as usize]);
            if !met.load(Ordering::Relaxed) && steps.any(|to| barrier.stops(&x, to)) {
                met.store(true, Ordering::Relaxed);
            }
        }
        let open: Vec<(f64, u32)> = near
            .iter()
            .filter(|to| **to != point && self.costs[**to as usize].is_finite())
            .map(|to| (angle(*to), *to))
            .collect();
        let ring = |ranks: std::ops::Range<usize>| {
            let ranks = ranks.start.min(open.len())..ranks.end.min(open.len());
            let ring = spread(&open[ranks], |to| passes(&self.points[to as usize]));
            self.joined(&x, &ring, plane, &passes)
        };
        (ring(INNER_RING), ring(OUTER_RING), spacing)
    }

    /// The spokes of a ring, with whether a segment joins each neighbour and the next one by angle.
    fn joined(
        &self,
        x: &Vector<D>,
        ring: &[(f64, u32)],
        plane: bool,
        passes: &impl Fn(&Vector<D>) -> bool,
    ) -> Vec<Spoke> {
        let count = ring.len();
        let spoke = |i: usize| {
            let (to, next) = (ring[i].1, ring[(i + 1) % count].1);
            let ends = [to, next].map(|i| self.points[i as usize]);
            let middle = (ends[0] + ends[1]) * 0.5;
            let narrow = plane && count > 1 && gap(ring, i) <= WIDEST_SEGMENT;
            let stops = |barrier: &Barrier| {
                barrier.stops(&ends[0], &ends[1]) || barrier.is_within([x, &ends[0], &ends[1]])
            };
            Spoke {
                to,
                joined: narrow && passes(&middle) && !self.barriers.iter().any(stops),
            }
        };
        (0..count).map(spoke).collect()
    }

    /// The largest difference between the costs in the ring of a point and the linear function
    /// nearest to them.
    fn jump(&self, point: u32) -> f64 {
        let (x, here) = (self.points[point as usize], self.costs[point as usize]);
        let ring = self.inner.of(point);
        let offsets = || {
            ring.iter().map(|spoke| {
                let to = spoke.to as usize;
                (self.points[to] - x, self.costs[to] - here)
            })
        };
        let Some(first) = offsets().next().and_then(|o| o.0.try_normalize(0.0)) else {
            return 0.0;
        };
        // The first neighbour and the neighbour farthest from its direction span the plane in which
        // the linear function is fitted.
        let across = offsets().map(|o| o.0 - first * first.dot(&o.0));
        let second = across.reduce(|a, b| {
            if b.norm_squared() > a.norm_squared() {
                b
            } else {
                a
            }
        });
        let second = second.and_then(|s| s.try_normalize(0.0));
        let second = second.unwrap_or_else(Vector::zeros);
        let (mut m, mut r) = ([0.0; 3], [0.0; 2]);
        for (offset, change) in offsets() {
            let (u, v) = (offset.dot(&first), offset.dot(&second));
            m = [m[0] + u * u, m[1] + u * v, m[2] + v * v];
            r = [r[0] + u * change, r[1] + v * change];
        }
        let determinant = m[0] * m[2] - m[1] * m[1];
        let slope = if determinant > 1e-6 * m[0] * m[2] {
            let along = (m[2] * r[0] - m[1] * r[1]) / determinant;
            let across = (m[0] * r[1] - m[1] * r[0]) / determinant;
            first * along + second * across
        } else {
            first * (r[0] / m[0])
        };
        let off = offsets().map(|(offset, change)| (change - slope.dot(&offset)).abs());
        off.fold(0.0, f64::max)
    }
}

/// The angle from a neighbour of a ring to the next one, in radians.
fn gap(ring: &[(f64, u32)], i: usize) -> f64 {
    let next = ring[(i + 1) % ring.len()].0;
    (next - ring[i].0).rem_euclid(std::f64::consts::TAU)
}

/// A ring of neighbours by angle: the nearest that can be passed to and are far enough apart, until
/// the ring is closed.
fn spread(nearest: &[(f64, u32)], passes: impl Fn(u32) -> bool) -> Vec<(f64, u32)> {
    let mut ring: Vec<(f64, u32)> = Vec::new();
    for (angle, to) in nearest {
        let place = ring.partition_point(|other| other.0 < *angle);
        let apart = |other: &(f64, u32)| {
            let turn = (other.0 - angle).rem_euclid(std::f64::consts::TAU);
            turn.min(std::f64::consts::TAU - turn) >= CLOSEST
        };
        if ring.iter().all(apart) && passes(*to) {
            ring.insert(place, (*angle, *to));
            if ring.len() > 2 && (0..ring.len()).all(|i| gap(&ring, i) <= CLOSED) {
                break;
            }
        }
    }
    ring
}

/// The cost per length at each point of the cloud.
fn costs_of_points<const D: usize>(
    atlas: &Atlas<D>,
    points: usize,
    at_rows: &[f64],
) -> Result<Vec<f64>, Error> {
    let cloud = atlas.cloud();
    if at_rows.is_empty() {
        return Ok(vec![1.0; points]);
    }
    let expected = cloud.point_of_row.len();
    if at_rows.len() != expected {
        return Err(Error::WrongCosts {
            found: at_rows.len(),
            expected,
        });
    }
    let cost = |row: &u32| {
        let found = at_rows[*row as usize];
        let row = *row as usize;
        (found > 0.0)
            .then_some(found)
            .ok_or(Error::BadCost { row, found })
    };
    cloud.rows.iter().map(cost).collect()
}
