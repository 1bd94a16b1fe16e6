//! What a reader or a writer answers when it cannot do its work.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Where in a file something was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A line of a text file, the first is 1.
    Line(usize),
    /// A byte, the first is 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(formatter, "line {line}"),
            Place::Byte(offset) => write!(formatter, "byte offset {offset}"),
        }
    }
}

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused.
    #[error("{}: cannot be read: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file has no bytes.
    #[error("{}: the file is empty: found 0 bytes, expected points; write the file again", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
    },
    /// Neither extension nor option names a format.
    #[error(
        "{}: found {found}, expected one of {known}; rename the file or name its format with --format NAME",
        file.display()
    )]
    UnknownFormat {
        /// The file.
        file: PathBuf,
        /// The extension found, in words.
        found: String,
        /// The extensions expected.
        known: String,
    },
    /// The file is well formed and holds no point.
    #[error("{}: no points: found 0 rows, expected at least 1; export the points again", file.display())]
    NoPoints {
        /// The file.
        file: PathBuf,
    },
    /// The file does not say what its format demands.
    #[error("{}: {place}: found {found}, expected {expected}; {remedy}", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// The line or byte.
        place: Place,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
        /// What the user can do.
        remedy: String,
    },
    /// The file has no such column.
    #[error("{}: found {found}, expected a column {column:?} of numbers beside the coordinates; name one that is there", file.display())]
    NoColumn {
        /// The file.
        file: PathBuf,
        /// The column asked for.
        column: String,
        /// The columns that there are, in words.
        found: String,
    },
    /// An option was given that the format cannot honour.
    #[error("{}: found a class filter, expected none, because only las and laz files have classes; leave it out", file.display())]
    ClassesWithoutLas {
        /// The file.
        file: PathBuf,
    },
}

/// Why a file could not be written. The file that stood there before, if any, is untouched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The operating system refused.
    #[error("{}: cannot be written: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The extension names no format that can be written.
    #[error("{}: found {found}, expected one of {known}; choose another extension", file.display())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
        /// The extension found, in words.
        found: String,
        /// The extensions known.
        known: &'static str,
    },
    /// The format holds only points of three coordinates.
    #[error("{}: found dimension {dimension}, expected 3 for .{extension}; {remedy}", file.display())]
    Dimension {
        /// The file.
        file: PathBuf,
        /// Number of coordinates of a point.
        dimension: usize,
        /// The extension.
        extension: &'static str,
        /// Formats that hold any dimension.
        remedy: &'static str,
    },
    /// NPY holds one array, hence one path.
    #[error("{}: found {count} paths, expected 1 for .npy; write .csv or .json, or one file for each path", file.display())]
    OnePathOnly {
        /// The file.
        file: PathBuf,
        /// Number of paths given.
        count: usize,
    },
    /// LAS holds what a scanner measured, so it is only written beside a file that has that.
    #[error("{}: found points that come from no LAS or LAZ file, expected such a file, to whose records the columns are added; write .ply, .csv, .vtp or .npy", file.display())]
    Original {
        /// The file.
        file: PathBuf,
    },
    /// The records of another file could not be copied.
    #[error("{}: the records of {} cannot be copied: {reason}; write .ply, .csv, .vtp or .npy", file.display(), original.display())]
    Las {
        /// The file.
        file: PathBuf,
        /// The file copied from.
        original: PathBuf,
        /// What went wrong.
        reason: String,
    },
    /// The arrays of a path or of points do not fit each other.
    #[error("{}: path {path}: found {found}, expected {expected}; pass arrays that belong together", file.display())]
    Shape {
        /// The file.
        file: PathBuf,
        /// Index of the path; 0 for points.
        path: usize,
        /// The lengths found, in words.
        found: String,
        /// The lengths expected, in words.
        expected: String,
    },
}

/// A reader's error before the file's name is known.
#[derive(Debug)]
pub(crate) enum Fault {
    Io(io::Error),
    Empty,
    NoColumn {
        column: String,
        found: String,
    },
    Malformed {
        place: Place,
        found: String,
        expected: String,
        remedy: String,
    },
}

impl Fault {
    pub(crate) fn line(
        line: usize,
        found: impl Into<String>,
        expected: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::at(Place::Line(line), found, expected, remedy)
    }

    pub(crate) fn byte(
        offset: u64,
        found: impl Into<String>,
        expected: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::at(Place::Byte(offset), found, expected, remedy)
    }

    /// Of the names of the columns that there are.
    pub(crate) fn no_column<'a>(column: &str, found: impl IntoIterator<Item = &'a str>) -> Self {
        let found: Vec<&str> = found.into_iter().collect();
        let found = match found.as_slice() {
            [] => "no named columns".to_owned(),
            names => format!("the columns {}", names.join(", ")),
        };
        let column = column.to_owned();
        Self::NoColumn { column, found }
    }

    fn at(
        place: Place,
        found: impl Into<String>,
        expected: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Malformed {
            place,
            found: found.into(),
            expected: expected.into(),
            remedy: remedy.into(),
        }
    }

    pub(crate) fn in_file(self, file: &Path) -> ReadError {
        let file = file.to_path_buf();
        match self {
            Fault::Io(source) => ReadError::Io { file, source },
            Fault::Empty => ReadError::Empty { file },
            Fault::NoColumn { column, found } => ReadError::NoColumn {
                file,
                column,
                found,
            },
            Fault::Malformed {
                place,
                found,
                expected,
                remedy,
            } => ReadError::Malformed {
                file,
                place,
                found,
                expected,
                remedy,
            },
        }
    }
}

impl From<io::Error> for Fault {
    fn from(source: io::Error) -> Self {
        Fault::Io(source)
    }
}

/// A piece of a file as an error quotes it: escaped, and cut to a readable length.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 48;
    let text = text.trim();
    let mut shown: String = text.chars().take(LONGEST).collect();
    if shown.len() < text.len() {
        shown.push_str("...");
    }
    format!("{shown:?}")
}

/// A file's extension as an error tells it.
pub(crate) fn extension_in_words(path: &Path) -> String {
    match path.extension() {
        Some(extension) => format!("extension \".{}\"", extension.display()),
        None => "no extension".to_owned(),
    }
}
