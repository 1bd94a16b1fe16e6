//! `taut log` and `taut exp`, against the unit sphere.

mod support;

use std::path::Path;

use support::{angle, code, number, object, objects, sphere, taut, text, write_points};

const HERE: [f64; 3] = [0.0; 3];
const POLE: [f64; 3] = [0.0, 0.0, 1.0];

fn name(file: &Path) -> &str {
    file.to_str().expect("UTF-8")
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

fn rows(text: &str, separator: char) -> Vec<Vec<f64>> {
    let numbers = |line: &str| {
        let fields = line.split(separator);
        fields.map(|v| v.parse().expect("a number")).collect()
    };
    text.lines().skip(1).map(numbers).collect()
}

fn array(value: &serde_json::Value) -> Vec<f64> {
    let numbers = value.as_array().expect("an array").iter();
    numbers.map(|v| v.as_f64().expect("a number")).collect()
}

/// The tangent at the pole whose geodesic leads to a point, and where the geodesic goes there; unit
/// vectors.
fn ways(point: &[f64; 3]) -> [[f64; 3]; 2] {
    let [x, y, z] = *point;
    let across = x.hypot(y);
    let out = [x / across, y / across];
    [[out[0], out[1], 0.0], [out[0] * z, out[1] * z, -across]]
}

/// A tangent at the pole, carried to a point in parallel: the part along the geodesic turns with
/// it.
fn carried(tangent: &[f64], point: &[f64; 3]) -> Vec<f64> {
    let [from, to] = ways(point);
    let along = dot(tangent, &from);
    (0..3)
        .map(|i| tangent[i] + along * (to[i] - from[i]))
        .collect()
}

#[test]
fn logarithms_and_transport_are_those_of_the_sphere() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path().join("at.xyz");
    let mut points = sphere(300, HERE, 31);
    points.retain(|p| (0.3..2.8).contains(&angle(POLE, *p)));
    write_points(&at, &points);
    let out = folder.path().join("log.csv");
    let asked = [
        "log",
        "--shape",
        "sphere:1",
        "--source",
        "0,0,1",
        "--at",
        name(&at),
    ];
    let told = object(
        &taut(&[&asked[..], &["--transport", "--json", "-o", name(&out)]].concat()),
        0,
    );
    assert_eq!(number(&told, "unreached"), 0.0);
    assert_eq!(number(&told, "not_transported"), 0.0);
    let tangents = [0, 1].map(|i| array(&told["source_tangents"][0][i]));
    assert!(dot(&tangents[0], &tangents[1]).abs() < 1e-12);
    let written = std::fs::read_to_string(&out).expect("written");
    assert!(
        written.starts_with("x,y,z,log_x,log_y,log_z,first_x,first_y,first_z,second_x,"),
        "{}",
        written.lines().next().unwrap_or_default()
    );
    let (mut covered, found) = (0, rows(&written, ','));
    assert_eq!(found.len(), points.len());
    for (row, point) in found.iter().zip(&points) {
        let length = angle(POLE, *point);
        let truth = ways(point)[0].map(|v| v * length);
        let missed = apart(&row[3..6], &truth);
        assert!(missed < 1e-3, "{point:?}: {missed:e}");
        covered += usize::from(missed <= row[12]);
        for (found, tangent) in [(&row[6..9], &tangents[0]), (&row[9..12], &tangents[1])] {
            assert!(apart(found, &carried(tangent, point)) < 1e-3, "{row:?}");
        }
    }
    assert!(
        covered * 100 >= found.len() * 95,
        "{covered} of {}",
        found.len()
    );
}

