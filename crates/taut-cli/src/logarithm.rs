//! `taut log`.

use std::io::{self, Write};

use serde::Serialize;
use taut::kind::Kind;
use taut::size::coordinates;
use taut_core::Vector;
use taut_core::field::{Field, Fields, Logarithm};
use taut_core::surface::Surface;
use taut_io::{Column, Content, PointTable, write_points, write_table};

use crate::exit::{Exit, Failure};
use crate::numbers::{exponential, significant};
use crate::output::{line, tell, write_columns};
use crate::outputs::Files;
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::settings::{LogSettings, Source};

/// Why a cloud has no logarithms. A fit does not help: its charts are no smaller than the cloud's
/// own.
const ROUGH: &str = "found a rough surface, expected a smooth one, as logarithms need: more points, or points with less noise; taut field finds the distances alone";
/// Why a model has none.
const LARGE_CHARTS: &str = "found charts that are too large or too rough, expected small and smooth ones, as logarithms need: fit again with a smaller --accuracy, and to more points or points with less noise where that is not enough; taut field finds the distances alone";

/// Finds the vectors and writes what was asked for.
pub fn run(settings: &LogSettings, progress: &Progress) -> Result<Exit, Failure> {
    // A vector, two tangents carried, an error, a source and how far the point was moved.
    let most = 3 * 3 + 3;
    let at = settings.at.as_deref();
    let content = Content::Table {
        original: at.or_else(|| settings.source.points()),
        columns: most,
    };
    let dimension = settings.source.dimension();
    Files::of(&settings.source)
        .reads("--at", at)
        .writes("--output", settings.output.as_deref(), content, dimension)
        .check()?;
    let question = Vectors { settings, progress };
    let table = ready::ask(&settings.source, &settings.sources, &question, progress)?;
    table.write(settings, progress)?;
    Ok(Exit::Success)
}

struct Vectors<'a> {
    settings: &'a LogSettings,
    progress: &'a Progress,
}

/// Vectors at points, their dimension forgotten.
struct Table {
    dimension: usize,
    /// Row-major.
    points: Vec<f64>,
    rows_kept: Option<Vec<usize>>,
    /// The logarithm, and behind it the tangents transported, if asked for: a column for each coordinate.
    vectors: Vec<(String, Vec<f64>)>,
    error: Vec<f64>,
    source: Vec<f64>,
    facts: Facts,
}

/// What is told of the vectors. Lengths are in the units of the input.
#[derive(Serialize)]
struct Facts {
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
    /// Points reached whose way bends round a hole, so that nothing is carried there.
    not_transported: usize,
    /// The most that a point was moved onto the surface; `None` for points of the surface itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    moved_most: Option<f64>,
}

impl Question for Vectors<'_> {
    type Answer = Table;

    fn answer<const D: usize>(&self, ready: &Ready<'_, D>) -> Result<Table, Failure> {
        let Self { settings, progress } = *self;
        let dimension = ready.geodesics.surface().intrinsic_dimension();
        if dimension != 2 {
            return Err(unfit(
                ready.name,
                &format!(
                    "found a surface of dimension {dimension}, expected 2, as logarithms need; taut field finds the distances alone"
                ),
            ));
        }
        let refused = |error| match (error, &settings.source) {
            (taut_core::error::Error::NoDirections, Source::Model(_)) => {
                unfit(ready.name, LARGE_CHARTS)
            }
            (taut_core::error::Error::NoDirections, _) => unfit(ready.name, ROUGH),
            (error, _) => ready.refused(error),
        };
        let (sources, sources_moved) = ready.sources(&settings.sources, &[], progress)?;
        let places = settings.at.as_ref();
        let places = places
            .map(|file| ready.places(file, progress))
            .transpose()?;
        progress.step("directions");
        let fields = Kind::fields(ready.geodesics, None).map_err(refused)?;
        let field = fields.from(&sources, &settings.field).map_err(refused)?;
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
        let mut table = Table::new(ready, points, settings.transport);
        table.facts.sources = sources.len();
        table.facts.sources_moved = sources_moved;
        table.facts.source_tangents = (0..sources.len() as u32)
            .filter_map(|source| fields.source_tangents(&field, source))
            .map(|tangents| tangents.map(|t| coordinates(&t, ready.dimension)))
            .collect();
        for logarithm in &found {
            table.push(&fields, &field, logarithm.as_ref());
        }
        table.facts.moved_most = moved.map(|moved| {
            let known = moved.into_iter().filter(|moved| !moved.is_nan());
            known.fold(0.0, f64::max)
        });
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

/// The names of a vector's coordinates.
pub fn names(vector: &str, dimension: usize) -> Vec<String> {
    let axis = |i: usize| match dimension {
        3 => ["x", "y", "z"][i].to_owned(),
        _ => i.to_string(),
    };
    (0..dimension)
        .map(|i| format!("{vector}_{}", axis(i)))
        .collect()
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
            facts: Facts {
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

    /// The logarithm of the next point; `None` where it has no place, within where it is not reached.
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
        let mut errors: Vec<f64> = reached.map(|(_, error)| *error).collect();
        errors.sort_by(f64::total_cmp);
        self.facts.error_median = errors.get(errors.len() / 2).copied();
        self.facts.error_most = errors.last().copied();
    }

    fn columns(&self) -> Vec<Column<'_>> {
        let vectors = self.vectors.iter().map(|(name, values)| (&**name, values));
        let known = [("error", &self.error), ("source", &self.source)];
        vectors
            .chain(known)
            .map(|(name, values)| Column { name, values })
            .collect()
    }

    fn write(&self, settings: &LogSettings, progress: &Progress) -> Result<(), Failure> {
        let columns = self.columns();
        if let Some(file) = &settings.output {
            progress.step("writing the vectors");
            if file.extension().is_some_and(|found| found == "npy") {
                // One column would be no vector.
                let rows = 0..self.facts.points;
                let vectors: Vec<f64> = rows
                    .flat_map(|row| self.vectors.iter().map(move |(_, values)| values[row]))
                    .collect();
                write_points(file, self.vectors.len(), &vectors, None)?;
            } else {
                let original = match (&settings.source, &settings.at) {
                    (_, Some(file)) => Some(file.as_path()),
                    (Source::Cloud(cloud), None) => Some(cloud.file.as_path()),
                    _ => None,
                };
                let table = PointTable {
                    dimension: self.dimension,
                    coordinates: &self.points,
                    normals: None,
                    columns: &columns,
                    colours: None,
                };
                let rows = self.rows_kept.as_deref();
                write_table(
                    file,
                    &table,
                    original,
                    rows.filter(|_| settings.at.is_none()),
                )?;
            }
        }
        self.facts.note(progress);
        progress.clear();
        if settings.json || settings.output.is_some() {
            return tell(&self.facts, settings.json, |out, facts| facts.write(out));
        }
        Ok(write_columns(&columns)?)
    }
}

impl Facts {
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
        let errors = [self.error_median, self.error_most].map(exponential);
        let errors = format!("{} (median), {} at most", errors[0], errors[1]);
        line(out, "estimated error", &errors)?;
        line(out, "not reached", &self.unreached.to_string())?;
        line(out, "bent round holes", &self.not_transported.to_string())?;
        if let Some(moved) = self.moved_most {
            line(out, "moved by at most", &exponential(Some(moved)))?;
            line(out, "off the surface", &self.unusable.to_string())?;
        }
        Ok(())
    }
}
