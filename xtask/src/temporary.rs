//! A folder for what a chore leaves behind.

use std::path::PathBuf;

/// A folder of this process alone, removed at the end.
pub struct Temporary {
    pub path: PathBuf,
}

impl Temporary {
    /// In the system's temporary folder, its name says which chore it belongs to.
    pub fn new(chore: &str) -> std::io::Result<Self> {
        let path = std::env::temp_dir().join(format!("taut-{chore}-{}", std::process::id()));
        std::fs::create_dir(&path)?;
        Ok(Self { path })
    }

    /// Leaves the folder where it is.
    pub fn keep(mut self) -> PathBuf {
        std::mem::take(&mut self.path)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            // A folder left behind in the system's temporary folder is no failure of the chore.
            let _ = std::fs::remove_dir_all(&self.path);
        }
    }
}
