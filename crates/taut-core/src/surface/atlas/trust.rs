//! How far charts are trusted. Beside an outlier a fit may err by a good part of a spacing where
//! the charts around do not err at all; the blend then follows these others.

use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::links::median;
use crate::surface::atlas::scale::NOISY;
use crate::surface::atlas::{ChartIndex, Lists, UNEVEN_ERRORS};
use crate::{Vector, parallel};

/// Median residual of the charts around, in spacings, above which all charts are trusted fully.
/// Creases and noise spoil many fits at once, and one that fits well may do so by chance.
const CLEAN: f64 = 2e-3;
/// Residual of a chart, in median residuals of the charts around it, up to which it is trusted
/// fully.
const USUAL: f64 = 3.0;
/// Power of the ratio of the residual allowed to a chart's residual by which a chart with a larger
/// residual is trusted.
const POWER: i32 = 4;
/// Error of a chart's height, in spacings, up to which its ripples do not matter.
const SMOOTH_ERROR: f64 = 1e-3;

/// Sets how far each chart is trusted, by the charts beside it, and how far the blend errs near it.
pub(super) fn judge<const D: usize>(charts: &mut [Chart<D>], neighbours: &Lists) {
    let trusts = parallel::map(charts.len(), |i| trust(charts, neighbours.of(i as u32)));
    for (chart, trust) in charts.iter_mut().zip(trusts) {
        chart.trust = trust;
    }
    let errors = parallel::map(charts.len(), |i| {
        let chart = &charts[i];
        let beside = neighbours.of(i as u32).iter().map(|i| &charts[*i as usize]);
        let counts = |other: &Chart<D>| other.trust < 1.0 || std::ptr::eq(other, chart);
        blend_error(&chart.origin, beside, counts)
    });
    let usual = median(charts.iter().map(|chart| chart.height_error));
    for (chart, error) in charts.iter_mut().zip(errors) {
        chart.blend_error = error;
        let most = (UNEVEN_ERRORS * usual).max(SMOOTH_ERROR * chart.spacing);
        chart.stands_alone = chart.trust == 1.0 && chart.height_error <= most;
    }
}

/// How far the first of some charts is trusted, from 0 to 1.
fn trust<const D: usize>(charts: &[Chart<D>], beside: &[ChartIndex]) -> f64 {
    let chart = &charts[beside[0] as usize];
    if chart.clean() {
        return 1.0;
    }
    let usual = median(beside.iter().map(|i| charts[*i as usize].residual));
    if usual > CLEAN * chart.spacing {
        return 1.0;
    }
    let most = (USUAL * usual).max(NOISY * chart.spacing);
    (most / chart.residual).min(1.0).powi(POWER)
}

/// The error of height of the blend of some charts at a point: the largest error of the charts that
/// count there, each weighted by how far the chart is trusted beside the others.
pub(super) fn blend_error<'a, const D: usize>(
    x: &Vector<D>,
    charts: impl Iterator<Item = &'a Chart<D>> + Clone,
    counts: impl Fn(&Chart<D>) -> bool,
) -> f64 {
    let near = |chart: &&Chart<D>| (x - chart.origin).norm_squared() < chart.radius * chart.radius;
    let near = charts.filter(near);
    let best = near.clone().map(|chart| chart.trust).fold(0.0, f64::max);
    let counted = near.filter(|chart| counts(chart));
    let errors = counted.map(|chart| chart.height_error * (chart.trust / best));
    errors.fold(0.0, f64::max)
}
