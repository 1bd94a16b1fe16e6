//! Integration of one geodesic from a source with its Jacobi field, which tells how far the rays
//! beside it spread.
//!
//! x'' = II(x', x') and J'' = -K J are integrated by the pair of orders 5 and 4 of Dormand and
//! Prince, "A family of embedded Runge-Kutta formulae", Journal of Computational and Applied
//! Mathematics 6 (1980). After each step x is put back onto the surface. A ray ends at a rim (the
//! boundary of the surface), at a crease, at a conjugate point, or past its limits.

use crate::Vector;
use crate::field::rays::dents::{self, Dent};
use crate::field::rays::frame::Frame;
use crate::field::rays::knot::Knot;
use crate::geodesics::ray::{State, Step};
use crate::guess::dijkstra::Distances;
use crate::guess::graph::Graph;
use crate::surface::{Geometry, Surface};

/// Where rays end and how finely they are followed. A ray ends past the distances along the graph,
/// which are never too short, or past the distance asked for.
pub(crate) struct Limits<'a, const D: usize, P> {
    pub graph: &'a Graph<D, P>,
    /// The spacing at each node of the graph, in the input's units.
    pub spacing: &'a [f64],
    /// Upper bounds of the distance of the graph's nodes, where there are any, and the start value
    /// of the source, which they include.
    pub bound: Option<(&'a Distances, f64)>,
    /// The largest length of a ray, in the input's units.
    pub longest: f64,
    /// Wavelength of the surface's finest detail, in the input's units; 0 where steps need not
    /// follow any.
    pub detail: f64,
    /// Estimated error of a step that is allowed, relative to the step's length.
    pub tolerance: f64,
    /// Whether rays go on where neighbouring rays meet them.
    pub past_conjugate: bool,
    /// Whether each node of the graph is near a rim; empty where the surface has no rim.
    pub rim: &'a [bool],
    /// Whether rays must not jump the dents of a rough rim.
    pub along: bool,
}

/// Longest step of a ray, in spacings of the graph's nodes.
const LONGEST_RAY_STEP: f64 = 8.0;
/// How far rays go on past a bound, in spacings of the graph's nodes.
const PAST: f64 = 2.0;

impl<const D: usize, P: Copy> Limits<'_, D, P> {
    /// The most that a ray may measure at a node of the graph: the node's distance along the graph
    /// less the source's start value.
    pub fn bound(&self, node: u32) -> f64 {
        self.bound.map_or(f64::INFINITY, |(bound, start)| {
            f64::from(bound.distance(node)) - start
        })
    }

    /// Whether a ray at a point is of no interest any more.
    pub(crate) fn beyond(&self, length: f64, point: &Vector<D>, near: u32) -> bool {
        let slack = PAST * self.spacing[near as usize];
        let off = (point - self.graph.nodes[near as usize].point).norm();
        length > self.longest + slack || length > self.bound(near) + off + slack
    }

    /// Relative error of a step that is allowed near a node; it is larger where the surface has an
    /// error of its own.
    pub fn tolerance_at(&self, near: u32, height_error: f64) -> f64 {
        let rough = ROUGH_RAY_STEP * height_error / self.spacing[near as usize];
        self.tolerance.max(rough)
    }

    /// The longest step of a ray near a node of the graph, in the input's units.
    pub(crate) fn longest_step(&self, near: u32) -> f64 {
        let step = LONGEST_RAY_STEP * self.spacing[near as usize];
        if self.detail > 0.0 {
            step.min(self.detail)
        } else {
            step
        }
    }
}

