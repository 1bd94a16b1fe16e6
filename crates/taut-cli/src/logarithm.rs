//! `taut log`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use taut::End;
use taut::kind::Kind;
use taut::size::coordinates;
use taut_core::Vector;
use taut_core::error::Error;
use taut_core::field::{self, Field, Fields, Logarithm};
use taut_core::surface::Surface;
use taut_io::{Column, Content, PointTable, write_points, write_table};

use crate::exit::{Exit, Failure};
use crate::numbers::{largest, median_and_most, significant};
use crate::output::{errors_line, line, moved_lines, names, tell, write_columns};
use crate::outputs::Files;
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::sites;
use crate::source::{Source, Sources, SurfaceFlags};
use crate::values::tolerance;

pub const EXAMPLES: &str = "\
Examples:
  taut log scan.ply --source 12 -o directions.ply
  taut log --shape torus:1,0.4 --source 1.4,0,0 --at points.xyz --transport

The vector is tangential at the nearest source and as long as the geodesic. Its error is that of its
end. A point that no source reaches has a vector of nan and an infinite error.";

#[derive(Debug, Args)]
pub struct Flags {
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

impl Flags {
    fn sources(&self) -> Sources {
        Sources::Ends(self.source.clone())
    }
}

/// Why a cloud has no logarithms. A fit does not help: its charts are no smaller than the cloud's
/// own.
const ROUGH: &str = "found a rough surface, expected a smooth one, as logarithms need: more points, or points with less noise; taut field finds the distances alone";
/// Why a model has none.
const LARGE_CHARTS: &str = "found charts that are too large or too rough, expected small and smooth ones, as logarithms need: fit again with a smaller --accuracy, and to more points or points with less noise where that is not enough; taut field finds the distances alone";

/// Finds the vectors and writes what was asked for.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let source = flags.surface.source()?;
    // A vector, two tangents carried, an error, a source and how far the point was moved.
    let most = 3 * 3 + 3;
    let at = flags.at.as_deref();
    let original = at.or_else(|| source.points());
    let content = Content::Table {
        original,
        columns: most,
    };
    let dimension = source.dimension();
    Files::of(&source)
        .reads("--at", at)
        .writes("--output", flags.output.as_deref(), content, dimension)
        .check()?;
    let vectors = Vectors {
        flags,
        of_model: matches!(source, Source::Model(_)),
    };
    let table = ready::visit(&source, vectors, progress)?;
    table.write(flags, original, progress)?;
    Ok(Exit::Success)
}

struct Vectors<'a> {
    flags: &'a Flags,
    of_model: bool,
}

/// Vectors at points, their dimension forgotten.
struct Table {
    dimension: usize,
    /// Row-major.
    points: Vec<f64>,
    rows_kept: Option<Vec<usize>>,
    /// The logarithm, and behind it the tangents transported, if asked for: a column for each
    /// coordinate.
    vectors: Vec<(String, Vec<f64>)>,
    error: Vec<f64>,
    source: Vec<f64>,
    facts: LogarithmFacts,
}

/// What is told of the vectors. Lengths are in the units of the input.
#[derive(Serialize)]
struct LogarithmFacts {
    surface: String,
    points: usize,
    sources: usize,
    /// How far each source was moved onto the surface.
    sources_moved: Vec<f64>,
    /// The orthonormal tangents at each source that are carried to the points.
    source_tangents: Vec<[Vec<f64>; 2]>,
    /// The longest vector; `None` where no point is reached.
    longest: Option<f64>,
    error_median: Option<f64>,
    error_most: Option<f64>,
    /// Points without a vector, as no geodesic leads there.
    unreached: usize,
    /// Points without a place on the surface.
    unusable: usize,
    /// Points reached whose way goes round a hole, so that nothing is carried there.
    not_transported: usize,
    /// The most that a point was moved onto the surface; `None` for points of the surface itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    moved_most: Option<f64>,
}

