//! The scale of a chart: how many points it is fitted to, and with which degree.

use crate::spatial::tree::Tree;
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::links::{STEEPEST_SECANT, median};
use crate::surface::atlas::polynomial::Monomials;
use crate::surface::atlas::sheets::{self, Neighbourhood, Sheet, Workspace};
use crate::{Matrix, Vector, parallel};

/// Scatter of a fit, in spacings, above which it is not clean: more points, or fewer, may serve.
pub(super) const NOISY: f64 = 0.02;
/// Most points of a chart's fit, in multiples of the usual neighbourhood.
const MOST_GROWTH: usize = 16;
/// Leave-one-out error of a higher degree, as a share of the best lower one's, below which the
/// higher degree is taken.
const DEGREE_GAIN: f64 = 0.95;
/// Least number of points for each coefficient of a degree that is used. With fewer, a good
/// leave-one-out error may be chance, and the polynomial runs away between the points.
const POINTS_A_COEFFICIENT: usize = 2;
/// Number of charts by which a cloud's roughness is judged.
const JUDGED_CHARTS: usize = 64;
/// Scatter, in spacings, above which smoothing detail away shows in lengths.
const ROUGH_SCATTER: f64 = 0.1;
/// Share of the scatter that half of the points leave, below which it is detail: of noise they
/// leave all.
const DETAIL_LEFT: f64 = 0.88;
/// Strays are left out of a neighbourhood only up to one in this many points.
const MOST_STRAYS: usize = 5;
/// Correlation of residuals with their neighbours' above which they are the surface's, not noise.
const MISFIT: f64 = 0.35;
/// Factor of the scatter's rise at which growth stops, because the model no longer follows the
/// surface.
const RISE: f64 = 1.15;

/// Shares of a larger neighbourhood's leave-one-out error below which a smaller one is taken.
#[derive(Clone, Copy)]
pub(super) struct Gains {
    /// The share for a smaller neighbourhood where the residuals of neighbours agree.
    smaller: f64,
    /// The share for half of the points where the residuals of neighbours do not agree: this may be
    /// noise, which few points fit well by chance.
    half: f64,
    /// The share for a quarter of the points where the residuals of neighbours do not agree.
    quarter: f64,
}

/// The shares on clouds whose roughness may be noise.
const CAUTIOUS: Gains = Gains {
    smaller: 0.7,
    half: 0.65,
    quarter: 0.5,
};
/// The shares on clouds whose roughness is detail.
const DETAILED: Gains = Gains {
    smaller: 0.85,
    half: 0.85,
    quarter: 0.75,
};

/// Judges from some of a cloud's cells (tree indices) whether its roughness is detail, which half
/// of the points fit better, or may be noise, which they do not.
pub(super) fn gains<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    cells: &[Vec<u32>],
) -> Gains {
    let judged: Vec<&Vec<u32>> = cells
        .iter()
        .step_by(cells.len().div_ceil(JUDGED_CHARTS).max(1))
        .collect();
    let usual = usual_points(monomials);
    let residuals = |wanted: usize| -> Vec<Option<[f64; 2]>> {
        parallel::map_with(judged.len(), Workspace::default, |workspace, i| {
            let cell = judged[i];
            let mut sheet = Sheet::new(tree, monomials, cell[cell.len() / 2]);
            let neighbourhood = sheet.grow(wanted, workspace)?;
            let chart = fit_chart(&sheet, &neighbourhood, workspace)?.chart;
            Some([chart.residual, chart.spacing])
        })
    };
    let whole = residuals(usual);
    let roughness = whole
        .iter()
        .flatten()
        .map(|[residual, spacing]| residual / spacing);
    if median(roughness) < ROUGH_SCATTER {
        return CAUTIOUS;
    }
    let half = residuals(usual / 2);
    let left = whole
        .iter()
        .zip(&half)
        .filter_map(|(whole, half)| Some((*half)?[0] / (*whole)?[0]));
    if median(left) < DETAIL_LEFT {
        DETAILED
    } else {
        CAUTIOUS
    }
}

/// Number of points of a chart's fit where nothing speaks for more or fewer.
pub(super) fn usual_points(monomials: &Monomials) -> usize {
    3 * monomials.count(4) + 5
}

/// The point nearest to the mean of some points (tree indices), from which a chart starts.
pub(super) fn seed<const D: usize>(tree: &Tree<D>, points: &[u32]) -> Option<u32> {
    let sum = points.iter().fold(Vector::<D>::zeros(), |sum, i| {
        sum + tree.points[*i as usize]
    });
    let mean = sum / points.len() as f64;
    let gap = |i: &u32| (tree.points[*i as usize] - mean).norm_squared();
    let nearest = points.iter().copied();
    nearest.min_by(|a, b| gap(a).total_cmp(&gap(b)))
}

