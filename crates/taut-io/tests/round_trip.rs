//! What is written reads back to the same bits.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;

use taut_io::{
    Column, PointSet, PointTable, Polyline, ReadOptions, WriteError, read, write_points,
    write_polylines, write_table,
};

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
        level: None,
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
fn levels_of_isolines_stand_beside_the_length() {
    let folder = tempfile::tempdir().unwrap();
    let lines = paths().map(|path| Polyline {
        normals: None,
        level: Some(0.1),
        ..path
    });
    let text = |extension: &str, lines: &[Polyline<'_>]| {
        let file = folder.path().join("lines").with_extension(extension);
        write_polylines(&file, lines).unwrap();
        String::from_utf8_lossy(&std::fs::read(&file).unwrap()).into_owned()
    };
    for (extension, told) in [
        ("csv", "path,arc_length,level,x,y,z\n0,0.0,0.1,"),
        ("json", r#""level":0.1"#),
        ("ply", "property double arc_length\nproperty double level\n"),
        ("vtk", "SCALARS level double 1"),
        ("vtp", r#"Name="level""#),
    ] {
        assert!(text(extension, &lines).contains(told), "{extension}");
        assert!(!text(extension, &[lines[0], paths()[1]]).contains("level double"));
        assert!(!text(extension, &paths()).contains("level"), "{extension}");
    }
    let file = folder.path().join("lines.ply");
    write_polylines(&file, &lines).unwrap();
    assert_eq!(bits(&load(&file).coordinates), bits(&POINTS));
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

const DISTANCES: [f64; 5] = [0.0, 0.1, f64::INFINITY, 1.0 / 3.0, 2.0];
const SOURCES: [f64; 5] = [0.0, 1.0, -1.0, 0.0, 1.0];
const COLUMNS: [Column<'static>; 2] = [
    Column {
        name: "distance",
        values: &DISTANCES,
    },
    Column {
        name: "source",
        values: &SOURCES,
    },
];

fn table() -> PointTable<'static> {
    PointTable {
        dimension: 3,
        coordinates: &POINTS,
        normals: None,
        columns: &COLUMNS,
        colours: Some(&[[1, 2, 3]; 5]),
    }
}

#[test]
fn columns_stand_beside_the_points() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["ply", "csv"] {
        let file = folder.path().join("table").with_extension(extension);
        write_table(&file, &table(), None, None).unwrap();
        assert_eq!(bits(&load(&file).coordinates), bits(&POINTS), "{extension}");
    }
    let text = fs::read_to_string(folder.path().join("table.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("x,y,z,distance,source"));
    assert!(lines.nth(2).is_some_and(|line| line.ends_with(",inf,-1.0")));
    let bytes = fs::read(folder.path().join("table.ply")).unwrap();
    let body = bytes.len() - 5 * (5 * 8 + 3);
    let header = String::from_utf8_lossy(&bytes[..body]);
    assert!(
        header.ends_with("property uchar blue\nend_header\n"),
        "{header}"
    );
    assert_eq!(bytes[body + 24..][..8], DISTANCES[0].to_le_bytes());
    assert_eq!(bytes[body + 40..][..3], [1, 2, 3]);
    let file = folder.path().join("table.npy");
    write_table(&file, &table(), None, None).unwrap();
    let bytes = fs::read(&file).unwrap();
    assert!(String::from_utf8_lossy(&bytes[..128]).contains("'shape': (5,)"));
    assert!(bytes[128..].chunks(8).eq(DISTANCES.map(f64::to_le_bytes)));
    let file = folder.path().join("table.vtp");
    write_table(&file, &table(), None, None).unwrap();
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.contains(r#"Name="distance""#) && text.contains(r#"NumberOfVerts="5""#));
}

/// The records of another file keep all that they have.
#[test]
fn las_gains_dimensions() {
    let folder = tempfile::tempdir().unwrap();
    let original = folder.path().join("scan.las");
    let mut writer = las::Writer::from_path(&original, las::Header::default()).unwrap();
    for i in 0..6 {
        let point = las::Point {
            x: f64::from(i),
            intensity: 100 + i as u16,
            ..las::Point::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
    for (name, rows) in [("part.las", [0, 1, 2, 4, 5]), ("part.laz", [1, 2, 3, 4, 5])] {
        let file = folder.path().join(name);
        write_table(&file, &table(), Some(&original), Some(&rows)).unwrap();
        let mut reader = las::Reader::from_path(&file).unwrap();
        let described = reader.header().vlrs().iter().any(|vlr| {
            vlr.record_id == 4
                && vlr.data.len() == 2 * 192
                && vlr.data[4..].starts_with(b"distance\0")
        });
        assert!(described, "{name}");
        let records = reader.read_points(10).unwrap();
        for (i, record) in records.points().enumerate() {
            let record = record.unwrap();
            assert_eq!(usize::from(record.intensity), 100 + rows[i], "{name}");
            assert_eq!(
                record.extra_bytes[..8],
                DISTANCES[i].to_le_bytes(),
                "{name}"
            );
            assert_eq!(record.extra_bytes[8..], SOURCES[i].to_le_bytes(), "{name}");
        }
        assert_eq!(records.len(), 5);
    }
    let refused = write_table(&folder.path().join("new.las"), &table(), None, None);
    assert!(matches!(refused, Err(WriteError::Original { .. })));
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
        level: None,
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
