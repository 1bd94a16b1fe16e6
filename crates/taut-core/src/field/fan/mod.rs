//! All the rays that leave a source, as far apart as the nodes of the graph.

mod bundle;
mod samples;

use std::f64::consts::TAU;

use crate::field::dents::Dent;
use crate::field::knot::{Knot, between};
use crate::field::ray::{self, Limits};
use crate::guess::graph::Graph;
use crate::parallel;
use crate::surface::Surface;
pub(crate) use bundle::Bundle;
pub(crate) use samples::Sample;

/// Rays lie at most this many spacings of the graph's nodes apart, or farther where that is a small share of
/// the radius of curvature.
const APART: f64 = 1.5;
const MOST_APART: f64 = 2.5;
const RESOLVED: f64 = 0.25;
/// Neighbouring rays that agree to this share of a radian, or of the length that they leave from, are not parted further.
const NARROWEST: f64 = 1e-9;
/// How many rays to search for a pair's neighbour.
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

/// A ray, with the length from which on it was needed.
struct Ray<const D: usize, P> {
    /// What tells it from those beside it: its angle at a point, or where it leaves a curve.
    angle: f64,
    needed_from: f64,
    knots: Vec<Knot<D, P>>,
    /// A rim ends it.
    stopped: bool,
    /// Of rough edges that it jumps.
    dents: Vec<Dent>,
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

    /// Whether it ends where rays beside it meet it.
    fn meets(&self) -> bool {
        self.knots.last().is_some_and(|last| last.jacobi[0] <= 0.0)
    }

    /// How much longer than the ray the way to a place on it may be, round the dents that it jumps.
    fn detour(&self, length: f64) -> f64 {
        let detours = self.dents.iter().map(|dent| dent.detour(length));
        detours.fold(0.0, f64::max)
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

/// The rays of a bundle.
pub(crate) struct Fan<'a, const D: usize, P> {
    rays: Vec<Ray<D, P>>,
    /// Where rays are told apart between two numbers; the last one then has none to its left.
    range: Option<[f64; 2]>,
    graph: &'a Graph<D, P>,
    spacing: &'a [f64],
    start: f64,
}

/// Where a ray begins between two others.
struct Gap {
    /// The ray to the right, and the angle to the one on its left.
    right: usize,
    angle: f64,
    needed_from: f64,
    begin: f64,
}

impl<'a, const D: usize, P: Copy + Send + Sync> Fan<'a, D, P> {
    /// Shoots rays between neighbours that part, generation by generation and in parallel. `reachable` nodes of the
    /// graph limit their number.
    pub fn new<S: Surface<D, Place = P>>(
        surface: &S,
        bundle: &Bundle<'_, D, P>,
        reachable: usize,
        limits: &Limits<'a, D, P>,
    ) -> Self {
        let shoot = |angle: f64, needed_from: f64, middle: Option<Knot<D, P>>, dents: Vec<Dent>| {
            let start = middle.unwrap_or_else(|| (bundle.knot)(angle));
            let flight = ray::shoot(surface, start, limits);
            Ray {
                angle,
                needed_from,
                knots: flight.knots,
                stopped: flight.stopped,
                dents: [dents, flight.dents].concat(),
            }
        };
        let first = &bundle.first;
        let mut fan = Self {
            rays: parallel::map(first.len(), |i| shoot(first[i], 0.0, None, Vec::new())),
            range: bundle.range(),
            graph: limits.graph,
            spacing: limits.spacing,
            start: bundle.start,
        };
        let mut young = vec![true; fan.rays.len()];
        let mut jets = 0;
        while jets <= MOST_JETS * reachable {
            let gaps = fan.gaps(&young, limits.along);
            if gaps.is_empty() {
                break;
            }
            let shot = parallel::map(gaps.len(), |i| {
                let gap = &gaps[i];
                let pair = fan.neighbours(gap.right, gap.angle, gap.begin);
                // What begins at the source itself is known there.
                let pair = pair.filter(|_| gap.begin > 0.0);
                let middle = pair.and_then(|[right, left]| {
                    let pair = [(&right.0, right.1), (&left.0, left.1)];
                    ray::halfway(surface, limits.graph, pair, gap.angle)
                });
                let angle = fan.rays[gap.right].angle + 0.5 * gap.angle;
                // What begins between two others has passed what they have.
                let dents = if middle.is_some() {
                    fan.dents_before(gap)
                } else {
                    Vec::new()
                };
                shoot(angle, gap.needed_from, middle, dents)
            });
            jets += shot.iter().map(|ray| ray.knots.len()).sum::<usize>();
            let new = gaps.iter().map(|gap| gap.right).zip(shot);
            (fan.rays, young) = merged(fan.rays, new);
        }
        fan
    }

