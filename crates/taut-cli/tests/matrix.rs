//! `taut matrix` against closed forms, and cut off at random moments.

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use support::{angle, code, number, object, sphere, taut, text, write_points};

/// A matrix as the file has it: header of version 1, then float64.
struct Matrix {
    columns: usize,
    values: Vec<f64>,
}

impl Matrix {
    fn read(file: &Path, rows: usize, columns: usize) -> Self {
        let values = array(
            &fs::read(file).expect("a matrix"),
            "<f8",
            &format!("({rows}, {columns})"),
        );
        let values: Vec<f64> = values
            .chunks_exact(8)
            .map(|v| f64::from_le_bytes(v.try_into().expect("8")))
            .collect();
        assert_eq!(values.len(), rows * columns);
        Self { columns, values }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.values[i * self.columns + j]
    }
}

/// What follows the header of an array of this type and shape.
fn array(bytes: &[u8], kind: &str, shape: &str) -> Vec<u8> {
    assert_eq!(bytes[..8], *b"\x93NUMPY\x01\x00");
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(start % 64, 0);
    let header = text(&bytes[10..start]);
    let expected = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    assert_eq!(header.trim_end(), expected);
    bytes[start..].to_vec()
}

/// A sphere in a file and rows of it in another.
struct Case {
    folder: tempfile::TempDir,
    points: Vec<[f64; 3]>,
    rows: Vec<usize>,
}

impl Case {
    fn new(count: usize, sources: usize) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let points = sphere(count, [0.0; 3], 11);
        write_points(&folder.path().join("sphere.xyz"), &points);
        let rows: Vec<usize> = (0..sources)
            .map(|i| 7 + i * (count / sources - 1))
            .collect();
        let lines: Vec<String> = rows.iter().map(usize::to_string).collect();
        fs::write(folder.path().join("rows.txt"), lines.join("\n")).expect("written");
        Self {
            folder,
            points,
            rows,
        }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The arguments of a run whose files are in the folder; names that begin with @ are files there.
    fn arguments(&self, more: &[&str]) -> Vec<String> {
        ["matrix", "@sphere.xyz", "--sources", "@rows.txt", "--quiet"]
            .iter()
            .chain(more)
            .map(|argument| match argument.strip_prefix('@') {
                Some(name) => self.file(name).to_str().expect("UTF-8").to_owned(),
                None => (*argument).to_owned(),
            })
            .collect()
    }

    fn run(&self, more: &[&str]) -> std::process::Output {
        let arguments = self.arguments(more);
        taut(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
    }

    fn truth(&self, i: usize, j: usize) -> f64 {
        angle(self.points[self.rows[i]], self.points[self.rows[j]])
    }
}

#[test]
fn a_sphere_is_symmetric_and_true() {
    let case = Case::new(3000, 40);
    let output = case.run(&["-o", "@D.npy", "--errors", "@E.npy", "--json"]);
    let facts = object(&output, 0);
    assert_eq!(number(&facts, "pairs"), 780.0);
    for counted in ["no_path", "not_converged", "unknown"] {
        assert_eq!(number(&facts, counted), 0.0, "{facts}");
    }
    let lengths = Matrix::read(&case.file("D.npy"), 40, 40);
    let errors = Matrix::read(&case.file("E.npy"), 40, 40);
    let mut largest: f64 = 0.0;
    for i in 0..40 {
        assert_eq!((lengths.at(i, i), errors.at(i, i)), (0.0, 0.0));
        for j in 0..i {
            assert_eq!(lengths.at(i, j), lengths.at(j, i));
            assert_eq!(errors.at(i, j), errors.at(j, i));
            let error = (lengths.at(i, j) - case.truth(i, j)).abs();
            assert!(
                error <= errors.at(i, j),
                "{error:e} is above {:e}",
                errors.at(i, j)
            );
            assert!(errors.at(i, j) < 1e-4);
            largest = largest.max(errors.at(i, j) / lengths.at(i, j));
        }
    }
    assert_eq!(number(&facts, "largest_error"), largest);
    let left: Vec<_> = fs::read_dir(case.folder.path())
        .expect("a folder")
        .collect();
    assert_eq!(left.len(), 4, "{left:?}");
}

#[test]
fn other_columns_and_coordinates() {
    let case = Case::new(3000, 35);
    let ends = [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, -1.0, 0.0]];
    write_points(&case.file("ends.xyz"), &ends);
    let output = case.run(&["--to", "@ends.xyz", "-o", "@D.npy", "--json"]);
    assert_eq!(number(&object(&output, 0), "pairs"), 105.0);
    let lengths = Matrix::read(&case.file("D.npy"), 35, 3);
    for i in 0..35 {
        for (j, end) in ends.iter().enumerate() {
            let truth = angle(case.points[case.rows[i]], *end);
            assert!((lengths.at(i, j) - truth).abs() < 1e-4 * truth);
        }
    }
    let file = case.file("ends.xyz");
    let shape = [
        "matrix",
        "--shape",
        "sphere:1",
        "--sources",
        file.to_str().expect("UTF-8"),
    ];
    let target = case.file("S.npy");
    let found = taut(
        &[
            &shape[..],
            &["--tol", "1e-9", "-o", target.to_str().expect("UTF-8")],
        ]
        .concat(),
    );
    assert_eq!(code(&found), 0, "{}", text(&found.stderr));
    assert!(
        text(&found.stdout).contains("pairs                   3"),
        "{}",
        text(&found.stdout)
    );
    let lengths = Matrix::read(&target, 3, 3);
    for i in 0..3 {
        for j in 0..3 {
            assert!((lengths.at(i, j) - angle(ends[i], ends[j])).abs() < 1e-8);
        }
    }
}

