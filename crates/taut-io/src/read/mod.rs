//! The list of all formats, each of which has a file. What the bytes are and what they mean are
//! kept apart inside each.

mod e57;
pub(crate) mod las;
mod npy;
mod obj;
mod off;
mod pcd;
mod ply;
mod stl;
mod table;

use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::str::FromStr;

use crate::error::{Fault, ReadError, extension_in_words};
use crate::point_set::PointSet;

/// A format of point clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Polygon file format: ASCII, binary little and big endian.
    Ply,
    /// Wavefront OBJ: `v` and `vn` lines.
    Obj,
    /// Object file format of Geomview: OFF, COFF, NOFF, CNOFF.
    Off,
    /// Stereolithography: ASCII and binary.
    Stl,
    /// Columns separated by white space, commas or semicolons.
    Xyz,
    /// Columns as in [`Format::Xyz`], every one a coordinate unless a header line says otherwise.
    Csv,
    /// Point Cloud Library: ASCII, binary, binary_compressed.
    Pcd,
    /// ASPRS LAS, and LAZ, its compressed form.
    Las,
    /// ASTM E2807.
    E57,
    /// One NumPy array of shape (n, d).
    Npy,
}

/// How to read a file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The format; by the extension when absent.
    pub format: Option<Format>,
    /// LAS and LAZ: the classification codes to keep; every one when empty.
    pub classes: Vec<u8>,
    /// The name of a column of numbers to read beside the points. In CSV, XYZ and TXT it stands in
    /// the first line; in PLY it is a property of vertices, in LAS and LAZ `intensity` or an extra
    /// dimension.
    pub column: Option<String>,
}

/// What is known of a format.
struct Known {
    format: Format,
    /// The extensions that name it.
    names: &'static [&'static str],
    /// Whether its columns have names, so that one of them can be asked for.
    has_columns: bool,
    read: fn(Input<'_>) -> Result<PointSet, Fault>,
}

/// A file to read.
struct Input<'a> {
    file: File,
    /// In bytes.
    length: u64,
    options: &'a ReadOptions,
}

/// Every format, in the order in which they are listed to users.
const FORMATS: &[Known] = &[
    Known {
        format: Format::Ply,
        names: &["ply"],
        has_columns: true,
        read: |input| ply::read(&input.whole()?, input.column()),
    },
    Known {
        format: Format::Obj,
        names: &["obj"],
        has_columns: false,
        read: |input| obj::read(input.buffered()),
    },
    Known {
        format: Format::Off,
        names: &["off"],
        has_columns: false,
        read: |input| off::read(input.buffered()),
    },
    Known {
        format: Format::Stl,
        names: &["stl"],
        has_columns: false,
        read: |input| stl::read(input.whole()?),
    },
    Known {
        format: Format::Xyz,
        names: &["xyz", "txt"],
        has_columns: true,
        read: |input| {
            let column = input.column();
            table::read(input.buffered(), table::Style::Positions, column)
        },
    },
    Known {
        format: Format::Csv,
        names: &["csv"],
        has_columns: true,
        read: |input| {
            let column = input.column();
            table::read(input.buffered(), table::Style::Columns, column)
        },
    },
    Known {
        format: Format::Pcd,
        names: &["pcd"],
        has_columns: false,
        read: |input| pcd::read(&input.whole()?),
    },
    Known {
        format: Format::Las,
        names: &["las", "laz"],
        has_columns: true,
        read: |input| {
            let (length, column) = (input.length, input.column());
            let classes = &input.options.classes;
            las::read(input.buffered(), length, classes, column)
        },
    },
    Known {
        format: Format::E57,
        names: &["e57"],
        has_columns: false,
        read: |input| {
            let length = input.length;
            e57::read(input.buffered(), length)
        },
    },
    Known {
        format: Format::Npy,
        names: &["npy"],
        has_columns: false,
        read: |input| npy::read(&input.whole()?),
    },
];

impl Format {
    /// The format that a file's extension names, upper or lower case.
    pub fn from_path(path: &Path) -> Option<Self> {
        path.extension().and_then(OsStr::to_str)?.parse().ok()
    }

    /// The known extensions, separated by commas.
    pub fn extensions() -> String {
        let names = FORMATS.iter().flat_map(|known| known.names);
        names.copied().collect::<Vec<_>>().join(", ")
    }
}

impl FromStr for Format {
    type Err = String;

    /// Reads a format's extension, without the dot, upper or lower case.
    ///
    /// # Errors
    /// A sentence that lists the known names.
    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let has_name = |known: &&Known| known.names.iter().any(|n| n.eq_ignore_ascii_case(name));
        let known = FORMATS.iter().find(has_name);
        known
            .map(|known| known.format)
            .ok_or_else(|| format!("found {name:?}, expected one of {}", Self::extensions()))
    }
}

/// Reads the points of a file.
///
/// The format is the option's, or else the extension's. Coordinates come in `f64`, in the file's
/// units and order; rows that are not finite and points that share a place are kept. STL, which has
/// only the corners of triangles, answers each place once, in order of first appearance. XYZ with
/// six columns and unit vectors in the last three are points with normals.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, is empty, has no point, or does not say what its
/// format demands. No more memory is asked for than the file's length justifies.
///
/// # Complexity
/// Linear in the file's length. LAS, LAZ, E57, OBJ, OFF and tables are read through a small buffer,
/// the others from one copy of the file. A line of text has at most 2^20 bytes.
pub fn read(path: &Path, options: &ReadOptions) -> Result<PointSet, ReadError> {
    let format = options
        .format
        .or_else(|| Format::from_path(path))
        .ok_or_else(|| ReadError::UnknownFormat {
            file: path.to_path_buf(),
            found: extension_in_words(path),
            known: Format::extensions(),
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
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    let length = metadata.len();
    if metadata.is_file() && length == 0 {
        return Err(Fault::Empty);
    }
    let input = Input {
        file,
        length,
        options,
    };
    let known = FORMATS.iter().find(|known| known.format == format);
    match (known, input.column()) {
        (Some(known), None) => (known.read)(input),
        (Some(known), Some(_)) if known.has_columns => (known.read)(input),
        (_, column) => Err(Fault::no_column(column.unwrap_or_default(), [])),
    }
}

impl<'a> Input<'a> {
    /// The name of a column that is read with the points.
    fn column(&self) -> Option<&'a str> {
        self.options.column.as_deref()
    }

    fn buffered(self) -> BufReader<File> {
        BufReader::new(self.file)
    }

    fn whole(&self) -> Result<Vec<u8>, Fault> {
        let mut bytes = Vec::new();
        (&self.file).read_to_end(&mut bytes)?;
        if bytes.is_empty() {
            return Err(Fault::Empty);
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_is_documented() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
        let Ok(text) = std::fs::read_to_string(file) else {
            println!("skipped: the package stands alone, without the documentation");
            return;
        };
        for known in FORMATS {
            let row = format!("\n| {} |", known.names.join(", "));
            assert!(text.contains(&row), "docs/formats.md has no row {row:?}");
        }
    }
}
