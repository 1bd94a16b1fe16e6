//! Clouds that were once answered wrongly in silence: what the command says of them.

mod support;

use std::path::{Path, PathBuf};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;
use support::{angle, code, number, object, objects, sphere, taut, text, write_points};

fn name(file: &Path) -> &str {
    file.to_str().expect("UTF-8")
}

fn written(points: &[[f64; 3]]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cloud.xyz");
    write_points(&file, points);
    (folder, file)
}

fn warnings(facts: &Value) -> String {
    facts["warnings"].to_string()
}

/// The distances of a field in the order of the rows.
fn distances(output: &std::process::Output) -> Vec<f64> {
    assert_eq!(code(output), 0, "{}", text(&output.stderr));
    let lines = text(&output.stdout)
        .lines()
        .filter(|line| !line.starts_with('#'));
    let first = |line: &str| line.split('\t').next().and_then(|v| v.parse().ok());
    lines.map(|line| first(line).expect("a number")).collect()
}

#[test]
fn rows_of_missing_data_are_left_out_and_said() {
    let mut points = sphere(2000, [0.0; 3], 1);
    points[7][2] = -3.402_823_5e38;
    let (_folder, file) = written(&points);
    let facts = object(&taut(&["check", name(&file), "--json"]), 0);
    assert_eq!((&facts["far"], &facts["points"]), (&1.into(), &1999.into()));
    assert!(
        warnings(&facts).contains("1 of 2000 rows are left out"),
        "{facts}"
    );
    let output = taut(&["field", name(&file), "--source", "0"]);
    assert!(
        text(&output.stderr).contains("1 points are left out"),
        "{}",
        text(&output.stderr)
    );
    let found = distances(&output);
    for (i, distance) in found.iter().enumerate().filter(|(i, _)| *i != 7) {
        assert!((distance - angle(points[0], points[i])).abs() < 1e-3, "{i}");
    }
    assert!(found[7].is_nan());
    let refused = taut(&["path", name(&file), "--from", "0", "--to", "7"]);
    assert!(code(&refused) != 0 && text(&refused.stderr).contains("1e7 times as far"));
}

#[test]
fn ends_that_share_a_place_have_a_path_of_length_0() {
    let mut points = sphere(2000, [0.0; 3], 2);
    points.push(points[5]);
    let (folder, file) = written(&points);
    let pairs = folder.path().join("pairs.txt");
    std::fs::write(&pairs, "5 5\n5 2000\n2000 5\n3 3\n").expect("written");
    let all = objects(
        &taut(&["path", name(&file), "--pairs", name(&pairs), "--json"]),
        0,
    );
    let one = taut(&["path", name(&file), "--from", "5", "--to", "2000", "--json"]);
    let law = [
        "path",
        "--implicit",
        "x^2+y^2+z^2=1",
        "--from",
        "1,0,0",
        "--to",
        "1,0,0",
        "--json",
    ];
    for path in all
        .iter()
        .chain([&object(&one, 0), &object(&taut(&law), 0)])
    {
        for key in ["length", "length_error", "surface_error"] {
            assert_eq!(number(path, key), 0.0, "{path}");
        }
        assert_eq!(path["converged"], true);
    }
}

#[test]
fn strips_hold_and_polygons_beside_the_data_are_told() {
    let mut random = Pcg64::seed_from_u64(3);
    let mut place = || 2.0 * random.random::<f64>() - 1.0;
    let points: Vec<[f64; 3]> = (0..6000).map(|_| [place(), place(), 0.0]).collect();
    let (folder, file) = written(&points);
    let zone = folder.path().join("zone.txt");
    let low = points
        .iter()
        .position(|p| p[1] < -0.5)
        .expect("a point")
        .to_string();
    for width in [1e-6, 0.01, 0.1] {
        let strip = format!("-2 0\n2 0.1\n2 {}\n-2 {width}\n", 0.1 + width);
        std::fs::write(&zone, strip).expect("written");
        let output = taut(&[
            "field",
            name(&file),
            "--source",
            &low,
            "--no-go",
            name(&zone),
        ]);
        assert!(!text(&output.stderr).contains("changes nothing"));
        for (distance, [x, y, _]) in distances(&output).iter().zip(&points) {
            let is_below = *y < 0.05 + 0.025 * x;
            assert_eq!(distance.is_finite(), is_below, "width {width} at {x} {y}");
        }
    }
    std::fs::write(&zone, "5 5\n6 5\n6 6\n").expect("written");
    let asked = [
        "field",
        name(&file),
        "--source",
        "0",
        "--no-go",
        name(&zone),
    ];
    let output = taut(&asked);
    assert!(
        text(&output.stderr).contains("it changes nothing"),
        "{}",
        text(&output.stderr)
    );
    let facts = object(&taut(&[&asked[..], &["--json"]].concat()), 0);
    assert!(warnings(&facts).contains("it changes nothing"), "{facts}");
}

