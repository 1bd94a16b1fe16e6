//! All the rays that leave a source, as close together as the nodes of the graph: where two
//! neighbouring rays part too far, or part at a rim (the boundary of the surface), more rays are
//! put between them.

mod bundle;
pub(in crate::field) mod samples;

use std::f64::consts::TAU;

use crate::field::rays::dents::Dent;
use crate::field::rays::knot::{Knot, between};
use crate::field::rays::ray::{self, Limits};
use crate::guess::graph::Graph;
use crate::parallel;
use crate::surface::Surface;
pub(crate) use bundle::Bundle;
pub(crate) use samples::Sample;

/// Largest distance between neighbouring rays, in spacings of the graph's nodes, where the surface
/// curves much.
const RAYS_APART: f64 = 1.5;
/// Largest distance between neighbouring rays, in spacings of the graph's nodes, where the surface
/// curves little.
const MOST_RAYS_APART: f64 = 2.5;
/// Share of the radius of curvature up to which neighbouring rays may be farther apart than
/// [`RAYS_APART`] spacings, but not than [`MOST_RAYS_APART`].
const RAYS_RESOLVED: f64 = 0.25;
/// Least difference between neighbouring rays at which more are put between them, in radians, or as
/// a share of the length of the curve that they leave from.
const NARROWEST_PAIR: f64 = 1e-9;
/// Number of rays to each side of a pair among which its neighbour is searched for; the neighbour
/// may be this many times as far off as the rays of the pair are from each other.
const OUTWARDS: usize = 4;
/// Distance of two neighbouring rays, as a share of their largest distance, at which a ray between
/// them begins.
const EARLIER: f64 = 0.5;
/// Least length, in spacings of the graph's nodes, by which a ray must go on past the end of a
/// neighbour that a rim stops, for the rim to cast a shadow there.
const SHADOW: f64 = 1.0;
/// Largest distance to a neighbour that a rim stops, in spacings of the graph's nodes, at which a
/// ray grazes the rim.
const GRAZING: f64 = 0.03;
/// Length before the rim, in spacings of the graph's nodes, from which rays put between two for its
/// sake start.
const BEFORE: f64 = 2.0;
/// Most jets for each node that a source may reach; no more rays are put between others above it.
const MOST_RAY_JETS: usize = 16;

/// A ray, with the length from which on it was needed.
struct Ray<const D: usize, P> {
    /// What tells the ray from those beside it: its angle at a point, in radians, or its place on
    /// the curve that it leaves, in the input's units.
    angle: f64,
    /// The length from which on jets are taken from the ray: before it, the rays beside it are
    /// close enough together.
    needed_from: f64,
    knots: Vec<Knot<D, P>>,
    /// Whether a rim ends the ray.
    stopped: bool,
    /// The dents of rough rims that the ray jumps.
    dents: Vec<Dent>,
}

/// A place where a ray grazes a rim.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Graze<const D: usize, P> {
    pub knot: Knot<D, P>,
    /// The distance there, in the input's units.
    pub distance: f64,
    /// The angle at the source of the ray, or its place on the curve that it leaves.
    pub angle: f64,
}

impl<const D: usize, P: Copy> Ray<D, P> {
    /// The length at which the ray ends: at the last knot, or where J becomes 0.
    fn end(&self) -> f64 {
        match &self.knots[..] {
            [.., a, b] if b.jacobi[0] <= 0.0 => {
                a.length + (b.length - a.length) * a.jacobi[0] / (a.jacobi[0] - b.jacobi[0])
            }
            [.., last] => last.length,
            [] => 0.0,
        }
    }

    /// Whether the ray ends where rays beside it meet it.
    fn meets(&self) -> bool {
        self.knots.last().is_some_and(|last| last.jacobi[0] <= 0.0)
    }

    /// How much longer than the ray the way to a place on it may be, round the dents that it jumps.
    fn detour(&self, length: f64) -> f64 {
        let detours = self.dents.iter().map(|dent| dent.detour(length));
        detours.fold(0.0, f64::max)
    }

    /// The knot at a length between the ray's first and last knot.
    fn at(&self, length: f64) -> Option<Knot<D, P>> {
        let after = self.knots.partition_point(|knot| knot.length < length);
        let next = self.knots.get(after)?;
        if next.length == length {
            return Some(*next);
        }
        between([self.knots.get(after.checked_sub(1)?)?, next], length)
    }

