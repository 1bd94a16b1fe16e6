//! `taut field`.

mod support;

use std::path::Path;

use serde_json::Value;

use support::{code, number, object, sphere, taut, text, write_points};

const HERE: [f64; 3] = [0.0; 3];

fn name(file: &Path) -> &str {
    file.to_str().expect("UTF-8")
}

/// Angle between two points of the unit sphere.
fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let chord = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    2.0 * (0.5 * chord).min(1.0).asin()
}

/// The numbers of the lines behind the first.
fn rows(text: &str, separator: char) -> Vec<Vec<f64>> {
    let numbers = |line: &str| {
        let fields = line.split(separator);
        fields.map(|v| v.parse().expect("a number")).collect()
    };
    text.lines().skip(1).map(numbers).collect()
}

#[test]
fn distances_of_all_rows_go_to_standard_output() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let points = sphere(4000, HERE, 3);
    write_points(&file, &points);
    let output = taut(&["field", name(&file), "--source", "7", "--source", "0,0,1"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let told = text(&output.stdout);
    assert_eq!(told.lines().next(), Some("# distance\terror\tsource"));
    let found = rows(told, '\t');
    assert_eq!(found.len(), points.len());
    let mut covered = 0;
    for (row, point) in found.iter().zip(&points) {
        let ways = [angle(&points[7], point), angle(&[0.0, 0.0, 1.0], point)];
        let least = ways[0].min(ways[1]);
        assert!((row[0] - least).abs() < 1e-3, "{row:?} {ways:?}");
        assert!(ways[row[2] as usize] < least + 1e-3, "{row:?} {ways:?}");
        covered += usize::from((row[0] - least).abs() <= row[1]);
    }
    assert!(covered > 3900, "{covered}");
}

#[test]
fn files_and_pictures_hold_the_field() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let points = sphere(3000, HERE, 4);
    write_points(&file, &points);
    let sources = folder.path().join("sources.txt");
    std::fs::write(&sources, "# row, start\n5, 0.25\n").expect("written");
    let picture = folder.path().join("field.png");
    for extension in ["csv", "npy", "ply", "vtp"] {
        let out = folder.path().join("field").with_extension(extension);
        let told = object(
            &taut(&[
                "field",
                name(&file),
                "--sources",
                name(&sources),
                "-o",
                name(&out),
                "--picture",
                name(&picture),
                "--json",
            ]),
            0,
        );
        assert_eq!(number(&told, "points"), 3000.0);
        assert_eq!(number(&told, "unreached"), 0.0);
        assert!((number(&told, "farthest") - std::f64::consts::PI - 0.25).abs() < 0.1);
    }
    assert!(std::fs::metadata(&picture).expect("drawn").len() > 10_000);
    let written = std::fs::read_to_string(folder.path().join("field.csv")).expect("written");
    assert!(written.starts_with("x,y,z,distance,error,source\n"));
    let numbers = std::fs::read(folder.path().join("field.npy")).expect("written");
    for (i, row) in rows(&written, ',').iter().enumerate() {
        assert!((row[3] - 0.25 - angle(&points[5], &points[i])).abs() < 1e-3);
        assert_eq!(numbers[128 + 8 * i..][..8], row[3].to_le_bytes());
    }
}

