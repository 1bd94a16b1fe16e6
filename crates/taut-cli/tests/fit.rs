//! `taut fit`, and its model as the surface of the other commands.

mod support;

use std::f64::consts::TAU;
use std::path::Path;

use support::{code, number, object, taut, text};

/// Points all over the unit sphere, evenly spread along a spiral.
fn sphere(file: &Path) {
    let count = 3000;
    let golden = TAU * (1.0 - 2.0 / (1.0 + 5.0_f64.sqrt()));
    let lines: Vec<String> = (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (across, angle) = ((1.0 - z * z).sqrt(), golden * f64::from(i));
            format!("{} {} {z}", across * angle.cos(), across * angle.sin())
        })
        .collect();
    std::fs::write(file, lines.join("\n")).expect("written");
}

#[test]
fn a_model_serves_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let [cloud, model, picture] =
        ["sphere.xyz", "sphere.taut", "sphere.png"].map(|name| folder.path().join(name));
    sphere(&cloud);
    let [cloud, model, picture] =
        [&cloud, &model, &picture].map(|file| file.to_str().expect("UTF-8"));
    let told = object(
        &taut(&[
            "fit",
            cloud,
            "-o",
            model,
            "--accuracy",
            "1e-3",
            "--json",
            "--picture",
            picture,
        ]),
        0,
    );
    assert_eq!(number(&told, "points"), 3000.0);
    assert!(number(&told, "largest_residual") <= 1e-3);
    for none in ["beyond", "contradictions", "outliers", "rim_length"] {
        assert_eq!(number(&told, none), 0.0, "{none}");
    }
    assert!(std::fs::metadata(picture).expect("drawn").len() > 1000);

    let checked = object(&taut(&["check", model, "--json"]), 0);
    assert_eq!(number(&checked, "charts"), number(&told, "charts"));

    let path = object(
        &taut(&[
            "path",
            model,
            "--from",
            "1,0,0",
            "--to=-0.6,0.8,0",
            "--json",
            "--picture",
            picture,
        ]),
        0,
    );
    let truth = (-0.6_f64).acos();
    assert!((number(&path, "length") - truth).abs() < 4e-3);

    let points = folder.path().join("points.csv");
    let points = points.to_str().expect("UTF-8");
    let sampled = taut(&[
        "sample",
        model,
        "-n",
        "200",
        "--uniform",
        "--json",
        "-o",
        points,
    ]);
    assert_eq!(number(&object(&sampled, 0), "points"), 200.0);
    let written = std::fs::read_to_string(points).expect("written");
    for row in written.lines().skip(1) {
        let row: Vec<f64> = row
            .split(',')
            .map(|v| v.parse().expect("a number"))
            .collect();
        let radius = row[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!((radius - 1.0).abs() < 1e-3);
        let outwards: f64 = row[..3].iter().zip(&row[3..]).map(|(x, n)| x * n).sum();
        assert!(outwards > 0.9, "the normals point out");
    }
}

#[test]
fn a_cloud_is_sampled_from_its_rows() {
    let folder = tempfile::tempdir().expect("a folder");
    let [cloud, points] = ["sphere.xyz", "points.csv"].map(|name| folder.path().join(name));
    sphere(&cloud);
    let [cloud, points] = [&cloud, &points].map(|file| file.to_str().expect("UTF-8"));
    let output = taut(&["sample", cloud, "-n", "50", "--source", "17", "-o", points]);
    assert_eq!(code(&output), 0);
    let row = |file: &str, line: usize, separator: char| -> Vec<f64> {
        let text = std::fs::read_to_string(file).expect("there");
        let line = text.lines().nth(line).expect("a line");
        let values = line.split(separator).take(3);
        values.map(|v| v.parse().expect("a number")).collect()
    };
    let (first, source) = (row(points, 1, ','), row(cloud, 17, ' '));
    let gap = first.iter().zip(&source).map(|(a, b)| (a - b).abs());
    assert!(gap.fold(0.0, f64::max) < 1e-5, "{first:?} {source:?}");
}

#[test]
fn what_is_no_model_is_refused_with_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let [cloud, model, broken] =
        ["sphere.xyz", "good.taut", "broken.taut"].map(|name| folder.path().join(name));
    sphere(&cloud);
    let [cloud, model, broken] =
        [&cloud, &model, &broken].map(|file| file.to_str().expect("UTF-8"));
    assert_eq!(code(&taut(&["fit", cloud, "-o", model])), 0);
    let good = std::fs::read_to_string(model).expect("written");
    let charts = good.lines().count() - 1;
    for (bad, words) in [
        (String::new(), "file is empty".to_owned()),
        ("0 0 1\n".to_owned(), "line 1: found".to_owned()),
        (
            good.replacen("\"version\":1", "\"version\":9", 1),
            "found version 9".to_owned(),
        ),
        (
            good.replacen("\"radius\":", "\"radius\":-", 1),
            "chart 0: found radius".to_owned(),
        ),
        (
            good.replacen("\"degree\":", "\"degree\":\"four\"", 1),
            "line 2: found".to_owned(),
        ),
        (
            good.lines().take(4).collect::<Vec<_>>().join("\n"),
            format!("found 3 lines of charts, expected {charts}"),
        ),
    ] {
        std::fs::write(broken, bad).expect("written");
        let output = taut(&["check", broken]);
        let said = text(&output.stderr);
        assert_eq!(code(&output), 3, "{said}");
        assert!(
            said.contains("broken.taut") && said.contains(&words),
            "{said}"
        );
    }
    let row = taut(&["path", model, "--from", "0", "--to", "1"]);
    assert_eq!(code(&row), 3);
    assert!(text(&row.stderr).contains("a model keeps no rows"));
    for wrong in [
        &["fit", cloud, "-o", "model.ply"][..],
        &["fit", cloud, "-o", broken, "--accuracy", "0"],
        &["check", model, "--dimension", "2"],
    ] {
        let output = taut(wrong);
        assert!([2, 3].contains(&code(&output)), "{wrong:?}");
    }
}

