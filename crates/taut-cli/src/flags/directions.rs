//! The flags of `taut log` and `taut exp`.

use std::path::PathBuf;

use clap::Args;
use taut::{End, coordinate};

use crate::flags::surface::SurfaceFlags;
use crate::values::{positive, tolerance};

pub const LOG_EXAMPLES: &str = "\
Examples:
  taut log scan.ply --source 12 -o directions.ply
  taut log --shape torus:1,0.4 --source 1.4,0,0 --at points.xyz --transport

The vector is tangential at the nearest source and as long as the geodesic. Its error is that of its
end. A point that no source reaches has a vector of nan and an infinite error.";

pub const EXP_EXAMPLES: &str = "\
Examples:
  taut exp scan.ply --source 12 --direction 1,0,0 --length 0.5 -o way.vtp --picture way.png
  taut exp --shape sphere:1 --source 0,0,1 --vectors vectors.txt -o ends.csv

Only the part of a direction that lies along the surface counts. A geodesic ends early where the
surface ends, or where the surface is not known well enough to go on; the exit code is then 5.";

#[derive(Debug, Args)]
pub struct LogFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// A point that vectors start from: a row of the file (the first is 0), or coordinates; repeat
    /// the flag for several points
    #[arg(long, value_name = "P", allow_hyphen_values = true, required = true)]
    pub source: Vec<End>,
    /// A file of the points that vectors lead to, by rows or coordinates [default: all points of
    /// the cloud]
    #[arg(long, value_name = "FILE")]
    pub at: Option<PathBuf>,
    /// Also write the two tangents of the source, carried along the geodesic by parallel transport
    #[arg(long)]
    pub transport: bool,
    /// Largest relative error of the geodesics that carry the directions
    #[arg(long = "tol", value_name = "T", default_value = "1e-6", value_parser = tolerance)]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Write one JSON object that describes the vectors, with the tangents of the sources
    #[arg(long)]
    pub json: bool,
    /// Write the points with their vector, error and source: .csv .ply .vtp .las .laz, or .npy
    /// (vectors alone)
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ExpFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// Where the geodesic starts: a row of the file (the first is 0), or coordinates
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    pub source: End,
    /// The direction in which the geodesic leaves, such as 1,0,-2
    #[arg(
        long,
        value_name = "X,..",
        allow_hyphen_values = true,
        value_delimiter = ','
    )]
    #[arg(value_parser = coordinate, num_args = 1)]
    #[arg(required_unless_present = "vectors", conflicts_with = "vectors")]
    pub direction: Vec<f64>,
    /// A text file with a direction on each line; the answer has a row for each end
    #[arg(long, value_name = "FILE", conflicts_with = "picture")]
    pub vectors: Option<PathBuf>,
    /// The length of the geodesic [default: that of the direction's part along the surface]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = positive)]
    pub length: Option<f64>,
    /// Largest relative error of the end of the geodesic on the surface
    #[arg(long = "tol", value_name = "T", default_value = "1e-6", value_parser = tolerance)]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Write one JSON object for each geodesic, on a line of its own
    #[arg(long)]
    pub json: bool,
    /// Write the geodesic (.ply .obj .csv .json .vtk .vtp .npy) or, with --vectors, the ends (.csv
    /// .ply .vtp .npy)
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw the surface with the geodesic over it
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}
