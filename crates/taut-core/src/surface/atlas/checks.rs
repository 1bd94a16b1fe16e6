//! What holds for the charts of every fitted model, so that what is computed on a model costs no
//! more than its size justifies.
//!
//! The bounds are far wider than what fits of clean, noisy, uneven and torn clouds reach; they are
//! there for damaged files.

use crate::error::Error;
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::model::{ModelChart, expect};
use crate::surface::atlas::rim::Disc;
use crate::surface::atlas::{Atlas, ChartIndex};

/// Least length that is accepted; the largest one is its inverse.
const SMALLEST_LENGTH: f64 = 1e-100;
/// Largest radius of a chart, as a multiple of its scale (the reach of the points that it was
/// fitted to).
pub(super) const LARGEST_RADIUS: f64 = 8.0;
/// Largest distance between points on a chart, in radii.
const SPARSEST: f64 = 10.0;
/// Largest residual and height error of a chart, in radii.
const ROUGHEST: f64 = 10.0;
/// Largest height of a chart at its radius, in radii.
const HIGHEST: f64 = 1e4;
/// Largest ratio of the radii of two charts beside each other.
const RADIUS_RATIO: f64 = 1e3;
/// Least distance between the origins of two charts beside each other, in radii of the smaller.
const CLOSEST_ORIGINS: f64 = 1e-3;
/// Largest distance between the origins of two charts beside each other, in sums of their radii.
const FARTHEST_APART: f64 = 20.0;
/// Radii of the discs of a rim (the boundary of the surface), in spacings.
const DISCS: std::ops::RangeInclusive<f64> = 1e-2..=1e3;
/// Largest distance of the points that discs touch from the chart's origin, in radii.
const TOUCHED: f64 = 4.0;
/// Largest length of rim that one disc may stand for, in radii of the disc.
const LONGEST_SHARE: f64 = 1e3;
/// Rounding that is allowed in unit vectors, and in distances that are sorted.
const UNIT_ROUNDING: f64 = 1e-9;
/// Least wavelength of detail in the smallest radius, and largest in the largest radius.
const WAVELENGTHS: [f64; 2] = [0.1, 10.0];

/// Refuses charts that no reader of the model would take, so that what was fitted can be kept.
pub(super) fn fitted<const D: usize>(atlas: &Atlas<D>) -> Result<(), Error> {
    let normals = D - atlas.monomials.variables;
    let checked = atlas.charts.iter().enumerate().try_for_each(|(i, chart)| {
        lengths(i, chart, normals)?;
        discs(i, chart, atlas.rim.of(i as ChartIndex))?;
        beside(i, atlas.neighbours.of(i as ChartIndex), &atlas.charts)
    });
    let checked = checked.and_then(|()| detail(atlas.detail, &atlas.charts));
    checked.map_err(|error| match error {
        Error::BadModel {
            chart,
            found,
            expected,
        } => Error::BadFit {
            place: chart.map(|i| {
                let point = atlas.charts[i].origin + atlas.cloud.centre;
                format!("{:?}", point.as_slice())
            }),
            found,
            expected,
        },
        other => other,
    })
}

/// Refuses a chart whose lengths do not fit each other.
pub(super) fn lengths<const D: usize>(
    i: usize,
    chart: &Chart<D>,
    normals: usize,
) -> Result<(), Error> {
    let Chart {
        radius,
        scale,
        spacing,
        residual,
        height_error,
        ..
    } = chart;
    let known = SMALLEST_LENGTH..=1.0 / SMALLEST_LENGTH;
    within(i, "radius", *radius, *known.start(), *known.end())?;
    let farthest = chart.origin.amax();
    within(i, "an origin at", farthest, 0.0, *known.end())?;
    within(i, "scale", *scale, radius / LARGEST_RADIUS, *known.end())?;
    within(i, "spacing", *spacing, *known.start(), SPARSEST * radius)?;
    within(i, "residual", *residual, 0.0, ROUGHEST * radius)?;
    within(i, "height_error", *height_error, 0.0, ROUGHEST * radius)?;
    let count = chart.coefficients.len() / normals;
    let ratio = (radius / scale).max(1.0).powi(i32::from(chart.degree));
    for heights in chart.coefficients.chunks(count) {
        let highest = ratio * heights.iter().map(|c| c.abs()).sum::<f64>();
        within(i, "heights up to", highest, 0.0, HIGHEST * radius)?;
        within(
            i,
            "a height at the origin of",
            heights[0].abs(),
            0.0,
            UNIT_ROUNDING * radius,
        )?;
    }
    Ok(())
}