#[test]
fn what_is_too_far_or_not_connected_is_infinite_and_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("two.xyz");
    let mut points = sphere(3000, HERE, 5);
    points.extend(sphere(1500, [9.0, 0.0, 0.0], 6));
    write_points(&file, &points);
    let arguments = ["field", name(&file), "--source", "0", "--max-distance", "1"];
    let output = taut(&arguments);
    assert_eq!(code(&output), 0);
    let found = rows(text(&output.stdout), '\t');
    let far = |i: usize| i >= 3000 || angle(&points[0], &points[i]) > 1.0;
    let mut unreached = 0;
    for (i, row) in found.iter().enumerate() {
        unreached += usize::from(row[0].is_infinite());
        assert!(
            row[0].is_infinite() == far(i) || (angle(&points[0], &points[i]) - 1.0).abs() < 1e-3
        );
        assert_eq!(row[0].is_infinite(), row[2] == -1.0);
    }
    let note = format!("{unreached} of 4500 points are not reached");
    assert!(
        text(&output.stderr).contains(&note),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn equations_are_asked_at_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("points.xyz");
    let points = sphere(300, HERE, 8);
    write_points(&file, &points);
    let surface = ["field", "--shape", "sphere:1", "--source", "0,0,1"];
    let output = taut(&[&surface[..], &["--at", name(&file)]].concat());
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    for (row, point) in rows(text(&output.stdout), '\t').iter().zip(&points) {
        let truth = angle(&[0.0, 0.0, 1.0], point);
        assert!((row[0] - truth).abs() < 1e-3, "{row:?} {truth}");
        assert!(row[3] < 1e-12, "moved: {row:?}");
    }
    let output = taut(&surface);
    assert_eq!(code(&output), 2);
    assert!(text(&output.stderr).contains("--at FILE"));
}

/// The rows of finite distance, nearest first, of equally near ones the first.
fn reached(found: &[Vec<f64>]) -> Vec<usize> {
    let mut reached: Vec<usize> = (0..found.len())
        .filter(|i| found[*i][0].is_finite())
        .collect();
    reached.sort_by(|a, b| found[*a][0].total_cmp(&found[*b][0]).then(a.cmp(b)));
    reached
}

#[test]
fn the_nearest_are_those_of_the_whole_field() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let mut points = sphere(5000, HERE, 21);
    points.push(points[40]);
    write_points(&file, &points);
    let rates = folder.path().join("rates.txt");
    let rate = |p: &[f64; 3]| format!("{}\n", 1.5 + p[2]);
    std::fs::write(&rates, points.iter().map(rate).collect::<String>()).expect("written");
    let curve = folder.path().join("curve.csv");
    let turn = |i: u32| (f64::from(i) * 0.01).sin_cos();
    let line = |i| format!("{},{},0,0\n", turn(i).1, turn(i).0);
    std::fs::write(&curve, (0..628).map(line).collect::<String>()).expect("written");
    let at = folder.path().join("at.xyz");
    let others = sphere(700, HERE, 22);
    write_points(&at, &others);
    let sources = ["--source", "40", "--source", "7"];
    for (surface, extra, counts) in [
        (&file, vec![], vec![1, 2, 100, 4000, 9000]),
        (&file, vec!["--cost", name(&rates)], vec![3, 300]),
        (&file, vec!["--at", name(&at)], vec![50]),
        (&curve, vec!["--dimension", "1"], vec![30]),
    ] {
        let asked = ["field", name(surface)];
        let whole = [&asked[..], &sources, &extra].concat();
        let output = taut(&whole);
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let all = rows(text(&output.stdout), '\t');
        let least = reached(&all);
        for count in counts {
            let most = count.to_string();
            let asked = [&whole[..], &["--nearest", &most]].concat();
            let output = taut(&asked);
            assert_eq!(code(&output), 0, "{}", text(&output.stderr));
            let some = rows(text(&output.stdout), '\t');
            let found = reached(&some);
            assert_eq!(found.len(), count.min(all.len()), "{asked:?}");
            for (found, row) in found.iter().zip(&least) {
                let [here, there] = [some[*found][0], all[*row][0]];
                assert!((here - there).abs() < 1e-5, "{asked:?}: {here} {there}");
                assert_eq!(some[*found][2], all[*found][2]);
            }
            let told = format!("only the {count} nearest were asked for");
            assert_eq!(
                text(&output.stderr).contains(&told),
                count < all.len(),
                "{}",
                text(&output.stderr)
            );
        }
    }
    let told = object(
        &taut(
            &[
                &["field", name(&file), "--nearest", "9", "--json"],
                &sources[..],
            ]
            .concat(),
        ),
        0,
    );
    assert_eq!(number(&told, "nearest"), 9.0);
    assert_eq!(number(&told, "unreached"), 4992.0);
}

