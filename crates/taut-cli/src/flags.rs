//! The command line as it is typed.

mod directions;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use taut_core::field::Slope;
use taut_core::surface::shapes::Shape;
use taut_io::Format;

use crate::exit::Exit;
use crate::settings::{
    Bounds, Correction, End, Reconstruction, class, coordinate, count, positive, seed, slope,
    tolerance, whole,
};
pub use directions::{ExpFlags, LogFlags};

const EXAMPLES: &str = "\
Examples:
  taut demo
      A path on a sheet rolled up seven times, next to the exact answer, with a picture.
  taut check scan.ply
      What the points are like, and what may go wrong with them.
  taut path scan.ply --from 12 --to 3400 --picture path.png
      The shortest path between two points of a scan.
  taut path --implicit '(sqrt(x^2 + y^2) - 1)^2 + z^2 = 0.16' --from 1.4,0,0 --to=-1.4,0,0 --tol 1e-12
      The same on a torus given by its equation, to twelve digits.
  taut field scan.ply --source 12 -o distances.ply --picture field.png
      The distance from a point of a scan to all others.
  taut path scan.las --class 2 --pairs pairs.txt --json > paths.jsonl
      A path for each line of pairs.txt, on the ground points of a LiDAR scan.";

const PATH_EXAMPLES: &str = "\
Examples:
  taut path scan.ply --from 12 --to 3400 --json
  taut path scan.ply --from 0.1,0,-2 --to 3400 -o path.vtk --picture path.png
  taut path --implicit 'x1^2 + x2^2 = 1' --implicit 'x3^2 + x4^2 = 1' --from 1,0,1,0 --to 0,1,-1,0
  seq 1 100 | sed 's/^/0 /' | taut path scan.xyz --pairs - | sort -g -k 3

The length comes with two errors: length_error is that of the path on the surface taut works on,
surface_error is what a surface reconstructed from points adds to it (0 for equations).";

const FIELD_EXAMPLES: &str = "\
Examples:
  taut field scan.ply --source 12 -o distances.ply --picture field.png
  taut field scan.las --class 2 --sources wells.txt -o ground.las
  taut field torus.npy --source 0 -o distances.npy --isolines lines.vtp
  taut field scan.ply --source 12 --nearest 100 --json
  taut field scan.ply --curve seam.xyz -o off_seam.ply
  taut field ground.las --class 2 --source 0 --slope hiking --no-go lake.txt --picture walks.png
  taut field --shape torus:1,0.4 --source 1.4,0,0 --at points.xyz

Each distance comes with an estimate of its error, what the surface adds included, and with the number of
the nearest source, the first is 0. What no source reaches is infinitely far.
Without -o, --picture, --isolines and --json the values go to standard output, a line a point.";

const MATRIX_EXAMPLES: &str = "\
Examples:
  taut matrix scan.ply --sources points.xyz -o D.npy --errors E.npy
  seq 0 100 9999 > rows.txt && taut matrix scan.ply --sources rows.txt -o D.npy --paths paths
  taut matrix --shape torus:1,0.4 --sources a.npy --to b.npy -o D.npy --tol 1e-9
  taut matrix scan.taut --sources points.xyz --radius 0.1 -o D.npz

D[i, j] is the length of the shortest path from source i to source j, infinite where there is none. A run
that was cut off, even by kill -9, goes on where it stopped when it is started again, to the same bytes.";

const SAMPLE_EXAMPLES: &str = "\
Examples:
  taut sample --shape torus:1,0.4 -n 4000 -o points.ply --picture points.png
  taut sample scan.ply -n 4000 --uniform -o points.ply
  taut sample --implicit 'x^4 + y^4 + z^4 = 1' -n 1000 --uniform -o points.xyz
  taut sample scan.ply -n 50 --farthest -o landmarks.csv
  taut sample --shape ellipsoid:3,2,1 -n 500 --source 3,0,0 --source=-3,0,0 -o points.csv

Particles born at the sources repel each other until they have spread over the surface. Sources stay
where they are; without any, all particles float.";

const FIT_EXAMPLES: &str = "\
Examples:
  taut fit scan.ply -o scan.taut
  taut fit scan.las --class 2 --accuracy 0.05 -o ground.taut --picture ground.png
  taut path scan.taut --from 0.1,0,-2 --to 0.3,0.2,-1.5

The model is an implicit surface F = 0, smooth charts that pass the points within the accuracy. Its sides
are told apart by the file's normals, else so that F is positive outside.";

