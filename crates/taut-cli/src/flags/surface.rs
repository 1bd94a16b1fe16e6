//! The flags that name a surface, which most commands take.

use std::path::PathBuf;

use clap::Args;
use taut::equations::Bounds;
use taut_core::surface::shapes::Shape;
use taut_io::Format;

use crate::values::{Reconstruction, class, count};

/// Where the surface comes from: exactly one of these.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct SourceFlags {
    /// A file of points (ply, obj, off, stl, xyz, txt, csv, pcd, las, laz, e57 or npy), or a model
    /// that taut fit wrote (taut)
    #[arg(value_name = "SURFACE")]
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
