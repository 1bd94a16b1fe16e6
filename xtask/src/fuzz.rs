//! Fuzzing: every target of `fuzz/` for some minutes, and what came of each.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// An input that takes this long on the clock is taken to run for ever. What inputs must keep to is
/// a limit of CPU time, which `taut_fuzz::run` checks.
const SECONDS: u32 = 300;
/// No input may take more memory.
const MEGABYTES: u32 = 1024;
/// Megabytes of freed memory that the address sanitizer keeps from being used again, to be left to
/// the input.
const QUARANTINE: &str = "quarantine_size_mb=64:detect_leaks=0";
const MEMORY: &str = "/dev/shm";
/// Bytes of the longest inputs.
const LONGEST: u32 = 1 << 14;

/// What was asked for.
pub struct Settings {
    pub minutes: f64,
    /// All where none is named.
    pub targets: Vec<String>,
}

impl Settings {
    /// Of `--minutes N` and names of targets in any order.
    pub fn parse(arguments: &[String]) -> Result<Self, String> {
        let mut minutes = None;
        let mut targets = Vec::new();
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--minutes" => {
                    let value = arguments.next().and_then(|value| value.parse::<f64>().ok());
                    let is_time = |value: &f64| value.is_finite() && *value > 0.0;
                    let value = value.filter(is_time);
                    minutes = Some(value.ok_or("--minutes: expected a number above 0 behind it")?);
                }
                name if name.starts_with('-') => {
                    return Err(format!("found {name}, expected --minutes N or a target"));
                }
                name => targets.push(name.to_owned()),
            }
        }
        Ok(Self {
            minutes: minutes.ok_or("expected --minutes N")?,
            targets,
        })
    }
}

/// What came of a target.
struct Outcome {
    target: String,
    executions: Option<u64>,
    /// Edges of the program's flow that inputs went along.
    coverage: Option<u64>,
    failure: Option<String>,
}

/// Builds the fuzzers, runs them and says what came of each.
pub fn run(settings: &Settings) -> ExitCode {
    match all(settings) {
        Ok(outcomes) => tell(&outcomes),
        Err(reason) => {
            println!("FAILED: {reason}");
            ExitCode::FAILURE
        }
    }
}

fn all(settings: &Settings) -> Result<Vec<Outcome>, String> {
    let toolchain = Toolchain::find();
    toolchain.install_fuzzers_tool()?;
    let known = targets()?;
    let targets = match settings.targets.as_slice() {
        [] => known.clone(),
        named => named.to_vec(),
    };
    if let Some(unknown) = targets.iter().find(|target| !known.contains(target)) {
        let known = known.join(", ");
        return Err(format!(
            "found the target {unknown}, expected one of {known}"
        ));
    }
    println!("building {} fuzzers", targets.len());
    succeed(toolchain.fuzz("build"), "the fuzzers cannot be built")?;
    let waiting = Mutex::new(VecDeque::from(targets));
    let outcomes = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(target) = locked(&waiting).pop_front() {
                    println!("{target}: {} minutes", settings.minutes);
                    let outcome = fuzz(&toolchain, target, settings.minutes);
                    locked(&outcomes).push(outcome);
                }
            });
        }
    });
    let mut outcomes = outcomes
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    outcomes.sort_by_key(|outcome| known.iter().position(|name| *name == outcome.target));
    Ok(outcomes)
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How cargo-fuzz is called.
struct Toolchain {
    /// Arguments of cargo that choose a toolchain.
    choice: Option<&'static str>,
}

impl Toolchain {
    /// The nightly one where there is one, else the stable one told to take unstable options, which
    /// sanitizers are.
    fn find() -> Self {
        let nightly = "+nightly";
        let mut version = Command::new("cargo");
        version.args([nightly, "--version"]);
        version.stdout(Stdio::null()).stderr(Stdio::null());
        let is_there = version.status().is_ok_and(|status| status.success());
        Self {
            choice: is_there.then_some(nightly),
        }
    }

    /// `cargo`, not the program of the toolchain that runs this one, which knows no `+nightly`.
    fn cargo(&self) -> Command {
        let mut command = Command::new("cargo");
        command.env_remove("CARGO").env_remove("RUSTUP_TOOLCHAIN");
        match self.choice {
            Some(choice) => command.arg(choice),
            None => command.env("RUSTC_BOOTSTRAP", "1"),
        };
        command
    }

    fn fuzz(&self, what: &str) -> Command {
        let mut command = self.cargo();
        command.current_dir(root());
        // The profile says which checks are built in.
        command.args(["fuzz", what, "--release", "--fuzz-dir", "fuzz"]);
        command
    }

    fn install_fuzzers_tool(&self) -> Result<(), String> {
        let mut version = self.cargo();
        version.args(["fuzz", "--version"]);
        version.stdout(Stdio::null()).stderr(Stdio::null());
        if version.status().is_ok_and(|status| status.success()) {
            return Ok(());
        }
        println!("installing cargo-fuzz");
        let mut install = self.cargo();
        install.args(["install", "--locked", "cargo-fuzz"]);
        succeed(install, "cargo-fuzz cannot be installed")
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Runs a command to its end.
fn succeed(mut command: Command, reason: &str) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{reason}: {status}")),
        Err(error) => Err(format!("{reason}: {error}")),
    }
}