/// The stages of the Runge-Kutta method: the weights of the slopes before each, which sum up to its
/// place on the step. The last stage is the end of the step at order 5.
pub(crate) const AT: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
    ],
    &[
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
    ],
    &[
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];
/// The weights of the fifth-order result less those of the fourth-order one, whose sum estimates a
/// step's error.
pub(crate) const ORDER_DIFFERENCE: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];
/// Weight of errors that change the length at second order only: those to the side, and those of
/// the Jacobi field.
pub(crate) const SIDEWAYS: f64 = 0.05;
/// Weight of errors off the surface, which every step takes back.
pub(crate) const OFF_WEIGHT: f64 = 0.01;
/// Largest distance between two rays, as a share of the radius of curvature, for a ray to start
/// halfway between them.
const HALFWAY_CURVATURE: f64 = 0.35;
/// Relative error of steps below which it is useless to go, per unit of the surface's own error
/// over the spacing.
const ROUGH_RAY_STEP: f64 = 0.03;
/// Most steps of one ray, tried ones included.
pub(crate) const MOST_RAY_STEPS: usize = 20_000;
/// Shortest step, as a share of the longest: a ray ends where steps must be shorter.
pub(crate) const SHORTEST_RAY_STEP: f64 = 1e-3;

/// How far off the surface a step may end, as a share of the longest step; also how far off it a
/// ray halfway between two others may begin, as a share of their distance.
pub(crate) const FARTHEST_OFF: f64 = 0.03;
/// Largest ratio of the chord of a step to the length of the step together with a jump between
/// charts.
pub(crate) const CHORD_OVER_STEP: f64 = 1.001;
/// Largest jump between charts, in errors of the surface's height.
pub(crate) const CHART_JUMP: f64 = 10.0;
/// How far beyond a rim a ray ends, as a share of the longest step.
pub(crate) const RAY_OVER_RIM: f64 = 0.03;

/// The derivative of a ray's state by its length.
fn slope<const D: usize>(state: &State<D>, frame: &Frame<D>) -> State<D> {
    let t = frame.coordinates(&state.v);
    State {
        x: state.v,
        v: frame.second_form(t, t),
        j: [state.j[1], -frame.gauss * state.j[0]],
    }
}

/// The frame at a point near the surface; `place` is brought up to date.
fn frame_at<const D: usize, S: Surface<D>>(
    surface: &S,
    x: &Vector<D>,
    place: &mut S::Place,
    geometry: &mut Geometry<D>,
) -> Option<Frame<D>> {
    let known =
        surface.find_place(x, place, geometry) && surface.cheap_geometry(x, *place, geometry);
    known.then(|| Frame::new(*x, geometry))
}

/// Puts a frame, found with this geometry, onto the surface and turns it along `v`, with the second
/// tangent to the side given. `None` where the surface is farther than `farthest`.
fn settled<const D: usize>(
    frame: Frame<D>,
    v: &Vector<D>,
    side: &Vector<D>,
    geometry: &Geometry<D>,
    farthest: f64,
) -> Option<Frame<D>> {
    let off = geometry.pseudo_inverse(&geometry.values);
    let point = frame.point - off;
    let frame = Frame { point, ..frame }.facing(v, side)?;
    (off.norm() <= farthest).then_some(frame)
}

/// A knot put back onto the surface, with the frame there; `None` where the surface has none.
pub(crate) fn onto<const D: usize, S: Surface<D>>(
    surface: &S,
    knot: &Knot<D, S::Place>,
) -> Option<Knot<D, S::Place>> {
    let mut geometry = Geometry::new(D - 2);
    let mut place = knot.place;
    let frame = frame_at(surface, &knot.frame.point, &mut place, &mut geometry)?;
    let [ahead, side] = knot.frame.tangents;
    let frame = settled(frame, &ahead, &side, &geometry, f64::INFINITY)?;
    Some(Knot {
        frame,
        place,
        ..*knot
    })
}

