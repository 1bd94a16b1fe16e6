//! `taut fit`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use taut_core::cloud::Cloud;
use taut_core::surface::atlas::{Atlas, Fit, FitSettings};
use taut_io::PointSet;

use crate::clouds;
use crate::exit::{Exit, Failure};
use crate::models;
use crate::numbers::significant;
use crate::output::{line, tell};
use crate::outputs::Files;
use crate::picture;
use crate::progress::Progress;
use crate::source::{MODEL_EXTENSION, PointFlags, formats};
use crate::surface::{Samples, flat_samples, too_many};
use crate::values::positive;

pub const EXAMPLES: &str = "\
Examples:
  taut fit scan.ply -o scan.taut
  taut fit scan.las --class 2 --accuracy 0.05 -o ground.taut --picture ground.png
  taut path scan.taut --from 0.1,0,-2 --to 0.3,0.2,-1.5

The model is an implicit surface F = 0, made of smooth charts that pass the points within the
accuracy. The normals of the file say which side is positive. Without normals, F is positive
outside.";

#[derive(Debug, Args)]
pub struct Flags {
    #[arg(value_name = "CLOUD", help = format!("A file of points: {}", formats()))]
    pub file: PathBuf,
    /// The distance from the surface within which the points must lie, in their units; a larger one
    /// gives a smoother surface [default: a thousandth of the diagonal of the points' box]
    #[arg(long, value_name = "LENGTH", value_parser = positive, allow_negative_numbers = true)]
    pub accuracy: Option<f64>,
    /// Where to put the model
    #[arg(long, short, value_name = "FILE.taut")]
    pub output: PathBuf,
    #[command(flatten)]
    pub points: PointFlags,
    /// Write one JSON object
    #[arg(long)]
    pub json: bool,
    /// Draw the surface
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

/// What came of the fit; lengths are in the units of the input.
#[derive(Serialize)]
struct FitFacts {
    surface: String,
    model: String,
    points: usize,
    charts: usize,
    accuracy: f64,
    residual: f64,
    largest_residual: f64,
    beyond: usize,
    outliers: usize,
    normals_given: bool,
    normals_against: usize,
    contradictions: usize,
    rim_length: f64,
    warnings: Vec<String>,
}

/// Fits a surface and writes it.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let extension = flags.output.extension();
    if extension.is_none_or(|found| found != MODEL_EXTENSION) {
        return Err(Failure::Usage(format!(
            "--output: found {}, expected the extension .{MODEL_EXTENSION}, which marks a model; rename it",
            flags.output.display()
        )));
    }
    Files::default()
        .reads("CLOUD", Some(&flags.file))
        .writes_any("--output", Some(&flags.output))
        .writes_picture(flags.picture.as_deref())
        .check()?;
    taut_io::check_place(&flags.output)?;
    let points = clouds::read(&flags.file, &flags.points.options(), progress)?;
    let facts = taut::by_size!(points.dimension, too_many, fitted(flags, &points, progress))?;
    progress.clear();
    tell(&facts, flags.json, |out, facts| write(out, facts))?;
    Ok(Exit::Success)
}

fn fitted<const D: usize>(
    flags: &Flags,
    points: &PointSet,
    progress: &Progress,
) -> Result<FitFacts, Failure> {
    let name = flags.file.display().to_string();
    let refused = |error| Failure::Surface {
        surface: name.clone(),
        error,
    };
    let intrinsic = clouds::intrinsic_dimension::<D>(flags.points.dimension, points.dimension)?;
    progress.step(format!("fitting {} points", points.rows()));
    let cloud = Cloud::<D>::new(&points.coordinates, points.dimension).map_err(refused)?;
    let fit_settings = FitSettings {
        accuracy: flags.accuracy,
        normals: points.normals.as_deref(),
    };
    let (atlas, fit) = Atlas::fit(cloud, intrinsic, &fit_settings).map_err(refused)?;
    clouds::note_changes(&name, &atlas, progress);
    progress.step(format!("writing {}", flags.output.display()));
    models::write(&flags.output, &atlas, points.dimension)?;
    if let Some(file) = &flags.picture {
        progress.step("drawing");
        let samples = flat_samples(
            &Samples::of_charts(&atlas),
            &atlas.cloud().centre,
            points.dimension,
        );
        picture::draw(file, &samples, &[])?;
    }
    let report = atlas.report();
    Ok(FitFacts {
        surface: name,
        model: flags.output.display().to_string(),
        points: atlas.cloud().points.len(),
        charts: report.charts,
        accuracy: fit.accuracy,
        residual: fit.residual,
        largest_residual: fit.largest_residual,
        beyond: fit.beyond,
        outliers: report.outliers,
        normals_given: points.normals.is_some(),
        normals_against: fit.normals_against,
        contradictions: fit.contradictions,
        rim_length: report.rim_length,
        warnings: warnings(&fit, report.rim_length),
    })
}

/// What a user of the model must know.
fn warnings(fit: &Fit, rim_length: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    if fit.beyond > 0 {
        warnings.push(format!(
            "{} points lie farther than {} from the surface, the farthest of them {} away: they are outliers, creases or noise; a larger --accuracy smooths more",
            fit.beyond,
            significant(fit.accuracy),
            significant(fit.largest_residual)
        ));
    }
    if fit.contradictions > 0 {
        warnings.push(format!(
            "{} pairs of neighbouring charts cannot agree on a side: the surface has only one side there, or layers are joined",
            fit.contradictions
        ));
    }
    if fit.normals_against > 0 {
        warnings.push(format!(
            "{} normals of the file point to the other side than those around them; in each piece the surface follows the majority",
            fit.normals_against
        ));
    }
    if rim_length > 0.0 {
        warnings.push(format!(
            "the surface is open: its rims (its boundary, holes included) are {} long; it is known up to them, and beyond them the two sides of F meet",
            significant(rim_length)
        ));
    }
    warnings
}

fn write(out: &mut impl Write, facts: &FitFacts) -> std::io::Result<()> {
    let normals = match facts.normals_given {
        true => "given",
        false => "estimated",
    };
    for (name, value) in [
        ("surface", facts.surface.clone()),
        ("model", facts.model.clone()),
        ("points", facts.points.to_string()),
        ("charts", facts.charts.to_string()),
        ("accuracy asked", significant(facts.accuracy)),
        (
            "residual",
            format!(
                "{} (root mean square), {} at most",
                significant(facts.residual),
                significant(facts.largest_residual)
            ),
        ),
        ("points beyond", facts.beyond.to_string()),
        ("outliers", facts.outliers.to_string()),
        ("normals", normals.to_owned()),
        ("contradictions", facts.contradictions.to_string()),
    ] {
        line(out, name, &value)?;
    }
    for warning in &facts.warnings {
        line(out, "warning", warning)?;
    }
    Ok(())
}