#[test]
fn the_far_side_of_a_gap_is_infinitely_far_and_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let mut points = sphere(500, [0.0; 3], 1);
    points.extend(sphere(500, [5.0, 0.0, 0.0], 2));
    write_points(Path::new(&file("two.xyz")), &points);
    fs::write(file("rows.txt"), "0\n1\n700\n").expect("written");
    let run = |more: &[&str]| {
        let surface = [
            "matrix",
            &file("two.xyz"),
            "--sources",
            &file("rows.txt"),
            "--json",
        ];
        object(
            &taut(&[&surface, more].concat()),
            if more.contains(&"--radius") { 0 } else { 4 },
        )
    };
    let facts = run(&["-o", &file("D.npy"), "--errors", &file("E.npy")]);
    assert_eq!(number(&facts, "no_path"), 2.0);
    let lengths = Matrix::read(Path::new(&file("D.npy")), 3, 3);
    let errors = Matrix::read(Path::new(&file("E.npy")), 3, 3);
    for (i, j) in [(0, 2), (2, 1)] {
        assert!(lengths.at(i, j) == f64::INFINITY && errors.at(i, j).is_nan());
    }
    assert!(lengths.at(0, 1) <= std::f64::consts::PI && lengths.at(2, 2) == 0.0);
    assert_eq!(
        number(&run(&["--radius", "9", "-o", &file("D.npz")]), "pairs"),
        1.0
    );
}

/// Everything in a folder.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(contents(&path));
        } else {
            found.insert(path.clone(), fs::read(&path).expect("a file"));
        }
    }
    found
}

/// Starts a run and kills it after a time; whether it had ended by itself.
fn killed_after(arguments: &[String], time: Duration) -> bool {
    let mut child = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(arguments)
        .stdout(Stdio::null())
        .spawn()
        .expect("the command starts");
    std::thread::sleep(time);
    let ended = child.try_wait().expect("a child");
    if ended.is_none() {
        child.kill().expect("killed");
        child.wait().expect("dead");
    }
    ended
        .inspect(|status| assert!(status.success(), "{status}"))
        .is_some()
}

/// Kills a run again and again; the number of kills that it took.
fn worn_down(case: &Case, random: &mut Pcg64, undisturbed: Duration, more: &[&str]) -> usize {
    for kills in 0.. {
        let threads = if kills % 2 == 0 { "1" } else { "2" };
        let arguments = case.arguments(&[more, &["--threads", threads]].concat());
        let share = 0.1 + 0.5 * random.random::<f64>();
        // A run that is killed too early each time would never end.
        let patience = 1.0 + 0.1 * kills as f64;
        if killed_after(&arguments, undisturbed.mul_f64(share * patience)) {
            return kills;
        }
    }
    unreachable!("the loop has no end")
}

