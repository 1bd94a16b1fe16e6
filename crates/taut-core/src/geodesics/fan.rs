//! Every geodesic of a two-dimensional surface from one point to another that may be the shortest.
//! Rays are shot in all directions, and the directions between them in which rays meet the target
//! are found.
//!
//! How far a ray misses the target is a smooth function of its angle, whose derivative the Jacobi
//! field knows. Where the function vanishes a geodesic arrives. Rays are put between others until a
//! cubic through both neighbours tells where that is, or until both stay clear of the target.

use std::f64::consts::TAU;

use crate::geodesics::ray::{Aim, Pass, Ray};
use crate::order::sort_by_number;
use crate::surface::{Node, Surface};

/// A geodesic that reaches the target without a conjugate point on the way.
#[derive(Clone, Debug)]
pub(crate) struct Arrival<const D: usize, P> {
    pub ray: Ray<D, P>,
    pub pass: Pass<D, P>,
}

impl<const D: usize, P> Arrival<D, P> {
    /// The length of the geodesic, as far as the shot tells.
    pub fn length(&self) -> f64 {
        self.pass.knot.length + self.pass.miss.abs()
    }

    /// The angle by which the geodesic turns with the surface, in radians.
    pub fn turning(&self) -> f64 {
        let steps = self.ray.knots.windows(2);
        let within = steps.take_while(|pair| pair[0].length < self.pass.knot.length);
        within
            .map(|pair| pair[0].normal_curvature.norm() * (pair[1].length - pair[0].length))
            .sum()
    }
}

/// What the rays from one point find out about another point.
#[derive(Clone, Debug)]
pub(crate) struct Sweep<const D: usize, P> {
    /// The geodesics that reach the target, shortest first.
    pub arrivals: Vec<Arrival<D, P>>,
    /// Whether rays were everywhere dense enough that no arrival up to the length asked for was
    /// missed.
    pub covered: bool,
}

/// Number of rays that are shot first, evenly spaced.
const FIRST_SWEEP_RAYS: usize = 16;
/// Narrowest angle between rays, in radians.
const NARROWEST_GAP: f64 = 1e-4;
/// Relative error of steps that is allowed at first.
const TOLERANCE: f64 = 1e-6;
/// Least relative error of steps that is asked for.
const LEAST_TOLERANCE: f64 = 1e-13;
/// Relative error of steps that is wanted, as a share of the largest miss over the scale.
const OF_MISSES: f64 = 1e-4;
/// Misses below this many errors of a ray count as none.
const DEGENERATE: f64 = 30.0;
/// Largest miss of a ray beside a gap, in units of what the gap spreads to, at which the gap may
/// hold an arrival.
const POSSIBLE: f64 = 2.0;
/// Largest difference between the miss of the ray halfway and what the cubic says, as a share of
/// the largest of the three misses, at which the cubic is trusted.
const TRUSTED_CUBIC: f64 = 0.02;
/// Largest difference of length between the passes of neighbouring rays that belong together, as a
/// share of the length, beyond what the rays spread to and miss by.
const PASSES_TOGETHER: f64 = 0.02;
/// Largest miss of an arrival, as a share of the scale, unless the bracket allows no less.
const MISS_FOUND: f64 = 1e-12;
/// Most shots to find an arrival.
const MOST_ARRIVAL_SHOTS: usize = 40;

/// The rays from one node, and what is found between them.
struct Fan<'a, const D: usize, S: Surface<D>> {
    aim: &'a Aim<'a, D, S>,
    from: Node<D, S::Place>,
    longest: f64,
    tolerance: f64,
    /// Misses below this length count as none.
    floor: f64,
    rays: usize,
    most_rays: usize,
    /// Pairs of neighbouring rays between which an arrival lies, with their passes.
    brackets: Vec<[BracketEnd; 2]>,
    /// Rays that pass the target closer than they can tell, by angle and length.
    touching: Vec<(f64, f64)>,
    covered: bool,
}

/// How a ray at an end of a bracket passes the target.
#[derive(Clone, Copy, Debug)]
struct BracketEnd {
    angle: f64,
    length: f64,
    miss: f64,
    jacobi: f64,
    /// The derivative J' of the Jacobi field.
    slope: f64,
    minimal: bool,
}

