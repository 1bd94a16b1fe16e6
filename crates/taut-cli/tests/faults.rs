//! What may go wrong around the command: it is killed, told to stop, the disk is full, pipes are
//! closed, bytes flip, two write the same. Nothing partial stands under a result's name, and
//! nothing is left beside it.
#![cfg(unix)]

mod support;

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use support::case::{BINARY, Case, Kept};
use support::{code, text};

/// A command of each verb that writes, and the files that it writes.
const WRITERS: [(&str, &[&str]); 6] = [
    (
        "path @sphere.xyz --pairs @pairs.txt -o @out.csv",
        &["out.csv"],
    ),
    (
        "field @sphere.xyz --source 0 -o @out.npy --isolines @lines.csv --picture @out.png",
        &["lines.csv", "out.npy", "out.png"],
    ),
    ("log @sphere.xyz --source 0 -o @out.ply", &["out.ply"]),
    (
        "exp @sphere.xyz --source 0 --direction 1,2,3 -o @out.csv",
        &["out.csv"],
    ),
    (
        "sample @sphere.xyz -n 60 --farthest -o @out.xyz",
        &["out.xyz"],
    ),
    ("fit @sphere.xyz -o @out.taut", &["out.taut"]),
];

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

#[test]
fn killed_or_stopped_at_any_moment_they_leave_nothing_behind() {
    let case = Case::new();
    let mut random = Pcg64::seed_from_u64(17);
    for (line, names) in WRITERS {
        let start = Instant::now();
        let whole = case.run(line);
        let duration = start.elapsed();
        assert_eq!(code(&whole), 0, "{line}: {}", text(&whole.stderr));
        let expected: Vec<Vec<u8>> = names
            .iter()
            .map(|name| fs::read(case.file(name)).expect("written"))
            .collect();
        assert_eq!(case.others(), names);
        for how in ["-KILL", "-TERM", "-INT", "-KILL"] {
            case.clear();
            let mut child = case.start(line);
            std::thread::sleep(duration.mul_f64(0.2 + random.random::<f64>()));
            if child.try_wait().expect("a child").is_none() {
                signal(&child, how);
            }
            child.wait().expect("ended");
            for name in case.others() {
                let which = names.iter().position(|known| **known == name);
                let which = which.unwrap_or_else(|| panic!("{line}: {name} was left by {how}"));
                let found = fs::read(case.file(&name)).expect("read");
                assert!(
                    found == expected[which],
                    "{line}: {name} is partial after {how}"
                );
            }
        }
        case.clear();
    }
}

#[test]
fn a_matrix_that_is_stopped_keeps_what_is_done_or_nothing() {
    let case = Case::new();
    // One thread and a small tolerance make the run last long enough to be stopped in between.
    let line = "matrix @sphere.xyz --sources @rows.txt -o @D.npy --errors @E.npy --paths @paths --threads 1 --tol 1e-11";
    // Before any block is done there is nothing to keep.
    let child = case.start(line);
    wait_for(|| case.file("D.npy.journal").exists());
    signal(&child, "-TERM");
    let ended = child.wait_with_output().expect("ended");
    assert_eq!(ended.status.signal(), Some(15));
    assert_eq!(case.others(), [""; 0]);
    // Later the next run goes on. Before a second block is done the first is sure to be kept.
    let child = case.start(line);
    wait_for(|| blocks(&case.file("D.npy.journal")) > 1);
    signal(&child, "-INT");
    child.wait_with_output().expect("ended");
    assert_eq!(
        case.others(),
        ["D.npy.journal", "D.npy.part", "E.npy.part", "paths.part"]
    );
    let again = case.run(line);
    assert_eq!(code(&again), 0, "{}", text(&again.stderr));
    assert!(text(&again.stderr).contains("blocks were done before"));
    assert_eq!(case.others(), ["D.npy", "E.npy", "paths"]);
}

/// Blocks that a journal says are done.
fn blocks(journal: &Path) -> usize {
    fs::read_to_string(journal).map_or(0, |text| text.matches("\"block\"").count())
}

fn wait_for(mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < Duration::from_secs(60), "it never came");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Runs the command where files have at most so many blocks of 512 bytes or a KiB.
fn within(case: &Case, most: u32, line: &str) -> Output {
    let script = format!("ulimit -f {most}; exec \"$0\" \"$@\"");
    Command::new("sh")
        .args(["-c", &script, BINARY])
        .args(case.arguments(line))
        .output()
        .expect("sh runs")
}

