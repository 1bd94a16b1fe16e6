//! What is written reads back to the same bits.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;

use taut_io::{PointSet, Polyline, ReadOptions, WriteError, read, write_points, write_polylines};

const POINTS: [f64; 15] = [
    0.1,
    -2.5e-300,
    1.0 / 3.0,
    4918340.36,
    f64::MIN_POSITIVE,
    -0.0,
    1e22,
    5e-324,
    0.30000000000000004,
    1.0,
    2.0,
    3.0,
    -1.5,
    f64::MAX,
    7.0,
];
const NORMALS: [f64; 15] = [
    0.0, 0.0, 1.0, 0.6, 0.8, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0,
];
const LENGTHS: [f64; 5] = [0.0, 0.25, 0.1, 0.0, 1e-17];

/// Two paths, of two and three nodes.
fn paths() -> [Polyline<'static>; 2] {
    let part = |nodes: std::ops::Range<usize>| Polyline {
        dimension: 3,
        points: &POINTS[3 * nodes.start..3 * nodes.end],
        normals: Some(&NORMALS[3 * nodes.start..3 * nodes.end]),
        arc_length: &LENGTHS[nodes],
    };
    [part(0..2), part(2..5)]
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn load(file: &Path) -> PointSet {
    read(file, &ReadOptions::default()).unwrap()
}

#[test]
fn paths_come_back_through_our_readers() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["ply", "obj", "csv"] {
        let file = folder.path().join("paths").with_extension(extension);
        write_polylines(&file, &paths()).unwrap();
        let points = load(&file);
        assert_eq!(bits(&points.coordinates), bits(&POINTS), "{extension}");
        assert_eq!(
            points.normals.as_deref().map(bits),
            Some(bits(&NORMALS)),
            "{extension}"
        );
    }
}

#[test]
fn points_come_back_through_our_readers() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["ply", "obj", "csv", "xyz", "npy"] {
        let file = folder.path().join("points").with_extension(extension);
        for normals in [None, Some(&NORMALS[..])] {
            write_points(&file, 3, &POINTS, normals).unwrap();
            let points = load(&file);
            assert_eq!(bits(&points.coordinates), bits(&POINTS), "{extension}");
            let expected = normals.filter(|_| extension != "npy").map(bits);
            assert_eq!(points.normals.as_deref().map(bits), expected, "{extension}");
        }
    }
}

#[test]
fn other_dimensions_come_back() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["csv", "xyz", "npy"] {
        let file = folder.path().join("points").with_extension(extension);
        for dimension in [5, 15] {
            write_points(&file, dimension, &POINTS, None).unwrap();
            let points = load(&file);
            assert_eq!(
                (points.dimension, bits(&points.coordinates)),
                (dimension, bits(&POINTS)),
                "{extension}"
            );
        }
    }
    let five = Polyline {
        dimension: 5,
        points: &POINTS,
        normals: None,
        arc_length: &LENGTHS[..3],
    };
    for extension in ["csv", "npy"] {
        let file = folder.path().join("path").with_extension(extension);
        write_polylines(&file, &[five]).unwrap();
        assert_eq!(load(&file).dimension, 5);
    }
    for extension in ["ply", "obj", "vtk", "vtp"] {
        let file = folder.path().join("flat").with_extension(extension);
        assert!(matches!(
            write_polylines(&file, &[five]),
            Err(WriteError::Dimension { dimension: 5, .. })
        ));
        assert!(!file.exists());
    }
}

#[test]
fn json_holds_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("paths.json");
    write_polylines(&file, &paths()).unwrap();
    let value: serde_json::Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let numbers = |key: &str| -> Vec<f64> {
        let objects = value.as_array().unwrap();
        let rows = objects
            .iter()
            .flat_map(|object| object[key].as_array().unwrap());
        rows.flat_map(|row| match row.as_array() {
            Some(row) => row.iter().map(|number| number.as_f64().unwrap()).collect(),
            None => vec![row.as_f64().unwrap()],
        })
        .collect()
    };
    assert_eq!(numbers("points"), POINTS);
    assert_eq!(numbers("normals"), NORMALS);
    assert_eq!(numbers("arc_length"), LENGTHS);
}