/// Least distance of an outlier from the fit, in spacings.
const STRAYED: f64 = 0.1;

/// Fits the chart around a point; returns it with the points that it was fitted to.
///
/// Clean points get the usual neighbourhood. Where it does not fit, the surface may turn within few
/// spacings, and a smaller neighbourhood that fits much better is taken. If none does, and the
/// residuals of neighbours do not agree, they are noise, and larger neighbourhoods are taken while
/// that only averages it (Lepski's rule).
pub(super) fn fit<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    gains: Gains,
    seed: u32,
    workspace: &mut Workspace<D>,
) -> Option<(Chart<D>, Vec<u32>)> {
    let usual = usual_points(monomials);
    let mut sheet = Sheet::new(tree, monomials, seed);
    let mut fit = |wanted: usize| {
        let neighbourhood = sheet.grow(wanted, workspace)?;
        fit_without_strays(&sheet, neighbourhood, workspace)
    };
    let first = match fit(usual) {
        Some((fitted, members)) if fitted.chart.clean() => return Some((fitted.chart, members)),
        other => other,
    };
    let residual = |f: &Option<(Fitted<D>, Vec<u32>)>| {
        f.as_ref()
            .map_or(f64::INFINITY, |(fitted, _)| fitted.chart.residual)
    };
    // Few noisy points often fit well by chance, so where there is noise they must gain more.
    let noise = first.as_ref().is_some_and(|f| f.0.misfit.abs() <= MISFIT);
    let mut detailed = None;
    for (wanted, chance) in [(usual / 2, gains.half), (usual / 4 + 1, gains.quarter)] {
        let smaller = fit(wanted);
        let gain = if noise { chance } else { gains.smaller };
        if residual(&smaller) < gain * residual(&first)
            && residual(&smaller) < gains.smaller * residual(&detailed)
        {
            detailed = smaller;
        }
    }
    if let Some((fitted, members)) = detailed {
        return Some((fitted.chart, members));
    }
    let mut best = first?;
    if best.0.misfit > MISFIT {
        return Some((best.0.chart, best.1));
    }
    let first = best.0.clone();
    // Larger neighbourhoods are taken while the centre moves by no more than the errors of both
    // fits explain.
    let mut growth = 2;
    while growth <= MOST_GROWTH {
        let Some((next, members)) = fit(growth * usual) else {
            break;
        };
        let moved = (next.chart.origin - best.0.chart.origin).norm();
        let allowed = 2.0 * (next.chart.height_error + best.0.chart.height_error);
        if next.sigma > RISE * first.sigma || moved > allowed || next.misfit > MISFIT {
            break;
        }
        best = (next, members);
        growth *= 2;
    }
    let mut chart = best.0.chart;
    chart.radius = chart.radius.min(first.chart.radius);
    chart.spacing = first.chart.spacing;
    Some((chart, best.1))
}

/// A chart that was fitted to a neighbourhood.
#[derive(Clone)]
pub(super) struct Fitted<const D: usize> {
    pub chart: Chart<D>,
    /// Weighted root mean square residual, corrected for the degrees of freedom.
    sigma: f64,
    /// Correlation of neighbours' residuals; 0 where the fit is clean.
    misfit: f64,
}

/// The chart of a neighbourhood without the points that lie far off what the others make, which are
/// outliers between sheets. They hide each other, so that it takes a few turns.
fn fit_without_strays<const D: usize>(
    sheet: &Sheet<D>,
    mut neighbourhood: Neighbourhood<D>,
    workspace: &mut Workspace<D>,
) -> Option<(Fitted<D>, Vec<u32>)> {
    let mut fitted = fit_chart(sheet, &neighbourhood, workspace)?;
    let most = neighbourhood.members.len() / MOST_STRAYS;
    let (mut strays, mut left_out) = (Vec::new(), 0);
    loop {
        std::mem::swap(&mut strays, &mut workspace.strays);
        left_out += strays.len();
        if strays.is_empty() || left_out > most {
            return Some((fitted, neighbourhood.members));
        }
        let mut place = 0..;
        neighbourhood.members.retain(|_| {
            place
                .next()
                .is_none_or(|place| strays.binary_search(&place).is_err())
        });
        let Some(next) = fit_chart(sheet, &neighbourhood, workspace) else {
            return Some((fitted, neighbourhood.members));
        };
        fitted = next;
    }
}

