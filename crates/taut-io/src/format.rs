//! The formats that can be read, and the extensions that name them.

use std::ffi::OsStr;
use std::path::Path;
use std::str::FromStr;

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

const NAMES: [(&str, Format); 12] = [
    ("ply", Format::Ply),
    ("obj", Format::Obj),
    ("off", Format::Off),
    ("stl", Format::Stl),
    ("xyz", Format::Xyz),
    ("txt", Format::Xyz),
    ("csv", Format::Csv),
    ("pcd", Format::Pcd),
    ("las", Format::Las),
    ("laz", Format::Las),
    ("e57", Format::E57),
    ("npy", Format::Npy),
];

impl Format {
    /// The format that a file's extension names, upper or lower case.
    pub fn from_path(path: &Path) -> Option<Self> {
        path.extension().and_then(OsStr::to_str)?.parse().ok()
    }

    /// The known extensions, separated by commas.
    pub fn extensions() -> String {
        NAMES.map(|(name, _)| name).join(", ")
    }
}

impl FromStr for Format {
    type Err = String;

    /// Reads a format's extension, without the dot, upper or lower case.
    ///
    /// # Errors
    /// A sentence that lists the known names.
    fn from_str(name: &str) -> Result<Self, Self::Err> {
        NAMES
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(name))
            .map(|(_, format)| *format)
            .ok_or_else(|| format!("found {name:?}, expected one of {}", Self::extensions()))
    }
}

/// A file's extension as an error tells it.
pub(crate) fn extension_in_words(path: &Path) -> String {
    match path.extension() {
        Some(extension) => format!("extension \".{}\"", extension.display()),
        None => "no extension".to_owned(),
    }
}