    /// The Jacobi field J and its derivative J' at a length; `None` beyond the end.
    fn jacobi(&self, length: f64) -> Option<[f64; 2]> {
        let inside = length > 0.0 && length <= self.end();
        let [j, slope] = self.at(length).filter(|_| inside)?.jacobi;
        (j > 0.0).then_some([j, slope])
    }

    /// The place where this ray passes a rim that another ray, `angle` beside it, runs into, and
    /// how far off that ray is there, in spacings of the graph's nodes.
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

    /// The first length at which a ray at an angle beside this one is too far off; with a `share`,
    /// the length at which it is off by this share of that distance.
    fn parted(&self, angle: f64, share: f64, spacing: &[f64]) -> Option<f64> {
        let far = |knot: &Knot<D, P>| {
            let spacing = spacing[knot.near as usize];
            let resolved = RAYS_RESOLVED / knot.frame.curvature();
            let most = resolved.clamp(RAYS_APART * spacing, MOST_RAYS_APART * spacing);
            knot.jacobi[0] * angle > share * most
        };
        let found = self.knots.iter().position(far)?;
        Some(self.knots[found.saturating_sub(1)].length)
    }
}

/// The rays of a bundle.
pub(crate) struct Fan<'a, const D: usize, P> {
    rays: Vec<Ray<D, P>>,
    /// The range of the rays' angles or places, if it has ends; the last ray then has none to its
    /// left. `None` where rays go all round.
    range: Option<[f64; 2]>,
    graph: &'a Graph<D, P>,
    spacing: &'a [f64],
    start: f64,
}

/// A gap between two rays, in which a ray is to begin.
struct Gap {
    /// The index of the ray to the right.
    right: usize,
    /// The angle from the ray on the right to the ray on the left.
    angle: f64,
    /// The length from which on the new ray is needed.
    needed_from: f64,
    /// The length at which the new ray begins.
    begin: f64,
}

impl<'a, const D: usize, P: Copy + Send + Sync> Fan<'a, D, P> {
    /// Shoots rays between neighbours that part, generation by generation and in parallel.
    /// `reachable`, the number of graph nodes that may be reached, limits the number of rays.
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
        while jets <= MOST_RAY_JETS * reachable {
            let gaps = fan.gaps(&young, limits.along);
            if gaps.is_empty() {
                break;
            }
            let shot = parallel::map(gaps.len(), |i| {
                let gap = &gaps[i];
                let pair = fan.neighbours(gap.right, gap.angle, gap.begin);
                // A ray that begins at the source itself is known there.
                let pair = pair.filter(|_| gap.begin > 0.0);
                let middle = pair.and_then(|[right, left]| {
                    let pair = [(&right.0, right.1), (&left.0, left.1)];
                    ray::halfway(surface, limits.graph, pair, gap.angle)
                });
                let angle = fan.rays[gap.right].angle + 0.5 * gap.angle;
                // A ray that begins between two others has passed the dents that they have passed.
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

    /// The dents that the rays on both sides of a gap jump before it.
    fn dents_before(&self, gap: &Gap) -> Vec<Dent> {
        let left = self.beside(gap.right, 1).map(|(ray, _)| ray);
        let sides = std::iter::once(&self.rays[gap.right]).chain(left);
        let dents = sides.flat_map(|ray| &ray.dents);
        dents
            .filter(|dent| dent.length < gap.begin)
            .copied()
            .collect()
    }

    /// All pairs of neighbouring rays, with the index of the right one and the angle between them.
    fn pairs(&self) -> impl Iterator<Item = (usize, [&Ray<D, P>; 2], f64)> {
        (0..self.rays.len()).filter_map(|i| {
            let (left, angle) = self.beside(i, 1)?;
            Some((i, [&self.rays[i], left], angle))
        })
    }

    /// The ray `places` to the left of another, and the angle from that one to it; both are
    /// negative to the right.
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

    /// The gaps where rays are too far apart, or part at a rim. One of the two rays must be young
    /// (new in this generation).
    fn gaps(&self, young: &[bool], along: bool) -> Vec<Gap> {
        let spacing = self.spacing;
        let parts_at_rims = along || self.range.is_none();
        let narrowest = NARROWEST_PAIR * self.range.map_or(1.0, |[from, to]| to - from);
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

    /// The jets along all rays.
    pub fn samples(&self) -> Vec<Sample<D>> {
        parallel::map(self.rays.len(), |i| samples::samples(self, i)).concat()
    }

    /// The places where the rays graze rims.
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

    /// Two neighbouring rays at a length, each with the derivative of J by the angle, for which the
    /// rays next to the pair are used too.
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

/// Merges new rays into the old ones, each after the ray of an index, and tells which rays are new.
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