/// The geodesics up to a length from a node to the target, found by at most `most_rays` rays;
/// `None` where the node has no tangent plane.
pub(crate) fn sweep<const D: usize, S: Surface<D>>(
    aim: &Aim<D, S>,
    from: &Node<D, S::Place>,
    longest: f64,
    most_rays: usize,
) -> Option<Sweep<D, S::Place>> {
    let mut fan = Fan {
        aim,
        from: *from,
        longest,
        tolerance: TOLERANCE,
        floor: 0.0,
        rays: 0,
        most_rays,
        brackets: Vec::new(),
        touching: Vec::new(),
        covered: true,
    };
    let first = fan.first_rays()?;
    for i in 0..FIRST_SWEEP_RAYS {
        let mut next = first[(i + 1) % FIRST_SWEEP_RAYS].clone();
        next.angle = TAU * (i + 1) as f64 / FIRST_SWEEP_RAYS as f64;
        fan.between(&first[i], &next, false);
    }
    let mut arrivals: Vec<Arrival<D, S::Place>> = Vec::new();
    let mut brackets = std::mem::take(&mut fan.brackets);
    sort_by_number(&mut brackets, |bracket| about(bracket)[0]);
    // The shortest come first, and brackets whose arrivals must be longer than one that is found
    // are left out.
    for bracket in brackets {
        let [length, slack] = about(&bracket);
        if arrivals.iter().any(|best| best.length() < length - slack) {
            continue;
        }
        let Some(arrival) = fan.arrive(&bracket) else {
            fan.covered = false;
            continue;
        };
        arrivals.extend(arrival.pass.minimal.then_some(arrival));
    }
    sort_by_number(&mut fan.touching, |ray| ray.0);
    sort_by_number(&mut fan.touching, |ray| ray.1);
    // All these rays are as long as each other as far as a ray can tell, as all meridians from pole
    // to pole are.
    for (angle, length) in fan.touching.iter().take(2) {
        arrivals.extend(fan.shot(*angle, *length));
    }
    sort_by_number(&mut arrivals, Arrival::length);
    Some(Sweep {
        arrivals,
        covered: fan.covered,
    })
}

