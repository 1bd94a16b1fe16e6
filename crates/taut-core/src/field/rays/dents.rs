//! Rims (the boundary of the surface) that rays pass: where a rim ends a ray, and the dents of a
//! rough rim that rays jump.

use crate::correction::length::detour;
use crate::field::rays::knot::{Knot, between};
use crate::field::rays::ray::{Limits, RAY_OVER_RIM, nearest};
use crate::surface::{Geometry, Surface};

/// Distance between the places at which a step is looked at for rims, in spacings of the graph's
/// nodes.
const RAY_DENT_LOOK: f64 = 0.3;
/// How many times the interval in which a step leaves the surface is halved.
const DENT_HALVINGS: usize = 5;
/// Greatest depth of a dent that a ray may jump, in units of the depth at which a ray ends beyond a
/// rim.
const DEEPEST: f64 = 2.0;

/// A dent of a rough rim that a ray jumps instead of going round it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dent {
    /// Length along the ray at which the dent is deepest, in the input's units.
    pub length: f64,
    /// How far the ray lies beyond the rim there, in the input's units.
    depth: f64,
}

impl Dent {
    /// How much longer the way round the dent may be than the ray, to a place at a length on the
    /// ray. The way is a taut string that the depth of the dent pushes aside.
    pub fn detour(&self, length: f64) -> f64 {
        let behind = length - self.length;
        if behind <= 0.0 {
            return 0.0;
        }
        detour([self.length, behind], self.depth)
    }
}

/// The deepest dent that a step jumps, and the step's last place on the surface where it leaves the
/// surface for good; `None` for what does not occur.
pub(in crate::field) fn passed<const D: usize, S: Surface<D>>(
    surface: &S,
    step: [&Knot<D, S::Place>; 2],
    limits: &Limits<D, S::Place>,
    geometry: &mut Geometry<D>,
) -> (Option<Dent>, Option<Knot<D, S::Place>>) {
    // The depth beyond the rim, which is looked at only near rims: elsewhere no ray leaves the
    // surface.
    let [from, to] = step;
    let length = to.length - from.length;
    let mut depth = |knot: &mut Knot<D, S::Place>| {
        let point = &knot.frame.point;
        knot.near = nearest(limits.graph, point, knot.near);
        if !limits.rim[knot.near as usize] {
            return 0.0;
        }
        if !surface.find_place(point, &mut knot.place, geometry) {
            return f64::INFINITY;
        }
        let beyond = surface.beyond_rim(point, knot.place);
        beyond.map_or(0.0, |(depth, _)| depth)
    };
    let shallow = |knot: &Knot<D, S::Place>| {
        let deepest = if limits.along { 1.0 } else { DEEPEST };
        deepest * RAY_OVER_RIM * limits.longest_step(knot.near)
    };
    let every = RAY_DENT_LOOK * limits.spacing[from.near as usize];
    let count = (length / every).ceil().max(1.0);
    let mut inside = *from;
    let mut deepest: Option<Dent> = None;
    // A ray that begins at a rim may come out of the rim.
    let mut most = depth(&mut inside);
    for i in 1..=count as usize {
        let Some(there) = between(step, from.length + length * i as f64 / count) else {
            break;
        };
        let mut there = Knot {
            place: inside.place,
            near: inside.near,
            ..there
        };
        let found = depth(&mut there);
        if found <= most.max(shallow(&there)) {
            if found > deepest.map_or(0.0, |dent| dent.depth) {
                deepest = Some(Dent {
                    length: there.length,
                    depth: found,
                });
            }
            inside = there;
            most = found;
            continue;
        }
        // The step leaves the surface between the last place inside and this one: bisection finds
        // where.
        let mut high = there.length;
        for _ in 0..DENT_HALVINGS {
            let Some(mut middle) = between(step, 0.5 * (inside.length + high)) else {
                break;
            };
            (middle.place, middle.near) = (inside.place, inside.near);
            if depth(&mut middle) > most.max(shallow(&middle)) {
                high = middle.length;
            } else {
                inside = middle;
            }
        }
        return (deepest, Some(inside));
    }
    (deepest, None)
}
