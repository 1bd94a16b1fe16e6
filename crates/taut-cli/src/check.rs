//! `taut check`.

use std::io::Write;

use serde::Serialize;
use taut::surface::Surface;
use taut::surface::atlas::Atlas;
use taut_io::PointSet;

use crate::answer::coordinates;
use crate::clouds;
use crate::equations;
use crate::exit::{Exit, Failure};
use crate::output::line;
use crate::progress::Progress;
use crate::settings::{CheckSettings, Model, Source};
use crate::surface::{corners, with_size};

/// What a surface is like. Lengths are in the units of the input.
#[derive(Serialize)]
pub struct Facts {
    /// The file, the equations or the shape.
    pub surface: String,
    /// Coordinates of a point.
    pub coordinates: usize,
    /// Dimension of the surface.
    pub dimension: usize,
    #[serde(flatten)]
    pub points: Option<PointFacts>,
    /// Smallest and largest coordinate on each axis.
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    /// Number of points (for equations: of samples) of each connected piece, largest first.
    pub components: Vec<usize>,
    /// What will go wrong, in sentences.
    pub warnings: Vec<String>,
}

/// What the rows of a file are like.
#[derive(Serialize)]
pub struct PointFacts {
    /// Rows of the file that were read.
    pub rows: usize,
    /// Distinct finite points.
    pub points: usize,
    pub duplicates: usize,
    pub non_finite: usize,
    /// Distinct points too far from the surface to be ends of paths.
    pub off_surface: usize,
}

/// Tells what the surface is like.
pub fn run(settings: &CheckSettings, progress: &Progress) -> Result<Exit, Failure> {
    let facts = match &settings.source {
        Source::Cloud(cloud) => {
            let points = clouds::read(cloud, progress)?;
            let name = cloud.file.display().to_string();
            with_size!(
                points.dimension,
                cloud_facts(&name, &points, cloud.model, progress)
            )?
        }
        Source::Equations(equations) => equations::facts(equations, progress)?,
    };
    progress.clear();
    let mut out = std::io::stdout().lock();
    if settings.json {
        let text = serde_json::to_string(&facts).map_err(std::io::Error::from)?;
        writeln!(out, "{text}")?;
    } else {
        write(&mut out, &facts)?;
    }
    Ok(Exit::Success)
}

fn cloud_facts<const D: usize>(
    name: &str,
    points: &PointSet,
    model: Model,
    progress: &Progress,
) -> Result<Facts, Failure> {
    let atlas: Atlas<D> = clouds::atlas(name, points, model.dimension, progress)?;
    let dimension = Surface::intrinsic_dimension(&atlas);
    let cloud = atlas.cloud();
    let (low, high) = corners(&cloud.points);
    let [low, high] = [low, high].map(|v| coordinates(&(v + cloud.centre), points.dimension));
    let mut counts = PointFacts {
        rows: points.rows(),
        points: cloud.points.len(),
        duplicates: cloud.duplicates,
        non_finite: cloud.non_finite,
        off_surface: 0,
    };
    progress.step("components");
    let (components, off_surface) = clouds::component_points(atlas);
    counts.off_surface = off_surface;
    Ok(Facts {
        surface: name.to_owned(),
        coordinates: points.dimension,
        dimension,
        low,
        high,
        warnings: warnings(&counts, &components),
        components,
        points: Some(counts),
    })
}

/// What will go wrong with a cloud.
fn warnings(points: &PointFacts, components: &[usize]) -> Vec<String> {
    let mut warnings = Vec::new();
    if points.non_finite > 0 {
        warnings.push(format!(
            "{} of {} rows are dropped because a coordinate is not finite; they cannot be ends of paths",
            points.non_finite, points.rows
        ));
    }
    if points.duplicates > 0 {
        warnings.push(format!(
            "{} rows repeat the place of another and count once",
            points.duplicates
        ));
    }
    if points.off_surface > 0 {
        warnings.push(format!(
            "{} points lie too far from the surface, or where it is undefined, to be ends of paths",
            points.off_surface
        ));
    }
    if let [largest, rest @ ..] = components
        && !rest.is_empty()
    {
        let unreachable: usize = rest.iter().sum();
        warnings.push(format!(
            "the surface has {} pieces: no path connects the largest, of {largest} points, with the {unreachable} points of the others",
            components.len()
        ));
    }
    warnings
}

/// Components listed one by one.
const LISTED: usize = 5;

fn write(out: &mut impl Write, facts: &Facts) -> std::io::Result<()> {
    line(out, "surface", &facts.surface)?;
    line(
        out,
        "dimension",
        &format!("{} in {} coordinates", facts.dimension, facts.coordinates),
    )?;
    if let Some(points) = &facts.points {
        line(out, "rows", &points.rows.to_string())?;
        line(out, "distinct points", &points.points.to_string())?;
        line(out, "duplicates", &points.duplicates.to_string())?;
        line(out, "not finite", &points.non_finite.to_string())?;
        line(out, "off the surface", &points.off_surface.to_string())?;
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
    let unit = match facts.points {
        Some(_) => "points of each",
        None => "samples of each",
    };
    line(out, unit, &format!("{}{more}", list(shown)))?;
    for warning in &facts.warnings {
        line(out, "warning", warning)?;
    }
    Ok(())
}

fn list<T: ToString>(values: &[T]) -> String {
    let values: Vec<String> = values.iter().map(T::to_string).collect();
    values.join(", ")
}