impl<const D: usize, S: Surface<D>> Fan<'_, D, S> {
    /// Shoots rays in evenly spaced directions, with errors well below what they miss the target
    /// by.
    fn first_rays(&mut self) -> Option<Vec<Ray<D, S::Place>>> {
        loop {
            let rays = (0..FIRST_SWEEP_RAYS).map(|i| {
                let angle = TAU * i as f64 / FIRST_SWEEP_RAYS as f64;
                self.aim
                    .shoot(&self.from, angle, self.longest, self.tolerance)
            });
            let rays: Vec<_> = rays.collect::<Option<_>>()?;
            let misses = rays.iter().map(|ray| {
                let all = ray.passes.iter().map(|pass| pass.miss.abs());
                all.reduce(f64::min).unwrap_or(f64::INFINITY)
            });
            let wanted = OF_MISSES * misses.fold(0.0, f64::max) / self.aim.scale;
            if wanted >= self.tolerance || self.tolerance <= LEAST_TOLERANCE {
                self.rays = FIRST_SWEEP_RAYS;
                let errors = self.tolerance.max(self.aim.roughness(&self.from));
                self.floor = DEGENERATE * errors * self.aim.scale;
                return Some(rays);
            }
            self.tolerance = (0.1 * wanted).max(LEAST_TOLERANCE);
        }
    }

    /// Finds the arrivals between two rays. `trusted` says that cubics were right on a gap twice as
    /// wide.
    fn between(&mut self, a: &Ray<D, S::Place>, b: &Ray<D, S::Place>, trusted: bool) {
        let turn = b.angle - a.angle;
        if !(a.complete && b.complete) {
            self.covered = false;
        }
        let sides = |ray: &Ray<D, S::Place>| -> Vec<BracketEnd> {
            let passes = ray.passes.iter();
            passes.map(|pass| side(ray.angle, pass)).collect()
        };
        let (sides, others) = (sides(a), sides(b));
        let paired: Vec<(BracketEnd, Option<BracketEnd>)> = (sides.iter())
            .map(|side| (*side, partner(side, &others, turn)))
            .chain(others.iter().filter_map(|other| {
                let alone = partner(other, &sides, turn).is_none();
                alone.then_some((*other, None))
            }))
            .collect();
        let wanted: Vec<_> = (paired.into_iter())
            .filter(|(side, other)| possible(side, other.as_ref(), turn))
            .collect();
        let target = &self.aim.target.point;
        // A gap is resolved where nothing can arrive in it, or where each pair of passes has at
        // most one arrival between them.
        let whole = wanted.iter().all(|(_, other)| other.is_some());
        let resolved = if wanted.is_empty() {
            a.clears(target, turn) && b.clears(target, turn)
        } else {
            let pairs = wanted.iter().filter_map(|(a, b)| Some((*a, (*b)?)));
            let single = |(a, b): (BracketEnd, BracketEnd)| {
                a.miss.abs().max(b.miss.abs()) <= self.floor || roots(&a, &b).len() <= 1
            };
            trusted && whole && pairs.into_iter().all(single)
        };
        if resolved {
            for (side, other) in wanted.iter().filter_map(|(a, b)| Some((*a, (*b)?))) {
                if side.miss.abs().max(other.miss.abs()) <= self.floor {
                    self.touching.push((side.angle, side.length));
                } else {
                    self.bracket(side, other);
                }
            }
            return;
        }
        if turn < NARROWEST_GAP || self.rays >= self.most_rays {
            self.covered = false;
            for (side, other) in wanted.iter().filter_map(|(a, b)| Some((*a, (*b)?))) {
                self.bracket(side, other);
            }
            return;
        }
        self.rays += 1;
        let angle = 0.5 * (a.angle + b.angle);
        let middle = (self.aim).shoot(&self.from, angle, self.longest, self.tolerance);
        let Some(middle) = middle else {
            self.covered = false;
            return;
        };
        let right = whole
            && wanted.iter().all(|(side, other)| {
                let Some(other) = other else { return false };
                let [said, length] = halfway(side, other);
                middle.pass_near(length).is_some_and(|pass| {
                    let largest = side.miss.abs().max(other.miss.abs()).max(pass.miss.abs());
                    (pass.miss - said).abs() <= TRUSTED_CUBIC * largest + self.floor
                })
            });
        self.between(a, &middle, right);
        self.between(&middle, b, right);
    }

    /// Notes that rays between two others arrive with J > 0: as the rays turn to their side, the
    /// target goes over to their other side.
    fn bracket(&mut self, a: BracketEnd, b: BracketEnd) {
        if a.miss > 0.0 && b.miss <= 0.0 && (a.minimal || b.minimal) {
            self.brackets.push([a, b]);
        }
    }

    /// The ray at an angle, with its pass near a length.
    fn shot(&self, angle: f64, length: f64) -> Option<Arrival<D, S::Place>> {
        let tolerance = (0.1 * self.tolerance).max(LEAST_TOLERANCE);
        let until = length + PASSES_TOGETHER * self.aim.scale;
        let ray = self.aim.shoot(&self.from, angle, until, tolerance)?;
        let pass = *ray.pass_near(length)?;
        Some(Arrival { ray, pass })
    }

    /// The arrival of rays in a bracket, by Newton's method with the Jacobi field, and halving
    /// where that does not help. `None` where a ray gets lost.
    fn arrive(&self, bracket: &[BracketEnd; 2]) -> Option<Arrival<D, S::Place>> {
        let [mut low, mut high] = *bracket;
        let share = roots(&low, &high).first().copied().unwrap_or(0.5);
        let mut angle = low.angle + share * (high.angle - low.angle);
        let mut best: Option<Arrival<D, S::Place>> = None;
        let found = MISS_FOUND.max(0.1 * self.tolerance) * self.aim.scale;
        for _ in 0..MOST_ARRIVAL_SHOTS {
            let shot = self.shot(angle, 0.5 * (low.length + high.length))?;
            let side = side(angle, &shot.pass);
            if (side.miss < 0.0) == (low.miss < 0.0) {
                low = side;
            } else {
                high = side;
            }
            let before = best
                .as_ref()
                .map_or(f64::INFINITY, |best| best.pass.miss.abs());
            if side.miss.abs() < before {
                best = Some(shot);
            }
            let spread = side.jacobi.abs().max(MISS_FOUND * self.aim.scale);
            if side.miss.abs().min((high.angle - low.angle) * spread) <= found {
                break;
            }
            angle += side.miss / side.jacobi;
            let inside = angle > low.angle && angle < high.angle;
            if !inside || side.miss.abs() > 0.25 * before {
                angle = 0.5 * (low.angle + high.angle);
            }
        }
        best
    }
}

