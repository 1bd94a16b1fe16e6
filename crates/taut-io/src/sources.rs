//! Points of a surface, named by a file: coordinates, or row numbers of the file of the surface's
//! points.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use crate::error::{Fault, ReadError, quoted};
use crate::point_set::PointSet;
use crate::read::{Format, ReadOptions, read};
use crate::text::{Lines, Separator};

/// Points named by a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Sources {
    /// Rows of the point file, the first is 0.
    Rows(Vec<usize>),
    /// Coordinates.
    Points(PointSet),
}

/// Reads points that a file names: row numbers where it is text of one column, or else points as
/// [`read`] does.
///
/// ```
/// use taut_io::{Sources, read_sources};
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("rows.txt");
/// std::fs::write(&file, "# sources\n12\n7\n")?;
/// assert_eq!(read_sources(&file)?, Sources::Rows(vec![12, 7]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`read`], and where a line of a file of row numbers is none.
pub fn read_sources(path: &Path) -> Result<Sources, ReadError> {
    if matches!(Format::from_path(path), Some(Format::Xyz | Format::Csv)) {
        let rows = rows(path).map_err(|fault| fault.in_file(path))?;
        if let Some(rows) = rows {
            return Ok(Sources::Rows(rows));
        }
    }
    read(path, &ReadOptions::default()).map(Sources::Points)
}

/// The rows in a text of one column, `None` where it has more.
fn rows(path: &Path) -> Result<Option<Vec<usize>>, Fault> {
    let mut lines = Lines::new(BufReader::new(File::open(path)?));
    let mut rows = Vec::new();
    while let Some((line, row)) = lines.next()? {
        if rows.is_empty() && Separator::of(row).fields(row).count() != 1 {
            return Ok(None);
        }
        let number = row.trim_end_matches([',', ';']).parse().map_err(|_| {
            let expected = "a row number: 0, 1, 2, ..., as in a file of one column";
            let remedy = "write a row number or a point's coordinates on each line";
            Fault::line(line, quoted(row), expected, remedy)
        })?;
        rows.push(number);
    }
    Ok((!rows.is_empty()).then_some(rows))
}