/// Geodesics, shortest paths along a surface, from a scan or an equation.
///
/// A point cloud becomes a smooth surface, a first guess crosses it, and the guess is pulled taut
/// until its length is known to the tolerance. Lengths are in the units of the input.
#[derive(Debug, Parser)]
#[command(name = "taut", version, arg_required_else_help = true)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", Exit::help()))]
pub struct Flags {
    #[command(subcommand)]
    pub command: Command,
    /// Number of threads [default: as many as the machine has]; the results do not depend on it
    #[arg(long, global = true, value_name = "N", help_heading = "General")]
    #[arg(value_parser = count, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// No progress and no notes on standard error, only errors
    #[arg(long, short, global = true, help_heading = "General")]
    pub quiet: bool,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Find the shortest path between points of a surface
    #[command(after_help = PATH_EXAMPLES)]
    #[command(after_long_help = format!("{PATH_EXAMPLES}\n\n{}", Exit::help()))]
    Path(PathFlags),
    /// Find the distance from one or several sources to every point of a surface
    #[command(after_help = FIELD_EXAMPLES)]
    #[command(after_long_help = format!("{FIELD_EXAMPLES}\n\n{}", Exit::help()))]
    Field(FieldFlags),
    /// Find the tangent vectors at a source whose geodesics lead to every point of a surface
    #[command(after_help = directions::LOG_EXAMPLES)]
    #[command(after_long_help = format!("{}\n\n{}", directions::LOG_EXAMPLES, Exit::help()))]
    Log(LogFlags),
    /// Follow the geodesic that leaves a point in a direction
    #[command(after_help = directions::EXP_EXAMPLES)]
    #[command(after_long_help = format!("{}\n\n{}", directions::EXP_EXAMPLES, Exit::help()))]
    Exp(ExpFlags),
    /// Find the distances of all pairs of many points, as a NumPy matrix
    #[command(after_help = MATRIX_EXAMPLES)]
    #[command(after_long_help = format!("{MATRIX_EXAMPLES}\n\n{}", Exit::help()))]
    Matrix(MatrixFlags),
    /// Tell what a surface is like, and warn of what may go wrong
    Check(CheckFlags),
    /// Fit a smooth surface to a scan and keep it in a file that every command takes as SURFACE
    #[command(after_help = FIT_EXAMPLES)]
    #[command(after_long_help = format!("{FIT_EXAMPLES}\n\n{}", Exit::help()))]
    Fit(FitFlags),
    /// Spread points over a surface, denser where it bends
    #[command(after_help = SAMPLE_EXAMPLES)]
    #[command(after_long_help = format!("{SAMPLE_EXAMPLES}\n\n{}", Exit::help()))]
    Sample(SampleFlags),
    /// Find a path on a rolled-up sheet and compare it with the exact answer
    Demo(DemoFlags),
    /// Write completions for a shell to standard output
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// Where the surface comes from: exactly one of these.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct SourceFlags {
    /// A file of points: ply, obj, off, stl, xyz, txt, csv, pcd, las, laz, e57 or npy; or a model that
    /// taut fit wrote: taut
    #[arg(value_name = "SURFACE")]
    pub file: Option<PathBuf>,
    /// An equation in x, y, z or x1, x2, .. such as 'x^2 + y^2 + z^2 = 1'; repeat it for several
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
    /// Only LAS points of these classes, such as 2 or 2,6
    #[arg(long = "class", value_name = "CLASS,..", value_delimiter = ',', value_parser = class)]
    #[arg(allow_negative_numbers = true)]
    pub classes: Vec<u8>,
    /// The format of the file, by the extension that it usually has
    #[arg(long, value_name = "NAME")]
    pub format: Option<Format>,
    /// The dimension of the surface that the points lie on [default: 2 in the plane and in space]
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    pub dimension: Option<usize>,
}

/// How paths are pulled taut.
#[derive(Debug, Args)]
pub struct CorrectionFlags {
    /// Largest relative error of a length
    #[arg(long = "tol", value_name = "T", default_value = "1e-6", value_parser = tolerance)]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: f64,
    /// How paths are pulled taut
    #[arg(long, value_name = "SCHEME", value_enum, default_value_t)]
    pub correction: Correction,
    /// Most nodes of a path
    #[arg(long, value_name = "N", default_value = "8192", value_parser = count)]
    #[arg(allow_negative_numbers = true)]
    pub most_nodes: usize,
}