#[test]
fn a_full_disk_is_told_and_leaves_nothing() {
    let case = Case::new();
    let matrix = "matrix @sphere.xyz --sources @rows.txt -o @D.npy";
    let sparse = "matrix @sphere.xyz --sources @rows.txt --radius 1 -o @D.npz";
    // Results of a few KB: the first is refused at once, or where the whole is larger than that.
    for (line, most) in WRITERS.iter().map(|(line, _)| (*line, 0)).chain([
        (WRITERS[1].0, 4),
        (WRITERS[5].0, 4),
        (matrix, 0),
        (matrix, 4),
        (sparse, 2),
    ]) {
        let failed = within(&case, most, line);
        assert_eq!(code(&failed), 1, "{line}: {}", text(&failed.stderr));
        let told = text(&failed.stderr);
        assert!(
            told.contains("cannot be written")
                && told.contains(case.0.path().to_str().expect("UTF-8")),
            "{told}"
        );
        for name in case.others() {
            // Of several results those before the one that failed are whole; a matrix goes on with
            // what is done.
            let is_part = line.starts_with("matrix")
                && blocks(&case.file(&format!("{}.journal", &name[..5]))) > 0;
            assert!(is_part || name == "out.npy", "{line}: {name} was left");
        }
        case.clear();
    }
    let line = format!("{sparse} --json");
    assert_eq!(code(&within(&case, 2, &line)), 1);
    assert_eq!(code(&case.run(&line)), 0);
    assert_eq!(case.others(), ["D.npz"]);
    // Standard output may be full as well.
    if let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") {
        let failed = Command::new(BINARY)
            .args(case.arguments("field @sphere.xyz --source 0"))
            .stdout(full)
            .output()
            .expect("it runs");
        assert_eq!(code(&failed), 1);
        assert!(
            text(&failed.stderr).contains("standard output"),
            "{}",
            text(&failed.stderr)
        );
    }
}

#[test]
fn a_closed_pipe_ends_it_in_silence() {
    let case = Case::new();
    for line in [
        "field @sphere.xyz --source 0",
        "path @sphere.xyz --pairs @pairs.txt --json --points",
        "completions bash",
        "--help",
    ] {
        let mut child = Command::new(BINARY)
            .args(case.arguments(line))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        let mut first = String::new();
        let out = child.stdout.take().expect("a pipe");
        BufReader::with_capacity(16, out)
            .read_line(&mut first)
            .expect("a line");
        let ended = child.wait_with_output().expect("ended");
        assert_eq!((code(&ended), text(&ended.stderr)), (0, ""), "{line}");
    }
}

#[test]
fn bytes_that_flip_in_journals_and_parts_are_found() {
    let case = Case::new();
    let mut random = Pcg64::seed_from_u64(23);
    for (line, names) in [
        (
            "matrix @sphere.xyz --sources @rows.txt -o @D.npy --errors @E.npy --paths @paths --threads 1",
            ["D.npy", "E.npy"],
        ),
        (
            "matrix @sphere.xyz --sources @rows.txt -o @D.npz --errors @E.npz --radius 1 --threads 1",
            ["D.npz", "E.npz"],
        ),
    ] {
        let whole = case.run(line);
        assert_eq!(code(&whole), 0, "{}", text(&whole.stderr));
        let expected = names.map(|name| fs::read(case.file(name)).expect("written"));
        case.clear();
        // A run that is cut off after some blocks, whose files are then kept aside.
        let mut child = case.start(line);
        let journal = case.file(&format!("{}.journal", names[0]));
        wait_for(|| blocks(&journal) > 1);
        child.kill().expect("killed");
        child.wait().expect("ended");
        let kept = Kept::of(&case);
        assert!(blocks(&journal) > 1);
        let mut outcomes = [0; 2];
        for _ in 0..5 {
            let (name, place) = kept.any_byte(&mut random);
            kept.put_back(&case);
            let file = case.0.path().join(&name);
            let mut bytes = fs::read(&file).expect("read");
            bytes[place] ^= 1 << random.random_range(0..8);
            fs::write(&file, bytes).expect("written");
            let again = case.run(line);
            let told = format!(
                "byte {place} of {}: {}",
                name.display(),
                text(&again.stderr)
            );
            match code(&again) {
                0 => {
                    for (name, expected) in names.iter().zip(&expected) {
                        assert!(
                            fs::read(case.file(name)).expect("written") == *expected,
                            "{told}"
                        );
                    }
                    outcomes[0] += 1;
                }
                2 => {
                    assert!(told.contains("--restart"), "{told}");
                    outcomes[1] += 1;
                }
                other => panic!("exit {other}: {told}"),
            }
        }
        assert!(outcomes[0] > 0, "{outcomes:?}");
        // The block that the journal speaks of is another: the line does not count.
        kept.put_back(&case);
        let changed =
            fs::read_to_string(&journal)
                .expect("read")
                .replacen("\"block\":1,", "\"block\":9,", 1);
        fs::write(&journal, changed).expect("written");
        let again = case.run(line);
        assert_eq!(code(&again), 0, "{}", text(&again.stderr));
        assert!(
            text(&again.stderr).contains("damaged"),
            "{}",
            text(&again.stderr)
        );
        for (name, expected) in names.iter().zip(&expected) {
            assert!(fs::read(case.file(name)).expect("written") == *expected);
        }
        case.clear();
    }
}

#[test]
fn of_three_runs_at_once_one_writes_and_the_others_say_so() {
    let case = Case::new();
    let line = "matrix @sphere.xyz --sources @rows.txt -o @D.npy";
    let children: Vec<Child> = (0..3).map(|_| case.start(line)).collect();
    let ended: Vec<Output> = children
        .into_iter()
        .map(|child| child.wait_with_output().expect("ended"))
        .collect();
    let done = ended.iter().filter(|output| code(output) == 0).count();
    assert!(done >= 1);
    for output in ended.iter().filter(|output| code(output) != 0) {
        assert_eq!(code(output), 2, "{}", text(&output.stderr));
        assert!(
            text(&output.stderr).contains("another run is writing"),
            "{}",
            text(&output.stderr)
        );
    }
    assert_eq!(case.others(), ["D.npy"]);
}