#[test]
fn fields_on_a_model_are_those_of_its_surface() {
    let folder = tempfile::tempdir().expect("a folder");
    let [cloud, model] = ["sphere.xyz", "sphere.taut"].map(|name| folder.path().join(name));
    sphere(&cloud);
    let [cloud, model] = [&cloud, &model].map(|file| file.to_str().expect("UTF-8"));
    assert_eq!(code(&taut(&["fit", cloud, "-o", model])), 0);
    for more in [&[][..], &["--nearest", "100"]] {
        let asked = ["field", model, "--source", "0.6,0.8,0", "--at", cloud];
        let output = taut(&[&asked[..], more].concat());
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let points = std::fs::read_to_string(cloud).expect("written");
        let (mut covered, mut reached) = (0, 0);
        let rows = text(&output.stdout).lines().skip(1);
        for (row, point) in rows.zip(points.lines()) {
            let numbers = |line: &str, by: char| -> Vec<f64> {
                let values = line.split(by);
                values.map(|v| v.parse().expect("a number")).collect()
            };
            let (row, x) = (numbers(row, '\t'), numbers(point, ' '));
            if row[0].is_infinite() {
                continue;
            }
            let truth = (0.6 * x[0] + 0.8 * x[1]).clamp(-1.0, 1.0).acos();
            assert!((row[0] - truth).abs() < 5e-3, "{row:?} {truth}");
            // The model's own accuracy is a thousandth of the box.
            covered += usize::from((row[0] - truth).abs() <= row[1] + 3.5e-3);
            reached += 1;
        }
        assert_eq!(reached, if more.is_empty() { 3000 } else { 100 });
        assert!(50 * covered >= 49 * reached, "{covered} of {reached}");
    }
}

#[test]
fn ends_far_from_a_model_are_warned_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let [cloud, model, pairs] =
        ["sphere.xyz", "sphere.taut", "pairs.txt"].map(|name| folder.path().join(name));
    sphere(&cloud);
    let [cloud, model, pairs] = [&cloud, &model, &pairs].map(|file| file.to_str().expect("UTF-8"));
    assert_eq!(code(&taut(&["fit", cloud, "-o", model])), 0);
    let far = ["path", model, "--from", "1.3,0,0", "--to", "0,1,0"];
    let found = object(&taut(&[&far[..], &["--json"]].concat()), 0);
    assert!((number(&found["from"], "moved") - 0.3).abs() < 1e-2);
    let warning = found["from"]["warning"].as_str().expect("a warning");
    assert!(warning.contains("from the model"), "{warning}");
    assert!(found["to"].get("warning").is_none());
    let told = taut(&far);
    assert!(text(&told.stdout).contains("warning"));
    std::fs::write(pairs, "1.3 0 0 0 1 0\n1 0 0 0 1 0\n").expect("written");
    let told = taut(&["path", model, "--pairs", pairs]);
    assert_eq!(code(&told), 0, "{}", text(&told.stderr));
    assert_eq!(text(&told.stderr).matches("from the model").count(), 1);
}

#[test]
fn a_damaged_chart_is_named_by_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let [cloud, model] = ["sphere.xyz", "sphere.taut"].map(|name| folder.path().join(name));
    sphere(&cloud);
    let [cloud, model] = [&cloud, &model].map(|file| file.to_str().expect("UTF-8"));
    assert_eq!(code(&taut(&["fit", cloud, "-o", model])), 0);
    let good = std::fs::read_to_string(model).expect("written");
    let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
    // Heights a million times as high; an empty line counts as one.
    lines[4] = lines[4].replacen("\"scale\":0.", "\"scale\":0.00", 1);
    lines.insert(2, String::new());
    std::fs::write(model, lines.join("\n")).expect("written");
    let at = ["field", model, "--source", "1,0,0", "--at", cloud];
    let refused = taut(&at);
    assert_eq!(code(&refused), 3);
    let said = text(&refused.stderr);
    assert!(
        said.contains("line 6") && said.contains("chart 3: found scale"),
        "{said}"
    );
}