    /// The dents that the rays to both sides of a gap jump before it.
    fn dents_before(&self, gap: &Gap) -> Vec<Dent> {
        let left = self.beside(gap.right, 1).map(|(ray, _)| ray);
        let sides = std::iter::once(&self.rays[gap.right]).chain(left);
        let dents = sides.flat_map(|ray| &ray.dents);
        dents
            .filter(|dent| dent.length < gap.begin)
            .copied()
            .collect()
    }

    /// Neighbouring rays, the index of the first, and the angle between them.
    fn pairs(&self) -> impl Iterator<Item = (usize, [&Ray<D, P>; 2], f64)> {
        (0..self.rays.len()).filter_map(|i| {
            let (left, angle) = self.beside(i, 1)?;
            Some((i, [&self.rays[i], left], angle))
        })
    }

    /// The ray so many places to the left of another, and the angle from that to it; both are negative to the right.
    fn beside(&self, index: usize, places: isize) -> Option<(&Ray<D, P>, f64)> {
        let (here, count) = (&self.rays[index], self.rays.len() as isize);
        let there = index as isize + places;
        if self.range.is_some() {
            let other = self.rays.get(usize::try_from(there).ok()?)?;
            return Some((other, other.angle - here.angle));
        }
        let other = &self.rays[there.rem_euclid(count) as usize];
        let sign = places.signum() as f64;
        Some((
            other,
            sign * (sign * (other.angle - here.angle)).rem_euclid(TAU),
        ))
    }

    /// Where rays are too far apart, one of the two being young, or part at a rim.
    fn gaps(&self, young: &[bool], along: bool) -> Vec<Gap> {
        let spacing = self.spacing;
        let parts_at_rims = along || self.range.is_none();
        let narrowest = NARROWEST * self.range.map_or(1.0, |[from, to]| to - from);
        let gap = |(i, [right, left], angle): (usize, [&Ray<D, P>; 2], f64)| {
            if !(young[i] || young[(i + 1) % young.len()]) || angle <= narrowest {
                return None;
            }
            let parted = |share| {
                let lengths = [right, left].map(|ray| ray.parted(angle, share, spacing));
                lengths.into_iter().flatten().reduce(f64::min)
            };
            let at_rim = || {
                let mut passing = [(right, left), (left, right)]
                    .into_iter()
                    .filter_map(|(ray, other)| ray.passes(other, angle, spacing));
                let (knot, _) = passing.find(|(_, off)| *off > GRAZING)?;
                Some((knot.length - BEFORE * spacing[knot.near as usize]).max(0.0))
            };
            let needed_from = parted(1.0).or_else(|| parts_at_rims.then(at_rim).flatten())?;
            let begin = parted(EARLIER).map_or(needed_from, |begin| begin.min(needed_from));
            let known = right.knots[0].length.max(left.knots[0].length);
            Some(Gap {
                right: i,
                angle,
                needed_from,
                begin: begin.max(known),
            })
        };
        self.pairs().filter_map(gap).collect()
    }

    /// The jets along the rays.
    pub fn samples(&self) -> Vec<Sample<D>> {
        parallel::map(self.rays.len(), |i| samples::samples(self, i)).concat()
    }

    /// Where the rays graze rims.
    pub fn grazes(&self) -> Vec<Graze<D, P>> {
        let graze = |ray: &Ray<D, P>, other: &Ray<D, P>, angle| {
            let (knot, off) = ray.passes(other, angle, self.spacing)?;
            (off <= GRAZING).then_some(Graze {
                distance: self.start + knot.length,
                knot,
                angle: ray.angle,
            })
        };
        let of_pair = |(_, [right, left], angle): (usize, [&Ray<D, P>; 2], f64)| {
            [graze(right, left, angle), graze(left, right, angle)]
        };
        self.pairs().flat_map(of_pair).flatten().collect()
    }

    /// Two neighbouring rays at a length, each with the change of J by the angle, from the rays next to them too.
    fn neighbours(&self, index: usize, angle: f64, length: f64) -> Option<[(Knot<D, P>, f64); 2]> {
        let right = self.rays[index].at(length)?;
        let left = self.beside(index, 1)?.0.at(length)?;
        let mut known = vec![(0.0, right.jacobi[0]), (angle, left.jacobi[0])];
        let most = OUTWARDS.min(self.rays.len() - 1) as isize;
        for (from, sign) in [(0, -1), (1, 1)] {
            let next = (1..=most).find_map(|step| {
                let (ray, turn) = self.beside(index, from + sign * step)?;
                let knot = ray.at(length).filter(|knot| knot.jacobi[0] > 0.0)?;
                Some((turn, knot.jacobi[0]))
            });
            known.extend(next.filter(|next| next.0.abs() <= OUTWARDS as f64 * angle));
        }
        Some([(right, slope_at(&known, 0)), (left, slope_at(&known, 1))])
    }
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