/// Refuses discs that are not at the rim of their chart.
pub(super) fn discs<const D: usize>(
    i: usize,
    chart: &Chart<D>,
    discs: &[Disc<D>],
) -> Result<(), Error> {
    for disc in discs {
        let off = (disc.outward.norm() - 1.0).abs();
        within(
            i,
            "a rim's outward off unit length by",
            off,
            0.0,
            UNIT_ROUNDING,
        )?;
        let [least, most] = [DISCS.start(), DISCS.end()].map(|s| s * chart.spacing);
        within(i, "rim radius", disc.radius, least, most)?;
        within(i, "rim share", disc.share, 0.0, LONGEST_SHARE * disc.radius)?;
        let touched = (disc.touched() - chart.origin).norm();
        within(
            i,
            "a rim at a distance of",
            touched,
            0.0,
            TOUCHED * chart.radius,
        )?;
    }
    Ok(())
}

/// Refuses neighbours that are not beside each other, or not in the order of distance.
pub(super) fn beside<const D: usize>(
    i: usize,
    list: &[ChartIndex],
    charts: &[Chart<D>],
) -> Result<(), Error> {
    let chart = &charts[i];
    let mut before = 0.0;
    for j in &list[1..] {
        let other = &charts[*j as usize];
        let (small, large) = if chart.radius < other.radius {
            (chart.radius, other.radius)
        } else {
            (other.radius, chart.radius)
        };
        let name = |what: &str| format!("{what} neighbour {j} of");
        within(i, &name("beside"), large, 0.0, RADIUS_RATIO * small)?;
        let gap = (other.origin - chart.origin).norm();
        let most = FARTHEST_APART * (small + large);
        within(
            i,
            &name("a distance to"),
            gap,
            CLOSEST_ORIGINS * small,
            most,
        )?;
        expect(Some(i), gap >= before * (1.0 - UNIT_ROUNDING), || {
            (
                format!("neighbour {j} at {gap:e} behind one at {before:e}"),
                "neighbours by distance".to_owned(),
            )
        })?;
        before = gap;
    }
    Ok(())
}

/// Refuses a wavelength of the finest detail that does not fit the charts.
pub(super) fn detail<const D: usize>(detail: f64, charts: &[Chart<D>]) -> Result<(), Error> {
    let radii = || charts.iter().map(|chart| chart.radius);
    let least = WAVELENGTHS[0] * radii().fold(f64::INFINITY, f64::min);
    let most = WAVELENGTHS[1] * radii().fold(0.0, f64::max);
    let holds = detail == 0.0 || (least..=most).contains(&detail);
    expect(None, holds, || {
        (
            format!("detail {detail:e}"),
            format!("0, or {least:e} to {most:e} by the charts' radii"),
        )
    })
}

/// Refuses a number that lies outside its bounds.
fn within(chart: usize, name: &str, found: f64, least: f64, most: f64) -> Result<(), Error> {
    expect(Some(chart), (least..=most).contains(&found), || {
        (
            format!("{name} {found:e}"),
            format!("{least:e} to {most:e} by the chart's other lengths and its neighbours'"),
        )
    })
}

/// Refuses lists of neighbours that do not name each other, and sides that do not belong to them.
pub(super) fn mutual(i: usize, given: &ModelChart, charts: &[ModelChart]) -> Result<(), Error> {
    let (list, sides) = (&given.neighbours, &given.sides);
    // This comes before all else, because the lists are compared item by item below.
    expect(Some(i), list.len() <= charts.len(), || {
        (
            format!("{} neighbours", list.len()),
            format!("at most {}, as there are charts", charts.len()),
        )
    })?;
    expect(Some(i), list.first() == Some(&(i as ChartIndex)), || {
        (
            format!("first neighbour {:?}", list.first()),
            "the chart itself".to_owned(),
        )
    })?;
    for (place, j) in list.iter().enumerate() {
        let other = charts.get(*j as usize);
        let known = other.is_some_and(|other| other.neighbours.contains(&(i as ChartIndex)));
        expect(Some(i), known && !list[..place].contains(j), || {
            (
                format!("neighbour {j}"),
                "different charts that have this one for a neighbour".to_owned(),
            )
        })?;
    }
    let fit = sides.len() == list.len() && sides.iter().all(|side| matches!(side, 1 | -1));
    expect(Some(i), fit, || {
        (
            format!("sides {sides:?}"),
            format!("{} times 1 or -1", list.len()),
        )
    })
}
