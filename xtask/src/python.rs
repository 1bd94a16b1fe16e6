//! The Python package, tested in an environment of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What the environment must hold to build and test the package.
const PACKAGES: [&str; 4] = ["maturin", "numpy", "pytest", "mypy"];

/// An environment with all that the package's tests need.
pub struct Environment {
    folder: PathBuf,
}

impl Environment {
    /// Makes the environment, or says why it cannot be made: no Python with `venv`, or a pip that
    /// finds no packages.
    pub fn make() -> Result<Self, String> {
        let folder = target().join("environment");
        let environment = Self { folder };
        let python = environment.program("python");
        let has_packages = python.is_file()
            && succeeds(Command::new(&python).args([
                "-c",
                "import importlib.util as i; assert all(map(i.find_spec, ['maturin', 'numpy', 'pytest', 'mypy']))",
            ]));
        if has_packages {
            return Ok(environment);
        }
        let made = Command::new("python3")
            .args(["-m", "venv"])
            .arg(&environment.folder)
            .status();
        if !made.is_ok_and(|status| status.success()) {
            return Err("there is no python3 with its module venv".to_owned());
        }
        let mut install = Command::new(&python);
        install
            .args(["-m", "pip", "install", "--quiet"])
            .args(PACKAGES);
        if succeeds(&mut install) {
            Ok(environment)
        } else {
            Err(format!("pip does not find {}", PACKAGES.join(", ")))
        }
    }

    /// A program of the environment.
    pub fn program(&self, name: &str) -> PathBuf {
        let (folder, suffix) = if cfg!(windows) {
            ("Scripts", ".exe")
        } else {
            ("bin", "")
        };
        self.folder.join(folder).join(format!("{name}{suffix}"))
    }

    /// Where the environment lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

/// Where the package and its environment are built.
pub fn target() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/python")
}

fn succeeds(command: &mut Command) -> bool {
    let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}
