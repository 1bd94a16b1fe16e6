//! All the rays that leave a source, as far apart as the nodes of the graph.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::Vector;
use crate::correction::length::HeightErrors;
use crate::field::frame::Frame;
use crate::field::jet::{Heading, Jet};
use crate::field::ray::{self, Knot, Limits};
use crate::guess::graph::Graph;
use crate::surface::{Node, Surface};

/// Rays that leave every source.
const FIRST_RAYS: usize = 32;
/// Rays lie at most this many spacings of the graph's nodes apart, or farther where that is a small share of
/// the radius of curvature; and their jets along them.
const APART: f64 = 1.5;
const MOST_APART: f64 = 2.5;
const RESOLVED: f64 = 0.25;
const ALONG: f64 = 1.0;
/// The change of the front's curvature is found from rays at least this many spacings apart.
const BESIDE: f64 = 0.7;
/// Nor are rays looked at that are farther off than the nearest of use by this factor.
const FARTHEST: f64 = 4.0;
/// A ray is of no use where rays beside it meet it within a spacing over this.
const FOCUSED: f64 = 1.0;
/// Most change of the front's curvature, times the square of the spacing.
const MOST_CHANGE: f64 = 0.1;
/// Neighbouring rays whose directions agree to this are not parted further.
const NARROWEST: f64 = 1e-9;
/// Rays looked through for the next one beside a pair, which may be so many times as far off as the pair's.
const OUTWARDS: usize = 4;
/// Rays begin between others where these are so much nearer to each other than they may be.
const EARLIER: f64 = 0.5;
/// A ray that a rim ends casts a shadow where the one beside it goes on by so many spacings, ...
const SHADOW: f64 = 1.0;
/// ... and that one grazes the rim where it is no farther off than this many.
const GRAZING: f64 = 0.03;
/// Rays put between two for that start so many spacings before.
const BEFORE: f64 = 2.0;
/// Most jets for each node that a source may reach.
const MOST_JETS: usize = 16;

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

/// A ray, with the length from which on it was needed.
struct Ray<const D: usize, P> {
    angle: f64,
    needed_from: f64,
    knots: Vec<Knot<D, P>>,
    /// A rim ends it.
    stopped: bool,
}

/// Where a ray grazes a rim.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Graze<const D: usize, P> {
    pub knot: Knot<D, P>,
    pub distance: f64,
    /// The ray's at the source.
    pub angle: f64,
}

impl<const D: usize, P: Copy> Ray<D, P> {
    /// Where it ends: at the last knot or where J becomes 0.
    fn end(&self) -> f64 {
        match &self.knots[..] {
            [.., a, b] if b.jacobi[0] <= 0.0 => {
                a.length + (b.length - a.length) * a.jacobi[0] / (a.jacobi[0] - b.jacobi[0])
            }
            [.., last] => last.length,
            [] => 0.0,
        }
    }

    /// The ray at a length between its first and last knot.
    fn at(&self, length: f64) -> Option<Knot<D, P>> {
        let after = self.knots.partition_point(|knot| knot.length < length);
        let next = self.knots.get(after)?;
        if next.length == length {
            return Some(*next);
        }
        between([self.knots.get(after.checked_sub(1)?)?, next], length)
    }

    /// J and J'; `None` beyond the end.
    fn jacobi(&self, length: f64) -> Option<[f64; 2]> {
        let inside = length > 0.0 && length <= self.end();
        let [j, slope] = self.at(length).filter(|_| inside)?.jacobi;
        (j > 0.0).then_some([j, slope])
    }

    /// Where the edge is that a ray beside it, `angle` off, runs into and this one passes, and how far off that ray is
    /// there.
    fn passes(&self, other: &Self, angle: f64, spacing: &[f64]) -> Option<(Knot<D, P>, f64)> {
        let last = other.knots.last().filter(|_| other.stopped)?;
        let spacing = spacing[last.near as usize];
        let farther = self.end() - last.length > SHADOW * spacing;
        let knot = self.at(last.length).filter(|_| farther)?;
        let apart = knot.jacobi[0].max(last.jacobi[0]) * angle;
        let (place, near) = (last.place, last.near);
        Some((
            Knot {
                place,
                near,
                ..knot
            },
            apart / spacing,
        ))
    }