impl Question for Vectors<'_> {
    type Answer = Table;

    fn seeds(&self, dimension: usize, progress: &Progress) -> Result<Vec<End>, Failure> {
        sites::places_of(&self.flags.sources(), dimension, progress)
    }

    fn answer<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<Table, Failure> {
        let flags = self.flags;
        let dimension = ready.geodesics.surface().intrinsic_dimension();
        if dimension != 2 {
            return Err(unfit(
                ready.name,
                &format!(
                    "found a surface of dimension {dimension}, expected 2, as logarithms need; taut field finds the distances alone"
                ),
            ));
        }
        let refused = |error| match error {
            Error::NoDirections if self.of_model => unfit(ready.name, LARGE_CHARTS),
            Error::NoDirections => unfit(ready.name, ROUGH),
            error => ready.refused(error),
        };
        let (sources, sources_moved) = ready.sources(&flags.sources(), &[], progress)?;
        let places = flags.at.as_ref();
        let places = places
            .map(|file| ready.places(file, progress))
            .transpose()?;
        let settings = field::Settings {
            tolerance: flags.tolerance,
            ..field::Settings::default()
        };
        progress.step("directions");
        let fields = Kind::fields(&ready.geodesics, None).map_err(refused)?;
        let field = fields.from(&sources, &settings).map_err(refused)?;
        let (points, found, moved) = match places {
            Some(places) => {
                let moved = places.moved();
                let found = places.located.iter().map(|place| {
                    let at = |(node, _): &(_, f64)| fields.logarithm(&field, node);
                    place.as_ref().map(at).transpose()
                });
                let found = found.collect::<Result<_, _>>().map_err(refused)?;
                (places.points, found, Some(moved))
            }
            None => {
                let surface = ready.geodesics.surface();
                let found = surface.logarithms_of_rows(&fields, &field);
                let found = found.map_err(refused)?;
                let own = ready.points.zip(found);
                let (points, found) = own.ok_or_else(|| ready.without_points())?;
                (points.coordinates.clone(), found, None)
            }
        };
        let mut table = Table::new(ready, points, flags.transport);
        table.facts.sources = sources.len();
        table.facts.sources_moved = sources_moved;
        table.facts.source_tangents = (0..sources.len() as u32)
            .filter_map(|source| fields.source_tangents(&field, source))
            .map(|tangents| tangents.map(|t| coordinates(&t, ready.dimension)))
            .collect();
        for logarithm in &found {
            table.push(&fields, &field, logarithm.as_ref());
        }
        table.facts.moved_most = moved.as_deref().map(largest);
        table.sum_up();
        Ok(table)
    }
}

fn unfit(surface: &str, reason: &str) -> Failure {
    Failure::Unfit {
        surface: surface.to_owned(),
        reason: reason.to_owned(),
    }
}

impl Table {
    fn new<const D: usize>(ready: &Ready<'_, D>, points: Vec<f64>, transport: bool) -> Self {
        let vectors: &[&str] = if transport {
            &["log", "first", "second"]
        } else {
            &["log"]
        };
        let names = vectors.iter().flat_map(|v| names(v, ready.dimension));
        Self {
            dimension: ready.dimension,
            rows_kept: ready.rows_kept().map(<[usize]>::to_vec),
            vectors: names.map(|name| (name, Vec::new())).collect(),
            error: Vec::new(),
            source: Vec::new(),
            facts: LogarithmFacts {
                surface: ready.name.to_owned(),
                points: points.len() / ready.dimension,
                sources: 0,
                sources_moved: Vec::new(),
                source_tangents: Vec::new(),
                longest: None,
                error_median: None,
                error_most: None,
                unreached: 0,
                unusable: 0,
                not_transported: 0,
                moved_most: None,
            },
            points,
        }
    }

