//! `taut path` against lengths in closed form.

mod support;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use serde_json::Value;
use support::{
    angle, code, number, object, objects, sphere, taut, taut_reading, text, write_points,
};

const KEYS: [&str; 13] = [
    "from",
    "to",
    "length",
    "length_error",
    "surface_error",
    "converged",
    "status",
    "stable",
    "shortest",
    "nodes",
    "max_geodesic_curvature",
    "max_off_surface",
    "steps",
];

fn assert_length(found: &Value, truth: f64, tolerance: f64) {
    assert_eq!(found["converged"], true, "{found}");
    let error = (number(found, "length") - truth).abs();
    assert!(error <= tolerance * truth, "{error:e} in {found}");
}

#[test]
fn named_shapes_meet_the_tolerance() {
    for tolerance in ["1e-3", "1e-6", "1e-9", "1e-12"] {
        let shape = [
            "path",
            "--shape",
            "torus:1,0.4",
            "--json",
            "--tol",
            tolerance,
        ];
        let ends = ["--from", "1.4,0,0", "--to", "1,0,-0.4"];
        let found = object(&taut(&[&shape[..], &ends].concat()), 0);
        let relative: f64 = tolerance.parse().expect("a number");
        // A quarter of a meridian.
        assert_length(&found, 0.4 * FRAC_PI_2, relative.max(1e-14));
        assert!(number(&found, "length_error") <= relative);
        assert_eq!(number(&found, "surface_error"), 0.0);
        let keys: Vec<&str> = KEYS
            .into_iter()
            .filter(|key| found.get(key).is_none())
            .collect();
        assert!(keys.is_empty(), "{keys:?} are missing");
    }
}

#[test]
fn the_flow_finds_the_same_length_with_more_nodes() {
    let find = |scheme| {
        let shape = ["path", "--shape", "torus:1,0.4", "--json", "--tol", "1e-6"];
        let ends = [
            "--from",
            "1.4,0,0",
            "--to",
            "0,1,0.4",
            "--correction",
            scheme,
        ];
        object(&taut(&[&shape[..], &ends].concat()), 0)
    };
    let (newton, flow) = (find("newton"), find("flow"));
    let length = number(&newton, "length");
    assert_length(&flow, length, 2e-6);
    assert!(
        number(&flow, "nodes") > 2.0 * number(&newton, "nodes"),
        "{flow}"
    );
}

#[test]
fn equations_in_three_four_and_five_variables() {
    let sphere = [
        "--implicit",
        "x^2 + y^2 + z^2 = 1",
        "--from=-1,0,0",
        "--to",
        "0,0,1",
    ];
    let tori = [
        "--implicit",
        "x1^2 + x2^2 = 1",
        "--implicit",
        "x3^2 + x4^2 = 1",
        "--from",
        "1,0,1,0",
        "--to",
        "0,1,-1,0",
    ];
    let five = [
        "--implicit",
        "x1^2 + x2^2 + x3^2 + x4^2 + x5^2 = 4",
        "--from",
        "2,0,0,0,0",
        "--to",
        "0,0,0,0,2",
    ];
    for (arguments, truth) in [
        (&sphere[..], FRAC_PI_2),
        (&tori[..], PI * 1.25_f64.sqrt()),
        (&five[..], PI),
    ] {
        let found = object(&taut(&[&["path", "--json"], arguments].concat()), 0);
        assert_length(&found, truth, 1e-6);
    }
}

#[test]
fn ends_off_the_surface_are_moved_onto_it() {
    let found = object(
        &taut(&[
            "path", "--shape", "sphere:1", "--from", "1.25,0,0", "--to", "0,0.5,0", "--json",
        ]),
        0,
    );
    assert_length(&found, FRAC_PI_2, 1e-6);
    assert!(
        (number(&found["from"], "moved") - 0.25).abs() < 1e-12,
        "{found}"
    );
    assert!(
        (number(&found["to"], "moved") - 0.5).abs() < 1e-12,
        "{found}"
    );
    assert_eq!(found["from"]["given"], serde_json::json!([1.25, 0.0, 0.0]));
}

