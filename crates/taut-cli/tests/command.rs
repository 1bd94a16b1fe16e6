//! Exit codes, messages, files and completions of the command.

mod support;

use std::process::{Command, Stdio};

use support::{code, number, object, shared_data, sphere, taut, taut_reading, text, write_points};

#[test]
fn usage_errors_are_two() {
    for arguments in [
        &[][..],
        &["walk"],
        &["path"],
        &["path", "cloud.xyz", "--from", "1"],
        &["path", "cloud.xyz", "--from", "1", "--to", "-1"],
        &[
            "path",
            "cloud.xyz",
            "--from",
            "1",
            "--to",
            "2",
            "--tol",
            "0",
        ],
        &["path", "cloud.xyz", "--from", "1", "--to", "2", "--points"],
        &[
            "path",
            "cloud.xyz",
            "--shape",
            "sphere:1",
            "--from",
            "1,0,0",
            "--to",
            "0,1,0",
        ],
        &[
            "path",
            "--shape",
            "sphere:-1",
            "--from",
            "1,0,0",
            "--to",
            "0,1,0",
        ],
        &[
            "path",
            "--shape",
            "torus:1,0.4",
            "--bounds=-1:1",
            "--from",
            "1,0,0",
            "--to",
            "0,1,0",
        ],
        &[
            "path",
            "--implicit",
            "x^2+y^2=1",
            "--bounds=-1:1,0:1",
            "--from",
            "1,0,0",
            "--to",
            "0,1,0",
        ],
        &["completions", "tcl"],
    ] {
        let output = taut(arguments);
        assert_eq!(code(&output), 2, "{arguments:?}: {}", text(&output.stderr));
        assert!(
            output.stdout.is_empty() && !output.stderr.is_empty(),
            "{arguments:?}"
        );
    }
}

#[test]
fn bad_input_is_three_and_says_what() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    write_points(&file, &sphere(300, [0.0; 3], 1));
    let cloud = file.to_str().expect("UTF-8");
    let ends = |surface: &[&str], from: &str, to: &str| {
        taut(&[&["path"], surface, &["--from", from, "--to", to]].concat())
    };
    for (output, message) in [
        (
            ends(&["absent.ply"], "0", "1"),
            "absent.ply: cannot be read",
        ),
        (ends(&[cloud], "0", "300"), "300"),
        (
            ends(&[cloud], "0,1", "3"),
            "found 2 coordinates, expected 3",
        ),
        (
            ends(&["--implicit", "x^2 + 2y = 1"], "1,0,0", "0,1,0"),
            "missing operator",
        ),
        (
            ends(&["--implicit", "x^2 + y^2 = 1"], "3", "0,1,0"),
            "expected 3 coordinates",
        ),
        (
            ends(&["--implicit", "x^2 + y^2 = -1"], "1,0,0", "0,1,0"),
            "pulled back",
        ),
        (
            taut_reading(&["path", cloud, "--pairs", "-"], "0 1\n2\n"),
            "line 2",
        ),
    ] {
        assert_eq!(code(&output), 3, "{message}: {}", text(&output.stderr));
        let error = text(&output.stderr);
        assert!(
            error.starts_with("taut: ") && error.contains(message),
            "{error}"
        );
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn a_reader_that_stops_is_no_error() {
    let pairs: String = (0..20_000).map(|_| "1 0 0 0 1 0\n").collect();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("pairs.txt");
    std::fs::write(&file, pairs).expect("written");
    let mut child = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(["path", "--shape", "sphere:1", "--tol", "1e-3", "--pairs"])
        .arg(&file)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    assert!(output.stderr.is_empty());
}

#[test]
fn files_hold_the_path() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    for extension in ["ply", "obj", "csv", "json", "vtk", "vtp", "npy"] {
        let file = place(&format!("path.{extension}"));
        let arguments = [
            "path", "--shape", "sphere:1", "--from", "1,0,0", "--to", "0,1,0", "--json", "-o",
            &file,
        ];
        let found = object(&taut(&arguments), 0);
        assert!(
            std::fs::metadata(&file).expect("written").len() > 100,
            "{file}"
        );
        if extension == "csv" {
            let rows = std::fs::read_to_string(&file).expect("text");
            assert_eq!(rows.lines().count() as f64, 1.0 + number(&found, "nodes"));
            let last = rows.lines().last().expect("a row");
            let arc: f64 = last
                .split(',')
                .nth(1)
                .expect("arc length")
                .parse()
                .expect("a number");
            assert!((arc - number(&found, "length")).abs() < 1e-9, "{last}");
        }
    }
    let unknown = place("path.foo");
    let output = taut(&[
        "path", "--shape", "sphere:1", "--from", "1,0,0", "--to", "0,1,0", "-o", &unknown,
    ]);
    assert_eq!(code(&output), 2);
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        7
    );
}

#[test]
fn pictures_are_png() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("path.png");
    let output = taut(&[
        "path",
        "--shape",
        "flat-torus:1,0.6",
        "--from",
        "1,0,0.6,0",
        "--to",
        "0,1,0,0.6",
        "--picture",
        file.to_str().expect("UTF-8"),
    ]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    assert!(
        std::fs::read(&file)
            .expect("written")
            .starts_with(b"\x89PNG\r\n\x1a\n")
    );
}

