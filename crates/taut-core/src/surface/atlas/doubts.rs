//! What speaks against an answer on a cloud although its error estimates do not know of it.

use std::fmt;

use crate::parallel;
use crate::spatial::principal;
use crate::surface::Node;
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::scale::usual_points;
use crate::surface::atlas::{Atlas, ChartIndex};

/// A reason to doubt all answers on a cloud. Its text is a sentence.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// Another sheet comes so near, for the noise that there is, that both may be read as one.
    NearSheet {
        /// Distance of the other sheet, in spacings.
        spacings: f64,
        /// Noise, in spacings.
        noise: f64,
    },
    /// The points spread in more or fewer directions than the surface has dimensions.
    Dimension {
        /// The intrinsic dimension of the surface.
        taken: usize,
        /// The number of directions in which neighbouring points spread.
        suggested: usize,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NearSheet { spacings, noise } => write!(
                formatter,
                "another sheet comes as near as {spacings:.1} spacings where the points scatter by {noise:.2}: sheets so near may be read as one, and paths cross between them"
            ),
            Self::Dimension { taken, suggested } => write!(
                formatter,
                "neighbouring points spread in {suggested} directions, but the surface was taken to be of dimension {taken}: distances are wrong by more than their errors say if it is not; name its dimension with --dimension"
            ),
        }
    }
}

/// Distance of sheets, in spacings, below which they may be read as one where there is no noise.
const NEAR_SHEET: f64 = 2.0;
/// Distance that is added to [`NEAR_SHEET`] where there is noise, in deviations of the noise.
const DEVIATIONS: f64 = 4.0;
/// Most charts that are looked at for other sheets.
const CHARTS_LOOKED_AT: usize = 500;
/// Most points whose neighbours are looked at for the dimension.
const SAMPLED: usize = 64;
/// Least number of neighbours per dimension plus two; with fewer, the directions are chance.
const FEWEST_NEIGHBOURS: usize = 4;
/// Largest spread of points along the last dimension, as a share of that along the one before it,
/// where the last dimension is none: among the usual neighbours, and among twice as many.
const FLAT_SPREADS: [f64; 2] = [0.3, 0.4];
/// Least spread of points across the surface, at all scales, as a share of that along the dimension
/// before, where the surface has one more dimension.
const THICK: f64 = 0.5;
/// Distance by which an end must be moved onto the surface to count as off it, in residuals of the
/// chart there.
const OFF_RESIDUALS: f64 = 6.0;
/// Distance that is added to [`OFF_RESIDUALS`] residuals for an end to count as off the surface, in
/// spacings.
const OFF_SPACINGS: f64 = 0.2;
/// Largest residual of a chart that counts for [`OFF_RESIDUALS`], in usual residuals of the cloud,
/// because charts between outliers leave more.
const TWICE: f64 = 2.0;

impl<const D: usize> Atlas<D> {
    /// What speaks against all answers on the cloud. It looks at a sample of the cloud's charts and
    /// points, so that its time grows only with the logarithm of their number. Of models nothing is
    /// known.
    #[must_use]
    pub fn doubts(&self) -> Vec<Doubt> {
        if !self.has_points {
            return Vec::new();
        }
        let sheet = self.near_sheet();
        let dimension = self
            .suggested_dimension()
            .map(|suggested| Doubt::Dimension {
                taken: self.monomials.variables,
                suggested,
            });
        sheet.into_iter().chain(dimension).collect()
    }

    /// How many spacings an end, which was moved onto the surface by `moved`, lies off it; `None`
    /// where this is no more than points usually do.
    #[must_use]
    pub fn spacings_off(&self, node: &Node<D, ChartIndex>, moved: f64) -> Option<f64> {
        let chart = self.charts.get(node.place as usize)?;
        (moved > self.usually_off(chart)).then(|| moved / chart.spacing)
    }

    /// The largest distance from the surface, in the input's units, at which points near a chart
    /// usually lie.
    fn usually_off(&self, chart: &Chart<D>) -> f64 {
        // Charts between outliers leave more than others do.
        let residual = chart.residual.min(TWICE * self.roughness * chart.spacing);
        OFF_RESIDUALS * residual + OFF_SPACINGS * chart.spacing
    }

