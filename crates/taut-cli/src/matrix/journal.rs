//! Which blocks of a table are done: a line each, written once the block is on the disk.

use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::exit::Failure;
use crate::matrix::files::failed;
use crate::matrix::identity::Identity;
use crate::matrix::tally::Tally;

/// The first line.
#[derive(Serialize, Deserialize, PartialEq)]
struct First {
    format: String,
    version: u32,
    run: Identity,
}

/// A block that is done.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Done {
    /// The block's number.
    pub block: usize,
    /// Length of the file of entries with the block's, in bytes; 0 where there is no such file.
    pub end: u64,
    #[serde(flatten)]
    pub tally: Tally,
}

/// A journal, open and locked.
pub struct Journal {
    path: PathBuf,
    file: File,
    pub done: Vec<Done>,
}

const FORMAT: &str = "taut matrix journal";
const VERSION: u32 = 1;
const REMEDY: &str = "give --restart to begin anew";

impl Journal {
    /// Opens the journal of a run that was cut off, `None` where there is none.
    pub fn resume(path: &Path, run: &Identity) -> Result<Option<Self>, Failure> {
        let mut file = match File::options().read(true).write(true).open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(failed(path, error)),
        };
        lock(path, &file)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)
            .map_err(|error| failed(path, error))?;
        let refused = |reason: String| refused(path, &reason);
        // A line that was cut off by the end of the run does not count.
        let whole = bytes
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |last| last + 1);
        let expected = first_line(run)?;
        if whole == 0 && expected.as_bytes().starts_with(&bytes) {
            drop(file);
            std::fs::remove_file(path).map_err(|error| failed(path, error))?;
            return Ok(None);
        }
        let text = std::str::from_utf8(&bytes[..whole])
            .map_err(|_| refused("found bytes that are not text".to_owned()))?;
        let mut lines = text.lines();
        let first = lines.next().unwrap_or_default();
        let first: First = serde_json::from_str(first)
            .map_err(|error| refused(format!("line 1 is not that of a journal: {error}")))?;
        compare(&first, run).map_err(refused)?;
        let done = (2..)
            .zip(lines)
            .map(|(number, line)| {
                serde_json::from_str(line)
                    .map_err(|error| refused(format!("line {number}: {error}")))
            })
            .collect::<Result<Vec<Done>, _>>()?;
        let cut = file
            .set_len(whole as u64)
            .and_then(|()| file.seek(SeekFrom::End(0)));
        cut.map_err(|error| failed(path, error))?;
        Ok(Some(Self {
            path: path.to_path_buf(),
            file,
            done,
        }))
    }

    /// Begins a journal where there is none.
    pub fn create(path: &Path, run: &Identity) -> Result<Self, Failure> {
        let line = first_line(run)?;
        let created = File::create_new(path).map_err(|error| failed(path, error))?;
        lock(path, &created)?;
        let mut journal = Self {
            path: path.to_path_buf(),
            file: created,
            done: Vec::new(),
        };
        journal.append(&line)?;
        Ok(journal)
    }

    /// Notes that a block is done, which must be on the disk.
    pub fn add(&mut self, done: Done) -> Result<(), Failure> {
        let line = serde_json::to_string(&done).map_err(io::Error::from)?;
        self.append(&format!("{line}\n"))?;
        self.done.push(done);
        Ok(())
    }

    /// Takes the journal away: the run is complete.
    pub fn remove(self) -> Result<(), Failure> {
        std::fs::remove_file(&self.path).map_err(|error| failed(&self.path, error))
    }

    fn append(&mut self, line: &str) -> Result<(), Failure> {
        let written = self.file.write_all(line.as_bytes());
        let written = written.and_then(|()| self.file.sync_data());
        written.map_err(|error| failed(&self.path, error))
    }
}

fn first_line(run: &Identity) -> Result<String, Failure> {
    let first = First {
        format: FORMAT.to_owned(),
        version: VERSION,
        run: run.clone(),
    };
    let line = serde_json::to_string(&first).map_err(io::Error::from)?;
    Ok(format!("{line}\n"))
}

/// Says in what a journal's run differs from this one.
fn compare(first: &First, run: &Identity) -> Result<(), String> {
    if (first.format.as_str(), first.version) != (FORMAT, VERSION) {
        return Err(format!(
            "found {:?} of version {}, expected {FORMAT:?} of version {VERSION}",
            first.format, first.version
        ));
    }
    let names = first.run.keys().chain(run.keys());
    let value = |run: &Identity, name: &str| run.get(name).map_or("nothing", |v| v).to_owned();
    for name in names {
        let (found, expected) = (value(&first.run, name), value(run, name));
        if found != expected {
            return Err(format!(
                "it belongs to another run: found {name} {found}, expected {expected}"
            ));
        }
    }
    Ok(())
}

/// Keeps others from writing the same files.
fn lock(path: &Path, file: &File) -> Result<(), Failure> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(Failure::Usage(format!(
            "{}: another run is writing; wait for its end, or name another output",
            path.display()
        ))),
        // Where the file system knows no locks the run goes on without.
        Err(TryLockError::Error(_)) | Ok(()) => Ok(()),
    }
}

/// The refusal of what stands where a run would go on.
pub fn refused(path: &Path, reason: &str) -> Failure {
    Failure::Usage(format!("{}: {reason}; {REMEDY}", path.display()))
}
