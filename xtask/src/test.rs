//! The whole test command: steps in order, stopping at the first that fails.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use crate::picture;
use crate::python::{self, Environment};
use crate::temporary::Temporary;

/// A command that must succeed.
struct Step {
    name: &'static str,
    program: PathBuf,
    arguments: Vec<OsString>,
    environment: Vec<(&'static str, OsString)>,
    /// A picture that the command must leave behind.
    picture: Option<PathBuf>,
}

/// Why a step failed, and the exit code to end with.
struct Failure {
    code: u8,
    reason: String,
}

/// Runs all steps and says how they went.
pub fn run() -> ExitCode {
    let folder = Temporary::new("test");
    let steps = match &folder {
        Ok(folder) => steps(&folder.path.join("demo.png")),
        Err(error) => {
            println!("FAILED: no temporary folder: {error}");
            return ExitCode::FAILURE;
        }
    };
    let count = steps.len();
    let start = Instant::now();
    for (number, step) in (1..).zip(&steps) {
        println!("[{number}/{count}] {}: {}", step.name, step.command_line());
        let begun = Instant::now();
        if let Err(failure) = step.run() {
            println!(
                "FAILED at step {number} of {count}, {}: {} (after {})",
                step.name,
                failure.reason,
                in_words(start.elapsed())
            );
            return ExitCode::from(failure.code);
        }
        println!("[{number}/{count}] passed in {}", in_words(begun.elapsed()));
    }
    println!("PASSED: all {count} steps in {}", in_words(start.elapsed()));
    ExitCode::SUCCESS
}

fn steps(picture: &Path) -> Vec<Step> {
    let mut demo = step("demo", "demo --picture");
    // Built by the tests beside this program; `cargo run` would build it again with other features.
    demo.program = this_program();
    demo.program
        .set_file_name(format!("taut{}", std::env::consts::EXE_SUFFIX));
    demo.arguments.push(picture.into());
    demo.picture = Some(picture.to_owned());
    let mut arrows = step("arrows", "arrows");
    arrows.program = this_program();
    let mut documentation = step("documentation", "doc --workspace --no-deps --lib");
    documentation.environment = vec![("RUSTDOCFLAGS", "-D warnings".into())];
    let mut steps = vec![
        step("rustfmt is there", "fmt --version"),
        step("clippy is there", "clippy --version"),
        arrows,
        step("formatting", "fmt --all --check"),
        step(
            "lints",
            "clippy --workspace --all-targets --all-features -- -D warnings",
        ),
        step("tests", "test --workspace --all-targets"),
        step("doc tests", "test --workspace --doc"),
        documentation,
        demo,
    ];
    match Environment::make() {
        Ok(environment) => steps.extend(python_steps(&environment)),
        Err(reason) => println!("The Python package is not tested, because {reason}."),
    }
    steps
}

/// The package built into its environment, its tests with those in the documentation, and its
/// types.
fn python_steps(environment: &Environment) -> [Step; 3] {
    let in_environment = |name, program, arguments| {
        let mut step = step(name, arguments);
        step.program = environment.program(program);
        step.environment = vec![
            ("VIRTUAL_ENV", environment.folder().into()),
            ("CARGO_TARGET_DIR", python::target().into()),
        ];
        step
    };
    [
        in_environment("Python package", "maturin", "develop --release --quiet"),
        in_environment("Python tests", "python", "-m pytest --quiet"),
        in_environment("Python types", "python", "-m mypy python/taut"),
    ]
}

fn this_program() -> PathBuf {
    std::env::current_exe().unwrap_or_default()
}

fn step(name: &'static str, arguments: &str) -> Step {
    Step {
        name,
        program: std::env::var_os("CARGO").unwrap_or("cargo".into()).into(),
        arguments: arguments.split(' ').map(OsString::from).collect(),
        environment: Vec::new(),
        picture: None,
    }
}

impl Step {
    fn command_line(&self) -> String {
        let set = |(name, value): &(_, OsString)| format!("{name}='{}' ", value.to_string_lossy());
        let environment: String = self.environment.iter().map(set).collect();
        let arguments: Vec<_> = self.arguments.iter().map(|a| a.to_string_lossy()).collect();
        format!(
            "{}{} {}",
            environment,
            self.program
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy(),
            arguments.join(" ")
        )
    }

    fn run(&self) -> Result<(), Failure> {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments);
        command.envs(self.environment.iter().map(|(name, value)| (name, value)));
        let status = command.status().map_err(|error| Failure {
            code: 1,
            reason: format!("{} cannot be started: {error}", self.program.display()),
        })?;
        if !status.success() {
            let code = status.code().and_then(|code| u8::try_from(code).ok());
            return Err(Failure {
                code: code.unwrap_or(1),
                reason: format!("{status}{}", self.remedy()),
            });
        }
        match &self.picture {
            Some(file) => picture::check(file).map_err(|reason| Failure { code: 1, reason }),
            None => Ok(()),
        }
    }

    /// What to do where a part of the toolchain is missing.
    fn remedy(&self) -> &'static str {
        if self.arguments.ends_with(&["--version".into()]) {
            "; get it by `rustup component add rustfmt clippy`"
        } else {
            ""
        }
    }
}

/// Whole minutes and seconds.
pub fn in_words(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds / 60 {
        0 => format!("{seconds} s"),
        minutes => format!("{minutes} min {} s", seconds % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failing_command_gives_its_exit_code() {
        let failure = step("unknown", "no-such-command").run().err();
        assert_eq!(failure.map(|failure| failure.code), Some(101));
    }

    #[test]
    fn a_missing_picture_fails() {
        let mut version = step("version", "--version");
        assert!(version.run().is_ok());
        version.picture = Some(PathBuf::from("no-such-picture.png"));
        assert_eq!(version.run().err().map(|failure| failure.code), Some(1));
    }
}
