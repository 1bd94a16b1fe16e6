//! What `taut sample` is asked.

use std::path::PathBuf;

use clap::Args;
use taut::End;

use crate::source::{Sources, SurfaceFlags};
use crate::values::{count, seed};

pub const EXAMPLES: &str = "\
Examples:
  taut sample --shape torus:1,0.4 -n 4000 -o points.ply --picture points.png
  taut sample scan.ply -n 4000 --uniform -o points.ply
  taut sample --implicit 'x^4 + y^4 + z^4 = 1' -n 1000 --uniform -o points.xyz
  taut sample scan.ply -n 50 --farthest -o landmarks.csv
  taut sample --shape ellipsoid:3,2,1 -n 500 --source 3,0,0 --source=-3,0,0 -o points.csv

Particles are born at the sources and repel each other until they have spread over the surface.
Sources that you name stay where they are. Without any, all particles move.";

#[derive(Debug, Args)]
pub struct Flags {
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

impl Flags {
    /// Where particles start.
    pub fn sources(&self) -> Sources {
        Sources::new(&self.source, self.sources.as_ref())
    }
}
