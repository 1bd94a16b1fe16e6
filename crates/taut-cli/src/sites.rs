//! Lists of points of a surface, as the user names them.

use std::ffi::OsStr;
use std::path::Path;

use taut_io::{ReadOptions, read_numbers};

use crate::exit::Failure;
use crate::progress::Progress;
use crate::settings::{End, Sources};

/// A point of a surface that a value may belong to.
#[derive(Clone)]
pub struct Site {
    pub end: End,
    /// The number behind it, where there is one.
    pub value: Option<f64>,
}

/// The sites of sources given, for points of `dimension` coordinates.
pub fn of_sources(
    sources: &Sources,
    dimension: usize,
    progress: &Progress,
) -> Result<Vec<Site>, Failure> {
    let alone = |end: &End| Site {
        end: end.clone(),
        value: None,
    };
    match sources {
        Sources::Any => Ok(Vec::new()),
        Sources::Ends(ends) => Ok(ends.iter().map(alone).collect()),
        Sources::File(file) => of_file(file, dimension, progress),
    }
}

/// The same where no values may stand behind the sites.
pub fn ends_of_sources(
    sources: &Sources,
    dimension: usize,
    progress: &Progress,
) -> Result<Vec<End>, Failure> {
    let sites = of_sources(sources, dimension, progress)?;
    match sites.iter().find_map(|site| site.value) {
        Some(value) => Err(Failure::Usage(format!(
            "--sources: found the value {value} behind a source, expected none; leave it out"
        ))),
        None => Ok(sites.into_iter().map(|site| site.end).collect()),
    }
}

/// The sites in a file: of text (.txt) rows or coordinates, each with a value behind it or none; of any
/// other format points.
pub fn of_file(file: &Path, dimension: usize, progress: &Progress) -> Result<Vec<Site>, Failure> {
    progress.step(format!("reading {}", file.display()));
    if file
        .extension()
        .is_none_or(|found| found == OsStr::new("txt"))
    {
        return of_text(file, dimension);
    }
    let read = taut_io::read(file, &ReadOptions::default())?;
    let rows = read.coordinates.chunks(read.dimension);
    let site = |row: &[f64]| Site {
        end: End::Point(row.to_vec()),
        value: None,
    };
    Ok(rows.map(site).collect())
}

fn of_text(file: &Path, dimension: usize) -> Result<Vec<Site>, Failure> {
    let numbers = read_numbers(file)?;
    let rows = numbers.values.chunks(numbers.columns);
    let wrong = |what: String| {
        Failure::Usage(format!(
            "{}: found {what}, expected rows of the point file (the first is 0) or {dimension} coordinates, each with a value behind it or none",
            file.display()
        ))
    };
    let (coordinates, valued) = match numbers.columns {
        columns if columns == dimension => (dimension, false),
        columns if columns == dimension + 1 => (dimension, true),
        1 => (1, false),
        2 => (1, true),
        columns => return Err(wrong(format!("{columns} columns"))),
    };
    let site = |row: &[f64]| {
        let value = valued.then(|| row[coordinates]);
        let end = match &row[..coordinates] {
            [index] if index.fract() == 0.0 && (0.0..2_f64.powi(53)).contains(index) => {
                End::Row(*index as usize)
            }
            [index] => return Err(wrong(format!("row {index}"))),
            point => End::Point(point.to_vec()),
        };
        Ok(Site { end, value })
    };
    rows.map(site).collect()
}
