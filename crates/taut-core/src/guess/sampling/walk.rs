//! Walks along an implicit surface: what a walk reaches lies on the sheet that it began on.
//!
//! Two layers of a surface can be nearer to each other than two samples of one layer, and a
//! pull-back from between them may end on either. A walk takes steps so short that the surface's
//! second order predicts their ends. The pull-back that is left is then far shorter than the step,
//! and than the way to the next layer where that way is known.

use crate::Vector;
use crate::surface::implicit::{Equations, ImplicitSurface};
use crate::surface::{Geometry, Surface};

/// Walks on one surface.
pub(super) struct Walker<'a, const D: usize, E> {
    surface: &'a ImplicitSurface<D, E>,
    pub scratch: Geometry<D>,
}

/// Most that the surface turns within one step, in radians.
const STEP_TURNING: f64 = 0.5;
/// Largest pull-back at the end of a step, as a share of the step's length.
const PULL: f64 = 0.02;
/// Largest pull-back at the end of a step, as a share of the distance to the next sheet.
const TUBE: f64 = 0.25;
/// Largest curvature^2 length^3 of a step, as a share of the distance to the next sheet (the gap).
/// With it the third order, curvature^2 length^3 / 6 where the curvature changes by itself within
/// its radius, is an eighth of the gap. One equation changes its sign from sheet to sheet, which
/// tells the rest.
const CUBIC: f64 = 0.75;
/// Most times that a step is halved before the walk is given up.
const MOST_HALVINGS: usize = 14;
/// Most steps of a walk.
const MOST_WALK_STEPS: usize = 300;
/// What may be left of the way when a walk arrives, as a share of the way.
const ARRIVED_WAY: f64 = 1e-5;
/// Distance below which two points of the surface lie on one sheet, as a share of the gap.
pub(super) const CLEARANCE: f64 = 0.5;
/// Distances of the probes along a normal, in spacings.
const PROBES: [f64; 4] = [2.0, 0.5, 0.125, 0.03125];
/// Number of normals above which each is probed less.
const MANY_NORMALS: usize = 3;
/// Farthest that a foot may lie off the curved surface at a probe's own point and still count as on
/// it, as a share of the probe's length.
const BACK: f64 = 1e-3;
/// Distance of the next sheet, in spacings, where no probe goes to another sheet: it is at least
/// this far away.
const FAR_SHEET: f64 = 4.0;

/// Whether two points of the surface, with `way` leading from one to the other, lie on one sheet
/// because the next sheet is farther away.
pub(super) fn is_clear<const D: usize>(way: &Vector<D>, gap: f64) -> bool {
    way.norm_squared() <= (CLEARANCE * gap).powi(2)
}

impl<'a, const D: usize, E: Equations<D>> Walker<'a, D, E> {
    pub fn new(surface: &'a ImplicitSurface<D, E>) -> Self {
        Self {
            surface,
            scratch: Geometry::new(D - surface.intrinsic_dimension()),
        }
    }

    /// Puts the geometry at a point of the surface into the scratch; `false` where there is no
    /// tangent space.
    pub fn look(&mut self, point: &Vector<D>) -> bool {
        self.surface.geometry(point, (), &mut self.scratch)
    }

    /// A step along a unit tangent from a point whose geometry is in the scratch: the place where
    /// it ends, and its length, which is at most `length`. `gap` is the distance to the next sheet.
    fn step(
        &mut self,
        from: &Vector<D>,
        tangent: &Vector<D>,
        length: f64,
        gap: f64,
    ) -> Option<(Vector<D>, f64)> {
        let curvature_vector = self.scratch.normal_curvature(tangent);
        let curvature = self.scratch.curvature_bound();
        let foretold = (CUBIC * gap / (curvature * curvature)).cbrt();
        let mut length = length
            .min(STEP_TURNING / curvature_vector.norm())
            .min(foretold);
        let side = self.scratch.gradients[0];
        let is_one_equation = self.scratch.codimension == 1;
        for _ in 0..MOST_HALVINGS {
            let target = from + tangent * length + curvature_vector * (0.5 * length * length);
            if let Some(point) = self.surface.foot(&target, &mut (), &mut self.scratch)
                && (point - target).norm() <= (PULL * length).min(TUBE * gap)
                && !(is_one_equation && self.scratch.gradients[0].dot(&side) <= 0.0)
            {
                return Some((point, length));
            }
            length *= 0.5;
        }
        None
    }

    /// The end of a straight walk of a length from a point along a unit tangent; `None` where the
    /// surface does not let it through.
    pub fn shoot(
        &mut self,
        from: &Vector<D>,
        tangent: &Vector<D>,
        length: f64,
        gap: f64,
    ) -> Option<Vector<D>> {
        let (mut point, mut tangent, mut left) = (*from, *tangent, length);
        for _ in 0..MOST_WALK_STEPS {
            if !self.look(&point) {
                return None;
            }
            tangent = self.scratch.project(&tangent).try_normalize(0.0)?;
            let (next, gone) = self.step(&point, &tangent, left, gap)?;
            point = next;
            left -= gone;
            if left <= 0.0 {
                return Some(point);
            }
        }
        None
    }