    /// Whether a point of the cloud may lie off the surface: it lies farther from its chart than
    /// points usually do, or outliers have pulled the chart off. Only clouds with points that no
    /// chart fits have such points.
    pub(crate) fn is_off(&self, point: usize) -> bool {
        if self.outliers == 0 {
            return false;
        }
        let (x, chart) = (
            &self.cloud.points[point],
            &self.charts[self.owners[point] as usize],
        );
        let mut offsets = [0.0; D];
        chart.offsets(&self.monomials, x, &mut offsets);
        let heights = &offsets[..D - self.monomials.variables];
        let height = heights.iter().map(|h| h * h).sum::<f64>().sqrt();
        let is_far = (x - chart.origin).norm() > chart.radius || height > self.usually_off(chart);
        is_far || chart.trust < 1.0
    }

    /// The doubt about other sheets, if there is one.
    fn near_sheet(&self) -> Option<Doubt> {
        let step = self.charts.len().div_ceil(CHARTS_LOOKED_AT).max(1);
        let looked_at = self.charts.len().div_ceil(step);
        let noises = self.charts.iter().step_by(step);
        let noises = sorted(noises.map(|c| c.residual / c.spacing));
        let noise = *noises.get(noises.len() / 2)?;
        let near = NEAR_SHEET + DEVIATIONS * noise;
        let others = parallel::map(looked_at, |i| self.other_sheet((i * step) as u32, near));
        let others = sorted(others.into_iter().flatten());
        // One chart that sees another sheet may be an accident.
        let spacings = *others.get((looked_at / 50).max(1))?;
        (spacings < near).then_some(Doubt::NearSheet { spacings, noise })
    }

    /// The number of directions in which neighbours spread; `None` where it is the dimension of the
    /// surface.
    fn suggested_dimension(&self) -> Option<usize> {
        let k = self.monomials.variables;
        let usual = usual_points(&self.monomials);
        let same = self.spreads(usual)?;
        let wider = |factor: usize| self.spreads(factor * usual);
        if k >= 2 {
            let flat = |spreads: &[f64; D], most: f64| spreads[k - 1] < most * spreads[k - 2];
            if flat(&same, FLAT_SPREADS[0]) && flat(&wider(2).unwrap_or(same), FLAT_SPREADS[1]) {
                let along = same
                    .iter()
                    .take_while(|spread| **spread > FLAT_SPREADS[1])
                    .count();
                return Some(along.clamp(1, k - 1));
            }
        }
        let across = |spreads: &[f64; D]| {
            let thick = |i: &usize| spreads[*i] > THICK * spreads[i - 1];
            (k..D).take_while(thick).count()
        };
        // Most surfaces are thin at the first scale already, and then the other scales need not be
        // looked at.
        let mut least = across(&same);
        for neighbours in [usual / 3, 2 * usual, 4 * usual] {
            if least > 0
                && let Some(spreads) = self.spreads(neighbours)
            {
                least = least.min(across(&spreads));
            }
        }
        (least > 0).then_some(k + least)
    }

    /// How far `neighbours` neighbours spread along their principal directions, the largest first,
    /// as shares of the largest: the median over points all over the cloud. `None` where the cloud
    /// has hardly more points.
    fn spreads(&self, neighbours: usize) -> Option<[f64; D]> {
        let points = &self.tree.points;
        if points.len() < 3 * neighbours
            || neighbours < FEWEST_NEIGHBOURS * (self.monomials.variables + 2)
        {
            return None;
        }
        let step = points.len().div_ceil(SAMPLED);
        let sampled = points.len().div_ceil(step);
        let found = parallel::map_with(sampled, Vec::new, |found, i| {
            self.tree.nearest(&points[i * step], neighbours, found);
            let near = found.iter().map(|n| points[n.index as usize]);
            let (values, _) = principal::eigen(&principal::scatter(near))?;
            let largest = values[D - 1];
            let spread = |j: usize| (values[D - 1 - j].max(0.0) / largest).sqrt();
            (largest > 0.0).then(|| std::array::from_fn::<f64, D, _>(spread))
        });
        let found: Vec<[f64; D]> = found.into_iter().flatten().collect();
        let median = |j: usize| sorted(found.iter().map(|s| s[j]))[found.len() / 2];
        (!found.is_empty()).then(|| std::array::from_fn(median))
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}
