//! The blend as one function F of space.
//!
//! A path knows the chart that it is on; a point of space does not. It is seen from the chart whose
//! surface passes nearest to it, so that of two layers the nearer one counts. Beyond the charts'
//! supports F is the signed distance to that surface: it has the right side, but no more.

use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::{Atlas, CROSSING, ChartIndex};
use crate::surface::{Geometry, Surface};
use crate::{Matrix, Vector};

/// F at a point, with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Level<const D: usize> {
    /// F: 0 on the surface, and near it about the signed distance from it, in the input's units.
    pub value: f64,
    /// The gradient of F.
    pub gradient: Vector<D>,
    /// The second derivatives of F.
    pub hessian: Matrix<D>,
    /// Whether charts reach the point. Where none does, F is the signed distance to the nearest
    /// chart.
    pub charted: bool,
    /// Whether the point of the surface near it lies beyond a rim (the boundary of the surface): in
    /// a hole, or past the end of the data.
    pub beyond_rim: bool,
}

/// Number of points next to a point of space whose charts may be the nearest.
const CANDIDATES: usize = 8;
/// How far points lie from the surface at most, in residuals.
const FARTHEST_POINT: f64 = 10.0;
/// How far points may lie from the surface in any case, in spacings.
const LEAST_FARTHEST: f64 = 0.01;
/// Share of a support within which its chart counts.
const WITHIN: f64 = 0.9;
/// Most steps along a chart towards the point of it nearest to a point of space.
const SLIDES: usize = 4;
/// Distance between the places on the way from a chart's origin at which rims are looked for, in
/// spacings.
const RIM_LOOK: f64 = 1.5;
/// Most places on the way from a chart's origin at which rims are looked for.
const MOST_RIM_LOOKS: f64 = 64.0;

impl<const D: usize> Atlas<D> {
    /// F at a point in the input's coordinates; `None` for surfaces of several normals. F has one
    /// sign on each side of a closed surface if the charts' sides are known, as those of a
    /// [fit](Atlas::fit) are.
    ///
    /// O(log n).
    #[must_use]
    pub fn level(&self, x: &Vector<D>) -> Option<Level<D>> {
        if self.monomials.variables + 1 != D {
            return None;
        }
        let x = x - self.cloud.centre;
        let (home, nearest) = self.nearest_chart(&x);
        if !self.charted(&x, home) {
            return Some(self.signed_distance(&x, home, &nearest));
        }
        let mut geometry = Geometry::new(1);
        self.blend::<true>(&x, home, &mut geometry);
        Some(Level {
            value: geometry.values[0],
            gradient: geometry.gradients[0],
            hessian: geometry.hessians[0],
            charted: true,
            beyond_rim: self.beyond_rim(&nearest, home).is_some(),
        })
    }

    /// About how far, at most, the points that a chart was fitted to lie from the surface near it.
    /// This is ten times the largest residual (root mean square) of a chart that is blended with
    /// it, or a hundredth of its spacing if that is more.
    #[must_use]
    pub fn farthest_point(&self, chart: ChartIndex) -> f64 {
        let beside = self.neighbours.of(chart).iter();
        let residuals = beside.map(|i| self.charts[*i as usize].residual);
        let spacing = self.charts[chart as usize].spacing;
        (FARTHEST_POINT * residuals.fold(0.0, f64::max)).max(LEAST_FARTHEST * spacing)
    }

    /// Whether the support of a chart known at `home` holds `x`.
    fn charted(&self, x: &Vector<D>, home: ChartIndex) -> bool {
        let mut charts = self
            .neighbours
            .of(home)
            .iter()
            .map(|i| &self.charts[*i as usize]);
        charts.any(|chart| (x - chart.origin).norm_squared() < chart.radius * chart.radius)
    }

    /// The chart whose surface passes nearest to `x`, among those of the points next to it, and the
    /// point where it does.
    ///
    /// On a model, whose charts may be much larger than its layers are apart, all charts are
    /// considered whose support is near enough.
    pub(super) fn nearest_chart(&self, x: &Vector<D>) -> (ChartIndex, Vector<D>) {
        if let Some(supports) = &self.supports {
            let gap = |chart, most| self.gap_within(chart, x, most);
            let nearest = supports.nearest(&self.charts, x, gap);
            return (nearest, self.nearest_on(&self.charts[nearest as usize], x));
        }
        let mut found = Vec::new();
        self.tree.nearest(x, CANDIDATES, &mut found);
        let mut best = (0, Vector::zeros(), f64::INFINITY);
        let mut tried = [ChartIndex::MAX; CANDIDATES];
        for (place, neighbour) in found.iter().enumerate() {
            let owner = self.owners[self.tree.order[neighbour.index as usize] as usize];
            if tried.contains(&owner) {
                continue;
            }
            tried[place] = owner;
            let point = self.nearest_on(&self.charts[owner as usize], x);
            let squared = (x - point).norm_squared();
            if squared < best.2 {
                best = (owner, point, squared);
            }
        }
        (best.0, best.1)
    }