    /// Walks from a point of the surface ever nearer to `x`. The walk ends where the tangential
    /// part of what is left is below `exactness` times the distance at first, or where no step
    /// leads nearer. `None` where the surface does not let it through.
    pub fn toward(
        &mut self,
        from: &Vector<D>,
        x: &Vector<D>,
        gap: f64,
        exactness: f64,
        mut visit: impl FnMut(&Vector<D>),
    ) -> Option<Vector<D>> {
        let mut point = *from;
        let mut left = (x - point).norm();
        let enough = exactness * left;
        for _ in 0..MOST_WALK_STEPS {
            if !self.look(&point) {
                return None;
            }
            let to = x - point;
            let along = self.scratch.project(&to);
            let length = along.norm();
            if length <= enough {
                return Some(point);
            }
            let tangent = along / length;
            // If `x` lies off the surface, on the side that the surface curves away from, the way
            // along the surface is shorter than the tangential part.
            let shorter = (1.0 - to.dot(&self.scratch.normal_curvature(&tangent))).max(1.0);
            let (next, _) = self.step(&point, &tangent, length / shorter, gap)?;
            let there = (x - next).norm();
            if there >= left {
                return Some(point);
            }
            (point, left) = (next, there);
            visit(&point);
        }
        None
    }

    /// Whether a walk from one point of the surface arrives at another, or need not set out because
    /// the next sheet is farther away than the other point.
    pub fn arrives(&mut self, from: &Vector<D>, to: &Vector<D>, gap: f64) -> bool {
        is_clear(&(to - from), gap) || self.walks(from, to, gap)
    }

    /// Whether a walk from one point of the surface arrives at another.
    pub fn walks(&mut self, from: &Vector<D>, to: &Vector<D>, gap: f64) -> bool {
        let end = self.toward(from, to, gap, 0.1 * ARRIVED_WAY, |_| ());
        end.is_some_and(|end| (end - to).norm() <= ARRIVED_WAY * (to - from).norm())
    }

    /// The distance from a point of the surface, whose geometry is in the scratch, to the next
    /// sheet along its normals, as far as some spacings show it.
    pub fn gap(&mut self, point: &Vector<D>, spacing: f64) -> f64 {
        let (basis, codimension) = (self.scratch.basis, self.scratch.codimension);
        let curvature = self.scratch.curvature_bound();
        // A sheet that returns beside another does so along every normal, so where there are many
        // normals each needs fewer probes.
        let probes = &PROBES[..if codimension > MANY_NORMALS {
            2
        } else {
            PROBES.len()
        }];
        let mut gap = FAR_SHEET * spacing;
        for normal in 0..codimension {
            for probe in probes.iter().flat_map(|probe| [*probe, -probe]) {
                let offset = basis.column(normal) * (probe * spacing);
                let foot = self
                    .surface
                    .foot(&(point + offset), &mut (), &mut self.scratch);
                let Some(moved) = foot.map(|foot| foot - point) else {
                    continue;
                };
                let across: f64 = (0..codimension)
                    .map(|i| basis.column(i).dot(&moved).powi(2))
                    .sum();
                let most = curvature * (moved.norm_squared() - across) + BACK * offset.norm();
                if across > most * most
                    && moved.norm() < gap
                    && !self.walks(point, &(point + moved), f64::INFINITY)
                {
                    gap = moved.norm();
                }
            }
        }
        gap
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::Shape;

    #[test]
    fn a_walk_stays_on_its_layer() {
        let (inner, gap) = (0.3, 0.03);
        let shape = Shape::parse("roll:0.3,0.03,7").expect("a shape");
        let surface = ImplicitSurface::new(shape.clone(), shape.size());
        let mut walker = Walker::new(&surface);
        let point = |angle: f64, z: f64| {
            let radius = inner + gap * angle / std::f64::consts::TAU;
            Vector::<3>::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        for angle in [0.1, 5.0, 20.0, 40.0] {
            let from = point(angle, 0.5);
            assert!(walker.look(&from));
            let found = walker.gap(&from, 0.2);
            assert!((found - gap).abs() < 0.05 * gap, "{found}");
            // The point is 0.8 radians on; the layers beside are as far along.
            for (turns, arrives) in [(0.0, true), (1.0, false), (-1.0, false), (2.0, false)] {
                let to = point(angle + 0.8 + std::f64::consts::TAU * turns, 0.4);
                assert_eq!(
                    walker.arrives(&from, &to, found),
                    arrives,
                    "{angle} {turns}"
                );
            }
        }
    }

    #[test]
    fn a_straight_walk_follows_a_great_circle() {
        let surface = ImplicitSurface::new(Shape::parse("sphere:2").expect("a shape"), 2.0);
        let mut walker = Walker::new(&surface);
        let (from, ahead) = (Vector::<3>::x() * 2.0, Vector::<3>::new(0.0, 0.6, 0.8));
        let end = walker.shoot(&from, &ahead, 3.0, 8.0).expect("an end");
        assert!((end.norm() - 2.0).abs() < 1e-12);
        assert!(end.dot(&Vector::<3>::new(0.0, 0.8, -0.6)).abs() < 1e-12);
        assert!((end.dot(&from) / 4.0 - 1.5_f64.cos()).abs() < 0.1);
    }
}