#[derive(Debug, Args)]
pub struct SurfaceFlags {
    #[command(flatten)]
    pub source: SourceFlags,
    /// The part of space that matters with --implicit: -2:2 for all axes, or -2:2,-2:2,0:1
    #[arg(
        long,
        value_name = "LO:HI,..",
        allow_hyphen_values = true,
        conflicts_with_all = ["file", "shape"]
    )]
    pub bounds: Option<Bounds>,
    #[command(flatten)]
    pub points: PointFlags,
    /// The cells of a grid, one interval for all axes or one for each, such as 0.1 or 0.1,0.1,0.2
    /// [default: cells of 8 to 16 points]
    #[arg(
        long = "cell",
        value_name = "LENGTH,..",
        value_delimiter = ',',
        allow_negative_numbers = true,
        conflicts_with_all = ["implicit", "shape"]
    )]
    pub cells: Vec<f64>,
    /// How the surface is made of the points
    #[arg(
        long,
        value_name = "KIND",
        value_enum,
        default_value_t,
        conflicts_with_all = ["implicit", "shape"]
    )]
    pub surface: Reconstruction,
}

#[derive(Debug, Args)]
pub struct PathFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// Where the path starts: a row of the file (the first is 0), or coordinates such as 1,0,-2
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    #[arg(
        required_unless_present = "pairs",
        requires = "to",
        conflicts_with = "pairs"
    )]
    pub from: Option<End>,
    /// Where it ends
    #[arg(long, value_name = "P", allow_hyphen_values = true, requires = "from")]
    pub to: Option<End>,
    /// Many paths: a file with two rows of the point file, or two points' coordinates, on each
    /// line; - reads them from standard input
    #[arg(long, value_name = "FILE")]
    pub pairs: Option<PathBuf>,
    #[command(flatten)]
    pub correction: CorrectionFlags,
    /// Also up to N further paths, such as round the other side of a hole
    #[arg(long, value_name = "N", default_value = "0", hide_default_value = true)]
    #[arg(value_parser = whole, allow_negative_numbers = true)]
    pub alternatives: usize,
    /// Find out whether the path is the shortest there is, by rays in all directions: some milliseconds a pair
    #[arg(long)]
    pub prove_shortest: bool,
    /// One JSON object for each pair, on a line of its own
    #[arg(long)]
    pub json: bool,
    /// The nodes of each path in the JSON object
    #[arg(long, requires = "json")]
    pub points: bool,
    /// Write the paths with normals and arc length: .ply .obj .csv .json .vtk .vtp .npy
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw the surface with the paths over it
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct FieldFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// A point to measure from: a row of the file (the first is 0), or coordinates; repeat it for several
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    #[arg(required_unless_present_any = ["sources", "curve"], conflicts_with = "sources")]
    pub source: Vec<End>,
    /// A file of points to measure from: of text (.txt), rows or coordinates on each line, and behind them
    /// the distance that the source starts with, if any; or a cloud
    #[arg(long, value_name = "FILE")]
    pub sources: Option<PathBuf>,
    /// A file of the vertices of a curve to measure from, as of sources without values: each is joined to the next
    /// by the shortest path, and the curve is closed if the last is the first again
    #[arg(long, value_name = "FILE", conflicts_with_all = ["source", "sources", "start"])]
    pub curve: Option<PathBuf>,
    /// The distance that a source starts with; repeat it, once for each [default: 0]
    #[arg(long, value_name = "V", allow_hyphen_values = true, value_parser = coordinate)]
    pub start: Vec<f64>,
    /// A file of points to find distances at, in any format that sources may have [default: all points of
    /// the cloud]
    #[arg(long, value_name = "FILE")]
    pub at: Option<PathBuf>,
    /// Largest relative error of the geodesics that carry the distances
    #[arg(long = "tol", value_name = "T", default_value = "1e-6", value_parser = tolerance)]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Look no farther than this; what is farther counts as not reached
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = positive)]
    pub max_distance: Option<f64>,
    /// Only the K points nearest to the sources; all others count as not reached
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    pub nearest: Option<usize>,
    /// The cost per length at each point, above 0, inf where nothing passes: a text file with one on each line, in
    /// the order of the points, or else the name of a column of SURFACE's own file (ply, las, laz, or csv, xyz and txt
    /// with names in the first line), such as intensity. Distances are then costs
    #[arg(long, value_name = "FILE|COLUMN")]
    pub cost: Option<PathBuf>,
    /// A text file of corners, x and y on each line, of a polygon that nothing passes, seen along z; repeat it for
    /// several
    #[arg(long, value_name = "FILE.txt")]
    pub no_go: Vec<PathBuf>,
    /// What slopes multiply the cost by, z up: hiking (Tobler's time of walking), or UP,DOWN for 1 + UP grade
    /// uphill and 1 + DOWN grade downhill
    #[arg(long, value_name = "LAW", value_parser = slope)]
    pub slope: Option<Slope>,
    /// Write isolines, polylines on the surface with their level: .ply .obj .csv .json .vtk .vtp
    #[arg(long, value_name = "FILE")]
    pub isolines: Option<PathBuf>,
    /// The distances of the isolines, such as 0.5,1,1.5 [default: round numbers, some 16 lines]
    #[arg(
        long,
        value_name = "V,..",
        allow_hyphen_values = true,
        value_delimiter = ',',
        requires = "isolines"
    )]
    #[arg(value_parser = coordinate)]
    pub levels: Vec<f64>,
    /// One JSON object that tells of the field
    #[arg(long)]
    pub json: bool,
    /// Write the points with distance, error and source: .npy (distances alone) .csv .ply .vtp .las .laz
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw the surface coloured by the distance, with isolines
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct MatrixFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// The points that rows and columns stand for: a file of points, or of row numbers of SURFACE, one on each
    /// line
    #[arg(long, value_name = "FILE")]
    pub sources: PathBuf,
    /// Other points that the columns stand for
    #[arg(long, value_name = "FILE")]
    pub to: Option<PathBuf>,
    /// Only pairs within this distance, in the units of SURFACE: a sparse matrix
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = positive)]
    pub radius: Option<f64>,
    #[command(flatten)]
    pub correction: CorrectionFlags,
    /// Where to put the matrix: .npy, or .npz with --radius
    #[arg(long, short, value_name = "FILE")]
    pub output: PathBuf,
    /// Write the estimated errors of the lengths as a matrix of the same kind
    #[arg(long, value_name = "FILE")]
    pub errors: Option<PathBuf>,
    /// Write the paths to files in a new folder
    #[arg(long, value_name = "FOLDER")]
    pub paths: Option<PathBuf>,
    /// The format of these files: ply, obj, csv, json, vtk or vtp
    #[arg(long, value_name = "NAME", default_value = "csv", requires = "paths")]
    pub paths_format: String,
    /// Begin anew, whatever an earlier run has left unfinished
    #[arg(long)]
    pub restart: bool,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct CheckFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct FitFlags {
    /// A file of points: ply, obj, off, stl, xyz, txt, csv, pcd, las, laz, e57 or npy
    #[arg(value_name = "CLOUD")]
    pub file: PathBuf,
    /// Distance from the surface within which the points must lie, in their units; larger is smoother
    /// [default: a thousandth of the diagonal of the points' box]
    #[arg(long, value_name = "LENGTH", value_parser = positive, allow_negative_numbers = true)]
    pub accuracy: Option<f64>,
    /// Where to put the model
    #[arg(long, short, value_name = "FILE.taut")]
    pub output: PathBuf,
    #[command(flatten)]
    pub points: PointFlags,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
    /// Draw the surface
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct SampleFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// How many points
    #[arg(long, short = 'n', value_name = "N", value_parser = count)]
    #[arg(allow_negative_numbers = true)]
    pub count: usize,
    /// As densely where the surface is flat as where it bends
    #[arg(long)]
    pub uniform: bool,
    /// Points of the cloud itself, each the farthest along the surface from those before it
    #[arg(long, conflicts_with = "uniform")]
    pub farthest: bool,
    /// A point to start from, which is kept: coordinates, or a row of the file; repeat it for several
    #[arg(
        long,
        value_name = "P",
        allow_hyphen_values = true,
        conflicts_with = "sources"
    )]
    pub source: Vec<End>,
    /// A file of points to start from
    #[arg(long, value_name = "FILE")]
    pub sources: Option<PathBuf>,
    /// Which random sample
    #[arg(long, value_name = "S", default_value = "1", value_parser = seed)]
    #[arg(allow_negative_numbers = true)]
    pub seed: u64,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
    /// Write the points with normals: .ply .obj .xyz .csv .npy
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw the points
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct DemoFlags {
    /// Where to put the picture
    #[arg(long, value_name = "FILE.png", default_value = "taut-demo.png")]
    pub picture: PathBuf,
    /// Which random sample of the sheet
    #[arg(long, value_name = "S", default_value = "1", value_parser = seed)]
    #[arg(allow_negative_numbers = true)]
    pub seed: u64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Flags::command().debug_assert();
    }
}
