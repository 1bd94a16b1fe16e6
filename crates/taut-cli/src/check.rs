//! `taut check`.

use std::io::Write;

use clap::Args;
use taut::equations::Implicit;
use taut::kind::Kind;
use taut::size::coordinates;
use taut_core::geodesics::Geodesics;
use taut_core::surface::Surface;
use taut_core::surface::atlas::Atlas;
use taut_core::surface::atlas::doubts::Doubt;

use crate::equations;
use crate::exit::{Exit, Failure};
use crate::facts::{ChartFacts, PointFacts, SurfaceFacts};
use crate::numbers::significant;
use crate::output::{line, tell};
use crate::progress::Progress;
use crate::ready::{self, Ready, Visit};
use crate::source::{Source, SurfaceFlags};
use crate::surface::corners;
use crate::values::Reconstruction;

#[derive(Debug, Args)]
pub struct Flags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// Write one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Tells what the surface is like.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let mut source = flags.surface.source()?;
    // Surfaces of both kinds rest on the charts, and these are what there is to tell of.
    if let Source::Cloud(cloud) = &mut source {
        cloud.model.reconstruction = Reconstruction::Atlas;
    }
    let facts = ready::visit(&source, Checked, progress)?;
    progress.clear();
    tell(&facts, flags.json, |out, facts| write(out, facts))?;
    Ok(Exit::Success)
}

/// The facts of any surface.
struct Checked;

impl Visit for Checked {
    type Answer = SurfaceFacts;

    fn charts<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<SurfaceFacts, Failure> {
        progress.step("report");
        let atlas = ready.atlas()?;
        let report = atlas.report();
        let cloud = atlas.cloud();
        let (low, high) = corners(&cloud.points);
        let [low, high] = [low, high].map(|v| coordinates(&(v + cloud.centre), ready.dimension));
        let charts = ChartFacts::new(&report);
        let points = ready.points.map(|points| PointFacts {
            rows: points.rows(),
            points: cloud.points.len(),
            duplicates: cloud.duplicates,
            non_finite: cloud.non_finite,
            far: cloud.far,
            other_sheet: report.other_sheet,
            outliers: report.outliers,
            points_between_rows: report.points_between_rows,
        });
        let components = match points {
            Some(_) => component_points(&ready.geodesics, atlas),
            None => ready.geodesics.component_sizes().to_vec(),
        };
        let warnings = points.as_ref().map_or(Vec::new(), |points| {
            warnings(points, &charts, &components, &atlas.doubts())
        });
        Ok(SurfaceFacts {
            surface: ready.name.to_owned(),
            coordinates: ready.dimension,
            intrinsic_dimension: report.intrinsic_dimension,
            low,
            high,
            warnings,
            components,
            points,
            charts: Some(charts),
        })
    }

    fn equations<const D: usize>(
        self,
        law: &Implicit,
        progress: &Progress,
    ) -> Result<SurfaceFacts, Failure> {
        let geodesics = equations::searched::<D>(law, progress)?;
        let (low, high) = corners(&geodesics.surface().samples());
        Ok(SurfaceFacts {
            surface: law.law.to_string(),
            coordinates: law.dimension,
            intrinsic_dimension: Surface::intrinsic_dimension(geodesics.surface()),
            points: None,
            charts: None,
            low: coordinates(&low, law.dimension),
            high: coordinates(&high, law.dimension),
            components: geodesics.component_sizes().to_vec(),
            warnings: Vec::new(),
        })
    }
}

/// The number of points on each component of a cloud's surface, largest first.
fn component_points<const D: usize>(
    geodesics: &Geodesics<D, Kind<D>>,
    atlas: &Atlas<D>,
) -> Vec<usize> {
    let mut counts = vec![0; geodesics.component_sizes().len()];
    for row in &atlas.cloud().rows {
        if let Some(component) = geodesics.component_of_row(*row as usize) {
            counts[component as usize] += 1;
        }
    }
    counts.retain(|count| *count > 0);
    counts.sort_unstable_by_key(|count| std::cmp::Reverse(*count));
    counts
}

