//! `taut exp`.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use taut::size::{coordinates, flat, padded};
use taut::{End, coordinate};
use taut_core::field::{self, Fields, Shot};
use taut_core::surface::Surface;
use taut_core::{Vector, parallel};
use taut_io::{Column, Content, PointTable, Polyline, read_numbers, write_polylines, write_table};

use crate::answer::{FoundPath, Outcome};
use crate::exit::{Exit, Failure};
use crate::numbers::exponential;
use crate::output::{line, names, tell, write_columns, yes_or_no};
use crate::outputs::Files;
use crate::picture;
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::source::SurfaceFlags;
use crate::surface::FlatSamples;
use crate::values::{positive, tolerance};

pub const EXAMPLES: &str = "\
Examples:
  taut exp scan.ply --source 12 --direction 1,0,0 --length 0.5 -o way.vtp --picture way.png
  taut exp --shape sphere:1 --source 0,0,1 --vectors vectors.txt -o ends.csv

Only the part of a direction that lies along the surface counts. A geodesic ends early where the
surface ends, or where the surface is not known well enough to go on; the exit code is then 5.";

#[derive(Debug, Args)]
pub struct Flags {
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

/// Follows the geodesics and writes what was asked for.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let source = flags.surface.source()?;
    let content = match flags.vectors {
        None => Content::Paths,
        Some(_) => Content::Table {
            original: None,
            columns: 3,
        },
    };
    let output = flags.output.as_deref();
    Files::of(&source)
        .reads("--vectors", flags.vectors.as_deref())
        .writes("--output", output, content, source.dimension())
        .writes_picture(flags.picture.as_deref())
        .check()?;
    let found = ready::visit(&source, Geodesics(flags), progress)?;
    match flags.vectors {
        None => found.write_one(flags, progress),
        Some(_) => found.write_many(flags, progress),
    }
}

struct Geodesics<'a>(&'a Flags);

/// Geodesics from one point, their dimension forgotten.
struct FoundShots {
    dimension: usize,
    /// In the order of the vectors.
    shots: Vec<Result<ShotAnswer, String>>,
    samples: Option<FlatSamples>,
}

/// A geodesic in the coordinates and units of the input.
#[derive(Serialize)]
struct ShotAnswer {
    end: Vec<f64>,
    length: f64,
    /// Whether it was followed as far as asked.
    complete: bool,
    /// Estimated error of the end.
    error: f64,
    nodes: usize,
    /// The orthonormal tangents at the source, the first along the geodesic.
    tangents: Vec<Vec<f64>>,
    /// The same, carried to the end in parallel.
    transported: Vec<Vec<f64>>,
    #[serde(skip)]
    points: Vec<f64>,
    #[serde(skip)]
    arc_length: Vec<f64>,
}

impl Question for Geodesics<'_> {
    type Answer = FoundShots;

    fn seeds(&self, _: usize, _: &Progress) -> Result<Vec<End>, Failure> {
        Ok(vec![self.0.source.clone()])
    }

    fn answer<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<FoundShots, Failure> {
        let Self(flags) = self;
        let settings = field::Settings {
            tolerance: flags.tolerance,
            ..field::Settings::default()
        };
        let (node, _) = ready.locate(&flags.source)?;
        let vectors = vectors(flags, ready.dimension)?;
        let surface = ready.geodesics.surface();
        let centre = surface.origin();
        progress.step("geodesics");
        let fields = Fields::new(&ready.geodesics);
        let intrinsic = surface.intrinsic_dimension();
        let shoot = |vector: &[f64]| {
            let vector: Vector<D> = padded(vector);
            let shot = match flags.length {
                Some(length) => fields.exponential_to(&node, &vector, length, &settings),
                None => fields.exponential(&node, &vector, &settings),
            };
            shot.map(|shot| ShotAnswer::new(&shot, &centre, ready.dimension, intrinsic))
                .map_err(|error| error.to_string())
        };
        let rows: Vec<&[f64]> = vectors.chunks(ready.dimension).collect();
        Ok(FoundShots {
            dimension: ready.dimension,
            shots: parallel::map(rows.len(), |i| shoot(rows[i])),
            samples: flags.picture.is_some().then(|| ready.samples()),
        })
    }
}

/// The vectors, row-major.
fn vectors(flags: &Flags, dimension: usize) -> Result<Vec<f64>, Failure> {
    let (name, columns, values) = match &flags.vectors {
        None => {
            let vector = &flags.direction;
            ("--direction".to_owned(), vector.len(), vector.clone())
        }
        Some(file) => {
            let numbers = read_numbers(file)?;
            (file.display().to_string(), numbers.columns, numbers.values)
        }
    };
    if columns == dimension {
        return Ok(values);
    }
    Err(Failure::End {
        end: name,
        reason: format!(
            "found {columns} coordinates, expected {dimension}, as many as the points of the surface have"
        ),
    })
}

