//! Whether the documents agree with the code: the thresholds that the pages on the method name,
//! the names in the glossary, and the links between documents.

mod links;
mod thresholds;
mod words;

use std::io;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest).to_owned()
}

/// Folders that hold no documents of ours.
const SKIPPED: [&str; 3] = ["target", "node_modules", "__pycache__"];

/// The files below a folder whose names end in one of `extensions`, in order.
fn files(folder: &Path, extensions: &[&str]) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_symlink() || name.starts_with('.') || SKIPPED.contains(&&*name) {
            continue;
        }
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            found.extend(files(&path, extensions)?);
        } else if extensions.contains(&&*extension) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The lines of a document outside of blocks of code, with their numbers from 1.
fn prose(document: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut in_code = false;
    (1..).zip(document.lines()).filter(move |(_, line)| {
        let is_fence = line.trim_start().starts_with("```");
        in_code ^= is_fence;
        !in_code && !is_fence
    })
}

/// Fails with all mistakes, if there are any.
fn none(mistakes: &[String]) {
    assert!(mistakes.is_empty(), "\n{}\n", mistakes.join("\n"));
}
