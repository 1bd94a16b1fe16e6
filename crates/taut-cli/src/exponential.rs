//! `taut exp`.

use std::io::{self, Write};

use serde::Serialize;
use taut::size::{coordinates, flat, padded};
use taut_core::field::{Fields, Shot};
use taut_core::surface::Surface;
use taut_core::{Vector, parallel};
use taut_io::{Column, Content, PointTable, Polyline, read_numbers, write_polylines, write_table};

use crate::answer::{FoundPath, Outcome};
use crate::exit::{Exit, Failure};
use crate::logarithm::names;
use crate::numbers::exponential;
use crate::output::{line, tell, write_columns, yes_or_no};
use crate::outputs::Files;
use crate::picture;
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::settings::{Aim, ExpSettings, Sources};
use crate::surface::{FlatSamples, Samples, flat_samples};

/// Follows the geodesics and writes what was asked for.
pub fn run(settings: &ExpSettings, progress: &Progress) -> Result<Exit, Failure> {
    let (list, content) = match &settings.aim {
        Aim::One(_) => (None, Content::Paths),
        Aim::File(file) => {
            let table = Content::Table {
                original: None,
                columns: 3,
            };
            (Some(file.as_path()), table)
        }
    };
    let dimension = settings.source.dimension();
    Files::of(&settings.source)
        .reads("--vectors", list)
        .writes("--output", settings.output.as_deref(), content, dimension)
        .writes_picture(settings.picture.as_deref())
        .check()?;
    let question = Geodesics { settings, progress };
    let start = Sources::Ends(vec![settings.start.clone()]);
    let found = ready::ask(&settings.source, &start, &question, progress)?;
    match settings.aim {
        Aim::One(_) => found.write_one(settings, progress),
        Aim::File(_) => found.write_many(settings, progress),
    }
}

struct Geodesics<'a> {
    settings: &'a ExpSettings,
    progress: &'a Progress,
}

/// Geodesics from one point, their dimension forgotten.
struct Found {
    dimension: usize,
    /// In the order of the vectors.
    shots: Vec<Result<Answer, String>>,
    samples: Option<FlatSamples>,
}

/// A geodesic in the coordinates and units of the input.
#[derive(Serialize)]
struct Answer {
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
    type Answer = Found;

    fn answer<const D: usize>(&self, ready: &Ready<'_, D>) -> Result<Found, Failure> {
        let Self { settings, progress } = *self;
        let (node, _) = ready.locate(&settings.start)?;
        let vectors = vectors(&settings.aim, ready.dimension)?;
        let surface = ready.geodesics.surface();
        let centre = surface.origin();
        progress.step("geodesics");
        let fields = Fields::new(ready.geodesics);
        let intrinsic = surface.intrinsic_dimension();
        let shoot = |vector: &[f64]| {
            let vector: Vector<D> = padded(vector);
            let shot = match settings.length {
                Some(length) => fields.exponential_to(&node, &vector, length, &settings.field),
                None => fields.exponential(&node, &vector, &settings.field),
            };
            shot.map(|shot| Answer::new(&shot, &centre, ready.dimension, intrinsic))
                .map_err(|error| error.to_string())
        };
        let rows: Vec<&[f64]> = vectors.chunks(ready.dimension).collect();
        Ok(Found {
            dimension: ready.dimension,
            shots: parallel::map(rows.len(), |i| shoot(rows[i])),
            samples: settings
                .picture
                .is_some()
                .then(|| flat_samples(&Samples::of(surface), &centre, ready.dimension)),
        })
    }
}

/// The vectors, row-major.
fn vectors(aim: &Aim, dimension: usize) -> Result<Vec<f64>, Failure> {
    let (name, columns, values) = match aim {
        Aim::One(vector) => ("--direction".to_owned(), vector.len(), vector.clone()),
        Aim::File(file) => {
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

impl Answer {
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

impl Found {
    fn write_one(self, settings: &ExpSettings, progress: &Progress) -> Result<Exit, Failure> {
        let Some(shot) = self.shots.into_iter().next() else {
            return Err(Failure::Usage(
                "--direction: found none, expected one".to_owned(),
            ));
        };
        let shot = shot.map_err(|reason| Failure::End {
            end: "--direction".to_owned(),
            reason,
        })?;
        if let Some(file) = &settings.output {
            let polyline = Polyline {
                dimension: self.dimension,
                points: &shot.points,
                normals: None,
                arc_length: &shot.arc_length,
                level: None,
            };
            write_polylines(file, &[polyline])?;
        }
        if let (Some(file), Some(samples)) = (&settings.picture, &self.samples) {
            progress.step("drawing");
            picture::draw(file, samples, &[shot.drawn()])?;
        }
        progress.clear();
        tell(&shot, settings.json, |out, shot| shot.write(out))?;
        Ok(shot.exit())
    }

    fn write_many(self, settings: &ExpSettings, progress: &Progress) -> Result<Exit, Failure> {
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
        if let Some(file) = &settings.output {
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
        if settings.json {
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
        } else if settings.output.is_none() {
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