impl ShotAnswer {
    fn new<const D: usize>(
        shot: &Shot<D>,
        centre: &Vector<D>,
        dimension: usize,
        intrinsic: usize,
    ) -> Self {
        let points = flat(&shot.points, centre, dimension);
        let tangents = |matrix: &taut_core::Matrix<D>| {
            let columns = (0..intrinsic).map(|j| matrix.column(j).into_owned());
            columns.map(|t| coordinates(&t, dimension)).collect()
        };
        Self {
            end: points[points.len().saturating_sub(dimension)..].to_vec(),
            length: shot.arc_length.last().copied().unwrap_or(0.0),
            complete: shot.complete,
            error: shot.error,
            nodes: shot.points.len(),
            tangents: tangents(&shot.tangents),
            transported: tangents(&shot.transported),
            arc_length: shot.arc_length.clone(),
            points,
        }
    }

    fn exit(&self) -> Exit {
        if self.complete {
            Exit::Success
        } else {
            Exit::NotConverged
        }
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let end: Vec<String> = self.end.iter().map(f64::to_string).collect();
        line(out, "end", &end.join(", "))?;
        line(out, "estimated error", &exponential(Some(self.error)))?;
        line(out, "length", &self.length.to_string())?;
        let why = if self.complete {
            ""
        } else {
            " (the surface ends there, or is not known well enough to go on)"
        };
        let complete = format!("{}{why}", yes_or_no(self.complete));
        line(out, "complete", &complete)?;
        line(out, "nodes", &self.nodes.to_string())
    }

    /// For a picture; its length is what was asked for and has no error.
    fn drawn(&self) -> FoundPath {
        FoundPath {
            outcome: Outcome::Asked(taut_core::result::Status::Converged),
            length: Some(self.length),
            length_error: Some(0.0),
            surface_error: Some(0.0),
            stable: false,
            shortest: false,
            max_geodesic_curvature: None,
            max_off_surface: None,
            steps: 0,
            points: self.points.clone(),
            normals: Vec::new(),
            arc_length: self.arc_length.clone(),
        }
    }
}

impl FoundShots {
    fn write_one(self, flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
        let Some(shot) = self.shots.into_iter().next() else {
            return Err(Failure::Usage(
                "--direction: found none, expected one".to_owned(),
            ));
        };
        let shot = shot.map_err(|reason| Failure::End {
            end: "--direction".to_owned(),
            reason,
        })?;
        if let Some(file) = &flags.output {
            let polyline = Polyline {
                dimension: self.dimension,
                points: &shot.points,
                normals: None,
                arc_length: &shot.arc_length,
                level: None,
            };
            write_polylines(file, &[polyline])?;
        }
        if let (Some(file), Some(samples)) = (&flags.picture, &self.samples) {
            progress.step("drawing");
            picture::draw(file, samples, &[shot.drawn()])?;
        }
        progress.clear();
        tell(&shot, flags.json, |out, shot| shot.write(out))?;
        Ok(shot.exit())
    }

    fn write_many(self, flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
        let mut worst = Exit::Success;
        let mut ends = Vec::new();
        let mut columns = [const { Vec::new() }; 3];
        for (row, shot) in self.shots.iter().enumerate() {
            let values = match shot {
                Ok(shot) => {
                    worst = worst.max(shot.exit());
                    ends.extend_from_slice(&shot.end);
                    [shot.length, shot.error, f64::from(u8::from(shot.complete))]
                }
                Err(reason) => {
                    worst = worst.max(Exit::BadInput);
                    progress.note(&format!("vector {row}: {reason}"));
                    ends.extend(std::iter::repeat_n(f64::NAN, self.dimension));
                    [f64::NAN, f64::NAN, 0.0]
                }
            };
            for (column, value) in columns.iter_mut().zip(values) {
                column.push(value);
            }
        }
        let known: Vec<Column<'_>> = ["length", "error", "complete"]
            .into_iter()
            .zip(&columns)
            .map(|(name, values)| Column { name, values })
            .collect();
        if let Some(file) = &flags.output {
            progress.step("writing the ends");
            if file.extension().is_some_and(|found| found == "npy") {
                taut_io::write_points(file, self.dimension, &ends, None)?;
            } else {
                let table = PointTable {
                    dimension: self.dimension,
                    coordinates: &ends,
                    normals: None,
                    columns: &known,
                    colours: None,
                };
                write_table(file, &table, None, None)?;
            }
        }
        progress.clear();
        if flags.json {
            for shot in &self.shots {
                match shot {
                    Ok(shot) => tell(shot, true, |out, shot| shot.write(out))?,
                    Err(reason) => {
                        tell(
                            &serde_json::json!({ "reason": reason }),
                            true,
                            |_, _| Ok(()),
                        )?
                    }
                }
            }
        } else if flags.output.is_none() {
            let axis = |i: usize| {
                ends.iter()
                    .skip(i)
                    .step_by(self.dimension)
                    .copied()
                    .collect()
            };
            let axes: Vec<Vec<f64>> = (0..self.dimension).map(axis).collect();
            let names = names("end", self.dimension);
            let ends = names.iter().zip(&axes);
            let ends = ends.map(|(name, values)| Column { name, values });
            write_columns(&ends.chain(known.iter().copied()).collect::<Vec<_>>())?;
        }
        Ok(worst)
    }
}
