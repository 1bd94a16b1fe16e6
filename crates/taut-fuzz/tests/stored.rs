//! Stored inputs: well-formed ones, those that a fuzzer found to reach far, and those that once
//! failed.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use taut_fuzz::TARGETS;

/// The inputs stored for a target; a target without any in `found` never failed.
fn inputs(kind: &str, target: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz");
    let folder = root.join(kind).join(target);
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn what_must_hold_holds_for_stored_inputs() {
    let mut failures = Vec::new();
    for target in TARGETS {
        let files = ["corpus", "found"].map(|kind| inputs(kind, target.name));
        for file in files.iter().flatten() {
            let bytes = std::fs::read(file).unwrap();
            let done = catch_unwind(AssertUnwindSafe(|| taut_fuzz::run(target.name, &bytes)));
            if done.is_err() {
                failures.push(file.clone());
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn every_target_has_inputs_and_a_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz");
    let mut names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
    for name in &names {
        assert!(!inputs("corpus", name).is_empty(), "{name}");
        let program = std::fs::read_to_string(root.join(format!("fuzz_targets/{name}.rs")));
        assert!(
            program
                .unwrap()
                .contains(&format!("run(\"{name}\", bytes)"))
        );
    }
    names.sort_unstable();
    for kind in ["corpus", "found"] {
        for folder in std::fs::read_dir(root.join(kind)).into_iter().flatten() {
            let folder = folder.unwrap().file_name();
            let is_known = names.iter().any(|name| folder == *name);
            assert!(is_known, "fuzz/{kind}/{} is of no target", folder.display());
        }
    }
}