    /// The first length at which a ray at an angle beside it is too far off, or at a share of that.
    fn parted(&self, angle: f64, share: f64, spacing: &[f64]) -> Option<f64> {
        let far = |knot: &Knot<D, P>| {
            let spacing = spacing[knot.near as usize];
            let resolved = RESOLVED / knot.frame.curvature();
            let most = resolved.clamp(APART * spacing, MOST_APART * spacing);
            knot.jacobi[0] * angle > share * most
        };
        let found = self.knots.iter().position(far)?;
        Some(self.knots[found.saturating_sub(1)].length)
    }
}

/// The jets along the rays of a source, which lies at a node with its frame, near a node of the graph, all of them or
/// those between two angles; and where they graze rims.
///
/// Rays are shot between neighbours that part, generation by generation and in parallel.
pub(crate) fn fan<const D: usize, S: Surface<D>>(
    surface: &S,
    source: (&Node<D, S::Place>, &Frame<D>, u32),
    angles: Option<[f64; 2]>,
    start: f64,
    reachable: usize,
    limits: &Limits<D, S::Place>,
) -> (Vec<Sample<D>>, Vec<Graze<D, S::Place>>) {
    let (graph, spacing) = (limits.graph, limits.spacing);
    let (node, frame, near) = source;
    let shoot = |angle: f64, needed_from: f64, middle: Option<Knot<D, S::Place>>| {
        let start = middle.unwrap_or_else(|| Knot {
            length: 0.0,
            frame: frame.turned([angle.cos(), angle.sin()]),
            jacobi: [0.0, 1.0],
            place: node.place,
            near,
            heights: HeightErrors::default(),
        });
        let (knots, stopped) = ray::shoot(surface, start, limits);
        Ray {
            angle,
            needed_from,
            knots,
            stopped,
        }
    };
    let apart = TAU / FIRST_RAYS as f64;
    let first: Vec<f64> = match angles {
        None => (0..FIRST_RAYS).map(|i| apart * i as f64).collect(),
        Some([from, to]) => {
            let steps = ((to - from) / apart).ceil().max(1.0);
            let angle = |i: usize| from + (to - from) * i as f64 / steps;
            (0..=steps as usize).map(angle).collect()
        }
    };
    let mut rays: Vec<Ray<D, S::Place>> = first
        .into_par_iter()
        .map(|angle| shoot(angle, 0.0, None))
        .collect();
    // In a sector the last ray has none to its left.
    let pairs = |count: usize| count - usize::from(angles.is_some());
    let mut young = vec![true; rays.len()];
    let mut jets = 0;
    while jets <= MOST_JETS * reachable {
        let count = rays.len();
        let between: Vec<(usize, f64, f64, f64)> = (0..pairs(count))
            .filter(|i| young[*i] || young[(i + 1) % count])
            .filter_map(|i| {
                let (left, right) = (&rays[i], &rays[(i + 1) % count]);
                let angle = (right.angle - left.angle).rem_euclid(TAU);
                let parted = |share| {
                    let lengths = [left, right].map(|ray| ray.parted(angle, share, spacing));
                    lengths.into_iter().flatten().reduce(f64::min)
                };
                let from = parted(1.0).or_else(|| {
                    if !limits.along {
                        return None;
                    }
                    let mut passing = [(left, right), (right, left)]
                        .into_iter()
                        .filter_map(|(ray, other)| ray.passes(other, angle, spacing));
                    let (knot, _) = passing.find(|(_, off)| *off > GRAZING)?;
                    Some((knot.length - BEFORE * spacing[knot.near as usize]).max(0.0))
                })?;
                let begin = parted(EARLIER).map_or(from, |begin| begin.min(from));
                let begin = begin.max(left.knots[0].length).max(right.knots[0].length);
                (angle > NARROWEST).then_some((i, angle, from, begin))
            })
            .collect();
        if between.is_empty() {
            break;
        }
        let shot: Vec<Ray<D, S::Place>> = between
            .par_iter()
            .map(|(i, angle, from, begin)| {
                let pair = neighbours(&rays, *i, *angle, *begin);
                let middle = pair.and_then(|[left, right]| {
                    let pair = [(&left.0, left.1), (&right.0, right.1)];
                    ray::halfway(surface, graph, pair, *angle)
                });
                shoot(rays[*i].angle + 0.5 * angle, *from, middle)
            })
            .collect();
        jets += shot.iter().map(|ray| ray.knots.len()).sum::<usize>();
        (rays, young) = merged(rays, between.iter().map(|b| b.0).zip(shot));
    }
    let count = rays.len();
    let samples = (0..count)
        .into_par_iter()
        .flat_map_iter(|i| samples(&rays, i, graph, spacing, start))
        .collect();
    let grazes = (0..pairs(count)).flat_map(|i| {
        let (left, right) = (&rays[i], &rays[(i + 1) % count]);
        let angle = (right.angle - left.angle).rem_euclid(TAU);
        [(left, right), (right, left)]
            .into_iter()
            .filter_map(move |(ray, other)| {
                let (knot, off) = ray.passes(other, angle, spacing)?;
                (off <= GRAZING).then_some(Graze {
                    distance: start + knot.length,
                    knot,
                    angle: ray.angle,
                })
            })
            .collect::<Vec<_>>()
    });
    (samples, grazes.collect())
}

