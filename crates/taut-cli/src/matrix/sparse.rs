//! Tables within a radius: entries as they are found, then compressed rows.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use taut_io::{SparseRows, write_sparse};

use crate::exit::Failure;
use crate::matrix::files::{Output, failed, refused};
use crate::matrix::fill::Entry;
use crate::matrix::journal::Done;
use crate::matrix::plan::Plan;
use crate::matrix::tally;

/// Bytes of an entry: row, column, length, error.
const ENTRY: usize = 32;

/// A file of entries.
pub struct Triplets {
    path: PathBuf,
    file: File,
    end: u64,
}

impl Triplets {
    /// Opens a file, of which what is behind `end` does not count.
    pub fn open(path: &Path, end: u64) -> Result<Self, Failure> {
        let opened = File::options()
            .write(true)
            .create(end == 0)
            .truncate(false)
            .open(path);
        let mut file = opened.map_err(|error| failed(path, error))?;
        let length = file.metadata().map_err(|error| failed(path, error))?.len();
        if length < end {
            return Err(refused(
                path,
                &format!("found {length} bytes, expected {end} or more"),
            ));
        }
        let cut = file.set_len(end).and_then(|()| file.seek(SeekFrom::End(0)));
        cut.map_err(|error| failed(path, error))?;
        Ok(Self {
            path: path.to_path_buf(),
            file,
            end,
        })
    }

    /// Writes entries to the disk; where they begin and end, and their check sum.
    pub fn append(&mut self, entries: &[Entry]) -> Result<(u64, u64, u32), Failure> {
        let mut bytes = Vec::with_capacity(ENTRY * entries.len());
        for Entry { pair: [i, j], path } in entries {
            bytes.extend((*i as u64).to_le_bytes());
            bytes.extend((*j as u64).to_le_bytes());
            bytes.extend(tally::length(path).to_le_bytes());
            bytes.extend(tally::error(path).to_le_bytes());
        }
        let written = self.file.write_all(&bytes);
        let written = written.and_then(|()| self.file.sync_data());
        written.map_err(|error| failed(&self.path, error))?;
        let start = self.end;
        self.end += bytes.len() as u64;
        Ok((start, self.end, crc32fast::hash(&bytes)))
    }
}

/// Makes compressed rows of the entries and puts them in their places.
pub fn complete(
    plan: &Plan,
    output: &Output,
    errors: Option<&Output>,
    done: &[Done],
) -> Result<(), Failure> {
    let part = &output.part;
    let mut entries = match read(part, done) {
        Ok(entries) => entries,
        // It goes last of all.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return output.was_completed(),
        Err(error) => return Err(failed(part, error)),
    };
    if plan.is_symmetric() {
        let mirrored: Vec<_> = entries
            .iter()
            .map(|(i, j, values)| (*j, *i, *values))
            .collect();
        entries.extend(mirrored);
    }
    entries.sort_unstable_by_key(|(i, j, _)| (*i, *j));
    let columns: Vec<u64> = entries.iter().map(|entry| entry.1).collect();
    let starts: Vec<u64> = (0..=plan.rows as u64)
        .map(|row| entries.partition_point(|entry| entry.0 < row) as u64)
        .collect();
    for (output, which) in [(Some(output), 0), (errors, 1)] {
        let Some(Output { whole, .. }) = output else {
            continue;
        };
        let values: Vec<f64> = entries.iter().map(|entry| entry.2[which]).collect();
        let matrix = SparseRows {
            shape: plan.shape(),
            starts: &starts,
            columns: &columns,
            values: &values,
        };
        write_sparse(whole, &matrix)?;
    }
    fs::remove_file(part).map_err(|error| failed(part, error))
}

/// The entries of a block, which must be there.
pub fn of_block(file: &mut File, done: &Done) -> io::Result<Vec<u8>> {
    let size = done.end.saturating_sub(done.start);
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(done.start))?;
    file.take(size).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == size {
        return Ok(bytes);
    }
    Err(io::ErrorKind::UnexpectedEof.into())
}

type FoundEntry = (u64, u64, [f64; 2]);

fn read(part: &Path, done: &[Done]) -> io::Result<Vec<FoundEntry>> {
    let mut file = File::open(part)?;
    let mut bytes = Vec::new();
    for done in done {
        bytes.extend(of_block(&mut file, done)?);
    }
    let eight = |entry: &[u8], at: usize| {
        let mut eight = [0; 8];
        eight.copy_from_slice(&entry[8 * at..8 * at + 8]);
        eight
    };
    let entry = |entry: &[u8]| {
        let index = |at| u64::from_le_bytes(eight(entry, at));
        let value = |at| f64::from_le_bytes(eight(entry, at));
        (index(0), index(1), [value(2), value(3)])
    };
    Ok(bytes.chunks_exact(ENTRY).map(entry).collect())
}