#[test]
fn the_nearest_query_points_of_an_equation_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("points.xyz");
    let points = sphere(2000, HERE, 23);
    write_points(&file, &points);
    let shape = ["field", "--shape", "sphere:1", "--source", "0,0,1"];
    let output = taut(&[&shape[..], &["--at", name(&file), "--nearest", "25"]].concat());
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let found = reached(&rows(text(&output.stdout), '\t'));
    let mut truth: Vec<usize> = (0..points.len()).collect();
    truth.sort_by(|a, b| points[*b][2].total_cmp(&points[*a][2]));
    assert_eq!(found, truth[..25]);
}

#[test]
fn isolines_are_circles_on_the_sphere() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let mut points = sphere(10_000, [40.0, 0.0, 0.0], 24);
    points.push([40.0, 0.0, 1.0]);
    write_points(&file, &points);
    let out = folder.path().join("lines.json");
    let asked = ["field", name(&file), "--source", "10000", "--json"];
    let told = object(
        &taut(&[&asked[..], &["--isolines", name(&out)]].concat()),
        0,
    );
    let text = std::fs::read_to_string(&out).expect("written");
    let lines: Vec<Value> = serde_json::from_str(&text).expect("JSON");
    // The farthest point is pi away, a sixteenth of that is 0.2 rounded up or 0.1 rounded down.
    assert_eq!(lines.len(), 31);
    assert_eq!(number(&told["isolines"], "closed"), 31.0);
    assert!(number(&told["isolines"], "missed_most") < 1e-6);
    for (i, line) in lines.iter().enumerate() {
        let level = number(line, "level");
        assert_eq!(level, (i + 1) as f64 / 10.0);
        let vertices: Vec<[f64; 3]> =
            serde_json::from_value(line["points"].clone()).expect("points");
        for [x, y, z] in &vertices {
            let off = angle(&[0.0, 0.0, 1.0], &[x - 40.0, *y, *z]);
            assert!((off - level).abs() < 1e-4, "{level} {off}");
        }
        let lengths = line["arc_length"].as_array().expect("lengths");
        let length = lengths.last().and_then(Value::as_f64).expect("a length");
        let truth = std::f64::consts::TAU * level.sin();
        assert!(
            (length / truth - 1.0).abs() < 4e-3,
            "{level}: {length} {truth}"
        );
        assert_eq!(vertices.first(), vertices.last());
    }
}

#[test]
fn isolines_go_to_files_as_paths_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let shape = ["field", "--shape", "torus:1,0.4", "--source", "1.4,0,0"];
    let at = folder.path().join("at.xyz");
    write_points(&at, &[[1.4, 0.0, 0.0], [-1.4, 0.0, 0.0]]);
    for extension in ["csv", "obj", "ply", "vtk", "vtp"] {
        let out = folder.path().join("lines").with_extension(extension);
        let asked = [
            "--at",
            name(&at),
            "--isolines",
            name(&out),
            "--levels",
            "0.8,1.6",
        ];
        let output = taut(&[&shape[..], &asked].concat());
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let told = text(&output.stdout);
        assert!(told.contains("3, 3 of them closed"), "{told}");
        assert!(std::fs::metadata(&out).expect("written").len() > 1000);
    }
    for (asked, status, words) in [
        (
            ["--isolines", "lines.xyz"],
            2,
            "ply, obj, csv, json, vtk, vtp",
        ),
        (["--levels", "1,2"], 2, "--isolines"),
    ] {
        let output = taut(&[&shape[..], &["--at", name(&at)], &asked].concat());
        assert_eq!(code(&output), status, "{}", text(&output.stderr));
        assert!(
            text(&output.stderr).contains(words),
            "{}",
            text(&output.stderr)
        );
    }
}

