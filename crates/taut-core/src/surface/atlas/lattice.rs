//! Points all over a surface, from its charts alone: a lattice on each chart, as far as no other
//! chart knows more of the place.

use crate::surface::atlas::{Atlas, ChartIndex};
use crate::surface::{Geometry, Node, Surface};
use crate::{Vector, parallel};

/// Least and largest number of points for each chart: the least resolves the blend, and more than
/// the largest do not know more of it.
const POINTS: std::ops::RangeInclusive<usize> = 24..=400;
/// Number of points that suffices for smooth surfaces; models of few charts have this many.
const SUFFICE: usize = 16_000;
/// Most points of a model, no more than clouds of usual size have.
const MOST_LATTICE: usize = 400_000;
/// Growth of the spacing, as a share of the way from a chart to the next.
const GRADING: f64 = 0.3;
/// Number of steps from the middle of a chart to its edge by which its area is measured.
const MEASURED: f64 = 10.0;

impl<const D: usize> Atlas<D> {
    /// Points all over a two-dimensional surface within its rims, closer together where charts are
    /// smaller.
    ///
    /// O(n) in the number of points, which is in proportion to that of the charts.
    pub(crate) fn spread(&self) -> Vec<Node<D, ChartIndex>> {
        let charts = self.charts.len();
        let most = SUFFICE.min(charts * POINTS.end());
        let wanted = (charts * POINTS.start()).max(most).min(MOST_LATTICE);
        let sizes = parallel::map(charts, |i| self.graded(i as ChartIndex));
        let areas = parallel::map(charts, |i| self.own_area(i as ChartIndex));
        let cells = sizes.iter().zip(&areas);
        let cells: f64 = cells.map(|(size, area)| area / (size * size)).sum();
        let share = (cells / wanted as f64).sqrt();
        self.lattice(|chart| share * sizes[chart as usize])
    }

    /// The radius of the smallest chart about a chart, where those farther off count as larger.
    fn graded(&self, chart: ChartIndex) -> f64 {
        let origin = self.charts[chart as usize].origin;
        let others = self.neighbours.of(chart).iter().map(|other| {
            let other = &self.charts[*other as usize];
            other.radius + GRADING * (other.origin - origin).norm()
        });
        others.fold(f64::INFINITY, f64::min)
    }

    /// The points on a lattice on each chart, with a spacing for each, that lie within the rims.
    fn lattice(&self, spacing: impl Fn(ChartIndex) -> f64 + Sync) -> Vec<Node<D, ChartIndex>> {
        let scratch = || Geometry::new(D - self.monomials.variables);
        let of_chart = |scratch: &mut Geometry<D>, i: usize| {
            let chart = i as ChartIndex;
            let on_chart = self.steps(chart, spacing(chart)).into_iter();
            let on_surface = on_chart.filter_map(|x| {
                let mut place = chart;
                let point = self.foot(&x, &mut place, scratch)?;
                let inside = self.beyond_rim(&point, place).is_none();
                inside.then_some(Node { point, place })
            });
            on_surface.collect::<Vec<_>>()
        };
        parallel::map_with(self.charts.len(), scratch, of_chart).concat()
    }

    /// The area, along its tangent plane, of the part of a chart that it knows more of than others
    /// do.
    fn own_area(&self, chart: ChartIndex) -> f64 {
        let step = self.charts[chart as usize].radius / MEASURED;
        self.steps(chart, step).len() as f64 * step * step
    }

    /// Points of a chart's own surface, on a lattice of hexagons as dense as a square lattice of
    /// the step, that lie nearer to the chart's origin than to another's, both measured in the
    /// charts' radii.
    fn steps(&self, index: ChartIndex, step: f64) -> Vec<Vector<D>> {
        let chart = &self.charts[index as usize];
        let normals = D - self.monomials.variables;
        let tangents = [normals, normals + 1].map(|i| chart.frame.column(i).into_owned());
        let along = step * (4.0_f64 / 3.0).powf(0.25);
        let across = step * step / along;
        let rows = (chart.radius / across) as i32;
        let mut points = Vec::new();
        let mut heights = [0.0; D];
        for row in -rows..=rows {
            let y = f64::from(row) * across;
            let shift = 0.5 * along * f64::from(row & 1);
            let half = ((chart.radius * chart.radius - y * y).max(0.0).sqrt() / along) as i32 + 1;
            for place in -half..=half {
                let x = f64::from(place) * along + shift;
                let flat = chart.origin + tangents[0] * x + tangents[1] * y;
                chart.offsets(&self.monomials, &flat, &mut heights);
                let lifted =
                    (0..normals).fold(flat, |point, a| point - chart.frame.column(a) * heights[a]);
                if self.knows_most(index, &lifted) {
                    points.push(lifted);
                }
            }
        }
        points
    }

    /// Whether a point within a chart's radius is nearer to the chart's origin than to those of
    /// others, each measured in the chart's radii.
    fn knows_most(&self, index: ChartIndex, x: &Vector<D>) -> bool {
        let away = |i: ChartIndex| {
            let chart = &self.charts[i as usize];
            (x - chart.origin).norm_squared() / (chart.radius * chart.radius)
        };
        let here = away(index);
        let others = &self.neighbours.of(index)[1..];
        here < 1.0
            && others.iter().all(|other| {
                let there = away(*other);
                there > here || (there == here && *other > index)
            })
    }
}
