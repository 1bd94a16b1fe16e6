//! Integration of one geodesic from a source in any dimension with its Jacobi fields, which tell
//! how the rays beside it spread.
//!
//! The equations are x'' = II(x', x'), E' = II(E, x') for a frame carried along the ray, and in
//! that frame A'' = -R A. They are integrated by the embedded pair of
//! [`field::ray`](crate::field::rays::ray).

use crate::correction::length::HeightErrors;
use crate::field::manifold::frame::{Frame, axis};
use crate::field::rays::fan::samples::JETS_ALONG;
use crate::field::rays::ray::{
    AT, CHART_JUMP, CHORD_OVER_STEP, FARTHEST_OFF, Limits, MOST_RAY_STEPS, OFF_WEIGHT,
    ORDER_DIFFERENCE, RAY_OVER_RIM, SHORTEST_RAY_STEP, SIDEWAYS, nearest,
};
use crate::geodesics::ray::Step;
use crate::surface::{Geometry, Surface};
use crate::{Matrix, Vector};

/// A place on a ray.
#[derive(Clone, Debug)]
pub(crate) struct Knot<const D: usize, P> {
    /// Length of the ray from the source, in the input's units.
    pub length: f64,
    /// The frame here: its first tangent is the ray's, the others have been carried in parallel
    /// along the ray.
    pub frame: Frame<D>,
    /// The Jacobi fields A and A' in this frame. Column i says how far rays that leave the source
    /// towards tangent i go apart: at the source it is 0 in A and that of the identity in A'. Along
    /// the ray itself A has 1 and A' has 0.
    pub jacobi: [Matrix<D>; 2],
    pub place: P,
    /// The nearest node of the graph.
    pub near: u32,
    /// What errors of the surface's height do to the length.
    pub heights: HeightErrors,
}

/// What is integrated along a ray: the point, the frame and the Jacobi fields.
#[derive(Clone, Copy)]
struct State<const D: usize> {
    x: Vector<D>,
    tangents: Matrix<D>,
    jacobi: [Matrix<D>; 2],
}

impl<const D: usize> State<D> {
    /// The state after a step along the weighted sum of slopes.
    fn moved(&self, step: f64, slopes: &[Self], weights: &[f64]) -> Self {
        let mut moved = *self;
        for (slope, weight) in slopes.iter().zip(weights) {
            let share = step * weight;
            moved.x += slope.x * share;
            moved.tangents += slope.tangents * share;
            moved.jacobi[0] += slope.jacobi[0] * share;
            moved.jacobi[1] += slope.jacobi[1] * share;
        }
        moved
    }

    /// The derivative of the state by length, with the frame of this state.
    fn slope(&self, frame: &Frame<D>) -> Self {
        let first = axis(0);
        Self {
            x: self.tangents.column(0).into_owned(),
            tangents: frame.second_form_along(&first),
            jacobi: [self.jacobi[1], -frame.tidal(&first) * self.jacobi[0]],
        }
    }
}

impl<const D: usize, P: Copy> Knot<D, P> {
    /// The knot at the source of the ray along a direction given in the coordinates of the source's
    /// frame.
    pub fn first(source: &Frame<D>, direction: &Vector<D>, place: P, near: u32) -> Self {
        let (mut spread, mut slope) = (Matrix::identity(), Matrix::zeros());
        for i in 1..source.dimension() {
            spread[(i, i)] = 0.0;
            slope[(i, i)] = 1.0;
        }
        Self {
            length: 0.0,
            frame: source.turned(direction),
            jacobi: [spread, slope],
            place,
            near,
            heights: HeightErrors::default(),
        }
    }
}

/// Follows the geodesic from a knot on. It ends beyond the limits, before rays beside it meet it,
/// or where the surface ends.
pub(crate) fn shoot<const D: usize, S: Surface<D>>(
    surface: &S,
    start: Knot<D, S::Place>,
    limits: &Limits<D, S::Place>,
) -> Vec<Knot<D, S::Place>> {
    let mut geometry = Geometry::new(D - start.frame.dimension());
    let longest = |near: u32| {
        let along = JETS_ALONG * limits.spacing[near as usize];
        limits.longest_step(near).min(along)
    };
    let mut step = 0.5 * longest(start.near);
    let mut knots = vec![start];
    for _ in 0..MOST_RAY_STEPS {
        let Some(knot) = knots.last() else { break };
        let longest = longest(knot.near);
        step = step.min(longest);
        // A node without neighbours knows no length to step by.
        if step <= 0.0 {
            break;
        }
        let taken = advance(surface, knot, step, FARTHEST_OFF * longest, &mut geometry);
        let Some(Step {
            end: mut next,
            error,
            is_creased,
        }) = taken
        else {
            step *= 0.5;
            if step < SHORTEST_RAY_STEP * longest {
                break;
            }
            continue;
        };
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
        let rim = surface.beyond_rim(&next.frame.point, next.place);
        if rim.is_some_and(|(depth, _)| depth > RAY_OVER_RIM * longest) {
            step *= 0.5;
            if step < RAY_OVER_RIM * longest {
                break;
            }
            continue;
        }
        let ends = !limits.past_conjugate && knot.length > 0.0;
        if ends && meets(&knot.jacobi[0], &next.jacobi[0]) {
            break;
        }
        next.near = nearest(limits.graph, &next.frame.point, next.near);
        let beyond = limits.beyond(next.length, &next.frame.point, next.near);
        knots.push(next);
        if beyond {
            break;
        }
        step *= change.min(3.0);
    }
    knots
}