#[test]
fn check_counts_points_and_pieces() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("two.csv");
    let mut points = sphere(600, [0.0; 3], 1);
    points.extend(sphere(400, [5.0, 0.0, 0.0], 2));
    points.extend_from_within(..100);
    points.push([f64::NAN, 0.0, 0.0]);
    write_points(&file, &points);
    let output = taut(&["check", file.to_str().expect("UTF-8"), "--json"]);
    let facts = object(&output, 0);
    for (key, count) in [
        ("rows", 1101),
        ("points", 1000),
        ("duplicates", 100),
        ("non_finite", 1),
    ] {
        assert_eq!(facts[key], count, "{key} in {facts}");
    }
    assert_eq!(facts["components"], serde_json::json!([600, 400]));
    assert_eq!(facts["intrinsic_dimension"], 2);
    assert_eq!(facts["warnings"].as_array().expect("an array").len(), 3);
    let summary = taut(&["check", file.to_str().expect("UTF-8")]);
    assert!(text(&summary.stdout).contains("2 pieces"));
}

#[test]
fn the_cells_of_a_grid_are_chosen_by_their_length() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sheet.xyz");
    // Points 0.02 apart on a unit square: from corner to corner straight across.
    let grid = |i: u32| f64::from(i) * 0.02;
    let points: Vec<[f64; 3]> = (0..51 * 51)
        .map(|i| [grid(i % 51), grid(i / 51), 0.0])
        .collect();
    write_points(&file, &points);
    let file = file.to_str().expect("UTF-8");
    let ends = ["path", file, "--from", "0", "--to", "2600", "--json"];
    for cells in ["0.1", "0.05,0.2,1"] {
        let found = taut(&[&ends[..], &["--cell", cells]].concat());
        let length = number(&object(&found, 0), "length");
        assert!((length - 2.0_f64.sqrt()).abs() < 1e-9, "{cells}: {length}");
    }
    let refused = taut(&[&ends[..], &["--cell", "0.1,0.1"]].concat());
    assert_eq!(code(&refused), 2);
    assert!(text(&refused.stderr).contains("found 2 intervals, expected 1 or 3"));
    let refused = taut(&[&ends[..], &["--cell=-1"]].concat());
    assert_eq!(code(&refused), 3);
    assert!(text(&refused.stderr).contains("a cell cannot be -1 long"));
}

#[test]
fn check_measures_a_flat_sheet() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sheet.xyz");
    let grid = |i: u32| f64::from(i) * 0.01;
    // Points 0.01 apart on a square of side 0.5, and the same 0.03 above it; at
    // the rim, with points on one side only, the spacing is estimated a quarter too large.
    let points: Vec<[f64; 3]> = (0..51 * 51 * 2)
        .map(|i| {
            [
                grid(i % 51),
                grid(i / 51 % 51),
                0.03 * f64::from(i / (51 * 51)),
            ]
        })
        .collect();
    write_points(&file, &points);
    let file = file.to_str().expect("UTF-8");
    let facts = object(&taut(&["check", file, "--json"]), 0);
    for i in 0..3 {
        let spacing = facts["spacing"][i].as_f64().expect("a number");
        assert!((0.008..0.014).contains(&spacing), "{facts}");
    }
    let sheet = number(&facts, "other_sheet");
    assert!(number(&facts, "noise") < 1e-12 && (2.0..3.5).contains(&sheet));
    assert!(
        (number(&facts, "rim_length") / 4.0 - 1.0).abs() < 0.2,
        "{facts}"
    );
    let degrees = facts["degrees"].as_array().expect("an array");
    let charts: f64 = degrees.iter().filter_map(serde_json::Value::as_f64).sum();
    assert_eq!(charts, number(&facts, "charts"));
    assert_eq!(facts["outliers"], 0);
    assert_eq!(facts["components"], serde_json::json!([2601, 2601]));
    let summary = taut(&["check", file]);
    for name in ["spacing", "noise", "nearest other sheet", "rims", "charts"] {
        let lines = text(&summary.stdout).lines();
        assert_eq!(lines.filter(|line| line.starts_with(name)).count(), 1);
    }
}

#[test]
fn check_finds_an_implicit_surface() {
    let facts = object(
        &taut(&["check", "--implicit", "x^2 + y^2 + z^2 = 1", "--json"]),
        0,
    );
    assert_eq!(
        (&facts["coordinates"], &facts["intrinsic_dimension"]),
        (&3.into(), &2.into())
    );
    assert_eq!(facts["components"].as_array().map(Vec::len), Some(1));
    for (key, truth) in [("low", -1.0), ("high", 1.0)] {
        for axis in 0..3 {
            let corner = facts[key][axis].as_f64().expect("a number");
            assert!((corner - truth).abs() < 0.1, "{facts}");
        }
    }
    let nothing = taut(&["check", "--implicit", "x^2 + y^2 = -1"]);
    assert_eq!(code(&nothing), 2);
    assert!(text(&nothing.stderr).contains("--bounds"));
}

