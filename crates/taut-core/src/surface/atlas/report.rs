//! What an atlas knows about its cloud: spacing, noise, other sheets, rims.

use crate::parallel;
use crate::spatial::tree::Neighbour;
use crate::surface::atlas::Atlas;

/// Facts about a cloud, by which a user can judge what its geodesics are worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Intrinsic dimension k.
    pub intrinsic_dimension: usize,
    /// Number of charts.
    pub charts: usize,
    /// Distance between neighbouring points: 10th percentile, median and 90th percentile over the
    /// charts, in the input's units. It is estimated from the density of points on the sheet.
    pub spacing: [f64; 3],
    /// Median over the charts of the root mean square distance of points from the surface fitted
    /// without them, in the input's units. This is the noise where there is some, and else the
    /// surface's own detail that the points do not resolve.
    pub noise: f64,
    /// Median over the charts of the estimated standard error of the surface's height, in the
    /// input's units.
    pub height_error: f64,
    /// The number of charts of degree 1, 2, 3 and 4.
    pub degrees: [usize; 4],
    /// Distance to the nearest other sheet, in spacings: the 1st percentile over the charts that
    /// see one within eight spacings; `None` where none does.
    pub other_sheet: Option<f64>,
    /// Estimated length of all rims (the boundary of the surface), holes included, in the input's
    /// units; 0 for closed surfaces.
    pub rim_length: f64,
    /// Number of points that no chart fits: outliers.
    pub outliers: usize,
    /// Number of points put between rows of points; see [`Atlas::points_between_rows`].
    pub points_between_rows: usize,
}

/// Largest distance at which another sheet is looked for, in spacings.
const SHEET_LOOK: f64 = 8.0;

impl<const D: usize> Atlas<D> {
    /// Facts about the cloud. O(n log n).
    #[must_use]
    pub fn report(&self) -> Report {
        let spacings = sorted(self.charts.iter().map(|c| c.spacing));
        let at = |values: &[f64], share: f64| values[(share * (values.len() - 1) as f64) as usize];
        let mut degrees = [0; 4];
        for chart in &self.charts {
            degrees[usize::from(chart.degree) - 1] += 1;
        }
        let others = parallel::map(self.charts.len(), |i| {
            self.other_sheet(i as u32, SHEET_LOOK)
        });
        let others = sorted(others.into_iter().flatten());
        Report {
            intrinsic_dimension: self.monomials.variables,
            charts: self.charts.len(),
            spacing: [at(&spacings, 0.1), at(&spacings, 0.5), at(&spacings, 0.9)],
            noise: at(&sorted(self.charts.iter().map(|c| c.residual)), 0.5),
            height_error: at(&sorted(self.charts.iter().map(|c| c.height_error)), 0.5),
            degrees,
            other_sheet: (!others.is_empty()).then(|| at(&others, 0.01)),
            rim_length: self.rim.length(),
            outliers: self.outliers,
            points_between_rows: self.points_between_rows(),
        }
    }

    /// Distance, in spacings, from a chart's origin to the first point above or below it that
    /// belongs to another sheet, looked for along the normals up to `most` spacings.
    pub(super) fn other_sheet(&self, i: u32, most: f64) -> Option<f64> {
        let chart = &self.charts[i as usize];
        let m = D - self.monomials.variables;
        let same_sheet = self.neighbours.of(i);
        let mut found: Vec<Neighbour> = Vec::new();
        let mut least: Option<f64> = None;
        for (step, normal) in
            (1..=most.ceil() as u32).flat_map(|step| (0..m).map(move |a| (step, a)))
        {
            for side in [-1.0, 1.0] {
                let height = side * f64::from(step) * chart.spacing;
                let x = chart.origin + chart.frame.column(normal) * height;
                self.tree.nearest(&x, 1, &mut found);
                let point = &self.tree.points[found[0].index as usize];
                let owner = self.owners[self.tree.order[found[0].index as usize] as usize];
                let mut offsets = [0.0; D];
                chart.offsets(&self.monomials, point, &mut offsets);
                let distance = offsets[..m].iter().map(|v| v * v).sum::<f64>().sqrt();
                let near = found[0].squared <= chart.spacing * chart.spacing;
                if near && distance > 0.5 * chart.spacing && !same_sheet.contains(&owner) {
                    let spacings = distance / chart.spacing;
                    least = Some(least.map_or(spacings, |l| l.min(spacings)));
                }
            }
            if least.is_some() && normal + 1 == m {
                break;
            }
        }
        least
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}
