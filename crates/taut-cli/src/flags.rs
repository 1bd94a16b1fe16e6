//! The command line as it is typed.

mod directions;
mod surface;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use taut::{End, coordinate};
use taut_core::field::Slope;

use crate::exit::Exit;
use crate::values::{Correction, count, positive, seed, slope, tolerance, whole};
pub use directions::{ExpFlags, LogFlags};
pub use surface::{PointFlags, SourceFlags, SurfaceFlags};

const EXAMPLES: &str = "\
Examples:
  taut demo
      A path on a sheet rolled up seven times, next to the exact answer, with a picture.
  taut check scan.ply
      What the points are like, and what may go wrong with them.
  taut path scan.ply --from 12 --to 3400 --picture path.png
      The shortest path between two points of a scan.
  taut path --implicit '(sqrt(x^2 + y^2) - 1)^2 + z^2 = 0.16' --from 1.4,0,0 --to=-1.4,0,0 --tol 1e-12
      The same on a torus that is given by its equation, to twelve digits.
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

The length comes with two estimated errors. length_error is the error of the path on the surface
that taut works on. surface_error is what the reconstruction of this surface from points adds to it;
it is 0 for equations.";

const FIELD_EXAMPLES: &str = "\
Examples:
  taut field scan.ply --source 12 -o distances.ply --picture field.png
  taut field scan.las --class 2 --sources wells.txt -o ground.las
  taut field torus.npy --source 0 -o distances.npy --isolines lines.vtp
  taut field scan.ply --source 12 --nearest 100 --json
  taut field scan.ply --curve seam.xyz -o off_seam.ply
  taut field ground.las --class 2 --source 0 --slope hiking --no-go lake.txt --picture walks.png
  taut field --shape torus:1,0.4 --source 1.4,0,0 --at points.xyz

Each distance comes with an estimate of its error, which includes what the surface adds, and with
the number of its nearest source (the first is 0). A point that no source reaches is infinitely far.
Without -o, --picture, --isolines and --json the values go to standard output, one line for each
point.";

const MATRIX_EXAMPLES: &str = "\
Examples:
  taut matrix scan.ply --sources points.xyz -o D.npy --errors E.npy
  seq 0 100 9999 > rows.txt && taut matrix scan.ply --sources rows.txt -o D.npy --paths paths
  taut matrix --shape torus:1,0.4 --sources a.npy --to b.npy -o D.npy --tol 1e-9
  taut matrix scan.taut --sources points.xyz --radius 0.1 -o D.npz

D[i, j] is the length of the shortest path from source i to source j. It is infinite where there is
no path. When a run was cut off, even by kill -9, the same command goes on where the run stopped,
and the result has the same bytes.";

const SAMPLE_EXAMPLES: &str = "\
Examples:
  taut sample --shape torus:1,0.4 -n 4000 -o points.ply --picture points.png
  taut sample scan.ply -n 4000 --uniform -o points.ply
  taut sample --implicit 'x^4 + y^4 + z^4 = 1' -n 1000 --uniform -o points.xyz
  taut sample scan.ply -n 50 --farthest -o landmarks.csv
  taut sample --shape ellipsoid:3,2,1 -n 500 --source 3,0,0 --source=-3,0,0 -o points.csv

Particles are born at the sources and repel each other until they have spread over the surface.
Sources that you name stay where they are. Without any, all particles move.";

const FIT_EXAMPLES: &str = "\
Examples:
  taut fit scan.ply -o scan.taut
  taut fit scan.las --class 2 --accuracy 0.05 -o ground.taut --picture ground.png
  taut path scan.taut --from 0.1,0,-2 --to 0.3,0.2,-1.5

The model is an implicit surface F = 0, made of smooth charts that pass the points within the
accuracy. The normals of the file say which side is positive. Without normals, F is positive
outside.";

