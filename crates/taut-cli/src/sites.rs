//! Lists of points of a surface, as the user names them.

use std::ffi::OsStr;
use std::path::Path;

use taut_io::{read_numbers, read_sources};

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

/// The sites in a file: of text (.txt) with one column more than it needs, each with the value that stands there.
pub fn of_file(file: &Path, dimension: usize, progress: &Progress) -> Result<Vec<Site>, Failure> {
    progress.step(format!("reading {}", file.display()));
    if file.extension() == Some(OsStr::new("txt")) {
        let numbers = read_numbers(file)?;
        let is_valued = numbers.columns == dimension + 1 || (numbers.columns == 2 && dimension > 2);
        if is_valued {
            return numbers
                .values
                .chunks(numbers.columns)
                .map(|row| valued(file, row))
                .collect();
        }
    }
    let alone = |end| Site { end, value: None };
    Ok(ends_of_file(file)?.into_iter().map(alone).collect())
}

/// The points that a file names, by rows or coordinates.
pub fn ends_of_file(file: &Path) -> Result<Vec<End>, Failure> {
    Ok(match read_sources(file)? {
        taut_io::Sources::Rows(rows) => rows.into_iter().map(End::Row).collect(),
        taut_io::Sources::Points(points) => {
            let rows = points.coordinates.chunks(points.dimension);
            rows.map(|row| End::Point(row.to_vec())).collect()
        }
    })
}

/// A row or coordinates with a value behind.
fn valued(file: &Path, row: &[f64]) -> Result<Site, Failure> {
    let (value, place) = (row.last().copied(), &row[..row.len() - 1]);
    let end = match place {
        [index] if index.fract() == 0.0 && (0.0..2_f64.powi(53)).contains(index) => {
            End::Row(*index as usize)
        }
        [index] => {
            return Err(Failure::Usage(format!(
                "{}: found row {index}, expected a row of the point file: 0, 1, 2, ..",
                file.display()
            )));
        }
        point => End::Point(point.to_vec()),
    };
    if row.iter().any(|number| number.is_infinite()) {
        return Err(Failure::Usage(format!(
            "{}: found {row:?}, expected finite numbers",
            file.display()
        )));
    }
    Ok(Site { end, value })
}
