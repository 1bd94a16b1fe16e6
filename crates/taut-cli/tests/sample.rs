//! `taut sample`.

mod support;

use support::{code, number, object, taut, text};

#[test]
fn points_are_written_and_told_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("points.csv");
    let picture = folder.path().join("points.png");
    let [file, picture] = [&file, &picture].map(|path| path.to_str().expect("UTF-8"));
    let told = object(
        &taut(&[
            "sample",
            "--shape",
            "ellipsoid:3,2,1",
            "-n",
            "400",
            "--source",
            "3,0,0",
            "--json",
            "-o",
            file,
            "--picture",
            picture,
        ]),
        0,
    );
    assert_eq!(number(&told, "points"), 400.0);
    assert!(number(&told, "density_follows_curvature") > 0.8);
    assert!(number(&told, "spread") < 0.4);
    let written = std::fs::read_to_string(file).expect("written");
    let rows: Vec<Vec<f64>> = written
        .lines()
        .skip(1)
        .map(|row| {
            row.split(',')
                .map(|v| v.parse().expect("a number"))
                .collect()
        })
        .collect();
    assert_eq!((rows.len(), &rows[0][..3]), (400, &[3.0, 0.0, 0.0][..]));
    for row in &rows {
        let [x, y, z] = [row[0] / 3.0, row[1] / 2.0, row[2]];
        assert!((x * x + y * y + z * z - 1.0).abs() < 1e-9);
        // The normal: along (x / 9, y / 4, z).
        let slope = [row[0] / 9.0, row[1] / 4.0, row[2]];
        let size = slope.iter().map(|s| s * s).sum::<f64>().sqrt();
        let along: f64 = slope.iter().zip(&row[3..]).map(|(s, n)| s * n / size).sum();
        assert!((along.abs() - 1.0).abs() < 1e-9);
    }
    assert!(std::fs::metadata(picture).expect("drawn").len() > 1000);
}

/// The six tips of the axes among other points of the sphere: from one of them the farthest is the
/// opposite, then the others.
#[test]
fn farthest_points_are_far_from_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sphere.xyz");
    let mut points = support::sphere(3000, [0.0; 3], 2);
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut tip = [0.0; 3];
            tip[axis] = sign;
            points.push(tip);
        }
    }
    support::write_points(&file, &points);
    let file = file.to_str().expect("UTF-8");
    let arguments = [
        "sample",
        file,
        "-n",
        "6",
        "--farthest",
        "--source",
        "3000",
        "--json",
    ];
    let told = object(&taut(&arguments), 0);
    let rows: Vec<usize> = told["rows"]
        .as_array()
        .expect("rows")
        .iter()
        .map(|row| row.as_u64().expect("a row") as usize)
        .collect();
    assert_eq!(rows[..2], [3000, 3001]);
    let angle = |a: usize, b: usize| {
        let cosine: f64 = (0..3).map(|i| points[a][i] * points[b][i]).sum();
        cosine.clamp(-1.0, 1.0).acos()
    };
    for (i, a) in rows.iter().enumerate() {
        for b in &rows[..i] {
            assert!(angle(*a, *b) > 1.2, "{rows:?}");
        }
    }
    let cover = (0..points.len())
        .map(|i| rows.iter().map(|row| angle(*row, i)).fold(4.0, f64::min))
        .fold(0.0, f64::max);
    assert!(
        (number(&told, "cover") - cover).abs() < 1e-3,
        "{told} {cover}"
    );
    let refused = taut(&["sample", "--shape", "sphere:1", "-n", "6", "--farthest"]);
    assert_eq!(code(&refused), 2);
}

#[test]
fn the_seed_alone_chooses_the_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let sampled = |seed: &str, threads: &str, name: &str| {
        let file = folder.path().join(name);
        let path = file.to_str().expect("UTF-8");
        let output = taut(&[
            "sample",
            "--implicit",
            "x^4+y^4+z^4=1",
            "-n",
            "150",
            "--uniform",
            "--seed",
            seed,
            "--threads",
            threads,
            "-o",
            path,
        ]);
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let note = "without --bounds";
        assert!(
            text(&output.stderr).contains(note),
            "nothing is assumed in silence"
        );
        std::fs::read(file).expect("written")
    };
    let first = sampled("7", "1", "a.xyz");
    assert_eq!(first, sampled("7", "3", "b.xyz"));
    assert_ne!(first, sampled("8", "1", "c.xyz"));
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    for (arguments, expected, word) in [
        (&["-n", "10"][..], 2, "--implicit"),
        (&["--shape", "sphere:1"], 2, "--count"),
        (&["--shape", "sphere:1", "-n", "0"], 2, "0"),
        (
            &["--shape", "sphere:1", "-n", "9", "--source", "1"],
            3,
            "coordinates",
        ),
        (
            &["--shape", "sphere:1", "-n", "9", "--source", "1,0"],
            3,
            "3 coordinates",
        ),
        (
            &["--implicit", "z=0*x", "-n", "900", "--source", "1,0,0"],
            3,
            "bound the part",
        ),
        (&["--implicit", "x^2+y^2+z^2=-1", "-n", "9"], 2, "--bounds"),
        (
            &[
                "--implicit",
                "x^2+y^2+z^2=1",
                "-n",
                "9",
                "--source",
                "0,0,0",
            ],
            3,
            "pulled back",
        ),
    ] {
        let all: Vec<&str> = ["sample"].iter().chain(arguments).copied().collect();
        let output = taut(&all);
        let told = text(&output.stderr);
        assert_eq!(code(&output), expected, "{arguments:?}: {told}");
        assert!(told.contains(word), "{arguments:?}: {told}");
    }
}

#[test]
fn surfaces_of_higher_codimension_are_sampled() {
    let told = object(
        &taut(&[
            "sample",
            "--implicit",
            "x1^2+x2^2=1",
            "--implicit",
            "x3^2+x4^2=1",
            "-n",
            "300",
            "--json",
        ]),
        0,
    );
    // 300 points on a lattice of triangles of area (2 pi)^2.
    let lattice = (std::f64::consts::TAU.powi(2) / 300.0 * 2.0 / 3.0_f64.sqrt()).sqrt();
    let nearest = number(&told, "nearest");
    assert!(
        nearest > 0.85 * lattice && nearest < 1.01 * lattice,
        "{nearest} {lattice}"
    );
}
