//! Lists of points of a surface, as the user names them.

use std::ffi::OsStr;
use std::path::Path;

use taut::End;
use taut_io::{read_numbers, read_sources};

use crate::exit::Failure;
use crate::progress::Progress;
use crate::source::Sources;

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

/// The same without the values.
pub fn places_of(
    sources: &Sources,
    dimension: usize,
    progress: &Progress,
) -> Result<Vec<End>, Failure> {
    let sites = of_sources(sources, dimension, progress)?;
    Ok(sites.into_iter().map(|site| site.end).collect())
}

/// The same where no values may stand behind the sites, which a flag named.
pub fn ends_of_sources(
    flag: &str,
    sources: &Sources,
    dimension: usize,
    progress: &Progress,
) -> Result<Vec<End>, Failure> {
    let sites = of_sources(sources, dimension, progress)?;
    match sites.iter().find_map(|site| site.value) {
        Some(value) => Err(Failure::Usage(format!(
            "{flag}: found the value {value} behind a point, expected none; leave it out"
        ))),
        None => Ok(sites.into_iter().map(|site| site.end).collect()),
    }
}

/// The sites in a file: of text (.txt) with one column more than it needs, each with the value that
/// stands there.
pub fn of_file(file: &Path, dimension: usize, progress: &Progress) -> Result<Vec<Site>, Failure> {
    progress.step(format!("reading {}", file.display()));
    if file.extension() != Some(OsStr::new("txt")) {
        let alone = |end| Site { end, value: None };
        return Ok(ends_of_file(file)?.into_iter().map(alone).collect());
    }
    let numbers = read_numbers(file)?;
    let is_valued = numbers.columns == dimension + 1 || (numbers.columns == 2 && dimension > 2);
    // Behind the coordinates of points in space there may be normals.
    let place = match numbers.columns {
        columns if is_valued => columns - 1,
        6 if dimension == 3 => dimension,
        columns => columns,
    };
    let rows = numbers.values.chunks(numbers.columns);
    rows.map(|row| {
        let (place, behind) = row.split_at(place);
        let value = behind.first().copied().filter(|_| is_valued);
        site(file, place, value)
    })
    .collect()
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

/// The site of a row number or coordinates, with the value that stands behind.
fn site(file: &Path, place: &[f64], value: Option<f64>) -> Result<Site, Failure> {
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
    if place
        .iter()
        .chain(&value)
        .any(|number| number.is_infinite())
    {
        return Err(Failure::Usage(format!(
            "{}: found {place:?}, expected finite numbers",
            file.display()
        )));
    }
    Ok(Site { end, value })
}