    /// The point of a chart's part of the surface next to `x`. It lies above the point next to `x`
    /// of the disc of half the support's radius.
    fn nearest_on(&self, chart: &Chart<D>, x: &Vector<D>) -> Vector<D> {
        let offset = x - chart.origin;
        let normals = D - self.monomials.variables;
        let mut along = offset;
        for a in 0..normals {
            let normal = chart.frame.column(a);
            along -= normal * normal.dot(&offset);
        }
        let length = along.norm();
        let within = 0.5 * chart.radius;
        if length > within {
            along *= within / length;
        }
        let flat = chart.origin + along;
        let mut heights = [0.0; D];
        chart.offsets(&self.monomials, &flat, &mut heights);
        (0..normals).fold(flat, |point, a| point - chart.frame.column(a) * heights[a])
    }

    /// The squared distance from `x` to the part of a chart's surface that lies within its support
    /// and not across a rim from its origin. Rims are not looked at where the distance without them
    /// is more than `most`.
    fn gap_within(&self, index: ChartIndex, x: &Vector<D>, most: f64) -> f64 {
        let chart = &self.charts[index as usize];
        let normals = D - self.monomials.variables;
        let along = |offset: Vector<D>| {
            let flat = (0..normals).fold(offset, |along, a| {
                let normal = chart.frame.column(a);
                along - normal * normal.dot(&offset)
            });
            let length = flat.norm();
            flat * (WITHIN * chart.radius / length).min(1.0)
        };
        let lifted = |flat: &Vector<D>| {
            let mut heights = [0.0; D];
            let point = chart.origin + flat;
            chart.offsets(&self.monomials, &point, &mut heights);
            (0..normals).fold(point, |point, a| point - chart.frame.column(a) * heights[a])
        };
        let mut flat = along(x - chart.origin);
        let mut point = lifted(&flat);
        for _ in 0..SLIDES {
            // Where there is only one normal, the step leads to the foot of x on the tangent plane
            // at the point.
            let normal = chart.normal(&self.monomials, &point);
            let off = x - point;
            let slide = off - normal * (normal.dot(&off) / normal.norm_squared());
            let next = along(point + slide - chart.origin);
            let there = lifted(&next);
            if normals > 1 || (x - there).norm_squared() >= off.norm_squared() {
                break;
            }
            (flat, point) = (next, there);
        }
        let gap = (x - point).norm_squared();
        if gap > most || self.rim.is_empty() {
            return gap;
        }
        (x - self.inside_rims(index, &flat, point, lifted)).norm_squared()
    }

    /// The last point before a rim on the way from a chart's origin to a point of it, along its
    /// tangent plane.
    fn inside_rims(
        &self,
        index: ChartIndex,
        flat: &Vector<D>,
        point: Vector<D>,
        lifted: impl Fn(&Vector<D>) -> Vector<D>,
    ) -> Vector<D> {
        let spacing = self.charts[index as usize].spacing;
        let steps = (flat.norm() / (RIM_LOOK * spacing))
            .ceil()
            .clamp(1.0, MOST_RIM_LOOKS);
        let mut inside = self.charts[index as usize].origin;
        for i in 1..=steps as usize {
            let there = lifted(&(flat * (i as f64 / steps)));
            let depth = self.beyond_rim(&there, index);
            if depth.is_some_and(|depth| depth.0 > CROSSING * spacing) {
                return inside;
            }
            inside = there;
        }
        point
    }

    /// The signed distance to a point of a chart's surface, by the side of the surface on which `x`
    /// lies.
    fn signed_distance(&self, x: &Vector<D>, home: ChartIndex, point: &Vector<D>) -> Level<D> {
        let offset = x - point;
        let distance = offset.norm();
        let normal = self.charts[home as usize].normal(&self.monomials, point);
        let side = if normal.dot(&offset) >= 0.0 {
            1.0
        } else {
            -1.0
        };
        let direction = offset / distance;
        let across = Matrix::identity() - direction * direction.transpose();
        Level {
            value: side * distance,
            gradient: direction * side,
            hessian: across * (side / distance),
            charted: false,
            beyond_rim: self.beyond_rim(point, home).is_some(),
        }
    }
}
