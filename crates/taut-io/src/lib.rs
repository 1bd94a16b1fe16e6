//! Readers of point clouds and writers of paths.
//!
//! [`read`] takes a file of any known [`Format`] and answers a [`PointSet`]: coordinates in `f64`,
//! row-major, exactly as in the file. Faces, edges and colours are left out and said so in
//! [`PointSet::notes`]. [`read_pairs`] reads the pairs of ends of a batch, [`read_sources`] the
//! sources of a matrix. [`write_polylines`], [`write_points`] and [`write_table`] write by
//! extension, through a temporary file that takes the place of the old one only when it is
//! complete.
//!
//! Declared counts are compared with the file's length before memory is asked for, so that a
//! malformed file is answered with a typed [`ReadError`] at once.
//!
//! ```
//! let folder = tempfile::tempdir()?;
//! let file = folder.path().join("three.xyz");
//! std::fs::write(&file, "0 0 0\n1 0 0\n0 1 0\n")?;
//! let points = taut_io::read(&file, &taut_io::ReadOptions::default())?;
//! assert_eq!((points.rows(), points.dimension), (3, 3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod json_lines;
mod numbers;
mod pairs;
mod point_set;
mod read;
mod sources;
mod text;
mod write;

pub use error::{Place, ReadError, WriteError};
pub use json_lines::{read_json_lines, write_json_lines};
pub use numbers::{Numbers, read_numbers};
pub use pairs::{Pairs, read_pairs, read_pairs_from};
pub use point_set::PointSet;
pub use read::{Format, ReadOptions, read};
pub use sources::{Sources, read_sources};
pub use write::{
    Column, Content, MatrixFile, PointTable, Polyline, SparseRows, Unfinished, check_output,
    check_place, discard_unfinished, sync_folder, target_of, write_points, write_polylines,
    write_sparse, write_table, write_whole,
};
