//! What was read of a LAS or LAZ file is there in a copy of it with a further column.

use std::path::Path;

use taut_io::{Column, PointSet, PointTable, ReadOptions, read, write_table};

/// Copies of more points take long for what they show.
const MOST: usize = 10_000;

pub fn copies(bytes: &[u8]) {
    for (name, copy) in [("original.las", "copy.las"), ("original.laz", "copy.laz")] {
        let folder = tempfile::tempdir().unwrap();
        let original = folder.path().join(name);
        std::fs::write(&original, bytes).unwrap();
        if let Ok(points) = read(&original, &ReadOptions::default())
            && points.rows() <= MOST
        {
            copied(&points, &original, &folder.path().join(copy));
        }
    }
}

fn copied(points: &PointSet, original: &Path, copy: &Path) {
    let numbers: Vec<f64> = (0..points.rows()).map(|row| row as f64).collect();
    let columns = [Column {
        name: "number",
        values: &numbers,
    }];
    let table = PointTable {
        dimension: 3,
        coordinates: &points.coordinates,
        normals: None,
        columns: &columns,
        colours: None,
    };
    // What cannot be copied as it is, is refused.
    if write_table(copy, &table, Some(original), None).is_err() {
        return;
    }
    let options = ReadOptions {
        column: Some("number".to_owned()),
        ..ReadOptions::default()
    };
    let again = read(copy, &options).unwrap();
    let bits = |points: &PointSet| -> Vec<u64> {
        points
            .coordinates
            .iter()
            .map(|value| value.to_bits())
            .collect()
    };
    assert!(bits(&again) == bits(points), "coordinates differ");
    assert_eq!(again.column, Some(numbers));
}
