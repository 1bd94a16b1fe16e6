//! Points of a surface, named by a file: coordinates, or row numbers of the file of the surface's points.

use std::path::Path;

use crate::error::{Fault, ReadError, quoted};
use crate::format::Format;
use crate::point_set::{PointSet, ReadOptions};
use crate::read::read;
use crate::text::{Separator, as_text, content_lines};

/// Points named by a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Sources {
    /// Rows of the point file, the first is 0.
    Rows(Vec<usize>),
    /// Coordinates.
    Points(PointSet),
}

/// Reads points that a file names: row numbers where it is text of one column, or else points as [`read`] does.
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
    let in_file = |fault: Fault| fault.in_file(path);
    if matches!(Format::from_path(path), Some(Format::Xyz | Format::Csv)) {
        let bytes = std::fs::read(path).map_err(|error| in_file(error.into()))?;
        let text = as_text(&bytes).map_err(in_file)?;
        let first = content_lines(text).next();
        if first.is_some_and(|(_, row)| Separator::of(row).fields(row).count() == 1) {
            return rows(text).map(Sources::Rows).map_err(in_file);
        }
    }
    read(path, &ReadOptions::default()).map(Sources::Points)
}

fn rows(text: &str) -> Result<Vec<usize>, Fault> {
    let row = |(line, row): (usize, &str)| {
        row.trim_end_matches([',', ';']).parse().map_err(|_| {
            let expected = "a row number: 0, 1, 2, ..., as in a file of one column";
            let remedy = "write a row number or a point's coordinates on each line";
            Fault::line(line, quoted(row), expected, remedy)
        })
    };
    content_lines(text).map(row).collect()
}
