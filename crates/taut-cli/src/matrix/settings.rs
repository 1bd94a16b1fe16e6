//! What `taut matrix` is asked: as typed, and checked.

use std::path::PathBuf;

use clap::Args;
use taut_core::correction;

use crate::correction::CorrectionFlags;
use crate::exit::Failure;
use crate::source::{Source, SurfaceFlags};
use crate::values::positive;

pub const EXAMPLES: &str = "\
Examples:
  taut matrix scan.ply --sources points.xyz -o D.npy --errors E.npy
  seq 0 100 9999 > rows.txt && taut matrix scan.ply --sources rows.txt -o D.npy --paths paths
  taut matrix --shape torus:1,0.4 --sources a.npy --to b.npy -o D.npy --tol 1e-9
  taut matrix scan.taut --sources points.xyz --radius 0.1 -o D.npz

D[i, j] is the length of the shortest path from source i to source j. It is infinite where there is
no path. When a run was cut off, even by kill -9, the same command goes on where the run stopped,
and the result has the same bytes.";

#[derive(Debug, Args)]
pub struct Flags {
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

/// What `taut matrix` was asked to do.
pub struct Settings {
    pub source: Source,
    /// A file of points or rows.
    pub sources: PathBuf,
    pub to: Option<PathBuf>,
    /// Only pairs within this distance.
    pub radius: Option<f64>,
    pub correction: correction::Settings,
    pub output: PathBuf,
    pub errors: Option<PathBuf>,
    pub paths: Option<PathsSettings>,
    /// Whether to begin anew.
    pub restart: bool,
    pub json: bool,
}

/// Where many paths go.
pub struct PathsSettings {
    pub folder: PathBuf,
    /// The extension that names the format.
    pub format: String,
}

/// Formats that hold many paths in a file.
const PATHS_FORMATS: [&str; 6] = ["ply", "obj", "csv", "json", "vtk", "vtp"];

impl TryFrom<&Flags> for Settings {
    type Error = Failure;

    fn try_from(flags: &Flags) -> Result<Self, Failure> {
        let extension = if flags.radius.is_some() { "npz" } else { "npy" };
        for file in std::iter::once(&flags.output).chain(&flags.errors) {
            if file.extension().is_none_or(|found| found != extension) {
                return Err(Failure::Usage(format!(
                    "{}: expected the extension .{extension}, which a matrix {} --radius must have; rename it",
                    file.display(),
                    if flags.radius.is_some() {
                        "with"
                    } else {
                        "without"
                    }
                )));
            }
        }
        let format = flags.paths_format.clone();
        if !PATHS_FORMATS.contains(&format.as_str()) {
            return Err(Failure::Usage(format!(
                "--paths-format: found {format}, expected one of {}",
                PATHS_FORMATS.join(", ")
            )));
        }
        let paths = flags.paths.clone();
        Ok(Self {
            source: flags.surface.source()?,
            sources: flags.sources.clone(),
            to: flags.to.clone(),
            radius: flags.radius,
            correction: flags.correction.settings(),
            output: flags.output.clone(),
            errors: flags.errors.clone(),
            paths: paths.map(|folder| PathsSettings { folder, format }),
            restart: flags.restart,
            json: flags.json,
        })
    }
}