#[test]
fn killed_at_random_moments_it_ends_with_the_same_bytes() {
    let case = Case::new(2000, 100);
    let mut random = Pcg64::seed_from_u64(5);
    let mut most = 0;
    for files in [
        ["-o", "@D.npy", "--errors", "@E.npy", "--paths", "@paths"].to_vec(),
        ["-o", "@D.npz", "--errors", "@E.npz", "--radius", "0.5"].to_vec(),
    ] {
        let start = std::time::Instant::now();
        let whole = case.run(&[&files[..], &["--threads", "2", "--json"]].concat());
        let duration = start.elapsed();
        let facts = object(&whole, 0);
        let expected = contents(case.folder.path());
        for name in ["D.npy", "E.npy", "D.npz", "E.npz"] {
            let _ = fs::remove_file(case.file(name));
        }
        let _ = fs::remove_dir_all(case.file("paths"));
        most = most.max(worn_down(&case, &mut random, duration, &files));
        let found = contents(case.folder.path());
        assert!(found.keys().eq(expected.keys()), "{:?}", found.keys());
        for (path, bytes) in &found {
            assert!(*bytes == expected[path], "{} differs", path.display());
        }
        let again = case.run(&[&files[..4], &["--json"]].concat());
        if files.contains(&"--radius") {
            assert_eq!(code(&again), 2, "an .npz needs a radius");
        } else {
            assert_eq!(object(&again, 0), facts);
        }
        for name in ["D.npy", "E.npy", "D.npz", "E.npz"] {
            let _ = fs::remove_file(case.file(name));
        }
        let _ = fs::remove_dir_all(case.file("paths"));
    }
    assert!(most > 0, "no run was ever killed");
}

#[test]
fn paths_are_those_of_the_pairs() {
    let case = Case::new(2000, 34);
    let output = case.run(&[
        "-o",
        "@D.npy",
        "--paths",
        "@paths",
        "--paths-format",
        "json",
    ]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let lengths = Matrix::read(&case.file("D.npy"), 34, 34);
    let mut seen = 0;
    for name in ["000000-000000", "000000-000032", "000032-000032"] {
        let pairs =
            fs::read_to_string(case.file(&format!("paths/block-{name}.pairs.txt"))).expect("pairs");
        let paths =
            fs::read_to_string(case.file(&format!("paths/block-{name}.json"))).expect("paths");
        let paths: Vec<serde_json::Value> = serde_json::from_str(&paths).expect("JSON");
        let pairs: Vec<&str> = pairs.lines().skip(1).collect();
        assert_eq!(pairs.len(), paths.len());
        for (pair, path) in pairs.iter().zip(&paths) {
            let [i, j] = pair
                .split(' ')
                .map(|index| index.parse().expect("an index"))
                .collect::<Vec<usize>>()[..]
            else {
                panic!("{pair}");
            };
            let along = path["arc_length"].as_array().expect("lengths");
            let length = along[along.len() - 1].as_f64().expect("a length");
            assert!((length - lengths.at(i, j)).abs() < 1e-6 * length);
            let first = path["points"][0].as_array().expect("a point");
            for (axis, coordinate) in first.iter().enumerate() {
                let truth = case.points[case.rows[i]][axis];
                assert!((coordinate.as_f64().expect("a number") - truth).abs() < 1e-2);
            }
            seen += 1;
        }
    }
    assert_eq!(seen, 34 * 33 / 2);
}

/// The numbers of an array of an archive.
fn numbers<T>(
    archive: &[u8],
    name: &str,
    kind: &str,
    shape: &str,
    number: fn([u8; 8]) -> T,
) -> Vec<T> {
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(archive)).expect("an archive");
    let mut bytes = Vec::new();
    archive
        .by_name(name)
        .expect("an array")
        .read_to_end(&mut bytes)
        .expect("read");
    let values = array(&bytes, kind, shape);
    values
        .chunks_exact(8)
        .map(|v| number(v.try_into().expect("8 bytes")))
        .collect()
}