/// Two neighbouring rays at a length, each with the change of J by the angle, from the rays next to them too.
fn neighbours<const D: usize, P: Copy>(
    rays: &[Ray<D, P>],
    index: usize,
    angle: f64,
    length: f64,
) -> Option<[(Knot<D, P>, f64); 2]> {
    let count = rays.len();
    let (left, right) = (
        rays[index].at(length)?,
        rays[(index + 1) % count].at(length)?,
    );
    let mut known = vec![(0.0, left.jacobi[0]), (angle, right.jacobi[0])];
    for (from, sign) in [(index, -1.0), (index + 1, 1.0)] {
        let next = (1..=OUTWARDS).find_map(|step| {
            let ray = &rays[if sign > 0.0 {
                from + step
            } else {
                from + count - step
            } % count];
            let turn = sign * (sign * (ray.angle - rays[index].angle)).rem_euclid(TAU);
            let knot = ray.at(length).filter(|knot| knot.jacobi[0] > 0.0)?;
            Some((turn, knot.jacobi[0]))
        });
        known.extend(next.filter(|next| next.0.abs() <= OUTWARDS as f64 * angle));
    }
    Some([(left, slope_at(&known, 0)), (right, slope_at(&known, 1))])
}

/// The derivative, at one of its nodes, of the polynomial through values at some nodes.
fn slope_at(nodes: &[(f64, f64)], index: usize) -> f64 {
    let (x, value) = nodes[index];
    let others = || nodes.iter().enumerate().filter(move |(j, _)| *j != index);
    let terms = others().map(|(j, (xj, vj))| {
        let weights = others().filter(|(i, _)| *i != j);
        let weight: f64 = weights.map(|(_, (xi, _))| (x - xi) / (xj - xi)).product();
        (vj - value) / (xj - x) * weight
    });
    terms.sum()
}

/// The ray between two knots: quintic in the point, whose first two derivatives the knots know, and in J.
/// Place, nearest node and height errors are the first knot's.
pub(crate) fn between<const D: usize, P: Copy>(
    pair: [&Knot<D, P>; 2],
    length: f64,
) -> Option<Knot<D, P>> {
    let [a, b] = pair;
    let h = b.length - a.length;
    let s = (length - a.length) / h;
    let (value, slope) = hermite(s);
    let mix = |w: &[f64; 6], a: [Vector<D>; 3], b: [Vector<D>; 3]| {
        a[0] * w[0]
            + a[1] * (w[1] * h)
            + a[2] * (w[2] * h * h)
            + b[0] * w[3]
            + b[1] * (w[4] * h)
            + b[2] * (w[5] * h * h)
    };
    let known = |k: &Knot<D, P>| [k.frame.point, k.frame.tangents[0], k.frame.second[0]];
    let point = mix(&value, known(a), known(b));
    let t = (mix(&slope, known(a), known(b)) / h).normalize();
    let side = a.frame.tangents[1] * (1.0 - s) + b.frame.tangents[1] * s;
    let side = (side - t * t.dot(&side)).try_normalize(1e-6)?;
    let second = std::array::from_fn(|i| a.frame.second[i] * (1.0 - s) + b.frame.second[i] * s);
    let spread = |k: &Knot<D, P>| [k.jacobi[0], k.jacobi[1], -k.frame.gauss * k.jacobi[0]];
    let (ja, jb) = (spread(a), spread(b));
    let mix = |w: &[f64; 6]| {
        ja[0] * w[0]
            + ja[1] * w[1] * h
            + ja[2] * w[2] * h * h
            + jb[0] * w[3]
            + jb[1] * w[4] * h
            + jb[2] * w[5] * h * h
    };
    Some(Knot {
        length,
        frame: Frame::of_forms(point, [t, side], second),
        jacobi: [mix(&value), mix(&slope) / h],
        ..*a
    })
}