fn numbers(words: &[&str]) -> Vec<f64> {
    words.iter().map(|word| word.parse().unwrap()).collect()
}

#[test]
fn vtk_says_what_vtk_reads() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("paths.vtk");
    write_polylines(&file, &paths()).unwrap();
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.starts_with("# vtk DataFile Version 3.0\n"));
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let behind = |keyword: &str, header: usize, count: usize| {
        let start = words.iter().position(|word| *word == keyword).unwrap() + header;
        &words[start..start + count]
    };
    assert_eq!(behind("POINTS", 1, 2), ["5", "double"]);
    assert_eq!(bits(&numbers(behind("POINTS", 3, 15))), bits(&POINTS));
    assert_eq!(
        behind("LINES", 1, 9),
        ["2", "7", "2", "0", "1", "3", "2", "3", "4"]
    );
    assert_eq!(numbers(behind("LOOKUP_TABLE", 2, 5)), LENGTHS);
    assert_eq!(numbers(behind("NORMALS", 3, 15)), NORMALS);
}

#[test]
fn vtp_says_what_vtk_reads() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("paths.vtp");
    write_polylines(&file, &paths()).unwrap();
    let text = fs::read_to_string(&file).unwrap();
    let array = |name: &str| {
        let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).unwrap();
        let (_, rest) = rest.split_once('>').unwrap();
        rest.split_once("</DataArray>")
            .unwrap()
            .0
            .split_ascii_whitespace()
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(&numbers(&array("points"))), bits(&POINTS));
    assert_eq!(numbers(&array("normals")), NORMALS);
    assert_eq!(numbers(&array("arc_length")), LENGTHS);
    assert_eq!(array("connectivity"), ["0", "1", "2", "3", "4"]);
    assert_eq!(array("offsets"), ["2", "5"]);
    let opened: Vec<&str> = text
        .split('<')
        .filter_map(|tag| tag.split([' ', '>', '\n']).next())
        .collect();
    for name in [
        "VTKFile",
        "PolyData",
        "Piece",
        "PointData",
        "Points",
        "Lines",
        "DataArray",
    ] {
        let count = |wanted: &str| opened.iter().filter(|tag| **tag == wanted).count();
        assert_eq!(count(name), count(&format!("/{name}")), "{name}");
    }
}

#[test]
fn ply_joins_the_nodes_of_each_path() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("paths.ply");
    write_polylines(&file, &paths()).unwrap();
    let bytes = fs::read(&file).unwrap();
    let edges: Vec<i32> = bytes[bytes.len() - 24..]
        .chunks(4)
        .map(|four| i32::from_le_bytes(four.try_into().unwrap()))
        .collect();
    assert_eq!(edges, [0, 1, 2, 3, 3, 4]);
}

#[test]
fn refusals_leave_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("paths.npy");
    fs::write(&file, "old").unwrap();
    let refused = write_polylines(&file, &paths()).unwrap_err();
    assert!(
        matches!(refused, WriteError::OnePathOnly { count: 2, .. }),
        "{refused}"
    );
    let torn = Polyline {
        arc_length: &LENGTHS[..3],
        ..paths()[0]
    };
    assert!(matches!(
        write_polylines(&file, &[torn]),
        Err(WriteError::Shape { .. })
    ));
    assert_eq!(fs::read(&file).unwrap(), b"old");
    let unknown = write_polylines(&folder.path().join("paths.doc"), &paths()).unwrap_err();
    assert!(unknown.to_string().contains(".doc") && unknown.to_string().contains("vtp"));
    let nowhere = folder.path().join("absent").join("paths.ply");
    assert!(matches!(
        write_polylines(&nowhere, &paths()),
        Err(WriteError::Io { .. })
    ));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