/// Those that have a program.
fn targets() -> Result<Vec<String>, String> {
    let folder = root().join("fuzz/fuzz_targets");
    let entries = std::fs::read_dir(&folder);
    let entries = entries.map_err(|error| format!("{}: {error}", folder.display()))?;
    let files = entries.flatten().map(|entry| entry.path());
    let stem = |file: PathBuf| Some(file.file_stem()?.to_str()?.to_owned());
    let mut names: Vec<String> = files.filter_map(stem).collect();
    names.sort();
    Ok(names)
}

/// Runs a target. New inputs go to a folder that is not committed; stored ones are begun with.
fn fuzz(toolchain: &Toolchain, target: String, minutes: f64) -> Outcome {
    let work = root().join("fuzz/target/inputs").join(&target);
    let log = root().join("fuzz/target").join(format!("{target}.log"));
    let report = std::fs::create_dir_all(&work)
        .and_then(|()| std::fs::File::create(&log))
        .and_then(|file| {
            let mut command = toolchain.fuzz("run");
            command.arg(&target).arg(&work);
            for kind in ["corpus", "found"] {
                let stored = root().join("fuzz").join(kind).join(&target);
                command.args(stored.is_dir().then_some(stored));
            }
            let seconds = Duration::from_secs_f64(60.0 * minutes).as_secs().max(1);
            command.arg("--").args([
                format!("-max_total_time={seconds}"),
                format!("-timeout={SECONDS}"),
                format!("-report_slow_units={SECONDS}"),
                format!("-rss_limit_mb={MEGABYTES}"),
                format!("-malloc_limit_mb={MEGABYTES}"),
                format!("-max_len={LONGEST}"),
                "-print_final_stats=1".to_owned(),
            ]);
            command.env("ASAN_OPTIONS", QUARANTINE);
            // Readers are given files: in memory, where the system has such a folder.
            if Path::new(MEMORY).is_dir() {
                command.env("TMPDIR", MEMORY);
            }
            // Targets run beside each other.
            command.env("RAYON_NUM_THREADS", "1");
            command
                .stdin(Stdio::null())
                .stdout(file.try_clone()?)
                .stderr(file);
            let status = command.status()?;
            Ok((status, std::fs::read(&log)?))
        });
    let failed = |reason: String| Some(format!("{reason}; see {}", log.display()));
    match report {
        Ok((status, text)) => {
            let text = String::from_utf8_lossy(&text);
            Outcome {
                executions: executions(&text),
                coverage: coverage(&text),
                failure: (!status.success())
                    .then(|| failed(artifact(&text).unwrap_or_else(|| status.to_string())))
                    .flatten(),
                target,
            }
        }
        Err(error) => Outcome {
            target,
            executions: None,
            coverage: None,
            failure: failed(error.to_string()),
        },
    }
}

/// What libFuzzer says at the end.
fn executions(log: &str) -> Option<u64> {
    let mut lines = log.lines().rev();
    lines.find_map(|line| {
        line.strip_prefix("stat::number_of_executed_units:")?
            .trim()
            .parse()
            .ok()
    })
}

/// The last number behind `cov:`.
fn coverage(log: &str) -> Option<u64> {
    let number = |line: &str| line.split_once(" cov: ")?.1.split(' ').next()?.parse().ok();
    log.lines().rev().find_map(number)
}

/// The input at which libFuzzer stopped.
fn artifact(log: &str) -> Option<String> {
    let written = |line: &str| {
        Some(
            line.split_once("Test unit written to ")?
                .1
                .trim()
                .to_owned(),
        )
    };
    log.lines().rev().find_map(written)
}

fn tell(outcomes: &[Outcome]) -> ExitCode {
    let number = |value: Option<u64>| value.map_or("-".to_owned(), |value| value.to_string());
    println!("{:<10} {:>12} {:>10}", "target", "executions", "coverage");
    for outcome in outcomes {
        let Outcome {
            target,
            executions,
            coverage,
            failure,
        } = outcome;
        let failure = failure.as_deref().unwrap_or("");
        println!(
            "{target:<10} {:>12} {:>10} {failure}",
            number(*executions),
            number(*coverage)
        );
    }
    let failed = outcomes
        .iter()
        .filter(|outcome| outcome.failure.is_some())
        .count();
    if failed == 0 {
        println!("PASSED: all {} targets", outcomes.len());
        return ExitCode::SUCCESS;
    }
    println!(
        "FAILED: {failed} of {} targets; mend the cause and move the input to fuzz/found/TARGET",
        outcomes.len()
    );
    ExitCode::FAILURE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_come_in_any_order() {
        let parse = |text: &str| {
            let arguments: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            Settings::parse(&arguments).map(|s| (s.minutes, s.targets))
        };
        let las = || vec!["las".to_owned()];
        assert_eq!(parse("las --minutes 2.5"), Ok((2.5, las())));
        assert_eq!(parse("--minutes 3 las"), Ok((3.0, las())));
        for wrong in [
            "",
            "--minutes",
            "--minutes 0",
            "--minutes x",
            "--minutes 1 --las",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_libfuzzer_says_is_understood() {
        let log = "#2\tINITED cov: 10 ft: 11\n#9\tNEW    cov: 12 ft: 15 corp: 2/3b\nDone\n\
                   artifact_prefix='a/'; Test unit written to a/crash-0\nstat::number_of_executed_units: 77\n";
        assert_eq!((executions(log), coverage(log)), (Some(77), Some(12)));
        assert_eq!(artifact(log), Some("a/crash-0".to_owned()));
        assert_eq!(
            (executions(""), coverage(""), artifact("")),
            (None, None, None)
        );
    }
}
