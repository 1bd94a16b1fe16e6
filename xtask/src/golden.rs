//! Checksums of what the command answers: whether a change left every answer as it was.

mod inputs;
mod list;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use crate::temporary::Temporary;
use crate::test::in_words;
use list::{Job, List, Sum};

/// Runs all jobs and compares their outputs with what is stored, or stores them if told to.
pub fn run(write: bool) -> ExitCode {
    all(write).unwrap_or_else(|reason| {
        println!("FAILED: {reason}");
        ExitCode::FAILURE
    })
}

fn all(write: bool) -> Result<ExitCode, String> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden.txt");
    let mut list = List::read(&file)?;
    let bench = Bench::new()?;
    let start = Instant::now();
    let mut known = bench.files()?;
    let (mut count, mut sums, mut changed) = (0, 0, 0);
    for job in list.jobs() {
        let found = bench.sums(job, &mut known)?;
        let differences = job.differences(&found);
        if !differences.is_empty() {
            println!("{}: {}", job.name, job.command_line());
            for difference in &differences {
                println!("    {difference}");
            }
            changed += 1;
        }
        count += 1;
        sums += found.len();
        job.sums = found;
    }
    let time = in_words(start.elapsed());
    if write {
        list.write(&file)?;
        println!(
            "stored {sums} sums of {count} jobs, {changed} of which are new or differ, in {time}; say with the change which and why"
        );
        return Ok(ExitCode::SUCCESS);
    }
    if changed == 0 {
        println!("PASSED: all {sums} sums of {count} jobs agree, in {time}");
        return Ok(ExitCode::SUCCESS);
    }
    println!(
        "FAILED: {changed} of {count} jobs differ from xtask/golden.txt, in {time}; jobs read what earlier ones wrote, so begin with the first. \
         The outputs are in {}. Where answers were meant to change, store the new sums by `cargo xtask golden --write`",
        bench.folder.keep().display()
    );
    Ok(ExitCode::FAILURE)
}

/// Where jobs are run.
struct Bench {
    program: PathBuf,
    folder: Temporary,
}

impl Bench {
    /// Builds the command and makes a folder with the inputs that it cannot make.
    fn new() -> Result<Self, String> {
        let program = build()?;
        let folder = Temporary::new("golden").map_err(|error| {
            format!("no temporary folder: {error}; name another by TMPDIR, or remove the old one")
        })?;
        inputs::write(&folder.path)?;
        Ok(Self { program, folder })
    }

    /// Runs a job. Its outputs are the exit code, what it says, and every file that is new or has
    /// changed.
    fn sums(&self, job: &Job, known: &mut BTreeMap<String, String>) -> Result<Vec<Sum>, String> {
        let output = Command::new(&self.program)
            .args(job.arguments.split_whitespace())
            .current_dir(&self.folder.path)
            .stdin(Stdio::null())
            .output()
            .map_err(|error| format!("{} cannot be started: {error}", self.program.display()))?;
        let code = output.status.code();
        let code = code.map_or_else(|| "killed".to_owned(), |code| code.to_string());
        let mut sums = vec![Sum::new("exit", &code)];
        let streams = [("stdout", output.stdout), ("stderr", output.stderr)];
        for (name, bytes) in streams.iter().filter(|(_, bytes)| !bytes.is_empty()) {
            sums.push(Sum::new(name, &checksum(bytes)));
        }
        let files = self.files()?;
        let written = files
            .iter()
            .filter(|(name, sum)| known.get(*name) != Some(sum));
        sums.extend(written.map(|(name, sum)| Sum::new(name, sum)));
        *known = files;
        Ok(sums)
    }

    /// The sums of all files in the folder and below it, by their names.
    fn files(&self) -> Result<BTreeMap<String, String>, String> {
        let mut sums = BTreeMap::new();
        let mut folders = vec![self.folder.path.clone()];
        while let Some(folder) = folders.pop() {
            let told = |error: std::io::Error| format!("{}: {error}", folder.display());
            for entry in std::fs::read_dir(&folder).map_err(told)? {
                let path = entry.map_err(told)?.path();
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let name = path.strip_prefix(&self.folder.path).unwrap_or(&path);
                let bytes = std::fs::read(&path).map_err(told)?;
                sums.insert(name.display().to_string(), checksum(&bytes));
            }
        }
        Ok(sums)
    }
}

/// CRC-32 in hexadecimal digits: it is meant to tell versions apart, not to withstand forgery.
fn checksum(bytes: &[u8]) -> String {
    format!("{:08x}", crc32fast::hash(bytes))
}

/// Builds the command as users have it, optimised, and says where it is.
fn build() -> Result<PathBuf, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let status = Command::new(cargo)
        .args(["build", "--release", "--package", "taut-cli"])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .status();
    match status {
        Ok(status) if status.success() => (),
        Ok(status) => return Err(format!("the command cannot be built: {status}")),
        Err(error) => return Err(format!("cargo cannot be started: {error}")),
    }
    // This program lies in the folder of another profile, beside that of releases.
    let own =
        std::env::current_exe().map_err(|error| format!("no path of this program: {error}"))?;
    let target = own.ancestors().nth(2).unwrap_or(&own);
    let program = target.join(format!("release/taut{}", std::env::consts::EXE_SUFFIX));
    match program.is_file() {
        true => Ok(program),
        false => Err(format!(
            "found no {}, expected it to be built there; leave the target folder of cargo the same for all profiles",
            program.display()
        )),
    }
}