#[test]
fn costs_may_stand_beside_the_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let points = sphere(2000, HERE, 25);
    let rate = |p: &[f64; 3]| 1.5 + p[2];
    let rates = folder.path().join("rates.txt");
    let lines: String = points.iter().map(|p| format!("{}\n", rate(p))).collect();
    std::fs::write(&rates, lines).expect("written");
    let line = |p: &[f64; 3]| format!("{} {} {} {}\n", p[0], p[1], rate(p), p[2]);
    let body: String = points.iter().map(line).collect();
    let header = "ply\nformat ascii 1.0\nelement vertex 2000\nproperty double x\nproperty double y\nproperty double slowness\nproperty double z\nend_header\n";
    let cloud = folder.path().join("sphere.ply");
    std::fs::write(&cloud, header.to_owned() + &body).expect("written");
    let named = folder.path().join("sphere.xyz");
    std::fs::write(&named, "x y slowness z\n".to_owned() + &body).expect("written");
    let found = |file: &Path, cost: &str| {
        let output = taut(&["field", name(file), "--source", "3", "--cost", cost]);
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        text(&output.stdout).to_owned()
    };
    let truth = found(&cloud, name(&rates));
    assert_eq!(found(&cloud, "slowness"), truth);
    assert_eq!(found(&named, "slowness"), truth);
    let output = taut(&["field", name(&cloud), "--source", "3", "--cost", "speed"]);
    assert_eq!(code(&output), 2, "{}", text(&output.stderr));
    let told = text(&output.stderr);
    assert!(
        told.contains("--cost speed: found no such file") && told.contains("the columns slowness"),
        "{told}"
    );
}

/// Points of the plane with a number beside them that no one asks for.
#[test]
fn numbers_beside_points_of_the_plane_are_no_coordinates() {
    let folder = tempfile::tempdir().expect("a folder");
    // Heights on a sphere are spread evenly.
    let [across, up] = [26, 27].map(|seed| sphere(1000, HERE, seed));
    let points = across.iter().zip(&up).map(|(a, b)| [a[2], b[2]]);
    let points: Vec<[f64; 2]> = points.collect();
    let line = |p: &[f64; 2]| format!("{},{},{}\n", p[0], p[1], 7.0 * p[0] * p[1]);
    let body: String = points.iter().map(line).collect();
    for names in ["x,y", "x1,x2"] {
        let file = folder.path().join("plane.csv");
        std::fs::write(&file, format!("{names},cost\n{body}")).expect("written");
        let output = taut(&["field", name(&file), "--source", "0"]);
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let told = text(&output.stderr);
        assert!(
            told.contains("columns ignored: cost; the coordinates are"),
            "{told}"
        );
        let rows = text(&output.stdout).lines().skip(1);
        let distances = rows.map(|row| row.split('\t').next().and_then(|v| v.parse::<f64>().ok()));
        let distances: Vec<f64> = distances.map(|v| v.expect("a distance")).collect();
        assert_eq!(distances.len(), points.len());
        for (point, found) in points.iter().zip(&distances) {
            let truth = (point[0] - points[0][0]).hypot(point[1] - points[0][1]);
            assert!(
                (found - truth).abs() < 1e-6,
                "{point:?}: {found}, not {truth}"
            );
        }
        let checked = object(&taut(&["check", name(&file), "--json"]), 0);
        assert_eq!(number(&checked, "coordinates"), 2.0);
    }
}

#[test]
fn refusals_say_what_was_expected() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    write_points(&file, &sphere(500, HERE, 9));
    let sources = folder.path().join("sources.txt");
    std::fs::write(&sources, "5 0.1\nx 0.2\n").expect("written");
    for (arguments, expected, words) in [
        (vec!["--source", "500"], 3, "500"),
        (
            vec!["--source", "1", "--start", "1", "--start", "2"],
            2,
            "one for each of 1 sources",
        ),
        (vec!["--sources", name(&sources)], 3, "line 2"),
        (vec!["--source", "1", "--max-distance", "-1"], 2, "above 0"),
        (vec!["--source", "1", "--surface", "mls"], 2, "leave it out"),
        (
            vec!["--source", "1", "-o", "field.las"],
            2,
            "no LAS or LAZ file",
        ),
        (
            vec!["--source", "1", "-o", "field.xyz"],
            2,
            "npy, csv, ply, vtp, las, laz",
        ),
        (vec![], 2, "--source"),
    ] {
        let output = taut(&[&["field", name(&file)], &arguments[..]].concat());
        assert_eq!(
            code(&output),
            expected,
            "{arguments:?}: {}",
            text(&output.stderr)
        );
        assert!(
            text(&output.stderr).contains(words),
            "{}",
            text(&output.stderr)
        );
    }
}