#[test]
fn within_a_radius_the_matrix_is_sparse() {
    let case = Case::new(3000, 60);
    let output = case.run(&[
        "-o", "@D.npz", "--errors", "@E.npz", "--radius", "0.7", "--json",
    ]);
    let facts = object(&output, 0);
    let archive = fs::read(case.file("D.npz")).expect("an archive");
    let integers =
        |name: &str, shape: &str| numbers(&archive, name, "<i8", shape, i64::from_le_bytes);
    assert_eq!(integers("shape.npy", "(2,)"), [60, 60]);
    let starts = integers("indptr.npy", "(61,)");
    let stored = starts[60] as usize;
    assert_eq!(number(&facts, "pairs"), stored as f64 / 2.0);
    let columns = integers("indices.npy", &format!("({stored},)"));
    let values = numbers(
        &archive,
        "data.npy",
        "<f8",
        &format!("({stored},)"),
        f64::from_le_bytes,
    );
    let errors = fs::read(case.file("E.npz")).expect("an archive");
    let errors = numbers(
        &errors,
        "data.npy",
        "<f8",
        &format!("({stored},)"),
        f64::from_le_bytes,
    );
    for i in 0..60 {
        let range = starts[i] as usize..starts[i + 1] as usize;
        let near: Vec<usize> = columns[range.clone()].iter().map(|j| *j as usize).collect();
        let expected: Vec<usize> = (0..60)
            .filter(|j| *j != i && case.truth(i, *j) <= 0.7)
            .collect();
        assert_eq!(near, expected);
        for (at, j) in range.zip(near) {
            let truth = case.truth(i, j);
            assert!(
                (values[at] - truth).abs() <= errors[at],
                "{} is not {truth}",
                values[at]
            );
        }
    }
    assert!(stored > 100 && stored < 1800, "{stored}");
}

#[test]
fn what_does_not_fit_is_refused_with_a_remedy() {
    let case = Case::new(2000, 100);
    let refused = |more: &[&str], expected: i32, words: &[&str]| {
        let output = case.run(more);
        assert_eq!(code(&output), expected, "{}", text(&output.stderr));
        for word in words {
            assert!(
                text(&output.stderr).contains(word),
                "{word} in {}",
                text(&output.stderr)
            );
        }
    };
    refused(&["-o", "@D.npz"], 2, &["D.npz", ".npy"]);
    refused(&["-o", "@D.npy", "--radius", "1"], 2, &["D.npy", ".npz"]);
    refused(&["-o", "@D.npz", "--radius", "-1"], 2, &["--radius"]);
    refused(
        &["-o", "@D.npy", "--errors", "@D.npy"],
        2,
        &["--errors", "another"],
    );
    refused(
        &["-o", "@D.npy", "--paths", "@p", "--paths-format", "npy"],
        2,
        &["npy", "csv"],
    );
    fs::write(case.file("bad.txt"), "1\n2000\n").expect("written");
    refused(&["-o", "@D.npy", "--to", "@bad.txt"], 3, &["2000"]);
    fs::write(case.file("bad.txt"), "1\n-2\n").expect("written");
    refused(
        &["-o", "@D.npy", "--to", "@bad.txt"],
        3,
        &["bad.txt", "line 2"],
    );
    assert!(!case.file("D.npy.journal").exists());
    fs::write(case.file("D.npy.part"), "mine").expect("written");
    refused(&["-o", "@D.npy"], 2, &["D.npy.part", "--restart"]);
    fs::remove_file(case.file("D.npy.part")).expect("removed");

    // A run that was cut off, which one with another tolerance must not go on with.
    let arguments = case.arguments(&["-o", "@D.npy", "--threads", "1"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(&arguments)
        .spawn()
        .expect("started");
    while !fs::read_to_string(case.file("D.npy.journal")).is_ok_and(|text| text.lines().count() > 2)
    {
        std::thread::sleep(Duration::from_millis(1));
    }
    refused(
        &["-o", "@D.npy"],
        2,
        &["D.npy.journal", "another run is writing"],
    );
    child.kill().expect("killed");
    child.wait().expect("dead");
    assert!(!case.file("D.npy").exists() && case.file("D.npy.part").exists());
    refused(
        &["-o", "@D.npy", "--tol", "1e-3"],
        2,
        &["--tol", "1e-6", "0.001", "--restart"],
    );
    fs::remove_file(case.file("D.npy.part")).expect("removed");
    refused(&["-o", "@D.npy"], 2, &["D.npy.part", "--restart"]);
    let again = case.run(&["-o", "@D.npy", "--tol", "1e-3", "--restart"]);
    assert_eq!(code(&again), 0, "{}", text(&again.stderr));
    assert!(!case.file("D.npy.journal").exists());
}
