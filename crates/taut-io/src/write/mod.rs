//! Writers of paths and points, one file per format.

mod atomic;
mod csv;
mod json;
mod las;
mod matrix;
mod npy;
mod npz;
mod obj;
mod ply;
mod unfinished;
mod vtk;
mod vtp;
mod xyz;

pub use atomic::{check_place, sync_folder, target_of, write_whole};
pub use matrix::MatrixFile;
pub use npz::{SparseRows, write_sparse};
pub use unfinished::{Unfinished, discard_unfinished};

use std::ffi::OsStr;
use std::io::{self, Write};
use std::path::Path;

use crate::error::{WriteError, extension_in_words};
use crate::read::Format;

const ANY_DIMENSION: &str = "write .csv, .json or .npy";

/// A path through points of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Polyline<'a> {
    /// Number of coordinates of a point.
    pub dimension: usize,
    /// Nodes x `dimension`, row-major, in the input's units.
    pub points: &'a [f64],
    /// The surface's normal at each node, in the shape of `points`.
    pub normals: Option<&'a [f64]>,
    /// Length of the path up to each node, in the input's units.
    pub arc_length: &'a [f64],
    /// The distance that all nodes of an isoline share, in the input's units.
    pub level: Option<f64>,
}

impl<'a> Polyline<'a> {
    fn nodes(&self) -> usize {
        self.arc_length.len()
    }

    fn point(&self, node: usize) -> &'a [f64] {
        &self.points[node * self.dimension..][..self.dimension]
    }

    fn normal(&self, node: usize) -> Option<&'a [f64]> {
        Some(&self.normals?[node * self.dimension..][..self.dimension])
    }
}

/// A number with a name for each of many points.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    /// What files call it.
    pub name: &'a str,
    /// One a point.
    pub values: &'a [f64],
}

/// Points with what is known of each.
#[derive(Debug, Clone, Copy)]
pub struct PointTable<'a> {
    /// Number of coordinates of a point.
    pub dimension: usize,
    /// Points x `dimension`, row-major, in the input's units.
    pub coordinates: &'a [f64],
    /// The surface's normal at each point, in the shape of `coordinates`.
    pub normals: Option<&'a [f64]>,
    /// Further numbers.
    pub columns: &'a [Column<'a>],
    /// sRGB, one a point.
    pub colours: Option<&'a [[u8; 3]]>,
}

impl<'a> PointTable<'a> {
    fn rows_count(&self) -> usize {
        self.coordinates.len() / self.dimension
    }

    /// The values of all columns at a point.
    fn values(&self, row: usize) -> impl Iterator<Item = &'a f64> {
        self.columns.iter().map(move |column| &column.values[row])
    }

    /// Each point with its normal, which is empty where there is none.
    fn rows(&self) -> impl Iterator<Item = (&'a [f64], &'a [f64])> {
        let (dimension, normals) = (self.dimension, self.normals);
        self.coordinates
            .chunks_exact(dimension)
            .enumerate()
            .map(move |(row, point)| {
                let normal =
                    normals.map_or(&[][..], |normals| &normals[row * dimension..][..dimension]);
                (point, normal)
            })
    }
}