    /// The logarithm of the next point; `None` where it has no place, within where it is not
    /// reached.
    fn push<const D: usize>(
        &mut self,
        fields: &Fields<'_, D, Kind<D>>,
        field: &Field<D>,
        found: Option<&Option<Logarithm<D>>>,
    ) {
        let unknown = Vector::<D>::repeat(f64::NAN);
        let mut vectors = [unknown; 3];
        let (mut error, mut source) = (f64::INFINITY, -1.0);
        let known = found.copied().flatten().and_then(|logarithm| {
            let tangents = fields.source_tangents(field, logarithm.source)?;
            Some((logarithm, tangents))
        });
        match (found, known) {
            (None, _) => {
                error = f64::NAN;
                self.facts.unusable += 1;
            }
            (Some(_), None) => self.facts.unreached += 1,
            (Some(_), Some((logarithm, tangents))) => {
                let [a, b] = logarithm.vector;
                vectors[0] = tangents[0] * a + tangents[1] * b;
                match logarithm.transported {
                    Some([first, second]) => vectors[1..].copy_from_slice(&[first, second]),
                    None => self.facts.not_transported += 1,
                }
                error = logarithm.error;
                source = f64::from(logarithm.source);
                let length = a.hypot(b);
                self.facts.longest = Some(self.facts.longest.unwrap_or(0.0).max(length));
            }
        }
        let values = vectors.iter().flat_map(|v| coordinates(v, self.dimension));
        for ((_, column), value) in self.vectors.iter_mut().zip(values) {
            column.push(value);
        }
        self.error.push(error);
        self.source.push(source);
    }

    fn sum_up(&mut self) {
        let reached = self.source.iter().zip(&self.error).filter(|v| *v.0 >= 0.0);
        let errors = median_and_most(reached.map(|(_, error)| *error));
        [self.facts.error_median, self.facts.error_most] = errors;
    }

    fn columns(&self) -> Vec<Column<'_>> {
        let vectors = self.vectors.iter().map(|(name, values)| (&**name, values));
        let known = [("error", &self.error), ("source", &self.source)];
        vectors
            .chain(known)
            .map(|(name, values)| Column { name, values })
            .collect()
    }

    fn write(
        &self,
        flags: &Flags,
        original: Option<&Path>,
        progress: &Progress,
    ) -> Result<(), Failure> {
        let columns = self.columns();
        if let Some(file) = &flags.output {
            progress.step("writing the vectors");
            if file.extension().is_some_and(|found| found == "npy") {
                // One column would be no vector.
                let rows = 0..self.facts.points;
                let vectors: Vec<f64> = rows
                    .flat_map(|row| self.vectors.iter().map(move |(_, values)| values[row]))
                    .collect();
                write_points(file, self.vectors.len(), &vectors, None)?;
            } else {
                let table = PointTable {
                    dimension: self.dimension,
                    coordinates: &self.points,
                    normals: None,
                    columns: &columns,
                    colours: None,
                };
                let rows = self.rows_kept.as_deref();
                write_table(file, &table, original, rows.filter(|_| flags.at.is_none()))?;
            }
        }
        self.facts.note(progress);
        progress.clear();
        if flags.json || flags.output.is_some() {
            return tell(&self.facts, flags.json, |out, facts| facts.write(out));
        }
        Ok(write_columns(&columns)?)
    }
}

impl LogarithmFacts {
    fn note(&self, progress: &Progress) {
        let counts = [
            (self.unreached, "are not reached"),
            (self.unusable, "have no place on the surface"),
        ];
        for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
            progress.note(&format!(
                "{}: {count} of {} points {what}: their vector is NaN",
                self.surface, self.points
            ));
        }
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        line(out, "surface", &self.surface)?;
        line(out, "points", &self.points.to_string())?;
        line(out, "sources", &self.sources.to_string())?;
        let longest = self.longest.map_or("none reached".to_owned(), significant);
        line(out, "longest", &longest)?;
        errors_line(out, [self.error_median, self.error_most])?;
        line(out, "not reached", &self.unreached.to_string())?;
        line(out, "bent round holes", &self.not_transported.to_string())?;
        moved_lines(out, self.moved_most, self.unusable)
    }
}
