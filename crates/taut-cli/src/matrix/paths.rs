//! The paths of a table: two files a block.

use std::collections::HashSet;
use std::fmt::Write;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use taut_io::{Polyline, write_polylines, write_whole};

use crate::exit::Failure;
use crate::matrix::files::{failed, refused};
use crate::matrix::fill::Entry;
use crate::matrix::plan::Block;

/// A folder that paths are written to.
pub struct PathFiles {
    folder: PathBuf,
    format: String,
}

impl PathFiles {
    /// Opens the folder of a run of which some blocks are done, and takes away all files but theirs.
    pub fn open(folder: &Path, format: &str, done: &[&Block]) -> Result<Self, Failure> {
        if done.is_empty() {
            fs::create_dir_all(folder).map_err(|error| failed(folder, error))?;
        } else if !folder.is_dir() {
            return Err(refused(
                folder,
                "it is missing, though the journal says that blocks are done",
            ));
        }
        let files = Self::of(folder, format);
        let kept: HashSet<PathBuf> = done.iter().flat_map(|block| files.names(block)).collect();
        let entries = fs::read_dir(folder).map_err(|error| failed(folder, error))?;
        for entry in entries {
            let path = entry.map_err(|error| failed(folder, error))?.path();
            if !kept.contains(&path) {
                fs::remove_file(&path).map_err(|error| failed(&path, error))?;
            }
        }
        Ok(files)
    }

    /// A folder as it is.
    pub fn of(folder: &Path, format: &str) -> Self {
        Self {
            folder: folder.to_path_buf(),
            format: format.to_owned(),
        }
    }

    /// The files of a block: its paths, and their pairs.
    fn names(&self, block: &Block) -> [PathBuf; 2] {
        let (row, column) = (block.rows.start, block.columns.start);
        [&*self.format, "pairs.txt"].map(|ending| {
            self.folder
                .join(format!("block-{row:06}-{column:06}.{ending}"))
        })
    }

    /// The check sum of a block's files, 0 where there are none.
    pub fn sum(&self, block: &Block) -> io::Result<u32> {
        let mut sum = crc32fast::Hasher::new();
        for name in self.names(block) {
            match fs::read(&name) {
                Ok(bytes) => sum.update(&bytes),
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
        }
        Ok(sum.finalize())
    }

    /// Writes the paths of a block, and which pair each belongs to; their check sum.
    pub fn write(
        &mut self,
        block: &Block,
        dimension: usize,
        entries: &[Entry],
    ) -> Result<u32, Failure> {
        let found: Vec<&Entry> = entries
            .iter()
            .filter(|entry| entry.path.nodes() > 0)
            .collect();
        if found.is_empty() {
            return Ok(0);
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
        let [paths, pairs] = self.names(block);
        write_polylines(&paths, &polylines)?;
        let mut text = String::from("# row column\n");
        for Entry { pair: [i, j], .. } in found {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{i} {j}");
        }
        write_whole(&pairs, |out| out.write_all(text.as_bytes()))?;
        self.sum(block).map_err(|error| failed(&paths, error))
    }
}
