//! Results as text and as JSON on standard output.

use std::io::{self, BufWriter, StdoutLock, Write};

use serde::Serialize;

use taut::End;
use taut_core::result::Status;
use taut_io::Column;

use crate::answer::{Answer, FoundPath, LocatedEnd, Outcome};
use crate::exit::Failure;
use crate::numbers::{exponential, rounded, rounding};

/// How results are written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A summary for people.
    Summary,
    /// A line of columns for each path.
    Table,
    /// A line with a JSON object for each pair.
    Json {
        /// With the nodes of the paths.
        points: bool,
    },
}

/// Writes what comes before the first answer.
pub fn write_header(out: &mut impl Write, style: Style, alternatives: bool) -> io::Result<()> {
    if style != Style::Table {
        return Ok(());
    }
    let which = if alternatives { "alternative\t" } else { "" };
    writeln!(
        out,
        "# from\tto\t{which}length\tlength_error\tsurface_error\tstatus\tstable\tnodes\tmoved_from\tmoved_to"
    )
}

/// Writes the answer for one pair.
pub fn write_answer(
    out: &mut impl Write,
    style: Style,
    alternatives: bool,
    dimension: usize,
    answer: &Answer,
) -> io::Result<()> {
    match style {
        Style::Summary => write_summary(out, answer),
        Style::Table => write_rows(out, alternatives, answer),
        Style::Json { points } => {
            serde_json::to_writer(&mut *out, &JsonAnswer::new(answer, dimension, points))?;
            writeln!(out)
        }
    }
}

fn write_rows(out: &mut impl Write, alternatives: bool, answer: &Answer) -> io::Result<()> {
    let [from, to] = &answer.ends;
    let moved = |end: &LocatedEnd| end.place.as_ref().map_or(f64::NAN, |place| place.moved);
    for (index, path) in answer.paths().enumerate() {
        // Points that no path connects are infinitely far apart; of others nothing is known.
        let without_length = match path.outcome {
            Outcome::Asked(Status::NoPath) => f64::INFINITY,
            _ => f64::NAN,
        };
        write!(out, "{}\t{}\t", from.named, to.named)?;
        if alternatives {
            write!(out, "{index}\t")?;
        }
        writeln!(
            out,
            "{}\t{}\t{}\t{}\t{}\t{}\t{:e}\t{:e}",
            path.length.unwrap_or(without_length),
            exponential(path.length_error),
            exponential(path.surface_error),
            path.outcome.word(),
            yes_or_no(path.stable),
            path.nodes(),
            moved(from),
            moved(to)
        )?;
    }
    Ok(())
}

fn write_summary(out: &mut impl Write, answer: &Answer) -> io::Result<()> {
    let [from, to] = &answer.ends;
    for (name, end) in [("from", from), ("to", to)] {
        line(out, name, &format!("{}{}", end.named, moved_by(end)))?;
        if let Some(warning) = end.warning() {
            line(out, "warning", &format!("{name} lies {warning}"))?;
        }
    }
    for (index, path) in answer.paths().enumerate() {
        if index > 0 {
            writeln!(out)?;
            line(out, "alternative", &index.to_string())?;
        }
        write_path(out, path)?;
    }
    for warning in answer.warnings() {
        line(out, "warning", &warning)?;
    }
    Ok(())
}

fn moved_by(end: &LocatedEnd) -> String {
    let Ok(place) = &end.place else {
        return String::new();
    };
    if place.moved <= rounding(&place.point) {
        return String::new();
    }
    format!(" (moved {:.1e} onto the surface)", place.moved)
}

fn write_path(out: &mut impl Write, path: &FoundPath) -> io::Result<()> {
    let Some(length) = path.length else {
        let why = match path.outcome {
            Outcome::Asked(Status::NoPath) => "inf (no path connects the two points)",
            Outcome::Asked(Status::Unknown) => {
                "unknown (no way was found, but the surface was not sampled all the way: it goes on beyond the samples, or has points that they cannot pass)"
            }
            _ => "unknown (no path could be followed on the surface)",
        };
        return line(out, "length", why);
    };
    line(out, "length", &with_errors(length, path))?;
    line(out, "status", path.outcome.word())?;
    line(out, "stable", yes_or_no(path.stable))?;
    if path.shortest {
        line(out, "shortest", "yes (rays found no shorter way)")?;
    }
    line(out, "nodes", &path.nodes().to_string())?;
    line(
        out,
        "geodesic curvature left",
        &exponential(path.max_geodesic_curvature),
    )?;
    line(
        out,
        "off the surface by",
        &exponential(path.max_off_surface),
    )
}

/// Tells facts on standard output: as one JSON object, or in lines as `write` puts them.
pub fn tell<F: Serialize>(
    facts: &F,
    json: bool,
    write: impl FnOnce(&mut StdoutLock<'_>, &F) -> io::Result<()>,
) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if json {
        let text = serde_json::to_string(facts).map_err(io::Error::from)?;
        writeln!(out, "{text}")?;
    } else {
        write(&mut out, facts)?;
    }
    Ok(())
}

