//! Which blocks of a table are done: a line each, written once the block is on the disk. Before
//! each line stands its check sum: what the disk has changed does not count.

use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use taut_io::Unfinished;

use crate::exit::Failure;
use crate::matrix::files::{failed, refused};
use crate::matrix::identity::Identity;
use crate::matrix::tally::Tally;

/// The first line.
#[derive(Serialize, Deserialize, PartialEq)]
struct First {
    format: String,
    version: u32,
    run: Identity,
}

/// A further line.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Line {
    Done(Done),
    /// A block whose values are not what they were: it is done again.
    Again {
        again: usize,
    },
    /// The process that writes from here on.
    Process {
        process: u32,
    },
}

/// A block that is done.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Done {
    /// The block's number.
    pub block: usize,
    /// Where in the file of entries the block's begin and end, in bytes; 0 where there is no such
    /// file.
    pub start: u64,
    pub end: u64,
    /// Check sums of what was written.
    #[serde(flatten)]
    pub sums: Sums,
    #[serde(flatten)]
    pub tally: Tally,
}

/// CRC-32 of a block in each result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sums {
    pub lengths_sum: u32,
    /// 0 where errors are not written to a file of their own.
    pub errors_sum: u32,
    /// 0 where the block has no files of paths.
    pub paths_sum: u32,
}

/// A journal, open and locked.
pub struct Journal {
    path: PathBuf,
    file: File,
    pub done: Vec<Done>,
    /// Lines that the disk has changed.
    pub damaged: usize,
    /// There was none before.
    pub is_fresh: bool,
}

const FORMAT: &str = "taut matrix journal";
const VERSION: u32 = 2;

impl Journal {
    /// Opens the journal of a run that was cut off, or begins one.
    pub fn open(path: &Path, run: &Identity) -> Result<Self, Failure> {
        let mut file = open_locked(path)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)
            .map_err(|error| failed(path, error))?;
        let mut journal = Self {
            path: path.to_path_buf(),
            file,
            done: Vec::new(),
            damaged: 0,
            is_fresh: false,
        };
        // A line that was cut off by the end of the run does not count.
        let whole = bytes
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |last| last + 1);
        let first = first_line(run)?;
        // Nothing is left of one that cannot be begun.
        let unfinished = (whole == 0).then(|| Unfinished::new(path));
        if whole == 0 && first.as_bytes().starts_with(&bytes) {
            journal.is_fresh = true;
            journal.cut(0)?;
            journal.append(&first)?;
        } else {
            journal.parse(&bytes[..whole], run)?;
            journal.cut(whole as u64)?;
        }
        let process = std::process::id();
        journal.append(&line(&Line::Process { process })?)?;
        if let Some(unfinished) = unfinished {
            unfinished.keep();
        }
        Ok(journal)
    }

    fn parse(&mut self, bytes: &[u8], run: &Identity) -> Result<(), Failure> {
        let mut lines = bytes.split(|byte| *byte == b'\n');
        let first = lines.next().unwrap_or_default();
        let refused = |reason: &str| refused(&self.path, reason);
        let text = checked(first).ok_or_else(|| {
            refused("line 1 is not that of a journal of this version, or it is damaged")
        })?;
        let first: First = serde_json::from_str(text)
            .map_err(|error| refused(&format!("line 1 is not that of a journal: {error}")))?;
        compare(&first, run).map_err(|reason| refused(&reason))?;
        for bytes in lines.filter(|line| !line.is_empty()) {
            match checked(bytes).and_then(|text| serde_json::from_str(text).ok()) {
                Some(Line::Done(done)) => self.done.push(done),
                Some(Line::Again { again }) => self.done.retain(|done| done.block != again),
                Some(Line::Process { .. }) => {}
                None => self.damaged += 1,
            }
        }
        Ok(())
    }

    /// Notes that a block is done, which must be on the disk.
    pub fn add(&mut self, done: Done) -> Result<(), Failure> {
        self.append(&line(&Line::Done(done))?)?;
        self.done.push(done);
        Ok(())
    }

    /// Notes that blocks must be done again.
    pub fn forget(&mut self, blocks: &[usize]) -> Result<(), Failure> {
        for again in blocks {
            self.append(&line(&Line::Again { again: *again })?)?;
        }
        self.done.retain(|done| !blocks.contains(&done.block));
        Ok(())
    }

    /// Takes the journal away: the run is complete.
    pub fn remove(self) -> Result<(), Failure> {
        std::fs::remove_file(&self.path).map_err(|error| failed(&self.path, error))
    }

    fn cut(&mut self, length: u64) -> Result<(), Failure> {
        let cut = self.file.set_len(length);
        cut.and_then(|()| self.file.seek(SeekFrom::End(0)))
            .map(|_| ())
            .map_err(|error| failed(&self.path, error))
    }

    fn append(&mut self, line: &str) -> Result<(), Failure> {
        let written = self.file.write_all(line.as_bytes());
        let written = written.and_then(|()| self.file.sync_data());
        written.map_err(|error| failed(&self.path, error))
    }
}

/// A line with its check sum.
fn line(value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string(value).map_err(io::Error::from)?;
    Ok(format!("{:08x} {text}\n", crc32fast::hash(text.as_bytes())))
}

/// A line without its check sum, if that is right.
fn checked(line: &[u8]) -> Option<&str> {
    let (sum, text) = std::str::from_utf8(line).ok()?.split_once(' ')?;
    let sum = u32::from_str_radix(sum, 16).ok()?;
    (sum == crc32fast::hash(text.as_bytes())).then_some(text)
}

fn first_line(run: &Identity) -> Result<String, Failure> {
    line(&First {
        format: FORMAT.to_owned(),
        version: VERSION,
        run: run.clone(),
    })
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

/// Opens a file, made if need be, and keeps others from writing the same results.
fn open_locked(path: &Path) -> Result<File, Failure> {
    loop {
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(|error| failed(path, error))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let process = process(path).map(|process| format!(" (process {process})"));
                return Err(Failure::Usage(format!(
                    "{}: another run is writing{}; wait for its end, or name another output",
                    path.display(),
                    process.unwrap_or_default()
                )));
            }
            // Where the file system knows no locks the run goes on without.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        // Whoever held the lock may have come to its end and taken the file away.
        if is_at(&file, path) {
            return Ok(file);
        }
    }
}

/// Whether an open file is still the one of its name.
fn is_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let (Ok(file), Ok(named)) = (file.metadata(), std::fs::metadata(path)) else {
            return false;
        };
        (file.dev(), file.ino()) == (named.dev(), named.ino())
    }
    #[cfg(not(unix))]
    {
        // Open files cannot be taken away there.
        let _ = file;
        path.exists()
    }
}

/// The process that writes a journal, as that says.
fn process(path: &Path) -> Option<u32> {
    let bytes = std::fs::read(path).ok()?;
    let lines = bytes.split(|byte| *byte == b'\n');
    let process = |line: &[u8]| match serde_json::from_str(checked(line)?).ok()? {
        Line::Process { process } => Some(process),
        _ => None,
    };
    lines.filter_map(process).next_back()
}
