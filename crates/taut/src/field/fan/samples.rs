//! The jets along rays that lie side by side.

use super::Fan;
use crate::field::frame::Frame;
use crate::field::jet::{Heading, Jet};
use crate::field::knot::Knot;
use crate::field::ray;

/// Jets along a ray lie so many spacings of the graph's nodes apart.
const ALONG: f64 = 1.0;
/// The change of the front's curvature is found from rays at least this many spacings apart.
const BESIDE: f64 = 0.7;
/// Nor are rays looked at that are farther off than the nearest of use by this factor.
const FARTHEST: f64 = 4.0;
/// A ray is of no use where rays beside it meet it within a spacing over this.
const FOCUSED: f64 = 1.0;
/// Most change of the front's curvature, times the square of the spacing.
const MOST_CHANGE: f64 = 0.1;

/// A jet on a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample<const D: usize> {
    pub frame: Frame<D>,
    pub jet: Jet,
    /// The nearest node of the graph.
    pub near: u32,
    /// Estimated error of the distance by that of the surface.
    pub surface_error: f64,
    /// How much shorter than others it must be to be believed.
    pub doubt: f64,
}

/// The jets along a ray from where on it is needed.
pub(super) fn samples<const D: usize, P: Copy + Send + Sync>(
    fan: &Fan<D, P>,
    index: usize,
) -> Vec<Sample<D>> {
    let (rays, spacing) = (&fan.rays, fan.spacing);
    let mut samples = Vec::new();
    let ray = &rays[index];
    let end = ray.end();
    let Some(first) = ray.knots.first() else {
        return samples;
    };
    let mut near = first.near;
    let mut length = ray.needed_from.max(0.5 * ALONG * spacing[near as usize]);
    let mut knot = 0;
    while length < end {
        while knot + 1 < ray.knots.len() && ray.knots[knot + 1].length <= length {
            knot += 1;
            near = ray.knots[knot].near;
        }
        let Some(Knot {
            frame,
            jacobi: [j, slope],
            ..
        }) = ray.at(length)
        else {
            break;
        };
        near = ray::nearest(fan.graph, &frame.point, near);
        let spacing = spacing[near as usize];
        let curvature = slope / j;
        if !(j > 0.0 && curvature * spacing > -FOCUSED) {
            break;
        }
        let least = BESIDE * spacing / j;
        let found = [-1, 1].map(|side| beside(fan, index, side, least, length));
        let fronts = found.map(|found| {
            let (angle, [spread, slope]) = found?;
            Some((angle * j, slope / spread - curvature))
        });
        let spreads = found.map(|found| {
            let (angle, [spread, _]) = found?;
            Some((angle * j, spread - j))
        });
        let most = MOST_CHANGE / (spacing * spacing);
        samples.push(Sample {
            frame,
            jet: Jet {
                distance: fan.start + length,
                gradient: [1.0, 0.0],
                curvature,
                change: change(fronts).clamp(-most, most),
                heading: Heading {
                    angle: ray.angle,
                    turn: j.recip(),
                    bow: -change(spreads) / (j * j),
                    range: fan.range,
                },
            },
            near,
            doubt: 0.0,
            surface_error: ray.knots[knot].heights.length_error(),
        });
        length += ALONG * spacing;
    }
    samples
}

/// The angle, and J and J' at a length, of a ray to one side of another by at least an angle: nearer ones tell the
/// change of the curvature from its error no better than their distance. `side` is 1 to the left, -1 to the right.
fn beside<const D: usize, P: Copy + Send + Sync>(
    fan: &Fan<D, P>,
    index: usize,
    side: isize,
    least: f64,
    length: f64,
) -> Option<(f64, [f64; 2])> {
    let count = fan.rays.len();
    let most = if fan.range.is_some() {
        count
    } else {
        count / 4
    };
    let mut step = 1;
    while step < most {
        let (other, turn) = fan.beside(index, side * step as isize)?;
        if turn.abs() >= least
            && let Some(jacobi) = other.jacobi(length)
        {
            return Some((turn, jacobi));
        }
        if turn.abs() > FARTHEST * least {
            return None;
        }
        step *= 2;
    }
    None
}

/// The derivative at 0 of a function that is 0 there, from its values on two sides: of the parabola through
/// both, the slope of the line to one, or 0 where nothing is known.
fn change(sides: [Option<(f64, f64)>; 2]) -> f64 {
    match sides {
        [Some((a, fa)), Some((b, fb))] => (fa * b / a - fb * a / b) / (b - a),
        [Some((a, fa)), None] | [None, Some((a, fa))] => fa / a,
        [None, None] => 0.0,
    }
}
