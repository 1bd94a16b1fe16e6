//! One file per format; what the bytes are and what they mean are kept apart inside each.

mod e57;
pub(crate) mod las;
mod npy;
mod obj;
mod off;
mod pcd;
mod ply;
mod stl;
mod table;

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::error::{Fault, ReadError};
use crate::format::{Format, extension_in_words};
use crate::point_set::{PointSet, ReadOptions};

/// Reads the points of a file.
///
/// The format is the option's, or else the extension's. Coordinates come in `f64`, in the file's units and order;
/// rows that are not finite and points that share a place are kept. STL, which has only the corners of triangles,
/// answers each place once, in order of first appearance. XYZ with six columns and unit vectors in the last three are
/// points with normals.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, is empty, has no point, or does not say what its format demands. No more
/// memory is asked for than the file's length justifies.
///
/// # Complexity
/// Linear in the file's length. LAS, LAZ, E57, OBJ, OFF and tables are read through a small buffer, the others from one
/// copy of the file. A line of text has at most 2^20 bytes.
pub fn read(path: &Path, options: &ReadOptions) -> Result<PointSet, ReadError> {
    let format = options
        .format
        .or_else(|| Format::from_path(path))
        .ok_or_else(|| ReadError::UnknownFormat {
            file: path.to_path_buf(),
            found: extension_in_words(path),
        })?;
    if !options.classes.is_empty() && format != Format::Las {
        return Err(ReadError::ClassesWithoutLas {
            file: path.to_path_buf(),
        });
    }
    let points = read_as(format, path, options).map_err(|fault| fault.in_file(path))?;
    if points.rows() == 0 {
        return Err(ReadError::NoPoints {
            file: path.to_path_buf(),
        });
    }
    Ok(points)
}

fn read_as(format: Format, path: &Path, options: &ReadOptions) -> Result<PointSet, Fault> {
    let column = options.column.as_deref();
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    let length = metadata.len();
    if metadata.is_file() && length == 0 {
        return Err(Fault::Empty);
    }
    let has_columns = matches!(
        format,
        Format::Ply | Format::Xyz | Format::Csv | Format::Las
    );
    if let Some(column) = column.filter(|_| !has_columns) {
        return Err(Fault::no_column(column, []));
    }
    match format {
        Format::Ply => ply::read(&whole(file)?, column),
        Format::Obj => obj::read(BufReader::new(file)),
        Format::Off => off::read(BufReader::new(file)),
        Format::Stl => stl::read(whole(file)?),
        Format::Xyz => table::read(BufReader::new(file), table::Style::Positions, column),
        Format::Csv => table::read(BufReader::new(file), table::Style::Columns, column),
        Format::Pcd => pcd::read(&whole(file)?),
        Format::Las => las::read(BufReader::new(file), length, options),
        Format::E57 => e57::read(BufReader::new(file), length),
        Format::Npy => npy::read(&whole(file)?),
    }
}

fn whole(mut file: File) -> Result<Vec<u8>, Fault> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    if bytes.is_empty() {
        return Err(Fault::Empty);
    }
    Ok(bytes)
}