/// Sheets nearer than so many spacings may be read as one.
const NEAR_SHEET: f64 = 2.0;
/// Noise of more spacings than this blurs what a few points could tell.
const LOUD: f64 = 0.5;
/// Ratio of wide to narrow spacings that is no longer even.
const UNEVEN: f64 = 5.0;
/// Share of outliers that is no longer an accident.
const MANY_OUTLIERS: f64 = 0.01;

/// What will go wrong with a cloud.
fn warnings(
    points: &PointFacts,
    charts: &ChartFacts,
    components: &[usize],
    doubts: &[Doubt],
) -> Vec<String> {
    let of_rows = rows_lost(points);
    let of_surface = surface_doubts(points, charts);
    let mut warnings: Vec<String> = of_rows.into_iter().chain(of_surface).collect();
    // Sheets that come near are told as such whatever the noise.
    let told = points
        .other_sheet
        .is_some_and(|distance| distance < NEAR_SHEET);
    let untold = |doubt: &&Doubt| !(told && matches!(doubt, Doubt::NearSheet { .. }));
    warnings.extend(doubts.iter().filter(untold).map(ToString::to_string));
    if let [largest, rest @ ..] = components
        && !rest.is_empty()
    {
        let unreachable: usize = rest.iter().sum();
        warnings.push(format!(
            "the surface has {} pieces: no path connects the largest piece, which has {largest} points, with the {unreachable} points of the others",
            components.len()
        ));
    }
    warnings
}

fn rows_lost(points: &PointFacts) -> Vec<String> {
    let mut warnings = Vec::new();
    if points.non_finite > 0 {
        warnings.push(format!(
            "{} of {} rows are dropped because a coordinate is not finite; they cannot be ends of paths",
            points.non_finite, points.rows
        ));
    }
    if points.far > 0 {
        warnings.push(format!(
            "{} of {} rows are left out because they lie more than 1e7 times as far off as all others (do they stand for missing data?); they cannot be ends of paths",
            points.far, points.rows
        ));
    }
    if points.duplicates > 0 {
        warnings.push(format!(
            "{} rows repeat the coordinates of another row and count once",
            points.duplicates
        ));
    }
    warnings
}

fn surface_doubts(points: &PointFacts, charts: &ChartFacts) -> Vec<String> {
    let mut warnings = Vec::new();
    let [narrow, spacing, wide] = charts.spacing;
    if let Some(distance) = points.other_sheet.filter(|distance| *distance < NEAR_SHEET) {
        warnings.push(format!(
            "another sheet comes as near as {} spacings: sheets nearer than about {NEAR_SHEET} spacings may be read as one, and paths then cross between them",
            significant(distance)
        ));
    }
    if charts.noise > LOUD * spacing {
        warnings.push(format!(
            "the points lie {} spacings off the surface fitted to them: the surface is smoothed, and detail as fine as this is lost",
            significant(charts.noise / spacing)
        ));
    }
    if wide > UNEVEN * narrow {
        warnings.push(format!(
            "the spacing varies {}-fold between its 10th and 90th percentile: the surface is least known where points are sparse",
            significant(wide / narrow)
        ));
    }
    if points.outliers as f64 > MANY_OUTLIERS * points.points as f64 {
        warnings.push(format!(
            "{} of {} points are outliers that no chart fits; remove them, or do not start paths there",
            points.outliers, points.points
        ));
    }
    if points.points_between_rows > 0 {
        warnings.push(format!(
            "the points lie in rows far apart, and {} more were put between them: no error estimate knows how good these are",
            points.points_between_rows
        ));
    }
    warnings
}

/// Components listed one by one.
const LISTED: usize = 5;