/// The ray halfway between two rays that leave the source at an angle to each other, at the same
/// length. Across both rays runs the quintic with the slopes and second derivatives that their
/// Jacobi fields determine; the derivatives of the Jacobi fields by the angle are given. `None`
/// where the rays are too far apart.
pub(crate) fn halfway<const D: usize, S: Surface<D>>(
    surface: &S,
    graph: &Graph<D, S::Place>,
    pair: [(&Knot<D, S::Place>, f64); 2],
    angle: f64,
) -> Option<Knot<D, S::Place>> {
    let [(a, change_a), (b, change_b)] = pair;
    let curvature = a.frame.curvature().max(b.frame.curvature());
    let apart = a.jacobi[0].max(b.jacobi[0]) * angle;
    if apart * curvature > HALFWAY_CURVATURE || a.jacobi[0] <= 0.0 || b.jacobi[0] <= 0.0 {
        return None;
    }
    let across = |k: &Knot<D, S::Place>, change: f64| {
        let ([t, side], [j, slope]) = (k.frame.tangents, k.jacobi);
        let first = side * j;
        let second = k.frame.second[2] * (j * j) - t * (j * slope) + side * change;
        let turning = side * slope + k.frame.second[1] * j;
        (first, second, turning)
    };
    let ((da, dda, ta), (db, ddb, tb)) = (across(a, change_a), across(b, change_b));
    let (xa, xb) = (a.frame.point, b.frame.point);
    let (va, vb) = (a.frame.tangents[0], b.frame.tangents[0]);
    // These are the values and derivatives of the quintics halfway, by Hermite interpolation over
    // the angle.
    let x =
        (xa + xb) * 0.5 + (da - db) * (5.0 / 32.0 * angle) + (dda + ddb) * (angle * angle / 64.0);
    let spread =
        (xb - xa) * (15.0 / 8.0 / angle) - (da + db) * (7.0 / 16.0) + (ddb - dda) * (angle / 32.0);
    let v = (va + vb) * 0.5 + (ta - tb) * (angle / 8.0);
    let turning = (vb - va) * (1.5 / angle) - (ta + tb) * 0.25;
    let mut geometry = Geometry::new(D - 2);
    let mut place = a.place;
    let frame = frame_at(surface, &x, &mut place, &mut geometry)?;
    let frame = settled(
        frame,
        &v,
        &a.frame.tangents[1],
        &geometry,
        FARTHEST_OFF * apart,
    )?;
    let side = frame.tangents[1];
    Some(Knot {
        length: a.length,
        jacobi: [spread.dot(&side), turning.dot(&side)],
        place,
        near: nearest(graph, &frame.point, a.near),
        heights: a.heights,
        frame,
    })
}

/// A geodesic as far as it was followed.
pub(crate) struct Flight<const D: usize, P> {
    /// The places where the steps of the geodesic end, from its start on.
    pub knots: Vec<Knot<D, P>>,
    /// Whether the geodesic ends because the surface does.
    pub stopped: bool,
    /// The dents of rough rims that the geodesic jumps.
    pub dents: Vec<Dent>,
}

/// Follows the geodesic from a knot on. It ends beyond the limits, where rays beside it meet it, or
/// where the surface ends.
pub(crate) fn shoot<const D: usize, S: Surface<D>>(
    surface: &S,
    start: Knot<D, S::Place>,
    limits: &Limits<D, S::Place>,
) -> Flight<D, S::Place> {
    let mut geometry = Geometry::new(D - 2);
    let mut knot = start;
    let mut flight = Flight {
        knots: vec![knot],
        stopped: false,
        dents: Vec::new(),
    };
    let mut step = 0.5 * limits.longest_step(knot.near);
    for _ in 0..MOST_RAY_STEPS {
        let longest = limits.longest_step(knot.near);
        step = step.min(longest).min(surface.rippled(knot.place));
        // A node without neighbours knows no length to step by.
        if step <= 0.0 {
            break;
        }
        let taken = advance(surface, &knot, step, FARTHEST_OFF * longest, &mut geometry);
        let Some(Step {
            end: next,
            error,
            is_creased,
        }) = taken
        else {
            step *= 0.5;
            if step < SHORTEST_RAY_STEP * longest {
                flight.stopped = !limits.rim.is_empty();
                break;
            }
            continue;
        };
        // The step must also suit the place where it ends: the surface may ripple there.
        let rippled = surface.rippled(next.place);
        if step > rippled {
            step = rippled.max(0.5 * step);
            continue;
        }
        let excess =
            error / (limits.tolerance_at(knot.near, surface.height_error(knot.place)) * step);
        let change = 0.9 * excess.max(1e-4).powf(-0.25);
        if excess > 1.0 && step > SHORTEST_RAY_STEP * longest {
            step *= change.max(0.2);
            continue;
        }
        if is_creased {
            step *= 0.5;
            if step < SHORTEST_RAY_STEP * longest {
                break;
            }
            continue;
        }
        let point = &next.frame.point;
        let over = surface.beyond_rim(point, next.place);
        if !limits.along && over.is_some_and(|(depth, _)| depth > RAY_OVER_RIM * longest) {
            step *= 0.5;
            if step < RAY_OVER_RIM * longest {
                flight.stopped = true;
                break;
            }
            continue;
        }
        if !limits.rim.is_empty() {
            let (dent, last) = dents::passed(surface, [&knot, &next], limits, &mut geometry);
            flight.dents.extend(dent);
            if let Some(last) = last {
                let ends_later = last.length > knot.length;
                flight.knots.extend(ends_later.then_some(last));
                flight.stopped = true;
                break;
            }
        }
        knot = next;
        knot.near = nearest(limits.graph, point, knot.near);
        flight.knots.push(knot);
        if knot.jacobi[0] <= 0.0 || limits.beyond(knot.length, point, knot.near) {
            break;
        }
        step *= change.min(3.0);
    }
    flight
}

