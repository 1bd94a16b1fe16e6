//! What the command says: what was given, what is expected, and how sure it is.
#![cfg(unix)]

mod support;

use std::fs;
use std::process::Command;

use support::case::{BINARY, Case};
use support::{code, object, sphere, text, write_points};

#[test]
fn a_line_without_end_is_refused_at_little_memory() {
    let case = Case::new();
    // Files of 40 MB within 400 MB of address space.
    let numbers = "1 2 3 ".repeat(7_000_000);
    fs::write(case.file("line.xyz"), &numbers).expect("written");
    fs::write(case.file("line.obj"), format!("v {numbers}")).expect("written");
    fs::write(case.file("line.off"), format!("OFF {numbers}")).expect("written");
    for line in [
        "check @line.xyz --threads 1",
        "check @line.obj --threads 1",
        "check @line.off --threads 1",
        "path @sphere.xyz --pairs @line.xyz --threads 1",
        "field @sphere.xyz --source 0 --cost @line.xyz --threads 1",
    ] {
        let script = "ulimit -v 400000; exec \"$0\" \"$@\"";
        let refused = Command::new("sh")
            .args(["-c", script, BINARY])
            .args(case.arguments(line))
            .output()
            .expect("sh runs");
        assert_eq!(code(&refused), 3, "{line}: {}", text(&refused.stderr));
        assert!(
            text(&refused.stderr).contains("line 1: found more than"),
            "{}",
            text(&refused.stderr)
        );
    }
}

#[test]
fn messages_say_what_was_given_and_what_to_do() {
    let case = Case::new();
    let told = |line: &str, expected: i32| {
        let output = case.run(line);
        assert_eq!(code(&output), expected, "{line}: {}", text(&output.stderr));
        text(&output.stderr).to_owned()
    };
    let refused = |line: &str, expected: i32, words: &[&str]| {
        let told = told(line, expected);
        for word in words {
            assert!(told.contains(word), "{line}: {told}");
        }
        assert!(
            !told.contains("invalid digit") && !told.contains("-- -"),
            "{told}"
        );
    };
    refused(
        "path @sphere.xyz --from 1 --to 2 --tol -1",
        2,
        &["positive", "--tol", "\"-1\""],
    );
    refused("field @sphere.xyz --source 1 --tol 0", 2, &["positive"]);
    refused(
        "path @sphere.xyz --from 1 --to 2 --class ground",
        2,
        &["--class", "0 to 255", "ground"],
    );
    refused("sample @sphere.xyz -n -5", 2, &["--count", "whole number"]);
    refused(
        "sample @sphere.xyz -n many",
        2,
        &["--count", "whole number"],
    );
    refused(
        "fit @sphere.xyz -o @m.taut --accuracy -1",
        2,
        &["--accuracy", "above 0"],
    );
    refused("check @sphere.xyz --cell -1", 3, &["-1", "positive length"]);
    refused(
        "path --implicit 1/x+y+z=1 --from 0,0,1 --to 1,0,0",
        3,
        &["not finite", "[0.0, 0.0, 1.0]"],
    );
    // A cloud far from the origin: its coordinates are those given.
    let points = sphere(1500, [1e6, 2e6, 3e6], 5);
    write_points(&case.file("far.xyz"), &points);
    let near = format!("{},{},{}", points[3][0], points[3][1], points[3][2]);
    fs::write(case.file("cost.txt"), "inf\n".repeat(1500)).expect("written");
    let message = told(
        &format!("field @far.xyz --source {near} --cost @cost.txt --json"),
        3,
    );
    assert!(
        message.contains("99999") || message.contains("100000"),
        "{message}"
    );
}

#[test]
fn sources_that_were_moved_are_told() {
    let case = Case::new();
    let output = case.run("field @sphere.xyz --source 0,0,1.004 --source 12 --json");
    let told = object(&output, 0);
    let moved = told["sources_moved"].as_array().expect("a list");
    assert!(
        (moved[0].as_f64().expect("a number") - 4e-3).abs() < 1e-4,
        "{told}"
    );
    assert!(moved[1].as_f64().expect("a number") < 1e-3, "{told}");
    assert!(
        text(&output.stderr).contains("source 0,0,1.004 was moved 0.004"),
        "{}",
        text(&output.stderr)
    );
    let output = case.run("field @sphere.xyz --source 0,0,1.9 --json");
    let stderr = text(&output.stderr);
    // Where it has no place at all it is refused.
    assert!(
        code(&output) == 3 || stderr.contains("farther than a few spacings"),
        "{stderr}"
    );
}

#[test]
fn isolines_err_by_what_the_field_errs() {
    let case = Case::new();
    let out = case.file("lines.json");
    let line = format!(
        "field @sphere.xyz --source 0 --isolines {} --levels 0.5,1 --json",
        out.display()
    );
    let told = object(&case.run(&line), 0);
    let claimed = told["isolines"]["error_most"].as_f64().expect("an error")
        + told["isolines"]["missed_most"].as_f64().expect("a miss");
    let source = sphere(1000, [0.0; 3], 3)[0];
    let lines: serde_json::Value =
        serde_json::from_slice(&fs::read(&out).expect("read")).expect("JSON");
    let mut worst: f64 = 0.0;
    for line in lines.as_array().expect("lines") {
        let level = line["level"].as_f64().expect("a level");
        for point in line["points"].as_array().expect("points") {
            let point: [f64; 3] = std::array::from_fn(|i| point[i].as_f64().expect("a number"));
            worst = worst.max((support::angle(source, point) - level).abs());
        }
    }
    assert!(worst > 0.0 && worst <= claimed, "{worst} beyond {claimed}");
}

#[test]
fn the_distance_of_a_point_to_itself_is_0() {
    let case = Case::new();
    fs::write(case.file("other.txt"), "500\n13\n0\n").expect("written");
    let line =
        "matrix @sphere.xyz --sources @rows.txt --to @other.txt -o @D.npy --errors @E.npy --json";
    let told = object(&case.run(line), 0);
    assert_eq!(told["unknown"].as_f64(), Some(0.0));
    for name in ["D.npy", "E.npy"] {
        let bytes = fs::read(case.file(name)).expect("read");
        let start = bytes.len() - 70 * 3 * 8;
        let at = |row: usize, column: usize| {
            let place = start + 8 * (3 * row + column);
            f64::from_le_bytes(bytes[place..place + 8].try_into().expect("8 bytes"))
        };
        assert_eq!((at(0, 2), at(1, 1)), (0.0, 0.0));
        assert!(
            bytes[start..]
                .chunks_exact(8)
                .all(|v| !f64::from_le_bytes(v.try_into().expect("8")).is_nan())
        );
    }
}