#[test]
fn a_cloud_by_rows_and_by_coordinates() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let centre = [5e3, -2e3, 10.0];
    let points = sphere(4000, centre, 7);
    write_points(&file, &points);
    let file = file.to_str().expect("UTF-8");
    let relative = |row: usize| std::array::from_fn(|i| points[row][i] - centre[i]);
    let truth = angle(relative(3), relative(2999));
    let rows = taut(&[
        "path", file, "--from", "3", "--to", "2999", "--json", "--points",
    ]);
    let rows = object(&rows, 0);
    assert_length(&rows, truth, 1e-5);
    let errors = number(&rows, "length_error") + number(&rows, "surface_error");
    assert!((number(&rows, "length") - truth).abs() <= errors, "{rows}");
    assert_eq!(rows["from"]["row"], 3);
    let nodes = rows["points"].as_array().expect("points");
    assert_eq!(nodes.len() as f64, number(&rows, "nodes"));
    for (node, row) in [(&nodes[0], 3), (&nodes[nodes.len() - 1], 2999)] {
        for i in 0..3 {
            let coordinate = node[i].as_f64().expect("a number");
            assert!((coordinate - points[row][i]).abs() < 1e-3);
        }
    }
    let named = |row: usize| points[row].map(|v| format!("{v:?}")).join(",");
    let (from, to) = (named(3), named(2999));
    let coordinates = object(
        &taut(&["path", file, "--from", &from, "--to", &to, "--json"]),
        0,
    );
    let difference = number(&coordinates, "length") - number(&rows, "length");
    assert!(difference.abs() < 1e-9, "{difference:e}");
}

#[test]
fn many_pairs_are_the_same_for_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let points = sphere(2000, [0.0; 3], 3);
    write_points(&file, &points);
    let file = file.to_str().expect("UTF-8");
    let pairs: String = (0..300)
        .map(|i| format!("{} {}\n", i, 1999 - 3 * i))
        .collect();
    let run = |threads, more: &[&str]| {
        let arguments = ["path", file, "--pairs", "-", "--threads", threads];
        taut_reading(&[&arguments, more].concat(), &pairs)
    };
    let one = run("1", &["--json"]);
    let found = objects(&one, 0);
    assert_eq!(found.len(), 300);
    for (i, object) in found.iter().enumerate() {
        assert_eq!(object["from"]["row"], i);
        assert_length(object, angle(points[i], points[1999 - 3 * i]), 1e-3);
    }
    assert_eq!(one.stdout, run("3", &["--json"]).stdout);
    let table = run("2", &[]);
    let lines: Vec<&str> = text(&table.stdout).lines().collect();
    assert_eq!(lines.len(), 301);
    assert!(lines[0].starts_with("# from\tto\tlength\t"), "{}", lines[0]);
    for (line, json) in lines[1..].iter().zip(text(&one.stdout).lines()) {
        let columns: Vec<&str> = line.split('\t').collect();
        assert_eq!(columns.len(), lines[0].split('\t').count());
        let length = format!("\"length\":{},", columns[2]);
        assert!(json.contains(&length), "{length} in {json}");
    }
}

#[test]
fn pairs_of_coordinates() {
    let pairs = "1 0 0  0 1 0\n0 0 1  0.6 0 -0.8\n";
    let found = objects(
        &taut_reading(
            &["path", "--shape", "sphere:1", "--pairs", "-", "--json"],
            pairs,
        ),
        0,
    );
    assert_length(&found[0], FRAC_PI_2, 1e-6);
    assert_length(&found[1], (-0.8_f64).acos(), 1e-6);
}

#[test]
fn further_paths_go_another_way_round() {
    let angle = (-0.6_f64).acos();
    let arguments = [
        "path",
        "--shape",
        "cylinder:1",
        "--from",
        "1,0,0",
        "--to=-0.6,0.8,0",
    ];
    let found = object(
        &taut(&[&arguments[..], &["--json", "--alternatives", "1"]].concat()),
        0,
    );
    assert_length(&found, angle, 1e-6);
    let further = found["alternatives"].as_array().expect("an array");
    assert_eq!(further.len(), 1);
    assert_length(&further[0], TAU - angle, 1e-6);
}

#[test]
fn two_pieces_have_no_path_between_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("two.xyz");
    let mut points = sphere(500, [0.0; 3], 1);
    points.extend(sphere(500, [5.0, 0.0, 0.0], 2));
    write_points(&file, &points);
    let file = file.to_str().expect("UTF-8");
    let output = folder.path().join("path.csv");
    let ends = [
        "path",
        file,
        "--from",
        "0",
        "--to",
        "700",
        "-o",
        output.to_str().expect("UTF-8"),
    ];
    let found = object(&taut(&[&ends[..], &["--json"]].concat()), 4);
    assert!(found["length"].is_null() && found["length_error"].is_null());
    assert_eq!(found["status"], "no-path");
    assert_eq!(found["converged"], false);
    assert!(!output.exists());
    let mixed = taut_reading(&["path", file, "--pairs", "-"], "0 1\n0 700\n600 700\n");
    assert_eq!(code(&mixed), 4);
    let rows: Vec<&str> = text(&mixed.stdout).lines().skip(1).collect();
    assert!(rows[1].starts_with("0\t700\tinf\t"), "{}", rows[1]);
}

