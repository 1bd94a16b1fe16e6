//! Point clouds made ready: files read, surfaces put through their points.

use std::path::Path;

use taut::Error;
use taut::kind::Kind;
use taut_core::cloud::Cloud;
use taut_core::geodesics::Geodesics;
use taut_core::surface::Surface;
use taut_core::surface::atlas::Atlas;
use taut_io::{PointSet, ReadOptions};

use crate::exit::Failure;
use crate::progress::Progress;
use crate::source::CloudSurface;
use crate::surface::Samples;

/// Reads the points of a file and passes on the reader's notes.
pub fn read(file: &Path, options: &ReadOptions, progress: &Progress) -> Result<PointSet, Failure> {
    progress.step(format!("reading {}", file.display()));
    let points = taut_io::read(file, options)?;
    for note in &points.notes {
        progress.note(&format!("{}: {note}", file.display()));
    }
    Ok(points)
}

/// A smooth surface through points.
pub fn atlas<const D: usize>(
    name: &str,
    points: &PointSet,
    model: &CloudSurface,
    progress: &Progress,
) -> Result<Atlas<D>, Failure> {
    let refused = |error| Failure::Surface {
        surface: name.to_owned(),
        error,
    };
    progress.step(format!("surface of {} points", points.rows()));
    let intrinsic = intrinsic_dimension::<D>(model.dimension, points.dimension)?;
    let intervals = intervals::<D>(&model.cells, points.dimension)?;
    let cloud = Cloud::new(&points.coordinates, points.dimension).map_err(refused)?;
    match intervals {
        Some(intervals) => Atlas::with_cells(cloud, intrinsic, &intervals),
        None => Atlas::new(cloud, intrinsic),
    }
    .map_err(refused)
}

/// The dimension asked for, or that of a surface in space.
pub fn intrinsic_dimension<const D: usize>(
    asked: Option<usize>,
    dimension: usize,
) -> Result<usize, Failure> {
    taut::size::intrinsic_dimension::<D>(asked, dimension).map_err(|error| {
        Failure::Usage(match error {
            Error::Dimension { found: None, most, .. } => format!(
                "points of {dimension} coordinates may lie on a surface of dimension 1 to {most}; name its dimension with --dimension"
            ),
            Error::Dimension { found: Some(found), most, .. } => format!(
                "--dimension: found {found}, expected 1 to {most} for points of {dimension} coordinates"
            ),
            other => other.to_string(),
        })
    })
}

/// The interval of the grid of cells along each axis; those of the padding do not matter.
fn intervals<const D: usize>(asked: &[f64], dimension: usize) -> Result<Option<[f64; D]>, Failure> {
    let mut intervals = [1.0; D];
    match asked {
        [] => return Ok(None),
        [one] => intervals.fill(*one),
        each if each.len() == dimension => intervals[..dimension].copy_from_slice(each),
        each => {
            return Err(Failure::Usage(format!(
                "--cell: found {} intervals, expected 1 or {dimension}, one for each coordinate",
                each.len()
            )));
        }
    }
    Ok(Some(intervals))
}

/// A surface of moving least squares.
pub fn mls(
    name: &str,
    points: &PointSet,
    model: &CloudSurface,
    progress: &Progress,
) -> Result<Geodesics<3, Kind<3>>, Failure> {
    if !(2..=3).contains(&points.dimension) {
        return Err(Failure::Usage(format!(
            "--surface mls: found points of {} coordinates, expected 2 or 3; leave it out",
            points.dimension
        )));
    }
    let atlas = atlas::<3>(name, points, model, progress)?;
    note_changes(name, &atlas, progress);
    let made = Geodesics::of_mls(atlas, None).map(Geodesics::into_kind);
    made.map_err(|error| Failure::Usage(format!("{name}: {error}")))
}

/// Notes points dropped, merged and added.
pub fn note_changes<const D: usize>(name: &str, atlas: &Atlas<D>, progress: &Progress) {
    let (non_finite, duplicates) = (atlas.cloud().non_finite, atlas.cloud().duplicates);
    if non_finite > 0 {
        progress.note(&format!(
            "{name}: {non_finite} points are dropped because a coordinate is not finite"
        ));
    }
    let far = atlas.cloud().far;
    if far > 0 {
        progress.note(&format!(
            "{name}: {far} points are left out because they lie more than 1e7 times as far off as all others (do they stand for missing data?)"
        ));
    }
    if duplicates > 0 {
        progress.note(&format!(
            "{name}: {duplicates} points repeat the coordinates of another point and count once"
        ));
    }
    let added = atlas.points_between_rows();
    if added > 0 {
        progress.note(&format!(
            "{name}: its points lie in rows far apart, and {added} more were put between them: no error estimate knows how good these are"
        ));
    }
    for doubt in atlas.doubts() {
        progress.note(&format!("{name}: {doubt}"));
    }
}

/// The part of a chart's support that is its own.
const OWN: f64 = 0.6;

impl<const D: usize> Samples<D> {
    /// Points on the charts of a surface.
    pub fn of_charts(atlas: &Atlas<D>) -> Self {
        let reach = |chart| OWN * atlas.resolution(chart);
        let nodes = atlas.nodes().into_iter();
        let centres: Vec<_> = nodes.map(|node| (node, reach(node.place))).collect();
        Self::about(atlas, &centres)
    }

    /// The points of a cloud.
    pub fn of_cloud(cloud: &Cloud<D>) -> Self {
        Self {
            points: cloud.points.clone(),
            discs: None,
        }
    }
}
