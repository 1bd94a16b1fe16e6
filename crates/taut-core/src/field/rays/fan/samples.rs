//! The jets along rays that lie side by side.

use super::Fan;
use crate::field::rays::frame::Frame;
use crate::field::rays::jet::{Jet, WIDE};
use crate::field::rays::knot::Knot;
use crate::field::rays::ray;
use crate::field::rays::sides::{self, Side};

/// Distance of the jets along a ray, in spacings of the graph's nodes.
pub(crate) const JETS_ALONG: f64 = 1.0;
/// Least distance, in spacings of the graph's nodes, of the rays from which the derivative of the
/// front curvature is found.
const RAYS_BESIDE: f64 = 0.7;
/// Farthest ray that is looked at for the derivative of the front curvature, as a multiple of the
/// least distance of useful rays.
const FARTHEST_RAY: f64 = 4.0;
/// A ray is of no use where rays beside it meet it within the spacing divided by this.
pub(crate) const USELESS_FOCUS: f64 = 1.0;
/// Factor of the distance to the next ray within which a jet may always be used.
const AS_FAR: f64 = 1.1;

/// A jet on a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample<const D: usize> {
    pub frame: Frame<D>,
    pub jet: Jet,
    /// The nearest node of the graph.
    pub near: u32,
    /// Estimated error of the distance because of the surface's error and of dents that the ray
    /// jumps, in the input's units.
    pub surface_error: f64,
    /// How much shorter than others the jet's distance must be to be believed, in the input's
    /// units.
    pub doubt: f64,
}

/// The jets along a ray, from the length on at which the ray is needed.
pub(in crate::field) fn samples<const D: usize, P: Copy + Send + Sync>(
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
    let mut length = ray
        .needed_from
        .max(0.5 * JETS_ALONG * spacing[near as usize]);
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
        // Jets are of no use beyond where rays meet, and shortly before.
        if !(j > 0.0 && slope / j * spacing > -USELESS_FOCUS) {
            break;
        }
        let least = RAYS_BESIDE * spacing / j;
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
        length += JETS_ALONG * spacing;
    }
    samples
}

/// Two angles on one side of a ray: to the next ray that goes as far as a length, and to where such
/// rays end. They end at the last ray before rays that met those beside them earlier, or at a ray
/// that a rim stopped. Each is `most` where there is none within that angle.
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

/// A ray on one side of another, at least at an angle from it, at a length. From nearer rays the
/// derivative of the front curvature is not known better than its error over their distance. `side`
/// is 1 to the left, -1 to the right.
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
        if turn.abs() > FARTHEST_RAY * least {
            return None;
        }
        step *= 2;
    }
    None
}