/// Whether every path has a level: a file has one for all of them or for none.
fn have_levels(paths: &[Polyline<'_>]) -> bool {
    paths.iter().all(|path| path.level.is_some()) && !paths.is_empty()
}

/// The level of each node, where every path has one.
fn levels<'a>(paths: &'a [Polyline<'_>]) -> impl Iterator<Item = f64> + 'a {
    let has_levels = have_levels(paths);
    let known = paths.iter().filter(move |_| has_levels);
    known.flat_map(|path| std::iter::repeat_n(path.level.unwrap_or(f64::NAN), path.nodes()))
}

/// Whether every path has normals: a file has them for all of its nodes or for none.
fn have_normals(paths: &[Polyline<'_>]) -> bool {
    paths.iter().all(|path| path.normals.is_some())
}

type PathWriter = fn(&mut dyn Write, &[Polyline<'_>]) -> io::Result<()>;
type PointWriter = fn(&mut dyn Write, &PointTable<'_>) -> io::Result<()>;

/// A format by its extension. The flag says that it holds any dimension.
const PATH_WRITERS: [(&str, bool, PathWriter); 7] = [
    ("ply", false, ply::write_paths),
    ("obj", false, obj::write_paths),
    ("csv", true, csv::write_paths),
    ("json", true, json::write_paths),
    ("vtk", false, vtk::write_paths),
    ("vtp", false, vtp::write_paths),
    ("npy", true, npy::write_paths),
];

const POINT_WRITERS: [(&str, bool, PointWriter); 5] = [
    ("ply", false, ply::write_points),
    ("xyz", true, xyz::write_points),
    ("csv", true, csv::write_points),
    ("npy", true, npy::write_points),
    ("obj", false, obj::write_points),
];

const TABLE_WRITERS: [(&str, bool, PointWriter); 4] = [
    ("npy", true, npy::write_first_column),
    ("csv", true, csv::write_points),
    ("ply", false, ply::write_points),
    ("vtp", false, vtp::write_points),
];

const PATH_FORMATS: &str = "ply, obj, csv, json, vtk, vtp, npy";
const POINT_FORMATS: &str = "ply, xyz, csv, npy, obj";
const TABLE_FORMATS: &str = "npy, csv, ply, vtp, las, laz";

fn writer_of<T: Copy>(
    path: &Path,
    writers: &'static [(&'static str, bool, T)],
    known: &'static str,
    dimension: usize,
) -> Result<(&'static str, T), WriteError> {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    let found = writers
        .iter()
        .find(|(name, ..)| name.eq_ignore_ascii_case(extension));
    let Some((name, any_dimension, writer)) = found else {
        return Err(WriteError::UnknownFormat {
            file: path.to_path_buf(),
            found: extension_in_words(path),
            known,
        });
    };
    if dimension != 3 && !any_dimension {
        return Err(WriteError::Dimension {
            file: path.to_path_buf(),
            dimension,
            extension: name,
            remedy: ANY_DIMENSION,
        });
    }
    Ok((name, *writer))
}

/// Writes paths in the format that the extension names.
///
/// | extension | holds |
/// |---|---|
/// | ply | binary little endian: x y z, nx ny nz, arc_length as double; the element edge joins the nodes |
/// | obj | v, vn, and l for each path |
/// | csv | path, arc_length, x, y, z, nx, ny, nz (x1 .. xd, n1 .. nd where d is not 3) |
/// | json | an array of objects with points, normals, arc_length |
/// | vtk, vtp | polydata of lines, text, with the point data arc_length and normals |
/// | npy | the points of one path, float64 of shape (nodes, d) |
///
/// Normals are written where every path has them, and so are levels, as `level` beside `arc_length`
/// (not in obj and npy). The file appears only when it is complete; until then the file that stood
/// there stays.
///
/// # Errors
/// [`WriteError`] for an unknown extension, arrays that do not fit, another dimension than 3 where
/// the format cannot hold it, more than one path for npy, or what the system says.
pub fn write_polylines(path: &Path, paths: &[Polyline<'_>]) -> Result<(), WriteError> {
    let dimension = paths.first().map_or(3, |first| first.dimension);
    for (index, polyline) in paths.iter().enumerate() {
        check_shape(path, index, dimension, polyline)?;
    }
    let (extension, writer) = writer_of(path, &PATH_WRITERS, PATH_FORMATS, dimension)?;
    if extension == "npy" && paths.len() != 1 {
        return Err(WriteError::OnePathOnly {
            file: path.to_path_buf(),
            count: paths.len(),
        });
    }
    write_whole(path, |file| writer(file, paths))
}

/// Writes points, with normals where given, as ply, xyz, csv, npy (no normals) or obj by extension.
///
/// `coordinates` is row-major, points x `dimension`; `normals` has the same shape.
///
/// # Errors
/// As [`write_polylines`].
pub fn write_points(
    path: &Path,
    dimension: usize,
    coordinates: &[f64],
    normals: Option<&[f64]>,
) -> Result<(), WriteError> {
    let points = PointTable {
        dimension,
        coordinates,
        normals,
        columns: &[],
        colours: None,
    };
    check_table(path, &points)?;
    let (_, writer) = writer_of(path, &POINT_WRITERS, POINT_FORMATS, dimension)?;
    write_whole(path, |file| writer(file, &points))
}

/// Writes points with named numbers in the format that the extension names.
///
/// | extension | holds |
/// |---|---|
/// | npy | the first column alone, float64 of shape (n,) |
/// | csv | x, y, z, nx, ny, nz (x1 .. xd, n1 .. nd where d is not 3), then the columns |
/// | ply | binary little endian: the same as double, then red, green, blue as uchar |
/// | vtp | polydata of vertices, text, with the columns as point data |
/// | las, laz | the records of `original`, which is such a file, with the columns as extra dimensions of type double |
///
/// `rows` are the rows of `original` that the points come from, all of them where `None`; records
/// of other rows are left out. Infinite values are written as infinity in every format.
///
/// # Errors
/// As [`write_polylines`]; for las and laz [`WriteError::Original`] where there is no original of
/// that format.
pub fn write_table(
    path: &Path,
    points: &PointTable<'_>,
    original: Option<&Path>,
    rows: Option<&[usize]>,
) -> Result<(), WriteError> {
    check_table(path, points)?;
    if Format::from_path(path) == Some(Format::Las) {
        return las::write_beside(path, points.columns, original, rows);
    }
    let (_, writer) = writer_of(path, &TABLE_WRITERS, TABLE_FORMATS, points.dimension)?;
    write_whole(path, |file| writer(file, points))
}

/// What a file is to hold.
#[derive(Debug, Clone, Copy)]
pub enum Content<'a> {
    /// What [`write_polylines`] writes.
    Paths,
    /// What [`write_points`] writes.
    Points,
    /// What [`write_table`] writes, with so many columns.
    Table {
        /// The file that the points come from.
        original: Option<&'a Path>,
        /// Number of columns.
        columns: usize,
    },
}

/// Says before there is anything to write whether it could be written, as far as that can be known
/// then: the format, the folder, points of `dimension` where it is known, and for las and laz the
/// file that records are copied from.
///
/// # Errors
/// As of the function that writes.
pub fn check_output(
    path: &Path,
    content: Content<'_>,
    dimension: Option<usize>,
) -> Result<(), WriteError> {
    let any = dimension.unwrap_or(3);
    match content {
        Content::Paths => writer_of(path, &PATH_WRITERS, PATH_FORMATS, any).map(|_| ())?,
        Content::Points => writer_of(path, &POINT_WRITERS, POINT_FORMATS, any).map(|_| ())?,
        Content::Table { original, columns } => {
            if Format::from_path(path) == Some(Format::Las) {
                las::check(path, original, columns)?;
            } else {
                writer_of(path, &TABLE_WRITERS, TABLE_FORMATS, any)?;
            }
        }
    }
    check_place(path)
}

fn check_table(path: &Path, points: &PointTable<'_>) -> Result<(), WriteError> {
    let length = points.coordinates.len();
    let fits = points.dimension > 0 && length.is_multiple_of(points.dimension);
    let found = if !fits
        || points
            .normals
            .is_some_and(|normals| normals.len() != length)
    {
        format!(
            "{length} coordinates and {:?} of normals",
            points.normals.map(<[f64]>::len)
        )
    } else {
        let rows = points.rows_count();
        let wrong = points.columns.iter().find(|c| c.values.len() != rows);
        match (wrong, points.colours) {
            (Some(column), _) => format!("{} values of {}", column.values.len(), column.name),
            (None, Some(colours)) if colours.len() != rows => format!("{} colours", colours.len()),
            _ => return Ok(()),
        }
    };
    Err(WriteError::Shape {
        file: path.to_path_buf(),
        path: 0,
        found,
        expected: format!(
            "a multiple of the dimension {}, the same for all",
            points.dimension
        ),
    })
}

fn check_shape(
    file: &Path,
    index: usize,
    dimension: usize,
    path: &Polyline<'_>,
) -> Result<(), WriteError> {
    let length = path.arc_length.len().checked_mul(dimension);
    let fits = path.dimension == dimension
        && dimension > 0
        && length == Some(path.points.len())
        && path
            .normals
            .is_none_or(|normals| normals.len() == path.points.len());
    if fits {
        return Ok(());
    }
    Err(WriteError::Shape {
        file: file.to_path_buf(),
        path: index,
        found: format!(
            "dimension {}, {} coordinates, {:?} of normals, {} arc lengths",
            path.dimension,
            path.points.len(),
            path.normals.map(<[f64]>::len),
            path.arc_length.len()
        ),
        expected: format!(
            "dimension {dimension} as in path 0, and as many coordinates as arc lengths times {dimension}"
        ),
    })
}

/// Writes numbers with a separator between them, in the shortest form that reads back to the same
/// bits.
fn write_row(
    out: &mut dyn Write,
    separator: char,
    values: impl IntoIterator<Item = f64>,
) -> io::Result<()> {
    for (index, value) in values.into_iter().enumerate() {
        if index > 0 {
            write!(out, "{separator}")?;
        }
        write!(out, "{value:?}")?;
    }
    Ok(())
}

/// The names of the columns of a point, and of its normal behind it: x, y, z in space, x1 .. xd
/// otherwise.
fn column_names(dimension: usize, normals: bool) -> Vec<String> {
    let names = |three: [&str; 3], letter: &str| match dimension {
        3 => three.map(str::to_owned).to_vec(),
        _ => (1..=dimension)
            .map(|axis| format!("{letter}{axis}"))
            .collect(),
    };
    let mut columns = names(["x", "y", "z"], "x");
    if normals {
        columns.extend(names(["nx", "ny", "nz"], "n"));
    }
    columns
}