/// How a ray at an angle passes the target.
fn side<const D: usize, P>(angle: f64, pass: &Pass<D, P>) -> BracketEnd {
    BracketEnd {
        angle,
        length: pass.knot.length,
        miss: pass.miss,
        jacobi: pass.knot.jacobi[0],
        slope: pass.knot.jacobi[1],
        minimal: pass.minimal,
    }
}

/// An estimate of the length of the arrival in a bracket, and how much it may be off. As the ray
/// turns, the length at which the target is abreast changes by the miss times J'.
fn about([a, b]: &[BracketEnd; 2]) -> [f64; 2] {
    let share = a.miss / (a.miss - b.miss);
    let turn = b.angle - a.angle;
    let from = |side: &BracketEnd, turn: f64| side.length + 0.5 * side.miss * side.slope * turn;
    let (first, last) = (from(a, share * turn), from(b, (share - 1.0) * turn));
    let spread = (a.miss * a.slope).abs().max((b.miss * b.slope).abs()) * turn;
    [0.5 * (first + last), 0.5 * (first - last).abs() + spread]
}

/// The pass of a neighbouring ray that belongs to a pass.
fn partner(side: &BracketEnd, others: &[BracketEnd], turn: f64) -> Option<BracketEnd> {
    let off = |other: &&BracketEnd| (other.length - side.length).abs();
    let nearest = others.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
    let spread = side.jacobi.abs().max(nearest.jacobi.abs()) * turn;
    let misses = side.miss.abs().max(nearest.miss.abs());
    let slack = PASSES_TOGETHER * side.length + spread + misses;
    (off(&nearest) <= slack).then_some(*nearest)
}

/// Whether a geodesic without a conjugate point may arrive beside a ray that passes.
fn possible(side: &BracketEnd, other: Option<&BracketEnd>, turn: f64) -> bool {
    let Some(other) = other else {
        return side.minimal && side.miss.abs() <= POSSIBLE * turn * side.jacobi.abs();
    };
    if !(side.minimal || other.minimal) {
        return false;
    }
    let spread = turn * side.jacobi.abs().max(other.jacobi.abs());
    (side.miss < 0.0) != (other.miss < 0.0)
        || side.miss.abs().min(other.miss.abs()) <= POSSIBLE * spread
}

/// The value of the cubic at a share of the gap. At the ends it has the values and slopes of the
/// misses; a ray that is turned to its side misses by J less.
fn cubic(a: &BracketEnd, b: &BracketEnd, s: f64) -> f64 {
    let turn = b.angle - a.angle;
    let (da, db) = (-a.jacobi * turn, -b.jacobi * turn);
    let r = 1.0 - s;
    a.miss * r * r * (1.0 + 2.0 * s) + da * s * r * r + b.miss * s * s * (3.0 - 2.0 * s)
        - db * s * s * r
}

/// The value of the cubic halfway, and the mean length.
fn halfway(a: &BracketEnd, b: &BracketEnd) -> [f64; 2] {
    [cubic(a, b, 0.5), 0.5 * (a.length + b.length)]
}

/// The shares of the gap at which the cubic changes sign.
fn roots(a: &BracketEnd, b: &BracketEnd) -> Vec<f64> {
    const CUBIC_PARTS: usize = 16;
    let at = |i: usize| i as f64 / CUBIC_PARTS as f64;
    let changes = |i: &usize| (cubic(a, b, at(*i)) < 0.0) != (cubic(a, b, at(i + 1)) < 0.0);
    let parts = (0..CUBIC_PARTS).filter(changes);
    let root = |i: usize| {
        let (mut low, mut high) = (at(i), at(i + 1));
        let sign = cubic(a, b, low) < 0.0;
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if (cubic(a, b, middle) < 0.0) == sign {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    };
    parts.map(root).collect()
}