/// Every answer on a cloud and `check` say what speaks against it.
fn is_said(file: &Path, further: &[&str], words: &str) {
    let with = |asked: &[&str]| object(&taut(&[asked, further, &["--json"]].concat()), 0);
    let ends = [
        "path",
        name(file),
        "--from",
        "0",
        "--to",
        "1",
        "--tol",
        "1e-3",
    ];
    let path = taut(&[&ends[..], further, &["--json"]].concat());
    let path: Value = serde_json::from_str(text(&path.stdout)).expect("JSON");
    let field = taut(&[&["field", name(file), "--source", "0", "--json"], further].concat());
    let code = field.status.code();
    let field: Value = serde_json::from_str(text(&field.stdout)).expect("JSON");
    let is_unknown = field["unknown"].as_u64().is_some_and(|points| points > 0);
    assert_eq!(code, Some(if is_unknown { 6 } else { 0 }), "{field}");
    for facts in [path, field, with(&["check", name(file)])] {
        assert!(warnings(&facts).contains(words), "{facts}");
    }
    let output = taut(&[&["field", name(file), "--source", "0"], further].concat());
    assert!(
        text(&output.stderr).contains(words),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn sheets_joined_by_noise_are_said() {
    let mut random = Pcg64::seed_from_u64(4);
    let spacing = 1.0 / 3000_f64.sqrt();
    let point = |i: usize| {
        let noise: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let height = (3.0 * (i % 2) as f64 + 0.25 * noise) * spacing;
        [random.random::<f64>(), random.random::<f64>(), height]
    };
    let points: Vec<[f64; 3]> = (0..6000).map(point).collect();
    let (_folder, file) = written(&points);
    is_said(&file, &[], "another sheet comes as near as");
}

#[test]
fn a_dimension_that_the_points_do_not_have_is_said() {
    let mut random = Pcg64::seed_from_u64(5);
    let (folder, _) = written(&[[0.0; 3]]);
    let file = folder.path().join("roll.xyz");
    let row = |_| {
        let (angle, across) = (
            2.0 + 9.0 * random.random::<f64>(),
            4.0 * random.random::<f64>(),
        );
        let radius = 0.2 * angle;
        let [x, y] = [radius * angle.cos(), radius * angle.sin()];
        format!(
            "{} {} {} {}",
            0.8 * x + 0.6 * across,
            y,
            0.8 * across - 0.6 * x,
            0.1 * x
        )
    };
    let rows: Vec<String> = (0..3000).map(row).collect();
    std::fs::write(&file, rows.join("\n")).expect("written");
    is_said(
        &file,
        &["--dimension", "3"],
        "points spread in 2 directions",
    );
    let right = object(
        &taut(&["check", name(&file), "--dimension", "2", "--json"]),
        0,
    );
    assert!(!warnings(&right).contains("directions"), "{right}");
}

#[test]
fn ends_off_the_surface_are_named() {
    let mut points = sphere(3000, [0.0; 3], 6);
    points.push([0.0, 0.0, 1.3]);
    let (_folder, file) = written(&points);
    let path = object(
        &taut(&["path", name(&file), "--from", "3000", "--to", "4", "--json"]),
        0,
    );
    assert!(
        warnings(&path).contains("no point of the surface"),
        "{path}"
    );
    assert!(
        (number(&path["from"], "moved") - 0.3).abs() < 0.01,
        "{path}"
    );
    let inner = object(
        &taut(&["path", name(&file), "--from", "3", "--to", "4", "--json"]),
        0,
    );
    assert!(inner["warnings"].is_null(), "{inner}");
    let summary = taut(&["path", name(&file), "--from", "3000", "--to", "4"]);
    assert!(
        text(&summary.stdout).contains("warning"),
        "{}",
        text(&summary.stdout)
    );
    let field = taut(&["field", name(&file), "--source", "3000"]);
    assert!(text(&field.stderr).contains("no point of the surface"));
}
