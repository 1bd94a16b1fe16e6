//! What is to be taken away unless it is finished.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static PATHS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file or folder that is taken away when this is dropped, or by [`discard_unfinished`], unless
/// it is kept.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// Of a path at which there may be nothing yet.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        paths().push(path.clone());
        Self(path)
    }

    /// Leaves it where it is.
    pub fn keep(self) {
        forget(&self.0);
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if forget(&self.0) {
            remove(&self.0);
        }
    }
}

/// Takes away all that is unfinished: for a process that was told to end. Nothing can be begun or
/// kept afterwards: who tries waits for the end.
pub fn discard_unfinished() {
    let mut paths = paths();
    for path in paths.drain(..) {
        remove(&path);
    }
    std::mem::forget(paths);
}

fn paths() -> MutexGuard<'static, Vec<PathBuf>> {
    PATHS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether it was there.
fn forget(path: &Path) -> bool {
    let mut paths = paths();
    let found = paths.iter().position(|known| known == path);
    found.is_some_and(|index| {
        paths.swap_remove(index);
        true
    })
}

fn remove(path: &Path) {
    // What cannot be taken away must stay.
    let _ = match fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(_) => Ok(()),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_kept_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(&path).unwrap();
            fs::write(path.join("inside"), "text").unwrap();
            path
        };
        let (kept, dropped) = (path("kept"), path("dropped"));
        Unfinished::new(&kept).keep();
        drop(Unfinished::new(&dropped));
        assert!(kept.exists() && !dropped.exists());
    }
}