/// One step; `None` where it leaves what is known of the surface or ends farther than `farthest`
/// off it.
fn advance<const D: usize, S: Surface<D>>(
    surface: &S,
    from: &Knot<D, S::Place>,
    step: f64,
    farthest: f64,
    geometry: &mut Geometry<D>,
) -> Option<Step<Knot<D, S::Place>>> {
    let start = State {
        x: from.frame.point,
        v: from.frame.tangents[0],
        j: from.jacobi,
    };
    let mut slopes = [start; 7];
    slopes[0] = slope(&start, &from.frame);
    let mut place = from.place;
    for (i, weights) in AT.iter().enumerate() {
        let stage = start.moved(step, &slopes[..=i], weights);
        let frame = frame_at(surface, &stage.x, &mut place, geometry)?;
        slopes[i + 1] = slope(&stage, &frame);
        if i + 1 < AT.len() {
            continue;
        }
        // An error along the ray changes its length at first order, one to the side at second order
        // only.
        let error = start.moved(step, &slopes, &ORDER_DIFFERENCE);
        let (dx, dj) = (error.x - start.x, error.j[0] - start.j[0]);
        let side = dx.dot(&from.frame.tangents[1]).abs() + dj.abs();
        let error = dx.dot(&start.v).abs() + SIDEWAYS * side + OFF_WEIGHT * dx.norm();
        let aside = &from.frame.tangents[1];
        let frame = settled(frame, &stage.v, aside, geometry, farthest)?;
        let turning = || from.frame.curvature().max(frame.curvature()) * step;
        let is_creased = surface.resolution(place) == 0.0
            && (geometry.is_creased([&stage.v], 0.0) || geometry.is_creased([aside], turning()));
        let chord = (frame.point - start.x).norm();
        if !(error.is_finite()
            && chord <= CHORD_OVER_STEP * step.hypot(CHART_JUMP * surface.height_error(place)))
        {
            return None;
        }
        let mut heights = from.heights;
        let error_of_height = surface.height_error(place);
        heights.add(
            step,
            frame.second[0].norm(),
            error_of_height,
            surface.resolution(place),
        );
        let end = Knot {
            length: from.length + step,
            frame,
            jacobi: stage.j,
            place,
            near: from.near,
            heights,
        };
        return Some(Step {
            end,
            error,
            is_creased,
        });
    }
    None
}

/// The node of the graph nearest to `x`, found by walking along edges from the node `from`.
pub(crate) fn nearest<const D: usize, P: Copy>(
    graph: &Graph<D, P>,
    x: &Vector<D>,
    from: u32,
) -> u32 {
    let squared = |node: u32| (graph.nodes[node as usize].point - x).norm_squared();
    let mut best = (squared(from), from);
    loop {
        let edges = graph.edges(best.1).iter();
        let next = edges.fold(best, |best, edge| {
            let there = squared(edge.to);
            if there < best.0 {
                (there, edge.to)
            } else {
                best
            }
        });
        if next.1 == best.1 {
            return best.1;
        }
        best = next;
    }
}