fn write(out: &mut impl Write, facts: &SurfaceFacts) -> std::io::Result<()> {
    line(out, "surface", &facts.surface)?;
    line(
        out,
        "dimension",
        &format!(
            "{} in {} coordinates",
            facts.intrinsic_dimension, facts.coordinates
        ),
    )?;
    if let Some(points) = &facts.points {
        write_points(out, points)?;
    }
    if let Some(charts) = &facts.charts {
        write_charts(out, charts)?;
    }
    line(out, "lowest coordinates", &list(&facts.low))?;
    line(out, "highest coordinates", &list(&facts.high))?;
    line(out, "components", &facts.components.len().to_string())?;
    let shown = &facts.components[..facts.components.len().min(LISTED)];
    let more = if facts.components.len() > LISTED {
        ", .."
    } else {
        ""
    };
    let unit = match (&facts.points, &facts.charts) {
        (Some(_), _) => "points of each",
        (None, Some(_)) => "charts of each",
        (None, None) => "samples of each",
    };
    line(out, unit, &format!("{}{more}", list(shown)))?;
    for warning in &facts.warnings {
        line(out, "warning", warning)?;
    }
    Ok(())
}

fn write_points(out: &mut impl Write, points: &PointFacts) -> std::io::Result<()> {
    let other = match points.other_sheet {
        None => "none seen".to_owned(),
        Some(distance) => format!("{} spacings away", significant(distance)),
    };
    for (name, value) in [
        ("rows", points.rows.to_string()),
        ("distinct points", points.points.to_string()),
        ("duplicates", points.duplicates.to_string()),
        ("not finite", points.non_finite.to_string()),
        ("too far off", points.far.to_string()),
        ("outliers", points.outliers.to_string()),
        ("nearest other sheet", other),
    ] {
        line(out, name, &value)?;
    }
    Ok(())
}

fn write_charts(out: &mut impl Write, charts: &ChartFacts) -> std::io::Result<()> {
    let [narrow, spacing, wide] = charts.spacing.map(significant);
    let noise = [charts.noise, charts.noise / charts.spacing[1]].map(significant);
    let degrees: Vec<String> = (1..)
        .zip(charts.degrees)
        .map(|(degree, charts)| format!("{charts} of degree {degree}"))
        .collect();
    let rim = match charts.rim_length {
        0.0 => "none".to_owned(),
        length => format!("{} long, holes included", significant(length)),
    };
    for (name, value) in [
        (
            "spacing",
            format!("{spacing} (10 % below {narrow}, 10 % above {wide})"),
        ),
        ("noise", format!("{} ({} spacings)", noise[0], noise[1])),
        ("height error", significant(charts.height_error)),
        ("rims", rim),
        ("charts", degrees.join(", ")),
    ] {
        line(out, name, &value)?;
    }
    Ok(())
}

fn list<T: ToString>(values: &[T]) -> String {
    let values: Vec<String> = values.iter().map(T::to_string).collect();
    values.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn healthy() -> (PointFacts, ChartFacts) {
        let points = PointFacts {
            rows: 1000,
            points: 1000,
            duplicates: 0,
            non_finite: 0,
            far: 0,
            other_sheet: Some(2.1),
            outliers: 10,
            points_between_rows: 0,
        };
        let charts = ChartFacts {
            charts: 100,
            spacing: [0.08, 0.1, 0.12],
            noise: 0.049,
            height_error: 0.001,
            degrees: [0, 0, 0, 100],
            rim_length: 1.0,
        };
        (points, charts)
    }

    #[test]
    fn each_doubt_has_its_warning() {
        let (points, charts) = healthy();
        assert_eq!(warnings(&points, &charts, &[1000], &[]), [""; 0]);
        type Spoil = fn(&mut PointFacts, &mut ChartFacts);
        let doubts: [(Spoil, &str); 5] = [
            (
                |points, _| points.other_sheet = Some(1.94),
                "as near as 1.9 spacings",
            ),
            (|_, charts| charts.noise = 0.06, "0.60 spacings off"),
            (|_, charts| charts.spacing[2] = 0.48, "varies 6.0-fold"),
            (
                |points, _| points.points_between_rows = 120,
                "120 more were put between",
            ),
            (
                |points, _| points.outliers = 11,
                "11 of 1000 points are outliers",
            ),
        ];
        for (spoil, words) in doubts {
            let (mut points, mut charts) = healthy();
            spoil(&mut points, &mut charts);
            let said = warnings(&points, &charts, &[1000], &[]);
            assert!(said.len() == 1 && said[0].contains(words), "{said:?}");
        }
    }
}