/// The distance of a point of the unit sphere from its equator.
fn latitude(point: &[f64; 3]) -> f64 {
    point[2].asin().abs()
}

/// The vertices by coordinates and by rows, which are moved onto the surface and lie in it: both
/// one source.
#[test]
fn curves_are_sources() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let mut points = sphere(4000, HERE, 7);
    let ring: Vec<[f64; 3]> = (0..6)
        .map(|i| {
            let (sin, cos) = f64::from(i).sin_cos();
            [cos, sin, 0.0]
        })
        .collect();
    points.extend(&ring);
    write_points(&file, &points);
    let by_rows = folder.path().join("rows.txt");
    std::fs::write(&by_rows, "4000\n4001\n4002\n4003\n4004\n4005\n4000\n").expect("written");
    let by_points = folder.path().join("ring.xyz");
    let closed = [&ring[..], &ring[..1]].concat();
    write_points(&by_points, &closed);
    for vertices in [&by_rows, &by_points] {
        let output = taut(&["field", name(&file), "--curve", name(vertices)]);
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let found = rows(text(&output.stdout), '\t');
        assert_eq!(found.len(), points.len());
        for (row, point) in found.iter().zip(&points) {
            let off = (row[0] - latitude(point)).abs();
            // All of the curve is about as far from the poles.
            let is_polar = latitude(point) > 1.3 && off <= row[1] && off < 0.05;
            assert!(off < 1e-3 || is_polar, "{row:?} {point:?}");
            assert!(row[0] >= 0.0 && row[2] == 0.0, "{row:?}");
        }
    }
    let lines = folder.path().join("lines.csv");
    let picture = folder.path().join("field.png");
    let told = object(
        &taut(&[
            "field",
            name(&file),
            "--curve",
            name(&by_points),
            "--nearest",
            "500",
            "--isolines",
            name(&lines),
            "--levels",
            "0.02,0.1",
            "--picture",
            name(&picture),
            "--json",
        ]),
        0,
    );
    assert_eq!(number(&told, "sources"), 1.0);
    assert_eq!(number(&told, "unreached"), 3506.0);
    assert_eq!(number(&told["isolines"], "lines"), 4.0);
    assert_eq!(number(&told["isolines"], "closed"), 4.0);
    assert!(picture.exists());
    let at = folder.path().join("at.txt");
    std::fs::write(&at, "0 0 1\n0.6 0 -0.8\n").expect("written");
    let of_equation = [
        "field",
        "--shape",
        "sphere:1",
        "--curve",
        name(&by_points),
        "--at",
    ];
    let output = taut(&[&of_equation[..], &[name(&at)]].concat());
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let found = rows(text(&output.stdout), '\t');
    let truth = [0.5 * std::f64::consts::PI, 0.8_f64.asin()];
    for (row, truth) in found.iter().zip(truth) {
        assert!((row[0] - truth).abs() < 1e-3, "{row:?} {truth}");
    }
}

#[test]
fn curves_that_are_none_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("spheres.xyz");
    let mut points = sphere(1000, HERE, 7);
    points.extend(sphere(1000, [5.0, 0.0, 0.0], 8));
    write_points(&file, &points);
    let curve = folder.path().join("curve.txt");
    for (vertices, flags, expected, words) in [
        (
            "0\n1\n1500\n",
            &[][..],
            3,
            "no geodesic joins vertices 1 and 2",
        ),
        ("0 0.5\n1 0.5\n", &[], 2, "--curve: found the value 0.5"),
        ("0\n1\n", &["--start", "1"], 2, "--start"),
        ("0\n1\n", &["--source", "1"], 2, "--source"),
        ("0\n1\n", &["--dimension", "1"], 3, "dimension"),
    ] {
        std::fs::write(&curve, vertices).expect("written");
        let arguments = ["field", name(&file), "--curve", name(&curve)];
        let output = taut(&[&arguments, flags].concat());
        let told = text(&output.stderr);
        assert_eq!(code(&output), expected, "{vertices:?} {flags:?}: {told}");
        assert!(told.contains(words), "{vertices:?} {flags:?}: {told}");
    }
}

