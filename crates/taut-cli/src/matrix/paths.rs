//! The paths of a table: two files a block.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use taut_io::{Polyline, write_polylines};

use crate::exit::Failure;
use crate::matrix::files::failed;
use crate::matrix::fill::Entry;
use crate::matrix::journal::refused;
use crate::matrix::plan::Block;

/// A folder that paths are written to.
pub struct PathFiles {
    folder: PathBuf,
    format: String,
}

impl PathFiles {
    /// Opens the folder of a run, which exists unless the run is fresh, and takes away what was cut off.
    pub fn open(folder: &Path, format: &str, fresh: bool) -> Result<Self, Failure> {
        if fresh {
            fs::create_dir_all(folder).map_err(|error| failed(folder, error))?;
        } else if !folder.is_dir() {
            return Err(refused(
                folder,
                "it is missing, though the journal says that blocks are done",
            ));
        }
        let entries = fs::read_dir(folder).map_err(|error| failed(folder, error))?;
        for entry in entries {
            let path = entry.map_err(|error| failed(folder, error))?.path();
            let name = path.file_name().unwrap_or_default();
            if !name.to_string_lossy().starts_with(PREFIX) {
                fs::remove_file(&path).map_err(|error| failed(&path, error))?;
            }
        }
        Ok(Self {
            folder: folder.to_path_buf(),
            format: format.to_owned(),
        })
    }

    /// Writes the paths of a block, and which pair each belongs to.
    pub fn write(
        &mut self,
        block: &Block,
        dimension: usize,
        entries: &[Entry],
    ) -> Result<(), Failure> {
        let found: Vec<&Entry> = entries
            .iter()
            .filter(|entry| entry.path.nodes() > 0)
            .collect();
        if found.is_empty() {
            return Ok(());
        }
        let polylines: Vec<Polyline<'_>> = found
            .iter()
            .map(|Entry { path, .. }| Polyline {
                dimension,
                points: &path.points,
                normals: Some(&path.normals),
                arc_length: &path.arc_length,
                level: None,
            })
            .collect();
        let (row, column) = (block.rows.start, block.columns.start);
        let name = |ending: &str| {
            self.folder
                .join(format!("{PREFIX}{row:06}-{column:06}.{ending}"))
        };
        write_polylines(&name(&self.format), &polylines)?;
        let mut text = String::from("# row column\n");
        for Entry { pair: [i, j], .. } in found {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{i} {j}");
        }
        let pairs = name("pairs.txt");
        fs::write(&pairs, text).map_err(|error| failed(&pairs, error))
    }
}

const PREFIX: &str = "block-";
