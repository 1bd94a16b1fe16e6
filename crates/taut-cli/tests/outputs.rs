//! Outputs are looked at before any work: none takes an input's place, or another's, or cannot be
//! written in the end.
#![cfg(unix)]

mod support;

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use support::case::{BINARY, Case, Kept};
use support::{code, sphere, text, write_points};

#[test]
fn outputs_that_are_inputs_or_each_other_are_refused() {
    let case = Case::new();
    symlink("sphere.xyz", case.file("link.xyz")).expect("linked");
    fs::hard_link(case.file("sphere.xyz"), case.file("hard.xyz")).expect("linked");
    symlink("new.csv", case.file("link-to-new.csv")).expect("linked");
    fs::copy(case.file("sphere.xyz"), case.file("sphere.csv")).expect("copied");
    fs::copy(case.file("sphere.xyz"), case.file("picture.png")).expect("copied");
    let before = Kept::of(&case);
    for line in [
        "sample @sphere.xyz -n 9 -o @sphere.xyz",
        "sample @sphere.xyz -n 9 -o @./sphere.xyz",
        "sample @sphere.xyz -n 9 -o @link.xyz",
        "sample @sphere.xyz -n 9 -o @hard.xyz",
        "sample @link.xyz -n 9 -o @hard.xyz",
        "field @sphere.csv --source 0 -o @sphere.csv",
        "field @sphere.xyz --source 0 --at @sphere.csv -o @sphere.csv",
        "field @sphere.xyz --source 0 -o @new.csv --isolines @new.csv",
        "field @sphere.xyz --source 0 -o @new.csv --isolines @link-to-new.csv",
        "field @picture.png --format xyz --source 0 --picture @picture.png",
        "path @sphere.xyz --pairs @sphere.csv -o @sphere.csv",
        "fit @sphere.xyz -o @m.taut --picture @m.taut",
        "log @sphere.csv --source 0 -o @sphere.csv",
        "exp @sphere.csv --source 0 --direction 1,0,0 -o @sphere.csv",
        "matrix @sphere.xyz --sources @rows.txt -o @D.npy --errors @./D.npy",
        "matrix @sphere.xyz --sources @rows.txt -o @D.npy --errors @D.npy.part",
    ] {
        let refused = case.run(line);
        assert_eq!(code(&refused), 2, "{line}: {}", text(&refused.stderr));
        let told = text(&refused.stderr);
        assert!(
            told.contains("the same file") || told.contains("extension"),
            "{line}: {told}"
        );
    }
    // What the shell redirects.
    let out = fs::File::create(case.file("out.csv")).expect("made");
    let refused = Command::new(BINARY)
        .args(case.arguments("path @sphere.xyz --from 1 --to 2 -o @out.csv"))
        .stdout(out)
        .output()
        .expect("it runs");
    assert_eq!(code(&refused), 2, "{}", text(&refused.stderr));
    fs::remove_file(case.file("out.csv")).expect("removed");
    assert!(Kept::of(&case).0 == before.0);
}

#[test]
fn formats_and_folders_are_looked_at_before_the_work() {
    let case = Case::new();
    // A surface that takes far longer than the test to make ready.
    let large = case.file("large.xyz");
    write_points(&large, &sphere(60_000, [0.0; 3], 4));
    for (line, expected, word) in [
        (
            "field @large.xyz --source 0 -o @out.xlsx",
            2,
            "expected one of",
        ),
        ("field @large.xyz --source 0 -o @out.las", 2, "LAS"),
        (
            "field @large.xyz --source 0 --isolines @out.xyz",
            2,
            "expected one of",
        ),
        ("field @large.xyz --source 0 --picture @out.jpg", 2, ".png"),
        (
            "field @large.xyz --source 0 -o @none/out.csv",
            1,
            "cannot be written",
        ),
        (
            "path @large.xyz --from 0 --to 1 -o @out.xlsx",
            2,
            "expected one of",
        ),
        (
            "path @large.xyz --pairs @pairs.txt -o @out.npy",
            2,
            "one path",
        ),
        ("sample @large.xyz -n 9 -o @out.vtp", 2, "expected one of"),
        (
            "log @large.xyz --source 0 -o @out.obj",
            2,
            "expected one of",
        ),
        (
            "exp @large.xyz --source 0 --direction 1,0,0 -o @out.las",
            2,
            "expected one of",
        ),
        ("fit @large.xyz -o @none/out.taut", 1, "cannot be written"),
        (
            "matrix @large.xyz --sources @rows.txt -o @none/D.npy",
            1,
            "cannot be written",
        ),
    ] {
        let start = Instant::now();
        let refused = case.run(line);
        assert_eq!(
            code(&refused),
            expected,
            "{line}: {}",
            text(&refused.stderr)
        );
        assert!(
            text(&refused.stderr).contains(word),
            "{line}: {}",
            text(&refused.stderr)
        );
        assert!(
            start.elapsed() < Duration::from_secs(2),
            "{line} took {:?}",
            start.elapsed()
        );
    }
}

#[test]
fn rights_and_links_of_outputs_are_kept() {
    let case = Case::new();
    fs::create_dir(case.file("deep")).expect("made");
    for (line, name) in [
        ("path @sphere.xyz --from 1 --to 700 -o @out.csv", "out.csv"),
        (
            "path @sphere.xyz --from 1 --to 700 --picture @out.png",
            "out.png",
        ),
        ("fit @sphere.xyz -o @out.taut", "out.taut"),
        (
            "matrix @sphere.xyz --sources @rows.txt --radius 0.2 -o @out.npz",
            "out.npz",
        ),
        (
            "matrix @sphere.xyz --sources @few.txt -o @out.npy",
            "out.npy",
        ),
    ] {
        fs::write(case.file("few.txt"), "1\n2\n").expect("written");
        let (link, real) = (case.file(name), case.file("deep").join(name));
        fs::write(&real, "old").expect("written");
        fs::set_permissions(&real, fs::Permissions::from_mode(0o600)).expect("set");
        symlink(Path::new("deep").join(name), &link).expect("linked");
        let found = case.run(line);
        assert_eq!(code(&found), 0, "{}", text(&found.stderr));
        assert!(
            fs::symlink_metadata(&link).expect("there").is_symlink(),
            "{line}"
        );
        assert_ne!(fs::read(&real).expect("read"), b"old", "{line}");
        let mode = fs::metadata(&real).expect("there").permissions().mode() & 0o777;
        assert_eq!(mode, 0o600, "{line}");
        assert_eq!(
            fs::read_dir(case.file("deep")).expect("a folder").count(),
            1
        );
        fs::remove_file(&real).expect("removed");
    }
}
