//! Where a surface comes from, checked.

use std::path::{Path, PathBuf};

use taut::End;
use taut::equations::{Bounds, Implicit, Law};
use taut_core::surface::shapes::Shape;
use taut_formula::Formula;
use taut_io::ReadOptions;

use crate::exit::Failure;
use crate::flags::{PointFlags, SourceFlags, SurfaceFlags};
use crate::values::Reconstruction;

/// The extension of a model's file.
pub const MODEL_EXTENSION: &str = "taut";

/// Where the surface comes from.
pub enum Source {
    Cloud(CloudSettings),
    /// The file of a fitted model.
    Model(PathBuf),
    Equations(Implicit),
}

impl Source {
    /// Coordinates of a point, where they are known before anything is read.
    pub fn dimension(&self) -> Option<usize> {
        match self {
            Self::Equations(settings) => Some(settings.dimension),
            Self::Cloud(_) | Self::Model(_) => None,
        }
    }

    /// The file that holds the surface's own points.
    pub fn points(&self) -> Option<&Path> {
        match self {
            Self::Cloud(cloud) => Some(&cloud.file),
            Self::Model(_) | Self::Equations(_) => None,
        }
    }
}

/// A point cloud in a file.
pub struct CloudSettings {
    pub file: PathBuf,
    pub options: ReadOptions,
    pub model: Model,
}

/// What surface to put through points.
#[derive(Clone, Default)]
pub struct Model {
    /// Intrinsic dimension.
    pub dimension: Option<usize>,
    /// Intervals of a grid of cells: none, one for all axes, or one for each.
    pub cells: Vec<f64>,
    pub reconstruction: Reconstruction,
}

impl From<PointFlags> for ReadOptions {
    fn from(flags: PointFlags) -> Self {
        Self {
            format: flags.format,
            classes: flags.classes,
            column: None,
        }
    }
}

/// Points that particles or distances start from.
pub enum Sources {
    /// Nowhere in particular.
    Any,
    Ends(Vec<End>),
    /// A file of points.
    File(PathBuf),
}

impl Sources {
    /// The sources of a file where one is given, else those given one by one.
    pub fn new(ends: Vec<End>, file: Option<PathBuf>) -> Self {
        match file {
            Some(file) => Self::File(file),
            None if ends.is_empty() => Self::Any,
            None => Self::Ends(ends),
        }
    }
}

impl TryFrom<SurfaceFlags> for Source {
    type Error = Failure;

    fn try_from(flags: SurfaceFlags) -> Result<Self, Failure> {
        if let Some(file) = flags.source.file.clone() {
            if file
                .extension()
                .is_some_and(|found| found == MODEL_EXTENSION)
            {
                return of_model(file, &flags);
            }
            return Ok(Self::Cloud(CloudSettings {
                file,
                model: Model {
                    cells: flags.cells,
                    dimension: flags.points.dimension,
                    reconstruction: flags.surface,
                },
                options: flags.points.into(),
            }));
        }
        let SourceFlags {
            implicit, shape, ..
        } = flags.source;
        equations(shape, implicit, flags.bounds).map(Self::Equations)
    }
}

/// A model says itself all that could be said of points.
fn of_model(file: PathBuf, flags: &SurfaceFlags) -> Result<Source, Failure> {
    let SurfaceFlags {
        points:
            PointFlags {
                classes,
                format,
                dimension,
            },
        cells,
        surface,
        ..
    } = flags;
    let unasked = classes.is_empty()
        && format.is_none()
        && dimension.is_none()
        && cells.is_empty()
        && *surface == Reconstruction::default();
    if unasked {
        return Ok(Source::Model(file));
    }
    Err(Failure::Usage(format!(
        "{}: a fitted model takes none of --class, --format, --dimension, --cell and --surface; leave them out, or give them to taut fit",
        file.display()
    )))
}

/// The surface of a shape, or else of equations.
fn equations(
    shape: Option<Shape>,
    texts: Vec<String>,
    bounds: Option<Bounds>,
) -> Result<Implicit, Failure> {
    if let Some(shape) = shape {
        return Ok(Implicit {
            dimension: shape.dimension(),
            bounds: None,
            law: Law::Shape(shape),
        });
    }
    let borrowed: Vec<&str> = texts.iter().map(String::as_str).collect();
    let dimension = Formula::parse(&borrowed, None)?.dimension();
    let bounds = bounds.map(|bounds| for_dimension(bounds, dimension));
    Ok(Implicit {
        dimension,
        bounds: bounds.transpose()?,
        law: Law::Texts(texts),
    })
}

/// One range serves all axes; otherwise there must be one each.
fn for_dimension(bounds: Bounds, dimension: usize) -> Result<Bounds, Failure> {
    match bounds.low.len() {
        1 => Ok(Bounds {
            low: vec![bounds.low[0]; dimension],
            high: vec![bounds.high[0]; dimension],
        }),
        found if found == dimension => Ok(bounds),
        found => Err(Failure::Usage(format!(
            "--bounds: found {found} ranges, expected 1, or {dimension}, one for each variable"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_one_range_or_one_each() {
        let bounds: Bounds = "-2:2".parse().expect("one range");
        let wide = for_dimension(bounds, 3).expect("fits");
        assert_eq!((wide.low, wide.high), (vec![-2.0; 3], vec![2.0; 3]));
        let bounds: Bounds = "-2:2,0:1.5".parse().expect("two ranges");
        assert!(matches!(for_dimension(bounds, 3), Err(Failure::Usage(_))));
    }
}
