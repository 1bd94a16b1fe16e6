//! Rims that rays pass: where one ends a ray, and the dents of a rough edge that rays jump.

use crate::correction::length::detour;
use crate::field::knot::{Knot, between};
use crate::field::ray::{Limits, OVER_RIM, nearest};
use crate::surface::{Geometry, Surface};

/// Steps are looked at for rims so many spacings of the graph's nodes apart, and where they leave the surface so many
/// times halved.
const LOOKED_AT: f64 = 0.3;
const HALVINGS: usize = 5;
/// Where it jumps dents, they are at most so many times deeper than a ray may end beyond a rim.
const DEEPEST: f64 = 2.0;

/// Where a ray jumps a dent of a rough edge instead of going round it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dent {
    /// How far along the ray it is deepest.
    pub length: f64,
    depth: f64,
}

impl Dent {
    /// How much longer the way round the dent may be to a place on the ray: as a taut string that is pushed aside by the
    /// dent's depth.
    pub fn detour(&self, length: f64) -> f64 {
        let behind = length - self.length;
        if behind <= 0.0 {
            return 0.0;
        }
        detour([self.length, behind], self.depth)
    }
}

/// The deepest dent that a step jumps, and its last place on the surface where it leaves it for good; `None` where there is
/// no such.
pub(super) fn passed<const D: usize, S: Surface<D>>(
    surface: &S,
    step: [&Knot<D, S::Place>; 2],
    limits: &Limits<D, S::Place>,
    geometry: &mut Geometry<D>,
) -> (Option<Dent>, Option<Knot<D, S::Place>>) {
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
        deepest * OVER_RIM * limits.longest_step(knot.near)
    };
    let every = LOOKED_AT * limits.spacing[from.near as usize];
    let count = (length / every).ceil().max(1.0);
    let mut inside = *from;
    let mut deepest: Option<Dent> = None;
    // What begins at a rim may come out of it.
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
        let mut high = there.length;
        for _ in 0..HALVINGS {
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
