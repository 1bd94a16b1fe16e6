//! Where a surface comes from: the flags that name it, which most commands take, and what they say.

use std::path::{Path, PathBuf};

use clap::Args;
use taut::End;
use taut::equations::{Bounds, Implicit, Law};
use taut_core::surface::shapes::Shape;
use taut_formula::Formula;
use taut_io::{Format, ReadOptions};

use crate::exit::Failure;
use crate::values::{Reconstruction, class, count};

/// Where the surface comes from: exactly one of these.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct SourceFlags {
    #[arg(value_name = "SURFACE")]
    #[arg(help = format!("A file of points ({}), or a model that taut fit wrote (taut)", formats()))]
    pub file: Option<PathBuf>,
    /// An equation in x, y, z or in x1, x2, .., such as 'x^2 + y^2 + z^2 = 1'; repeat the flag for
    /// several equations
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    #[arg(conflicts_with_all = ["classes", "format", "dimension"])]
    pub implicit: Vec<String>,
    /// A named shape such as sphere:1, torus:1,0.4 or ellipsoid:3,2,1
    #[arg(long, value_name = "NAME:SIZES", value_parser = Shape::parse)]
    #[arg(conflicts_with_all = ["classes", "format", "dimension"])]
    pub shape: Option<Shape>,
}

/// The extensions of files of points, as a sentence lists them.
pub fn formats() -> String {
    let list = Format::extensions();
    let parts = list.rsplit_once(", ");
    parts.map_or(list.clone(), |(first, last)| format!("{first} or {last}"))
}

/// How a file of points is read.
#[derive(Debug, Args)]
pub struct PointFlags {
    /// Read only the LAS points of these classes, such as 2 or 2,6
    #[arg(long = "class", value_name = "CLASS,..", value_delimiter = ',', value_parser = class)]
    #[arg(allow_negative_numbers = true)]
    pub classes: Vec<u8>,
    /// The format of the file, named by its usual extension
    #[arg(long, value_name = "NAME")]
    pub format: Option<Format>,
    /// The dimension of the surface that the points lie on [default: 2 in the plane and in space]
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    pub dimension: Option<usize>,
}

#[derive(Debug, Args)]
pub struct SurfaceFlags {
    #[command(flatten)]
    pub source: SourceFlags,
    /// Take the surface of --implicit only within this part of space: -2:2 for all axes, or a range
    /// for each, such as -2:2,-2:2,0:1
    #[arg(
        long,
        value_name = "LO:HI,..",
        allow_hyphen_values = true,
        conflicts_with_all = ["file", "shape"]
    )]
    pub bounds: Option<Bounds>,
    #[command(flatten)]
    pub points: PointFlags,
    /// Place charts on the cells of a grid, whose sides are one length for all axes or one for
    /// each, such as 0.1 or 0.1,0.1,0.2 [default: cells of 8 to 16 points]
    #[arg(
        long = "cell",
        value_name = "LENGTH,..",
        value_delimiter = ',',
        allow_negative_numbers = true,
        conflicts_with_all = ["implicit", "shape"]
    )]
    pub cells: Vec<f64>,
    /// How the surface is made from the points
    #[arg(
        long,
        value_name = "KIND",
        value_enum,
        default_value_t,
        conflicts_with_all = ["implicit", "shape"]
    )]
    pub surface: Reconstruction,
}

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

    /// What errors and answers call the surface.
    pub fn name(&self) -> String {
        match self {
            Self::Cloud(cloud) => cloud.file.display().to_string(),
            Self::Model(file) => file.display().to_string(),
            Self::Equations(law) => law.law.to_string(),
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
    pub model: CloudSurface,
}

/// What surface to put through points.
#[derive(Clone, Default)]
pub struct CloudSurface {
    /// Intrinsic dimension.
    pub dimension: Option<usize>,
    /// Intervals of a grid of cells: none, one for all axes, or one for each.
    pub cells: Vec<f64>,
    pub reconstruction: Reconstruction,
}

impl PointFlags {
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            format: self.format,
            classes: self.classes.clone(),
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
    pub fn new(ends: &[End], file: Option<&PathBuf>) -> Self {
        match file {
            Some(file) => Self::File(file.clone()),
            None if ends.is_empty() => Self::Any,
            None => Self::Ends(ends.to_vec()),
        }
    }
}

impl SurfaceFlags {
    /// Where the surface comes from, checked.
    pub fn source(&self) -> Result<Source, Failure> {
        let SourceFlags {
            file,
            implicit,
            shape,
        } = &self.source;
        let Some(file) = file else {
            let law = equations(shape.as_ref(), implicit, self.bounds.as_ref())?;
            return Ok(Source::Equations(law));
        };
        if file
            .extension()
            .is_some_and(|found| found == MODEL_EXTENSION)
        {
            self.check_model(file)?;
            return Ok(Source::Model(file.clone()));
        }
        Ok(Source::Cloud(CloudSettings {
            file: file.clone(),
            model: CloudSurface {
                cells: self.cells.clone(),
                dimension: self.points.dimension,
                reconstruction: self.surface,
            },
            options: self.points.options(),
        }))
    }

    /// A model says itself all that could be said of points.
    fn check_model(&self, file: &Path) -> Result<(), Failure> {
        let PointFlags {
            classes,
            format,
            dimension,
        } = &self.points;
        let unasked = classes.is_empty()
            && format.is_none()
            && dimension.is_none()
            && self.cells.is_empty()
            && self.surface == Reconstruction::default();
        if unasked {
            return Ok(());
        }
        Err(Failure::Usage(format!(
            "{}: a fitted model takes none of --class, --format, --dimension, --cell and --surface; leave them out, or give them to taut fit",
            file.display()
        )))
    }
}

/// The surface of a shape, or else of equations.
fn equations(
    shape: Option<&Shape>,
    texts: &[String],
    bounds: Option<&Bounds>,
) -> Result<Implicit, Failure> {
    if let Some(shape) = shape {
        return Ok(Implicit {
            dimension: shape.dimension(),
            bounds: None,
            law: Law::Shape(shape.clone()),
        });
    }
    let borrowed: Vec<&str> = texts.iter().map(String::as_str).collect();
    let dimension = Formula::parse(&borrowed, None)?.dimension();
    let bounds = bounds.map(|bounds| for_dimension(bounds.clone(), dimension));
    Ok(Implicit {
        dimension,
        bounds: bounds.transpose()?,
        law: Law::Texts(texts.to_vec()),
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