/// Writes the names of columns and then a line for each row to standard output.
pub fn write_columns(columns: &[Column<'_>]) -> io::Result<()> {
    let mut out = BufWriter::new(io::stdout().lock());
    let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
    writeln!(out, "# {}", names.join("\t"))?;
    let rows = columns.first().map_or(0, |column| column.values.len());
    for row in 0..rows {
        for (i, column) in columns.iter().enumerate() {
            let separator = if i > 0 { "\t" } else { "" };
            write!(out, "{separator}{}", column.values[row])?;
        }
        writeln!(out)?;
    }
    out.flush()
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

/// A line of an aligned list.
pub fn line(out: &mut impl Write, name: &str, value: &str) -> io::Result<()> {
    writeln!(out, "{name:<24}{value}")
}

/// The line of estimated errors of many values: that in the middle, and the largest.
pub fn errors_line(out: &mut impl Write, errors: [Option<f64>; 2]) -> io::Result<()> {
    let [median, most] = errors.map(exponential);
    let told = format!("{median} (median), {most} at most");
    line(out, "estimated error", &told)
}

/// The lines about points given: how far they were moved onto the surface, and how many have no
/// place there.
pub fn moved_lines(out: &mut impl Write, most: Option<f64>, unusable: usize) -> io::Result<()> {
    if most.is_none() {
        return Ok(());
    }
    line(out, "moved by at most", &exponential(most))?;
    line(out, "off the surface", &unusable.to_string())
}

pub fn yes_or_no(value: bool) -> &'static str {
    if value { "yes" } else { "no" }
}

/// The length of a path with as many digits as its errors leave, and the errors: on a cloud first
/// that of the surface, then that of the path on it.
pub fn with_errors(length: f64, path: &FoundPath) -> String {
    match (path.length_error, path.surface_error) {
        (None, _) => format!("{length:.1e} (error unknown)"),
        (Some(correction), None) => format!(
            "{} ± {correction:.1e} (path; error of the surface unknown)",
            rounded(length, correction)
        ),
        (Some(0.0), Some(0.0)) => length.to_string(),
        (Some(correction), Some(0.0)) => {
            format!("{} ± {correction:.1e}", rounded(length, correction))
        }
        (Some(correction), Some(surface)) => format!(
            "{} ± {surface:.1e} (surface) ± {correction:.1e} (path)",
            rounded(length, correction + surface)
        ),
    }
}

/// One object for a pair, as it is documented.
#[derive(Serialize)]
struct JsonAnswer<'a> {
    from: JsonEnd<'a>,
    to: JsonEnd<'a>,
    #[serde(flatten)]
    path: JsonPath<'a>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    alternatives: Vec<JsonPath<'a>>,
    /// What speaks against the answer.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct JsonEnd<'a> {
    /// The row of the file, where the end was given as one.
    #[serde(skip_serializing_if = "Option::is_none")]
    row: Option<usize>,
    /// The coordinates given, where it was given by coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    given: Option<&'a [f64]>,
    /// On the surface; null where the end cannot be used.
    point: Option<&'a [f64]>,
    moved: Option<f64>,
    /// That it was moved farther than a model lies from its points.
    #[serde(skip_serializing_if = "Option::is_none")]
    warning: Option<String>,
    /// Why the end cannot be used.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'a str>,
}

#[derive(Serialize)]
struct JsonPath<'a> {
    length: Option<f64>,
    length_error: Option<f64>,
    surface_error: Option<f64>,
    converged: bool,
    status: &'static str,
    stable: bool,
    /// Null where that is not known.
    shortest: Option<bool>,
    nodes: usize,
    max_geodesic_curvature: Option<f64>,
    max_off_surface: Option<f64>,
    steps: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<Vec<&'a [f64]>>,
}

impl<'a> JsonAnswer<'a> {
    fn new(answer: &'a Answer, dimension: usize, points: bool) -> Self {
        let [from, to] = &answer.ends;
        let path = |path| JsonPath::new(path, dimension, points);
        Self {
            from: JsonEnd::new(from),
            to: JsonEnd::new(to),
            path: path(&answer.path),
            alternatives: answer.alternatives.iter().map(path).collect(),
            warnings: answer.warnings(),
        }
    }
}

impl<'a> JsonEnd<'a> {
    fn new(end: &'a LocatedEnd) -> Self {
        let (row, given) = match &end.named {
            End::Row(row) => (Some(*row), None),
            End::Point(point) => (None, Some(point.as_slice())),
        };
        Self {
            row,
            given,
            point: end.place.as_ref().ok().map(|place| place.point.as_slice()),
            moved: end.place.as_ref().ok().map(|place| place.moved),
            warning: end
                .warning()
                .map(|warning| format!("the end lies {warning}")),
            reason: end.place.as_ref().err().map(String::as_str),
        }
    }
}

impl<'a> JsonPath<'a> {
    fn new(path: &'a FoundPath, dimension: usize, points: bool) -> Self {
        Self {
            length: path.length,
            length_error: path.length_error,
            surface_error: path.surface_error,
            converged: path.outcome == Outcome::Asked(Status::Converged),
            status: path.outcome.word(),
            stable: path.stable,
            shortest: path.shortest.then_some(true),
            nodes: path.nodes(),
            max_geodesic_curvature: path.max_geodesic_curvature,
            max_off_surface: path.max_off_surface,
            steps: path.steps,
            points: points.then(|| path.points.chunks(dimension).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_stand_beside_the_length() {
        let shown = |length_error, surface_error| {
            let path = FoundPath {
                length_error,
                surface_error,
                ..FoundPath::new(
                    &taut_core::result::Path::<3>::none(),
                    &taut_core::Vector::zeros(),
                    3,
                )
            };
            with_errors(2.0 / 3.0, &path)
        };
        assert_eq!(
            shown(Some(1e-11), Some(2.1e-4)),
            "0.66667 ± 2.1e-4 (surface) ± 1.0e-11 (path)"
        );
        assert_eq!(shown(Some(1e-3), Some(0.0)), "0.6667 ± 1.0e-3");
        assert_eq!(
            shown(Some(1e-3), None),
            "0.6667 ± 1.0e-3 (path; error of the surface unknown)"
        );
        assert_eq!(shown(None, Some(1e-3)), "6.7e-1 (error unknown)");
    }
}
