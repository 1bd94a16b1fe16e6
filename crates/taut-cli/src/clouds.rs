//! Point clouds made ready: files read, surfaces put through their points.

use taut::End;
use taut_core::cloud::Cloud;
use taut_core::geodesics::Geodesics;
use taut_core::surface::Surface;
use taut_core::surface::atlas::Atlas;
use taut_io::PointSet;

use crate::exit::Failure;
use crate::located::Located;
use crate::prepared::Prepared;
use crate::progress::Progress;
use crate::settings::{CloudSettings, Model};
use crate::surface::{Samples, with_size};
use crate::values::Reconstruction;

/// Reads a file, puts a surface through its points and locates the ends on it.
pub fn prepare(
    settings: &CloudSettings,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    let points = read(settings, progress)?;
    let name = settings.file.display().to_string();
    let model = &settings.model;
    match (model.reconstruction, points.dimension) {
        (Reconstruction::Atlas, dimension) => {
            with_size!(dimension, of_atlas(&name, &points, model, ends, progress))
        }
        (Reconstruction::Mls, 2 | 3) => of_mls(&name, &points, model, ends, progress),
        (Reconstruction::Mls, found) => Err(Failure::Usage(format!(
            "--surface mls: found points of {found} coordinates, expected 2 or 3; leave it out"
        ))),
    }
}

/// Reads the points of a file and passes on the reader's notes.
pub fn read(settings: &CloudSettings, progress: &Progress) -> Result<PointSet, Failure> {
    progress.step(format!("reading {}", settings.file.display()));
    let points = taut_io::read(&settings.file, &settings.options)?;
    for note in &points.notes {
        progress.note(&format!("{}: {note}", settings.file.display()));
    }
    Ok(points)
}

/// Refuses a kind of surface on which only paths are found.
pub fn refuse_mls(model: &Model) -> Result<(), Failure> {
    match model.reconstruction {
        Reconstruction::Atlas => Ok(()),
        Reconstruction::Mls => Err(Failure::Usage(
            "--surface mls: only taut path works on this surface; leave it out".to_owned(),
        )),
    }
}

/// A smooth surface through points.
pub fn atlas<const D: usize>(
    name: &str,
    points: &PointSet,
    model: &Model,
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
    let most = dimension.min(D - 1);
    match asked {
        Some(found) if (1..=most).contains(&found) => Ok(found),
        Some(found) => Err(Failure::Usage(format!(
            "--dimension: found {found}, expected 1 to {most} for points of {dimension} coordinates"
        ))),
        None if dimension <= 3 => Ok(2),
        None => Err(Failure::Usage(format!(
            "points of {dimension} coordinates may lie on a surface of dimension 1 to {most}; name its dimension with --dimension"
        ))),
    }
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

/// A surface through points, with ends located on it; `name` is what errors call the points.
pub fn of_atlas<const D: usize>(
    name: &str,
    points: &PointSet,
    model: &Model,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    let atlas = atlas::<D>(name, points, model, progress)?;
    note_changes(name, &atlas, progress);
    let geodesics = Geodesics::of_atlas(atlas).into_kind();
    let rows_kept = points.rows_kept.as_deref();
    let located = Located::new(geodesics, points.dimension, ends, rows_kept);
    Ok(Box::new(located))
}

fn of_mls(
    name: &str,
    points: &PointSet,
    model: &Model,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    let atlas = atlas::<3>(name, points, model, progress)?;
    note_changes(name, &atlas, progress);
    let geodesics = Geodesics::of_mls(atlas, None)
        .map_err(|error| Failure::Usage(format!("{name}: {error}")))?;
    let rows_kept = points.rows_kept.as_deref();
    let located = Located::new(geodesics.into_kind(), points.dimension, ends, rows_kept);
    Ok(Box::new(located))
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

/// The number of points on each component of a cloud's surface, largest first.
pub fn component_points<const D: usize>(atlas: Atlas<D>) -> Vec<usize> {
    let geodesics = Geodesics::of_atlas(atlas);
    let mut counts = vec![0; geodesics.component_sizes().len()];
    for row in &geodesics.surface().cloud().rows {
        if let Some(component) = geodesics.component_of_row(*row as usize) {
            counts[component as usize] += 1;
        }
    }
    counts.retain(|count| *count > 0);
    counts.sort_unstable_by_key(|count| std::cmp::Reverse(*count));
    counts
}