#[test]
fn the_demo_agrees_with_the_exact_answer() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("demo.png");
    let output = taut(&["demo", "--picture", picture.to_str().expect("UTF-8")]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let shown = text(&output.stdout);
    let rows: Vec<Vec<&str>> = shown
        .lines()
        .filter(|line| line.ends_with("converged"))
        .map(|line| line.split_whitespace().collect())
        .collect();
    assert_eq!(rows.len(), 2, "{shown}");
    for row in rows {
        let number = |i: usize| row[i].parse::<f64>().expect("a number");
        let [length, exact, difference, surface, path] = std::array::from_fn(number);
        assert!((length - exact).abs() < 1e-5 * exact, "{shown}");
        // Shown with two digits each.
        assert!(difference.abs() <= 1.05 * (surface + path), "{shown}");
    }
    assert!(picture.exists());
}

#[test]
fn completions_and_help_name_the_commands() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = taut(&["completions", shell]);
        assert_eq!(code(&output), 0);
        assert!(text(&output.stdout).contains("alternatives"), "{shell}");
    }
    let help = taut(&["--help"]);
    assert_eq!(code(&help), 0);
    for word in ["Examples:", "taut demo", "Exit codes", "4  no path"] {
        assert!(text(&help.stdout).contains(word), "{word}");
    }
}

/// How a malformed file must be answered.
enum Expected {
    /// Exit code 3 and a message with these words.
    Error(&'static [&'static str]),
    /// Exit code 0 and these words in the report.
    Works(&'static [&'static str]),
}

#[test]
fn malformed_files_are_answered_as_their_readme_says() {
    use Expected::{Error, Works};
    let Some(folder) = shared_data() else { return };
    for (name, expected) in [
        ("empty.ply", Error(&["empty"])),
        ("trunc_header.ply", Error(&["line 5"])),
        ("trunc_body_le.ply", Error(&["byte offset", "500", "313"])),
        ("huge_count.ply", Error(&["1099511627776"])),
        ("zero_points.ply", Error(&["no points"])),
        ("nan_inf.ply", Works(&["not finite", "3 of 500 rows"])),
        ("wrong_count.off", Error(&["500", "420"])),
        ("one_point.xyz", Error(&["too few points"])),
        ("all_identical.xyz", Error(&["coincide"])),
        ("collinear.xyz", Error(&["tangent plane"])),
        ("mixed_columns.xyz", Error(&["line 7"])),
        ("garbage.xyz", Error(&["offset 0"])),
        ("unknown.foo", Error(&["xyz", "--format"])),
        ("wrong_dtype.npy", Error(&["f4", "f8"])),
        ("huge_shape.npy", Error(&["1099511627776"])),
        ("bad_fields.pcd", Error(&["line"])),
        ("bad_compressed.pcd", Error(&["4294967280"])),
        ("trunc.las", Error(&["1000000", "10"])),
        ("two_components.ply", Works(&["2 pieces", "500"])),
        ("duplicates.xyz", Works(&["300 rows repeat"])),
    ] {
        let file = folder.join("bad").join(name);
        let output = taut(&["check", file.to_str().expect("UTF-8")]);
        let error = text(&output.stderr);
        let (exit, said, words) = match expected {
            Error(words) => (3, error, words),
            Works(words) => (0, text(&output.stdout), words),
        };
        assert_eq!(code(&output), exit, "{name}: {error}");
        for word in words {
            assert!(said.contains(word), "{name}: {word:?} in {said}");
        }
        if exit == 3 {
            assert!(
                error.starts_with("taut: ") && error.contains(name),
                "{error}"
            );
            assert_eq!(error.lines().count(), 1, "{error}");
            assert!(output.stdout.is_empty());
        }
    }
}

#[test]
fn real_files_are_checked_and_crossed() {
    let Some(folder) = shared_data() else { return };
    for name in [
        "camel.off",
        "camel.pcd",
        "hand.obj",
        "kitten.xyz",
        "rops_scan.pcd",
        "roll.ply",
    ] {
        let file = folder.join(name);
        let file = file.to_str().expect("UTF-8");
        let facts = object(&taut(&["check", file, "--json", "-q"]), 0);
        let pieces = facts["components"].as_array().expect("an array");
        let largest = pieces[0].as_f64().expect("a number");
        assert!(largest > 0.5 * number(&facts, "points"), "{name}: {facts}");
        if pieces.len() == 1 {
            let ends = ["path", file, "--from", "10", "--to", "4000"];
            let output = taut(&[&ends[..], &["--json", "-q"]].concat());
            assert!([0, 5].contains(&code(&output)), "{name}");
            let found = object(&output, code(&output));
            let coordinate =
                |end: &str, axis: usize| found[end]["point"][axis].as_f64().expect("a number");
            let offsets = (0..3).map(|axis| coordinate("from", axis) - coordinate("to", axis));
            let chord = offsets.map(|offset| offset * offset).sum::<f64>().sqrt();
            let length = number(&found, "length");
            let error = number(&found, "length_error");
            assert!(length + error >= chord && chord > 0.0, "{name}: {found}");
        }
    }
}