/// A square with a wall across it but for a gap: the way leads through the gap, and slower ground
/// costs more.
#[test]
fn costs_and_zones_turn_ways_aside() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("square.xyz");
    let mut points: Vec<[f64; 3]> = (0..41 * 41)
        .map(|i| [f64::from(i % 41) / 40.0, f64::from(i / 41) / 40.0, 0.0])
        .collect();
    points.push([0.2, 0.5, 0.0]);
    points.push([0.8, 0.5, 0.0]);
    write_points(&file, &points);
    let [source, goal] = [points.len() - 2, points.len() - 1];
    let zone = folder.path().join("wall.txt");
    std::fs::write(&zone, "0.42 0.3\n0.58 0.3\n0.58 2\n0.42 2\n").expect("written");
    let rates = folder.path().join("rates.txt");
    std::fs::write(&rates, "2\n".repeat(points.len())).expect("written");
    let to_goal = |arguments: &[&str]| {
        let asked = ["field", name(&file), "--source", &source.to_string()];
        let output = taut(&[&asked[..], arguments].concat());
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        rows(text(&output.stdout), '\t')
    };
    let free = to_goal(&[])[goal][0];
    assert!((free - 0.6).abs() < 1e-6, "{free}");
    let twice = to_goal(&["--cost", name(&rates)])[goal][0];
    assert!((twice - 1.2).abs() < 0.01, "{twice}");
    let aside = to_goal(&["--no-go", name(&zone)]);
    let round = 2.0 * 0.22_f64.hypot(0.2) + 0.16;
    assert!(
        (aside[goal][0] - round).abs() < 0.06,
        "{} {round}",
        aside[goal][0]
    );
    let inside = 20 + 41 * 20;
    assert!(aside[inside][0].is_infinite());
    let level = to_goal(&["--slope", "hiking"])[goal][0];
    assert!((level - 0.6).abs() < 0.01, "{level}");
    for (arguments, expected) in [
        (["--slope", "4"], "hiking, or UP,DOWN"),
        (["--no-go", name(&rates)], "corners of a polygon"),
        (["--cost", name(&zone)], "one cost on each line"),
    ] {
        let asked = ["field", name(&file), "--source", "0"];
        let output = taut(&[&asked[..], &arguments[..]].concat());
        assert_eq!(code(&output), 2, "{}", text(&output.stderr));
        assert!(
            text(&output.stderr).contains(expected),
            "{}",
            text(&output.stderr)
        );
    }
}

#[test]
fn the_extent_of_an_equation_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("at.xyz");
    let field = |equation: &str, points: &[[f64; 3]]| {
        write_points(&file, points);
        let given = [
            "--source",
            "1,0,0",
            "--at",
            name(&file),
            "--max-distance",
            "4",
        ];
        taut(&[&["field", "--implicit", equation][..], &given].concat())
    };
    let points = sphere(500, [0.0; 3], 31);
    let output = field("x^2+y^2+z^2=1", &points);
    assert_eq!(code(&output), 0);
    let found = rows(text(&output.stdout), '\t');
    assert_eq!(found.len(), 500);
    for (row, point) in found.iter().zip(&points) {
        assert!(
            (row[0] - angle(&[1.0, 0.0, 0.0], point)).abs() < 1e-3,
            "{row:?}"
        );
    }
    // The second point lies on the other of two sheets without end, which nothing is known to
    // connect.
    let output = field("x^2-y^2-z^2=1", &[[1.25, 0.75, 0.0], [-1.25, 0.75, 0.0]]);
    assert_eq!(code(&output), 6);
    let found = rows(text(&output.stdout), '\t');
    assert!((found[0][0] - 0.800_508_8).abs() < 1e-3 && found[1][0].is_nan());
    assert!(text(&output.stderr).contains("is unknown"));
}