/// Turns the frame to the surface at the seed, then fits heights. A higher degree is taken where
/// its leave-one-out error is less than [`DEGREE_GAIN`] times that of the best lower one.
pub(super) fn fit_chart<const D: usize>(
    sheet: &Sheet<D>,
    neighbourhood: &Neighbourhood<D>,
    workspace: &mut Workspace<D>,
) -> Option<Fitted<D>> {
    let monomials = sheet.monomials;
    let k = monomials.variables;
    let m = D - k;
    let (samples, fit) = (&mut workspace.samples, &mut workspace.fit);
    let points = &sheet.tree.points;
    let members = neighbourhood.members.iter().map(|i| points[*i as usize]);
    let rows = members.len();
    let mut frame = neighbourhood.frame;
    let mut origin = points[sheet.seed as usize];
    let mut coefficients = Vec::new();
    let locals = members.clone().map(|x| frame.tr_mul(&(x - origin)));
    let scale = samples.set(m, locals);
    // A first fit turns the frame, so that the heights have no slope at the origin.
    if let Some(degree) = fit.factor(monomials, 2, samples) {
        fit.coefficients(monomials, degree, &mut coefficients);
        (origin, frame) = turned(&origin, &frame, &coefficients, scale, k);
    }
    let scale = samples.set(m, members.map(|x| frame.tr_mul(&(x - origin))));
    let reached = fit.factor(monomials, 4, samples)?;
    let qualities = fit.qualities(monomials, samples);
    let spacing = spread(scale, rows, k);
    fit.strays(samples, STRAYED * spacing, &mut workspace.strays);
    let mut best = (1, qualities[0]);
    for candidate in (1..).zip(qualities).take(reached) {
        if POINTS_A_COEFFICIENT * monomials.count(candidate.0) <= rows
            && candidate.1.leave_one_out < DEGREE_GAIN * best.1.leave_one_out
        {
            best = candidate;
        }
    }
    let (degree, quality) = best;
    let misfit = if quality.leave_one_out > NOISY * spacing {
        fit.misfit(monomials, degree, samples)
    } else {
        0.0
    };
    fit.coefficients(monomials, degree, &mut coefficients);
    let count = monomials.count(degree);
    for a in 0..m {
        origin += frame.column(a) * std::mem::take(&mut coefficients[a * count]);
    }
    Some(Fitted {
        chart: Chart {
            origin,
            frame,
            radius: scale,
            coefficients,
            degree: degree as u8,
            scale,
            spacing,
            residual: quality.leave_one_out,
            height_error: quality.leave_one_out
                * fit.variance_at_origin(monomials, degree).sqrt().min(1.0),
            trust: 1.0,
            blend_error: 0.0,
            stands_alone: true,
        },
        sigma: quality.sigma,
        misfit,
    })
}

/// The distance between neighbouring points among `count` points spread evenly over a k-ball.
fn spread(radius: f64, count: usize, k: usize) -> f64 {
    radius * (sheets::unit_ball(k) / count as f64).powf(1.0 / k as f64)
}

/// The frame turned so that the fitted heights have no slope at the origin, and the origin moved
/// onto them.
fn turned<const D: usize>(
    origin: &Vector<D>,
    frame: &Matrix<D>,
    coefficients: &[f64],
    scale: f64,
    k: usize,
) -> (Vector<D>, Matrix<D>) {
    let m = D - k;
    let count = coefficients.len() / m;
    let mut moved = *origin;
    let mut turned = Matrix::<D>::zeros();
    for a in 0..m {
        moved += frame.column(a) * coefficients[a * count];
        let mut normal = frame.column(a).into_owned();
        for j in 0..k {
            normal -= frame.column(m + j) * (coefficients[a * count + 1 + j] / scale);
        }
        for b in 0..a {
            let done = turned.column(b).into_owned();
            normal -= done * done.dot(&normal);
        }
        turned.set_column(a, &normal.normalize());
    }
    sheets::complete(&mut turned, m);
    (moved, turned)
}

/// Distance from the origin to the nearest fitted point where the chart is too steep over its plane
/// to be a height any more; infinite where there is none.
pub(super) fn steep_distance<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    chart: &Chart<D>,
    members: &[u32],
) -> f64 {
    if chart.steepest(monomials) <= STEEPEST_SECANT {
        return f64::INFINITY;
    }
    let away = members.iter().filter_map(|i| {
        let x = &tree.points[*i as usize];
        let steep = chart.steepness(monomials, x) > STEEPEST_SECANT;
        steep.then(|| (x - chart.origin).norm())
    });
    away.fold(f64::INFINITY, f64::min)
}
