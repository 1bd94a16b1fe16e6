//! The jets along rays that lie side by side.

use super::Fan;
use crate::field::frame::Frame;
use crate::field::jet::{Jet, WIDE};
use crate::field::knot::Knot;
use crate::field::ray;
use crate::field::sides::{self, Side};

/// Jets along a ray lie so many spacings of the graph's nodes apart.
const ALONG: f64 = 1.0;
/// The change of the front's curvature is found from rays at least this many spacings apart.
const BESIDE: f64 = 0.7;
/// Nor are rays looked at that are farther off than the nearest of use by this factor.
const FARTHEST: f64 = 4.0;
/// A ray is of no use where rays beside it meet it within a spacing over this.
const FOCUSED: f64 = 1.0;
/// A jet may be used as far as the ray beside it, and by this factor farther, whatever else.
const AS_FAR: f64 = 1.1;

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
        if !(j > 0.0 && slope / j * spacing > -FOCUSED) {
            break;
        }
        let least = BESIDE * spacing / j;
        let sides = [-1, 1].map(|side| beside(fan, index, side, least, length));
        let distance = fan.start + length;
        let mut jet = sides::jet(distance, [j, slope], sides, (ray.angle, fan.range), spacing);
        for (side, width) in [-1, 1].into_iter().zip(&mut jet.width) {
            let [next, last] = room(fan, index, side, WIDE * spacing / j, length);
            if fan.range.is_none() {
                *width = width.min(last * j).max(AS_FAR * next * j);
            }
        }
        samples.push(Sample {
            frame,
            jet,
            near,
            doubt: 0.0,
            surface_error: ray.knots[knot].heights.length_error() + ray.detour(length),
        });
        length += ALONG * spacing;
    }
    samples
}

/// The angles on one side to the next ray that goes as far as a length, and to where such rays end: at the last one before rays
/// that met those beside them earlier, or at a ray that a rim stopped; `most` where neither is within that.
fn room<const D: usize, P: Copy + Send + Sync>(
    fan: &Fan<D, P>,
    index: usize,
    side: isize,
    most: f64,
    length: f64,
) -> [f64; 2] {
    let (mut next, mut last) = (None, 0.0);
    for step in 1..fan.rays.len() as isize {
        let Some((other, turn)) = fan.beside(index, side * step) else {
            break;
        };
        if other.end() < length {
            if other.meets() {
                return [next.unwrap_or(0.0), last];
            }
            if other.stopped {
                return [next.unwrap_or(turn.abs()), turn.abs()];
            }
            continue;
        }
        if other
            .knots
            .first()
            .is_some_and(|first| first.length <= length)
        {
            last = turn.abs();
            next = next.or(Some(last));
        }
        if turn.abs() > most {
            break;
        }
    }
    [next.unwrap_or(most), most]
}

/// A ray to one side of another by at least an angle, at a length: nearer ones tell the
/// change of the curvature from its error no better than their distance. `side` is 1 to the left, -1 to the right.
fn beside<const D: usize, P: Copy + Send + Sync>(
    fan: &Fan<D, P>,
    index: usize,
    side: isize,
    least: f64,
    length: f64,
) -> Option<Side> {
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
            return Some(Side {
                angle: turn,
                jacobi,
            });
        }
        if turn.abs() > FARTHEST * least {
            return None;
        }
        step *= 2;
    }
    None
}