/// Weights of value, slope and second derivative at 0 and then at 1 of the quintic at s, and of its slope.
fn hermite(s: f64) -> ([f64; 6], [f64; 6]) {
    let (s2, s3) = (s * s, s * s * s);
    let (s4, s5) = (s2 * s2, s2 * s3);
    (
        [
            1.0 - 10.0 * s3 + 15.0 * s4 - 6.0 * s5,
            s - 6.0 * s3 + 8.0 * s4 - 3.0 * s5,
            0.5 * s2 - 1.5 * s3 + 1.5 * s4 - 0.5 * s5,
            10.0 * s3 - 15.0 * s4 + 6.0 * s5,
            -4.0 * s3 + 7.0 * s4 - 3.0 * s5,
            0.5 * s3 - s4 + 0.5 * s5,
        ],
        [
            -30.0 * s2 + 60.0 * s3 - 30.0 * s4,
            1.0 - 18.0 * s2 + 32.0 * s3 - 15.0 * s4,
            s - 4.5 * s2 + 6.0 * s3 - 2.5 * s4,
            30.0 * s2 - 60.0 * s3 + 30.0 * s4,
            -12.0 * s2 + 28.0 * s3 - 15.0 * s4,
            1.5 * s2 - 4.0 * s3 + 2.5 * s4,
        ],
    )
}

/// The rays with new ones, each after the one of an index, and which are new.
fn merged<R>(old: Vec<R>, new: impl Iterator<Item = (usize, R)>) -> (Vec<R>, Vec<bool>) {
    let mut new = new.peekable();
    let (mut rays, mut young) = (Vec::new(), Vec::new());
    for (i, ray) in old.into_iter().enumerate() {
        rays.push(ray);
        young.push(false);
        if let Some((_, ray)) = new.next_if(|next| next.0 == i) {
            rays.push(ray);
            young.push(true);
        }
    }
    (rays, young)
}

/// The jets along a ray from where on it is needed.
fn samples<const D: usize, P: Copy>(
    rays: &[Ray<D, P>],
    index: usize,
    graph: &Graph<D, P>,
    spacing: &[f64],
    start: f64,
) -> Vec<Sample<D>> {
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
        near = ray::nearest(graph, &frame.point, near);
        let spacing = spacing[near as usize];
        let curvature = slope / j;
        if !(j > 0.0 && curvature * spacing > -FOCUSED) {
            break;
        }
        let least = BESIDE * spacing / j;
        let found = [false, true].map(|left| beside(rays, index, left, least, length));
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
                distance: start + length,
                gradient: [1.0, 0.0],
                curvature,
                change: change(fronts).clamp(-most, most),
                heading: Heading {
                    angle: ray.angle,
                    turn: j.recip(),
                    bow: -change(spreads) / (j * j),
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

/// The angle, and J and J' at a length, of a ray to the left or right of another by at least an angle: nearer
/// ones tell the change of the curvature from its error no better than their distance.
fn beside<const D: usize, P: Copy>(
    rays: &[Ray<D, P>],
    index: usize,
    left: bool,
    least: f64,
    length: f64,
) -> Option<(f64, [f64; 2])> {
    let count = rays.len();
    let mut step = 1;
    while step < count / 4 {
        let other = if left {
            index + step
        } else {
            index + count - step
        } % count;
        let turn = (rays[other].angle - rays[index].angle).rem_euclid(TAU);
        let turn = if left { turn } else { turn - TAU };
        if turn.abs() >= least
            && let Some(jacobi) = rays[other].jacobi(length)
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
