//! The files of a run: parts until it is complete, then the results.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use taut_io::WriteError;

use crate::exit::Failure;
use crate::matrix::settings::{PathsSettings, Settings};

/// A result and its unfinished part, files or folders.
pub struct Output {
    pub part: PathBuf,
    pub whole: PathBuf,
}

impl Output {
    /// Through links: what they lead to is replaced, not they.
    pub fn new(whole: &Path) -> Self {
        let whole = taut_io::target_of(whole).unwrap_or_else(|_| whole.to_path_buf());
        Self {
            part: beside(&whole, ".part"),
            whole,
        }
    }

    /// Puts the part, which is on the disk, in the place of the whole, unless that was done before.
    /// Access rights stay those of the whole.
    pub fn complete(&self) -> Result<(), Failure> {
        if let (Ok(before), Ok(_)) = (fs::metadata(&self.whole), fs::metadata(&self.part)) {
            fs::set_permissions(&self.part, before.permissions())
                .map_err(|error| failed(&self.part, error))?;
        }
        match fs::rename(&self.part, &self.whole) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return self.was_completed(),
            renamed => renamed.map_err(|error| failed(&self.whole, error))?,
        }
        let folder = self
            .whole
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        taut_io::sync_folder(folder.unwrap_or(Path::new(".")))
            .map_err(|error| failed(&self.whole, error))
    }

    /// The part, or else the whole that it became.
    pub fn present(&self) -> &Path {
        if self.part.exists() || !self.whole.exists() {
            &self.part
        } else {
            &self.whole
        }
    }

    /// Where there is no part any more there must be the whole.
    pub fn was_completed(&self) -> Result<(), Failure> {
        if self.whole.exists() {
            Ok(())
        } else {
            Err(refused(
                &self.part,
                "it is missing, though the journal says that it is complete",
            ))
        }
    }
}

/// The journal beside a result.
pub fn journal(settings: &Settings) -> PathBuf {
    beside(&Output::new(&settings.output).whole, ".journal")
}

/// A name with something behind it.
pub fn beside(file: &Path, ending: &str) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// All results of a run.
pub fn outputs(settings: &Settings) -> Vec<Output> {
    let folder = settings.paths.as_ref().map(|paths| &paths.folder);
    let all = [Some(&settings.output), settings.errors.as_ref(), folder];
    all.into_iter()
        .flatten()
        .map(|whole| Output::new(whole))
        .collect()
}

/// Refuses parts that no journal speaks of, and a folder with something in it.
pub fn check_fresh(settings: &Settings) -> Result<(), Failure> {
    for Output { part, .. } in outputs(settings) {
        if part.exists() {
            let reason = "found this unfinished part without its journal, expected both or neither";
            return Err(refused(&part, reason));
        }
    }
    let Some(PathsSettings { folder, .. }) = &settings.paths else {
        return Ok(());
    };
    let is_empty = fs::read_dir(folder).is_ok_and(|mut found| found.next().is_none());
    if is_empty || !folder.exists() {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "--paths: found {}, expected a folder that does not exist or is empty; name another",
        folder.display()
    )))
}

/// Takes away what an unfinished run left.
pub fn clear(settings: &Settings) -> Result<(), Failure> {
    let journal = journal(settings);
    let parts = outputs(settings).into_iter().map(|output| output.part);
    for path in parts.chain([journal]) {
        let removed = if path.is_dir() {
            fs::remove_dir_all(&path)
        } else {
            fs::remove_file(&path)
        };
        match removed {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(failed(&path, error));
            }
            _ => {}
        }
    }
    Ok(())
}

const REMEDY: &str = "give --restart to begin anew";

/// The refusal of what stands where a run would go on.
pub fn refused(path: &Path, reason: &str) -> Failure {
    Failure::Usage(format!("{}: {reason}; {REMEDY}", path.display()))
}

/// What the system said of a file.
pub fn failed(file: &Path, source: io::Error) -> Failure {
    Failure::Write(WriteError::Io {
        file: file.to_path_buf(),
        source,
    })
}
