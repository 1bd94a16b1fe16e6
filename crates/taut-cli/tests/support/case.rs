//! A folder with a sphere in it, for what the command does to files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use rand::RngExt;
use rand_pcg::Pcg64;

use super::{sphere, taut, write_points};

pub const BINARY: &str = env!("CARGO_BIN_EXE_taut");

/// A folder with a sphere and lists of rows of it.
pub struct Case(pub tempfile::TempDir);

impl Case {
    pub fn new() -> Self {
        let case = Self(tempfile::tempdir().expect("a folder"));
        write_points(&case.file("sphere.xyz"), &sphere(1000, [0.0; 3], 3));
        let rows: Vec<String> = (0..70).map(|i| (13 * i).to_string()).collect();
        fs::write(case.file("rows.txt"), rows.join("\n")).expect("written");
        let pairs: Vec<String> = (0..100).map(|i| format!("{i} {}", 990 - 3 * i)).collect();
        fs::write(case.file("pairs.txt"), pairs.join("\n")).expect("written");
        case
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Words, of which those that begin with @ are files of the folder.
    pub fn arguments(&self, line: &str) -> Vec<String> {
        let word = |word: &str| match word.strip_prefix('@') {
            Some(name) => self.file(name).to_str().expect("UTF-8").to_owned(),
            None => word.to_owned(),
        };
        line.split_whitespace().map(word).collect()
    }

    pub fn run(&self, line: &str) -> Output {
        let arguments = self.arguments(line);
        taut(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
    }

    pub fn start(&self, line: &str) -> Child {
        Command::new(BINARY)
            .args(self.arguments(line))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started")
    }

    /// Names in the folder besides those that were there from the beginning.
    pub fn others(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name().into_string());
        let mut names: Vec<String> = names.map(|name| name.expect("UTF-8")).collect();
        names.retain(|name| !["sphere.xyz", "rows.txt", "pairs.txt"].contains(&&**name));
        names.sort();
        names
    }

    pub fn clear(&self) {
        for name in self.others() {
            let path = self.file(&name);
            let removed = if path.is_dir() {
                fs::remove_dir_all(&path)
            } else {
                fs::remove_file(&path)
            };
            removed.expect("removed");
        }
    }
}

/// The files of a folder at some time.
pub struct Kept(pub Vec<(PathBuf, Vec<u8>)>);

impl Kept {
    pub fn of(case: &Case) -> Self {
        let mut files = Vec::new();
        let mut folders = vec![PathBuf::new()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(case.0.path().join(&folder)).expect("a folder") {
                let name = folder.join(entry.expect("an entry").file_name());
                let path = case.0.path().join(&name);
                if path.is_symlink() {
                    files.push((
                        name,
                        fs::read_link(&path)
                            .expect("read")
                            .into_os_string()
                            .into_encoded_bytes(),
                    ));
                } else if path.is_dir() {
                    folders.push(name);
                } else {
                    files.push((name, fs::read(&path).expect("read")));
                }
            }
        }
        files.retain(|(name, _)| {
            !["sphere.xyz", "rows.txt", "pairs.txt"]
                .iter()
                .any(|input| name == Path::new(input))
        });
        files.sort();
        Self(files)
    }

    /// A file that holds something, and a place in it.
    pub fn any_byte(&self, random: &mut Pcg64) -> (PathBuf, usize) {
        loop {
            let (name, bytes) = &self.0[random.random_range(0..self.0.len())];
            if !bytes.is_empty() {
                return (name.clone(), random.random_range(0..bytes.len()));
            }
        }
    }

    pub fn put_back(&self, case: &Case) {
        case.clear();
        for (name, bytes) in &self.0 {
            let path = case.0.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, bytes).expect("written");
        }
    }
}