#[test]
fn what_is_shot_along_a_logarithm_comes_to_the_point() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let points = sphere(4000, HERE, 32);
    write_points(&file, &points);
    let output = taut(&["log", name(&file), "--source", "7"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let logs: Vec<_> = rows(text(&output.stdout), '\t');
    assert_eq!(logs.len(), points.len());
    let chosen: Vec<usize> = (0..points.len())
        .step_by(40)
        .filter(|i| (0.3..2.8).contains(&angle(points[7], points[*i])))
        .collect();
    let vectors = folder.path().join("vectors.txt");
    let line = |i: &usize| format!("{} {} {}\n", logs[*i][0], logs[*i][1], logs[*i][2]);
    std::fs::write(&vectors, chosen.iter().map(line).collect::<String>()).expect("written");
    let asked = [
        "exp",
        name(&file),
        "--source",
        "7",
        "--vectors",
        name(&vectors),
    ];
    let output = taut(&asked);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    assert!(text(&output.stdout).starts_with("# end_x\tend_y\tend_z\tlength\terror\tcomplete\n"));
    let ends = rows(text(&output.stdout), '\t');
    assert_eq!(ends.len(), chosen.len());
    let mut covered = 0;
    for (end, i) in ends.iter().zip(&chosen) {
        let missed = apart(&end[..3], &points[*i]);
        assert!(missed < 1e-3, "{missed:e}");
        assert!((end[3] - angle(points[7], points[*i])).abs() < 1e-3);
        let log = &logs[*i][..3];
        assert!((end[3] - dot(log, log).sqrt()).abs() < 1e-12);
        covered += usize::from(missed <= logs[*i][3] + end[4]);
    }
    assert!(
        covered * 100 >= ends.len() * 90,
        "{covered} of {}",
        ends.len()
    );
    let alone = taut(&[&asked[..], &["--threads", "1"]].concat());
    assert_eq!(alone.stdout, output.stdout);
}

#[test]
fn geodesics_go_where_great_circles_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let way = folder.path().join("way.csv");
    let picture = folder.path().join("way.png");
    // The part along the normal does not count.
    let asked = [
        "exp", "--shape", "sphere:1", "--source", "0,0,1", "--tol", "1e-9",
    ];
    let aimed = ["--direction", "3,4,7", "--length", "4", "--json"];
    let files = ["-o", name(&way), "--picture", name(&picture)];
    let told = object(&taut(&[&asked[..], &aimed, &files].concat()), 0);
    let (sin, cos) = 4.0_f64.sin_cos();
    let missed = apart(&array(&told["end"]), &[0.6 * sin, 0.8 * sin, cos]);
    assert!(
        missed < 1e-7 && missed <= number(&told, "error"),
        "{missed:e}"
    );
    assert!((number(&told, "length") - 4.0).abs() < 1e-12);
    assert_eq!(told["complete"], true);
    assert!(apart(&array(&told["tangents"][0]), &[0.6, 0.8, 0.0]) < 1e-9);
    assert!(
        apart(
            &array(&told["transported"][0]),
            &[0.6 * cos, 0.8 * cos, -sin]
        ) < 1e-7
    );
    assert!(
        apart(
            &array(&told["transported"][1]),
            &array(&told["tangents"][1])
        ) < 1e-7
    );
    let written = std::fs::read_to_string(&way).expect("written");
    assert_eq!(written.lines().count() as f64, number(&told, "nodes") + 1.0);
    assert!(std::fs::metadata(&picture).expect("drawn").len() > 10_000);
    let own = [&asked[..], &["--direction", "3,4,7", "--json"]].concat();
    assert!((number(&object(&taut(&own), 0), "length") - 5.0).abs() < 1e-9);
}

/// A direction that leans far out of the surface, where tangent planes that differ by a little
/// give it other lengths.
#[test]
fn geodesics_are_as_long_as_asked_whatever_their_direction() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let points = sphere(1000, HERE, 34);
    write_points(&file, &points);
    for source in 0..5 {
        let start = points[source];
        let aside = [-start[1], start[0], 0.0];
        let leaning: Vec<f64> = (0..3).map(|i| 30.0 * start[i] + aside[i]).collect();
        let direction = format!("{},{},{}", leaning[0], leaning[1], leaning[2]);
        let row = source.to_string();
        let shot = ["exp", name(&file), "--source", &row, "--direction"];
        for length in [0.1, 0.5, 2.0] {
            let asked = [&direction, "--length", &length.to_string(), "--json"];
            let told = object(&taut(&[&shot[..], &asked].concat()), 0);
            assert_eq!(number(&told, "length"), length, "row {source}");
            let end = array(&told["end"]);
            let reached = angle(start, [end[0], end[1], end[2]]);
            assert!((reached - length).abs() < 2e-5, "{source}: {reached}");
        }
    }
}

#[test]
fn geodesics_end_at_a_rim() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("plane.xyz");
    let at = |i: usize| f64::from(i as u32) * 0.05;
    let points: Vec<[f64; 3]> = (0..1681).map(|i| [at(i % 41), at(i / 41), 0.0]).collect();
    write_points(&file, &points);
    let asked = [
        "exp",
        name(&file),
        "--source",
        "1,1,0",
        "--direction",
        "1,0,0",
    ];
    let told = object(
        &taut(&[&asked[..], &["--length", "5", "--json"]].concat()),
        5,
    );
    assert_eq!(told["complete"], false);
    assert!((number(&told, "length") - 1.0).abs() < 0.1, "{told}");
}