/// The geodesic from a knot to exactly a length, or as far as [`shoot`] follows it.
pub(crate) fn follow<const D: usize, S: Surface<D>>(
    surface: &S,
    start: Knot<D, S::Place>,
    limits: &Limits<D, S::Place>,
    length: f64,
) -> Vec<Knot<D, S::Place>> {
    let mut geometry = Geometry::new(D - start.frame.dimension());
    let mut knots = shoot(surface, start, limits);
    let within = knots.partition_point(|knot| knot.length < length);
    if within < knots.len() {
        knots.truncate(within);
        let last = knots.last().and_then(|knot| {
            let farthest = FARTHEST_OFF * limits.longest_step(knot.near);
            let rest = length - knot.length;
            Some(advance(surface, knot, rest, farthest, &mut geometry)?.end)
        });
        knots.extend(last);
    }
    knots
}

/// Whether rays beside a ray meet it on a step: the matrix that takes one A to the next is then no
/// longer near the identity.
fn meets<const D: usize>(before: &Matrix<D>, after: &Matrix<D>) -> bool {
    let Some(inverse) = before.try_inverse() else {
        return true;
    };
    let passed = after * inverse;
    (passed + passed.transpose()).cholesky().is_none()
}

/// One step; `None` where it leaves what is known of the surface or ends
/// farther than `farthest` off it.
fn advance<const D: usize, S: Surface<D>>(
    surface: &S,
    from: &Knot<D, S::Place>,
    step: f64,
    farthest: f64,
    geometry: &mut Geometry<D>,
) -> Option<Step<Knot<D, S::Place>>> {
    let start = State {
        x: from.frame.point,
        tangents: from.frame.tangents,
        jacobi: from.jacobi,
    };
    let mut slopes = [start; 7];
    slopes[0] = start.slope(&from.frame);
    let mut place = from.place;
    let mut frame = from.frame.clone();
    for (i, weights) in AT.iter().enumerate() {
        let stage = start.moved(step, &slopes[..=i], weights);
        let known = surface.find_place(&stage.x, &mut place, geometry)
            && surface.cheap_geometry(&stage.x, place, geometry);
        if !known {
            return None;
        }
        frame.point = stage.x;
        frame.tangents = stage.tangents;
        frame.take_second_form(geometry);
        slopes[i + 1] = stage.slope(&frame);
    }
    let stage = start.moved(step, &slopes[..6], AT[5]);
    // An error along the ray changes its length at first order, one to the side at second order
    // only.
    let error = start.moved(step, &slopes, &ORDER_DIFFERENCE);
    let off_by = error.x - start.x;
    let ahead = start.tangents.column(0);
    let spread = (error.jacobi[0] - start.jacobi[0]).amax();
    let error =
        off_by.dot(&ahead).abs() + (SIDEWAYS + OFF_WEIGHT) * off_by.norm() + SIDEWAYS * spread;
    let is_creased = surface.resolution(place) == 0.0
        && (0..frame.dimension())
            .any(|j| geometry.is_creased([&stage.tangents.column(j).into_owned()], 0.0));
    frame.settle(geometry, farthest)?;
    let chord = (frame.point - start.x).norm();
    if !(error.is_finite()
        && chord <= CHORD_OVER_STEP * step.hypot(CHART_JUMP * surface.height_error(place)))
    {
        return None;
    }
    let mut heights = from.heights;
    let curvature = frame.second_form_along(&axis(0)).column(0).norm();
    let height_error = surface.height_error(place);
    heights.add(step, curvature, height_error, surface.resolution(place));
    let knot = Knot {
        length: from.length + step,
        frame,
        jacobi: stage.jacobi,
        place,
        near: from.near,
        heights,
    };
    Some(Step {
        end: knot,
        error,
        is_creased,
    })
}