#[test]
fn a_pair_that_cannot_be_used_leaves_the_others_their_answers() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    write_points(&file, &sphere(500, [0.0; 3], 1));
    let file = file.to_str().expect("UTF-8");
    let pairs = "0 1\n2 500\n3 4\n";
    let arguments = ["path", file, "--pairs", "-"];
    let output = taut_reading(&[&arguments[..], &["--json"]].concat(), pairs);
    assert!(text(&output.stderr).contains("500"), "the end is named");
    let found = objects(&output, 3);
    let statuses: Vec<_> = found.iter().map(|pair| pair["status"].clone()).collect();
    assert_eq!(statuses, ["converged", "unusable-end", "converged"]);
    assert!(found[1]["length"].is_null() && found[1]["to"]["point"].is_null());
    assert!(
        found[1]["to"]["reason"]
            .as_str()
            .is_some_and(|reason| reason.contains("fewer rows"))
    );
    let table = taut_reading(&arguments, pairs);
    assert_eq!(code(&table), 3);
    let rows: Vec<&str> = text(&table.stdout).lines().skip(1).collect();
    assert!(rows[1].starts_with("2\t500\tNaN\t"), "{}", rows[1]);
}

#[test]
fn a_tolerance_below_rounding_does_not_converge() {
    let shape = ["path", "--shape", "torus:1,0.4", "--tol", "1e-16", "--json"];
    let ends = ["--from", "1.4,0,0", "--to=-0.6,0.1,0"];
    let found = object(&taut(&[&shape[..], &ends].concat()), 5);
    assert_eq!(found["converged"], false);
    assert!(number(&found, "length_error") > 1e-16 * number(&found, "length"));
}

#[test]
fn the_summary_of_a_cloud_has_both_errors() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let points = sphere(2000, [0.0; 3], 5);
    write_points(&file, &points);
    let ends = ["--from", "3", "--to", "1500"];
    let path = [&["path", file.to_str().expect("UTF-8")][..], &ends].concat();
    let output = taut(&path);
    let shown = text(&output.stdout);
    let words: Vec<&str> = shown
        .lines()
        .find(|line| line.starts_with("length"))
        .expect("a length")
        .split_whitespace()
        .collect();
    let [
        _,
        length,
        "±",
        surface,
        "(surface)",
        "±",
        correction,
        "(path)",
    ] = words[..]
    else {
        panic!("{shown}");
    };
    let value = |text: &str| text.parse::<f64>().expect("a number");
    let error = value(surface) + value(correction);
    let decimals = length.split_once('.').map_or(0, |(_, d)| d.len()) as i32;
    assert!(
        (0.01..=0.1).contains(&(10_f64.powi(-decimals) / error)),
        "{shown}"
    );
    assert!((value(length) - angle(points[3], points[1500])).abs() <= 1.1 * error);
    let planes = object(
        &taut(&[&path[..], &["--surface", "mls", "--json"]].concat()),
        0,
    );
    assert!(planes["surface_error"].is_null(), "{planes}");
}

#[test]
fn the_summary_shows_only_digits_that_are_known() {
    let output = taut(&[
        "path", "--shape", "sphere:1", "--from", "1,0,0", "--to", "0,1,0", "--tol", "1e-3",
    ]);
    let summary = text(&output.stdout);
    let length = summary
        .lines()
        .find(|line| line.starts_with("length"))
        .expect("a length");
    let (value, error) = length["length".len()..]
        .split_once(" ± ")
        .expect("an error");
    let error: f64 = error.trim().parse().expect("a number");
    let decimals = value
        .trim()
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    assert!(
        10_f64.powi(-(decimals as i32)) <= error && error < 1e-3,
        "{length}"
    );
    let value: f64 = value.trim().parse().expect("a number");
    assert!((value - FRAC_PI_2).abs() <= 2.0 * error, "{length}");
}

#[test]
fn whether_two_endless_sheets_meet_is_unknown() {
    let path = |to: &str| {
        taut(&[
            "path",
            "--implicit",
            "x^2-y^2-z^2=1",
            "--from",
            "1,0,0",
            to,
            "--json",
        ])
    };
    let found = object(&path("--to=-1,0,0"), 6);
    assert_eq!(found["status"], "unknown");
    assert!(found["length"].is_null(), "{found}");
    let output = path("--to=1.25,0.75,0");
    assert_eq!(object(&output, 0)["status"], "converged");
    assert!(text(&output.stderr).contains("goes on beyond the part that was searched"));
}
