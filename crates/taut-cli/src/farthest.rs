//! `taut sample --farthest`.

use std::io;

use serde::Serialize;
use taut::End;
use taut::kind::Kind;
use taut::size::flat;
use taut_core::error::Error;
use taut_core::field;
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_io::PointSet;

use crate::clouds;
use crate::exit::{Exit, Failure};
use crate::numbers::rounded;
use crate::output::{line, tell};
use crate::picture;
use crate::progress::Progress;
use crate::settings::{CloudSettings, SampleSettings};
use crate::sites;
use crate::surface::{FlatSamples, with_size};

/// What is told of points far from each other. Lengths are in the units of the input.
#[derive(Serialize)]
struct Facts {
    surface: String,
    /// Rows of the file, in the order in which they were found.
    rows: Vec<usize>,
    /// Every point lies within this distance of one of them; `None` where some piece has none.
    cover: Option<f64>,
    /// Largest estimated error of the distances that it was found from.
    error: f64,
    #[serde(skip)]
    points: FlatSamples,
}

/// Finds points of a cloud far from each other and writes what was asked for.
pub fn run(
    settings: &SampleSettings,
    cloud: &CloudSettings,
    progress: &Progress,
) -> Result<Exit, Failure> {
    clouds::refuse_mls(&cloud.model)?;
    let points = clouds::read(cloud, progress)?;
    let facts = with_size!(points.dimension, found(settings, cloud, &points, progress))?;
    if let Some(file) = &settings.output {
        progress.step("writing the points");
        taut_io::write_points(file, points.dimension, &facts.points.points, None)?;
    }
    if let Some(file) = &settings.picture {
        progress.step("drawing");
        picture::draw(file, &facts.points, &[])?;
    }
    progress.clear();
    tell(&facts, settings.json, write)?;
    Ok(Exit::Success)
}

fn found<const D: usize>(
    settings: &SampleSettings,
    cloud: &CloudSettings,
    points: &PointSet,
    progress: &Progress,
) -> Result<Facts, Failure> {
    let name = cloud.file.display().to_string();
    let atlas = clouds::atlas::<D>(&name, points, &cloud.model, progress)?;
    clouds::note_changes(&name, &atlas, progress);
    let refused = |error| Failure::Surface {
        surface: name.clone(),
        error,
    };
    let ends = sites::ends_of_sources("--sources", &settings.sources, points.dimension, progress)?;
    let position = |end: &End| {
        let wrong = |reason: &str| Failure::End {
            end: end.to_string(),
            reason: reason.to_owned(),
        };
        let End::Row(row) = end else {
            return Err(wrong(
                "found coordinates, expected a row of the file, because --farthest keeps points of the file",
            ));
        };
        let read = match &points.rows_kept {
            Some(kept) => kept.binary_search(row).ok(),
            None => Some(*row),
        };
        let point = read.and_then(|row| atlas.cloud().point_of_row.get(row).copied().flatten());
        let found = point.ok_or_else(|| wrong("the row is not among the points of the surface"));
        found.map(|point| point as usize)
    };
    let first: Vec<usize> = ends.iter().map(position).collect::<Result<_, _>>()?;
    let geodesics = Geodesics::of_atlas(atlas).into_kind();
    let fields = Kind::fields(&geodesics, None).map_err(refused)?;
    progress.step("distances");
    progress.count_to(settings.count);
    let found = fields
        .farthest(&first, settings.count, &field::Settings::default(), |_| {
            progress.done(1);
        })
        .map_err(refused)?;
    let atlas = geodesics.surface().atlas();
    let cloud = atlas.ok_or_else(|| refused(Error::NoCloud))?.cloud();
    let kept: Vec<_> = found.points.iter().map(|i| cloud.points[*i]).collect();
    let row_of_file = |i: &usize| {
        let read = cloud.rows[*i] as usize;
        points.rows_kept.as_ref().map_or(read, |kept| kept[read])
    };
    Ok(Facts {
        surface: name.clone(),
        rows: found.points.iter().map(row_of_file).collect(),
        cover: Some(found.cover).filter(|cover| cover.is_finite()),
        error: found.error,
        points: FlatSamples {
            dimension: points.dimension,
            points: flat(&kept, &cloud.centre, points.dimension),
            discs: None,
        },
    })
}

fn write(out: &mut io::StdoutLock<'_>, facts: &Facts) -> io::Result<()> {
    line(out, "surface", &facts.surface)?;
    line(out, "points", &facts.rows.len().to_string())?;
    let cover = facts.cover.map_or_else(
        || "none, because a piece of the surface has no such point".to_owned(),
        |cover| {
            format!(
                "every point lies within {} ± {:.1e} of one of them",
                rounded(cover, facts.error),
                facts.error
            )
        },
    );
    line(out, "cover", &cover)?;
    let rows: Vec<String> = facts.rows.iter().map(usize::to_string).collect();
    line(out, "rows", &rows.join(" "))
}