#[test]
fn what_leads_nowhere_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let pole = ["exp", "--shape", "sphere:1", "--source", "0,0,1"];
    for (direction, expected, reason) in [
        ("0,0,0", 3, "no part along the surface"),
        ("0,0,1", 3, "no part along the surface"),
        ("nan,0,1", 2, "finite"),
        ("1,0", 3, "found 2 coordinates, expected 3"),
    ] {
        for length in [&[][..], &["--length", "1"]] {
            let output = taut(&[&pole[..], &["--direction", direction], length].concat());
            assert_eq!(code(&output), expected, "{direction}");
            let told = text(&output.stderr);
            assert!(told.contains(reason), "{direction}: {told}");
            assert!(output.stdout.is_empty());
        }
    }
    let file = folder.path().join("sphere.xyz");
    write_points(&file, &sphere(500, HERE, 33));
    for command in [&["exp", "--direction", "1,0,0"][..], &["log"]] {
        let output = taut(&[command, &[name(&file), "--source", "500"]].concat());
        assert_eq!(code(&output), 3, "{}", text(&output.stderr));
    }
    let vectors = folder.path().join("vectors.txt");
    std::fs::write(&vectors, "1 0 0\n0 0 1\n0 0 0\n").expect("written");
    let output = taut(&[&pole[..], &["--vectors", name(&vectors), "--json"]].concat());
    let told = objects(&output, 3);
    assert_eq!(told.len(), 3);
    assert!((number(&told[0], "length") - 1.0).abs() < 1e-9);
    assert!(told[1]["reason"].is_string() && told[2]["reason"].is_string());
}

/// What the refusal of a model says must help.
#[test]
fn models_have_logarithms_once_their_charts_are_small() {
    let folder = tempfile::tempdir().expect("a folder");
    let cloud = folder.path().join("sphere.xyz");
    let model = folder.path().join("sphere.taut");
    let at = folder.path().join("at.xyz");
    write_points(&cloud, &sphere(5000, HERE, 35));
    let mut points = sphere(200, HERE, 36);
    points.retain(|p| (0.3..2.6).contains(&angle(POLE, *p)));
    write_points(&at, &points);
    let found = |accuracy: &[&str]| {
        let fit = ["fit", name(&cloud), "-o", name(&model)];
        let fitted = taut(&[&fit[..], accuracy].concat());
        assert_eq!(code(&fitted), 0, "{}", text(&fitted.stderr));
        taut(&["log", name(&model), "--source", "0,0,1", "--at", name(&at)])
    };
    let refused = found(&[]);
    assert_eq!(code(&refused), 3);
    let told = text(&refused.stderr);
    assert!(
        told.contains("fit again with a smaller --accuracy"),
        "{told}"
    );
    let output = found(&["--accuracy", "1e-7"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let logs = rows(text(&output.stdout), '\t');
    assert_eq!(logs.len(), points.len());
    for (log, point) in logs.iter().zip(&points) {
        let truth = ways(point)[0].map(|v| v * angle(POLE, *point));
        let missed = apart(&log[..3], &truth);
        assert!(missed < 1e-3, "{point:?}: {missed:e}");
    }
}

#[test]
fn directions_need_smooth_surfaces_of_two_dimensions() {
    let folder = tempfile::tempdir().expect("a folder");
    let curve = folder.path().join("curve.csv");
    let turn = |i: u32| (f64::from(i) * 0.01).sin_cos();
    let line = |i| format!("{},{},0\n", turn(i).1, turn(i).0);
    std::fs::write(&curve, (0..628).map(line).collect::<String>()).expect("written");
    let output = taut(&["log", name(&curve), "--dimension", "1", "--source", "0"]);
    assert_eq!(code(&output), 3);
    let told = text(&output.stderr);
    assert!(
        told.contains("found a surface of dimension 1, expected 2"),
        "{told}"
    );
    let asked = ["exp", name(&curve), "--dimension", "1", "--source", "0"];
    let told = object(
        &taut(&[&asked[..], &["--direction", "0,2,0", "--json"]].concat()),
        0,
    );
    let (sin, cos) = 2.0_f64.sin_cos();
    assert!(
        apart(&array(&told["end"]), &[cos, sin, 0.0]) < 1e-3,
        "{told}"
    );
    let two = folder.path().join("two.xyz");
    let mut points = sphere(2000, HERE, 34);
    points.extend(sphere(1000, [9.0, 0.0, 0.0], 35));
    write_points(&two, &points);
    let output = taut(&["log", name(&two), "--source", "0"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    for row in &rows(text(&output.stdout), '\t')[2000..] {
        assert!(row[..3].iter().all(|v| v.is_nan()), "{row:?}");
        assert!(row[3] == f64::INFINITY && row[4] == -1.0, "{row:?}");
    }
    assert!(text(&output.stderr).contains("1000 of 3000 points are not reached"));
}