/// Find geodesics, the shortest paths along a surface, from a scan or an equation.
///
/// A point cloud becomes a smooth surface. A first guess crosses it, and the guess is pulled taut
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
    /// Write only errors to standard error, no notes and no progress
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
    /// Find, for every point, the tangent vector at the source whose geodesic leads to it
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
    /// Largest number of nodes that a path may have
    #[arg(long, value_name = "N", default_value = "8192", value_parser = count)]
    #[arg(allow_negative_numbers = true)]
    pub most_nodes: usize,
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
    /// Where the path ends
    #[arg(long, value_name = "P", allow_hyphen_values = true, requires = "from")]
    pub to: Option<End>,
    /// Find many paths: each line of this file holds two rows of the point file, or the coordinates
    /// of two points; - reads the lines from standard input
    #[arg(long, value_name = "FILE")]
    pub pairs: Option<PathBuf>,
    #[command(flatten)]
    pub correction: CorrectionFlags,
    /// Also find up to N further paths, such as one round the other side of a hole
    #[arg(long, value_name = "N", default_value = "0", hide_default_value = true)]
    #[arg(value_parser = whole, allow_negative_numbers = true)]
    pub alternatives: usize,
    /// Find out by rays in all directions whether the path is the shortest there is; this takes
    /// some milliseconds for each pair
    #[arg(long)]
    pub prove_shortest: bool,
    /// Write one JSON object for each pair, on a line of its own
    #[arg(long)]
    pub json: bool,
    /// Add the nodes of each path to the JSON object
    #[arg(long, requires = "json")]
    pub points: bool,
    /// Write the paths with their normals and arc length: .ply .obj .csv .json .vtk .vtp .npy
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
    /// A point to measure from: a row of the file (the first is 0), or coordinates; repeat the flag
    /// for several points
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    #[arg(required_unless_present_any = ["sources", "curve"], conflicts_with = "sources")]
    pub source: Vec<End>,
    /// A file of points to measure from: a cloud, or a text file (.txt) with a row or coordinates
    /// on each line, which the distance that the source starts with may follow
    #[arg(long, value_name = "FILE")]
    pub sources: Option<PathBuf>,
    /// A file of the vertices of a curve to measure from, as for --sources but without start
    /// values. Each vertex is joined to the next by the shortest path, and the curve is closed if
    /// the last vertex repeats the first
    #[arg(long, value_name = "FILE", conflicts_with_all = ["source", "sources", "start"])]
    pub curve: Option<PathBuf>,
    /// The distance that a source starts with; repeat the flag, once for each source [default: 0]
    #[arg(long, value_name = "V", allow_hyphen_values = true, value_parser = coordinate)]
    pub start: Vec<f64>,
    /// A file of points to find distances at, in any format that --sources takes [default: all
    /// points of the cloud]
    #[arg(long, value_name = "FILE")]
    pub at: Option<PathBuf>,
    /// Largest relative error of the geodesics that carry the distances
    #[arg(long = "tol", value_name = "T", default_value = "1e-6", value_parser = tolerance)]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Look no farther than this; points that are farther count as not reached
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = positive)]
    pub max_distance: Option<f64>,
    /// Find only the K points nearest to the sources; all others count as not reached
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    pub nearest: Option<usize>,
    /// The cost per length at each point: a number above 0, or inf where nothing passes. Give a
    /// text file with one cost on each line, in the order of the points, or the name of a column of
    /// SURFACE's own file, such as intensity (in ply, las and laz, and in csv, xyz and txt with
    /// names in the first line). Distances are then costs
    #[arg(long, value_name = "FILE|COLUMN")]
    pub cost: Option<PathBuf>,
    /// A polygon, seen along z, that nothing passes: a text file with x and y of a corner on each
    /// line; repeat the flag for several polygons
    #[arg(long, value_name = "FILE.txt")]
    pub no_go: Vec<PathBuf>,
    /// What slopes multiply the cost by, with z pointing up: hiking (Tobler's time of walking), or
    /// UP,DOWN for 1 + UP times the grade uphill and 1 + DOWN times the grade downhill
    #[arg(long, value_name = "LAW", value_parser = slope)]
    pub slope: Option<Slope>,
    /// Write the isolines, which are polylines on the surface, with their levels: .ply .obj .csv
    /// .json .vtk .vtp
    #[arg(long, value_name = "FILE")]
    pub isolines: Option<PathBuf>,
    /// The distances of the isolines, such as 0.5,1,1.5 [default: round numbers, for about 16
    /// levels]
    #[arg(
        long,
        value_name = "V,..",
        allow_hyphen_values = true,
        value_delimiter = ',',
        requires = "isolines"
    )]
    #[arg(value_parser = coordinate)]
    pub levels: Vec<f64>,
    /// Write one JSON object that describes the field
    #[arg(long)]
    pub json: bool,
    /// Write the points with their distance, error and source: .csv .ply .vtp .las .laz, or .npy
    /// (distances alone)
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
    /// The points that the rows and columns stand for: a file of points, or a file with a row
    /// number of SURFACE on each line
    #[arg(long, value_name = "FILE")]
    pub sources: PathBuf,
    /// Other points for the columns to stand for, in a file of the same kind
    #[arg(long, value_name = "FILE")]
    pub to: Option<PathBuf>,
    /// Find only pairs within this distance, in the units of SURFACE; the matrix is then sparse
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
    /// Begin anew, and delete what an earlier run has left unfinished
    #[arg(long)]
    pub restart: bool,
    /// Write one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct CheckFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// Write one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct FitFlags {
    /// A file of points: ply, obj, off, stl, xyz, txt, csv, pcd, las, laz, e57 or npy
    #[arg(value_name = "CLOUD")]
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

#[derive(Debug, Args)]
pub struct SampleFlags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// How many points
    #[arg(long, short = 'n', value_name = "N", value_parser = count)]
    #[arg(allow_negative_numbers = true)]
    pub count: usize,
    /// Spread the points evenly: as densely where the surface is flat as where it bends
    #[arg(long)]
    pub uniform: bool,
    /// Take points of the cloud itself, each the farthest along the surface from those before it
    #[arg(long, conflicts_with = "uniform")]
    pub farthest: bool,
    /// A point to start from, which is kept: a row of the file (the first is 0), or coordinates;
    /// repeat the flag for several points
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
    /// The seed of the random numbers
    #[arg(long, value_name = "S", default_value = "1", value_parser = seed)]
    #[arg(allow_negative_numbers = true)]
    pub seed: u64,
    /// Write one JSON object
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
    /// The seed of the random points of the sheet
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
