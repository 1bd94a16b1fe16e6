//! Columns of numbers beside the points.

use std::fs;
use std::path::Path;

use taut_io::{Column, PointSet, PointTable, ReadError, ReadOptions, read, write_table};

fn with_column(file: &Path, column: &str) -> Result<PointSet, ReadError> {
    let options = ReadOptions {
        column: Some(column.to_owned()),
        ..ReadOptions::default()
    };
    read(file, &options)
}

/// What an error says was found.
fn refused(file: &Path, column: &str) -> String {
    match with_column(file, column) {
        Err(ReadError::NoColumn {
            found,
            column: named,
            ..
        }) => {
            assert_eq!(named, column);
            found
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn of_text_they_are_named_in_the_first_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.csv");
    fs::write(&file, "label,x,y,Cost,z\na,1,2,0.5,3\nb,4,5,inf,6\n").unwrap();
    let points = with_column(&file, "cost").unwrap();
    assert_eq!(points.coordinates, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(points.column, Some(vec![0.5, f64::INFINITY]));
    assert_eq!(refused(&file, "speed"), "the columns label, Cost");
    assert!(matches!(
        with_column(&file, "label"),
        Err(ReadError::Malformed { .. })
    ));
    fs::write(&file, "1,2,3\n").unwrap();
    assert_eq!(refused(&file, "cost"), "no named columns");
    let file = folder.path().join("points.npy");
    fs::write(&file, "anything").unwrap();
    assert_eq!(refused(&file, "cost"), "no named columns");
}

#[test]
fn of_ply_they_are_properties() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.ply");
    let header = |format: &str| {
        let properties = "property float x\nproperty float y\nproperty uchar speed\nproperty float z\nproperty list uchar int more\nproperty float nx\n";
        format!("ply\nformat {format} 1.0\nelement vertex 2\n{properties}end_header\n")
    };
    fs::write(&file, header("ascii") + "1 2 7 3 0 0\n4 5 9 6 1 8 0\n").unwrap();
    let read = with_column(&file, "speed").unwrap();
    assert_eq!(read.coordinates, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(read.column, Some(vec![7.0, 9.0]));
    for absent in ["more", "x", "none"] {
        assert_eq!(refused(&file, absent), "the columns speed");
    }
    let mut bytes = header("binary_big_endian").into_bytes();
    for [x, y, z] in [[1.0_f32, 2.0, 3.0], [4.0, 5.0, 6.0]] {
        bytes.extend(x.to_be_bytes());
        bytes.extend(y.to_be_bytes());
        bytes.push(3 * z as u8);
        bytes.extend(z.to_be_bytes());
        bytes.extend([1, 0, 0, 0, 9]);
        bytes.extend(0.0_f32.to_be_bytes());
    }
    fs::write(&file, bytes).unwrap();
    let read = with_column(&file, "speed").unwrap();
    assert_eq!(read.coordinates, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(read.column, Some(vec![9.0, 18.0]));
}

#[test]
fn of_las_they_are_the_intensity_and_extra_dimensions() {
    let folder = tempfile::tempdir().unwrap();
    let original = folder.path().join("scan.las");
    // An array without a meaning, then a scaled number that may be absent.
    let mut described = vec![0; 2 * 192];
    described[3] = 3;
    described[4..8].copy_from_slice(b"junk");
    described[192 + 2] = 4;
    described[192 + 3] = 1 | 8 | 16;
    described[192 + 4..][..5].copy_from_slice(b"speed");
    described[192 + 40..][..8].copy_from_slice(&(-999_i64).to_le_bytes());
    described[192 + 112..][..8].copy_from_slice(&0.5_f64.to_le_bytes());
    described[192 + 136..][..8].copy_from_slice(&10.0_f64.to_le_bytes());
    let mut builder = las::Builder::from((1, 4));
    builder.point_format.extra_bytes = 5;
    builder.vlrs.push(las::Vlr {
        user_id: "LASF_Spec".to_owned(),
        record_id: 4,
        description: String::new(),
        data: described,
    });
    let mut writer = las::Writer::from_path(&original, builder.into_header().unwrap()).unwrap();
    for (i, speed) in (0_u16..).zip([4_i16, -6, -999, 8]) {
        let [low, high] = speed.to_le_bytes();
        let point = las::Point {
            x: f64::from(i),
            intensity: 10 * i,
            classification: las::point::Classification::new(2 + (i % 2) as u8).unwrap(),
            extra_bytes: vec![9, 9, 9, low, high],
            ..las::Point::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
    let speeds = with_column(&original, "speed").unwrap().column.unwrap();
    assert_eq!((speeds[0], speeds[1], speeds[3]), (12.0, 7.0, 14.0));
    assert!(speeds[2].is_nan());
    let intensity = with_column(&original, "Intensity").unwrap().column;
    assert_eq!(intensity, Some(vec![0.0, 10.0, 20.0, 30.0]));
    assert_eq!(refused(&original, "junk"), "the columns intensity, speed");
    let some = ReadOptions {
        classes: vec![3],
        column: Some("speed".to_owned()),
        ..ReadOptions::default()
    };
    assert_eq!(
        read(&original, &some).unwrap().column,
        Some(vec![7.0, 14.0])
    );
    let file = folder.path().join("distances.laz");
    let table = PointTable {
        dimension: 3,
        coordinates: &[0.0; 12],
        normals: None,
        columns: &[Column {
            name: "distance",
            values: &[0.25, 0.5, f64::INFINITY, 2.0],
        }],
        colours: None,
    };
    write_table(&file, &table, Some(&original), None).unwrap();
    let distances = with_column(&file, "distance").unwrap().column;
    assert_eq!(distances, Some(vec![0.25, 0.5, f64::INFINITY, 2.0]));
    let speeds = with_column(&file, "speed").unwrap().column.unwrap();
    assert_eq!(speeds[3], 14.0);
}
