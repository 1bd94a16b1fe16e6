//! No bytes whatever make a reader panic, hang, or ask for memory that the file does not justify.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Cursor;
use std::sync::LazyLock;

use proptest::prelude::*;
use taut_io::{
    Content, Format, Polyline, ReadOptions, check_output, read, read_pairs_from, write_polylines,
};

/// The names of all formats.
static NAMES: LazyLock<Vec<String>> = LazyLock::new(|| {
    Format::extensions()
        .split(", ")
        .map(str::to_owned)
        .collect()
});

/// Reads `bytes` as the format called `name`, for the sake of ending; the answer is checked for its
/// shape.
fn feed(name: &str, bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("input");
    std::fs::write(&file, bytes).unwrap();
    let format: Option<Format> = name.parse().ok();
    assert!(format.is_some(), "{name}");
    match read(
        &file,
        &ReadOptions {
            format,
            ..ReadOptions::default()
        },
    ) {
        Ok(points) => {
            assert!(points.dimension >= 2 && points.rows() > 0);
            assert_eq!(points.coordinates.len(), points.rows() * points.dimension);
            assert!(
                points
                    .normals
                    .is_none_or(|normals| normals.len() == points.coordinates.len())
            );
            assert!(points.rows_kept.is_none_or(|rows| rows.is_sorted()));
        }
        Err(error) => assert!(error.to_string().contains("input")),
    }
}

/// Nine points of the point format 1 (LAS 1.2) or 6 (LAS 1.4).
fn las(format: u8, compressed: bool) -> Vec<u8> {
    let mut builder = las::Builder::from((1, if format < 6 { 2 } else { 4 }));
    builder.point_format = las::point::Format::new(format).unwrap();
    builder.point_format.is_compressed = compressed;
    if format >= 6 {
        builder.evlrs.push(las::Vlr {
            data: vec![1; 9],
            ..las::Vlr::default()
        });
    }
    let mut writer =
        las::Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    for index in 0..9 {
        let x = f64::from(index);
        writer
            .write_point(las::Point {
                x,
                y: x * x,
                z: 0.5,
                gps_time: Some(x),
                ..las::Point::default()
            })
            .unwrap();
    }
    writer.into_inner().unwrap().into_inner()
}

fn e57() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = e57::E57Writer::new(&mut bytes, "file").unwrap();
    let prototype = vec![
        e57::Record::CARTESIAN_X_F64,
        e57::Record::CARTESIAN_Y_F64,
        e57::Record::CARTESIAN_Z_F64,
        e57::Record {
            name: e57::RecordName::CartesianInvalidState,
            data_type: e57::RecordDataType::Integer { min: 0, max: 2 },
        },
    ];
    let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
    scan.set_transform(Some(e57::Transform {
        rotation: e57::Quaternion {
            w: 0.5_f64.sqrt(),
            x: 0.0,
            y: 0.0,
            z: 0.5_f64.sqrt(),
        },
        translation: e57::Translation {
            x: 10.0,
            y: 0.0,
            z: 0.0,
        },
    }));
    for index in 0..4 {
        let x = e57::RecordValue::Double(f64::from(index));
        let zero = e57::RecordValue::Double(0.0);
        let state = e57::RecordValue::Integer(if index == 1 { 2 } else { 0 });
        scan.add_point(vec![x, zero.clone(), zero, state]).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    bytes.into_inner()
}

fn written(extension: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(format!("path.{extension}"));
    let path = Polyline {
        dimension: 3,
        points: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        normals: Some(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]),
        arc_length: &[0.0, 1.0],
        level: None,
    };
    write_polylines(&file, &[path]).unwrap();
    std::fs::read(&file).unwrap()
}

const PCD: &str = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ";

/// A well-formed file of each format, by the format's name.
fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let pcd = |data: &str, body: &[u8]| [PCD.as_bytes(), data.as_bytes(), b"\n", body].concat();
    let ply_text = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int a\nelement vertex 1\n\
                    property float x\nproperty float y\nproperty float z\nend_header\n3 0 0 0\n1 2 3\n";
    let stl_text = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\nendsolid s\n";
    let stl_binary = [vec![0; 80], vec![1, 0, 0, 0], vec![7; 50]].concat();
    let compressed = [
        &14_u32.to_le_bytes()[..],
        &12_u32.to_le_bytes(),
        &[1, 0, 0, 0x20, 1, 0x20, 1, 0, 9, 0x20, 4, 1, 2, 3],
    ]
    .concat();
    vec![
        ("ply", written("ply")),
        ("ply", ply_text.into()),
        ("obj", written("obj")),
        ("off", b"NOFF\n1 1 0\n1 2 3 0 0 1\n1 0\n".to_vec()),
        ("stl", stl_text.into()),
        ("stl", stl_binary),
        ("xyz", b"1 2 3 0 0 1\n4 5 6 0 1 0\n".to_vec()),
        ("csv", written("csv")),
        ("pcd", pcd("ascii", b"1 2 3\n")),
        ("pcd", pcd("binary", &[0; 12])),
        ("pcd", pcd("binary_compressed", &compressed)),
        ("las", las(6, false)),
        ("las", las(6, true)),
        ("las", las(1, false)),
        ("las", las(1, true)),
        ("e57", e57()),
        ("npy", written("npy")),
    ]
}

/// Renews the sum of each of an E57 file's pages, so that what was changed reaches the reader.
fn reseal(bytes: &mut [u8]) {
    const PAGE: usize = 1024;
    const CASTAGNOLI: u32 = 0x82f6_3b78;
    for page in bytes.chunks_exact_mut(PAGE) {
        let (data, sum) = page.split_at_mut(PAGE - 4);
        let crc = !data.iter().fold(u32::MAX, |crc, byte| {
            let byte_in = crc ^ u32::from(*byte);
            (0..8).fold(byte_in, |crc, _| {
                crc >> 1 ^ if crc & 1 == 1 { CASTAGNOLI } else { 0 }
            })
        });
        sum.copy_from_slice(&crc.to_be_bytes());
    }
}

#[test]
fn resealing_changes_nothing_in_a_whole_file() {
    let mut bytes = e57();
    reseal(&mut bytes);
    assert_eq!(bytes, e57());
}

#[test]
fn seeds_are_well_formed() {
    for (name, bytes) in seeds() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("seed.{name}"));
        std::fs::write(&file, &bytes).unwrap();
        let read = read(&file, &ReadOptions::default());
        // The compressed body is only nearly right: it is there to be changed.
        assert!(
            read.is_ok() || bytes.windows(17).any(|word| word == b"binary_compressed"),
            "{read:?}"
        );
    }
}

#[test]
fn poses_move_points_and_invalid_ones_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scan.e57");
    std::fs::write(&file, e57()).unwrap();
    let points = read(&file, &ReadOptions::default()).unwrap();
    assert_eq!(points.rows_kept, Some(vec![0, 2, 3]));
    // A quarter turn about z, then 10 along x: (2, 0, 0) goes to (10, 2, 0).
    for (found, truth) in points.coordinates[3..6].iter().zip([10.0, 2.0, 0.0]) {
        assert!((found - truth).abs() < 1e-15);
    }
    assert_eq!(points.notes.len(), 1);
}

#[test]
fn las_keeps_nine_points_compressed_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.las");
    for (format, compressed) in [(1, false), (1, true), (6, false), (6, true)] {
        std::fs::write(&file, las(format, compressed)).unwrap();
        let points = read(&file, &ReadOptions::default()).unwrap();
        assert_eq!(points.rows(), 9);
        assert_eq!(points.coordinates[15..18], [5.0, 25.0, 0.5]);
    }
}

#[test]
fn chunk_tables_that_end_too_soon_are_told() {
    let name = b"laszip encoded";
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.laz");
    for (format, count) in [(1, 107), (6, 247)] {
        let mut bytes = las(format, true);
        let vlr = bytes
            .windows(name.len())
            .position(|word| word == name)
            .unwrap();
        // Behind the record's reserved number and name: the rest of its header, then 12 bytes
        // before the chunk size.
        let chunk_size = vlr - 2 + 54 + 12;
        bytes[chunk_size..chunk_size + 4].fill(0xff);
        bytes[107] = 0;
        bytes[count] = 200;
        bytes.extend([0; 4096]);
        std::fs::write(&file, bytes).unwrap();
        let error = read(&file, &ReadOptions::default()).unwrap_err();
        let message = error.to_string();
        assert!(message.contains("declared 200"), "{message}");
        println!("{message}");
    }
}

/// Bits that say so many times that a GPS time belongs to another sequence: `symbol` of a model of
/// so many.
fn endless(symbols: u32, symbol: u32, times: usize) -> Vec<u8> {
    let mut encoder = laz::encoders::ArithmeticEncoder::new(Vec::new());
    let mut builder = laz::models::ArithmeticModelBuilder::new(symbols);
    let mut model = builder.with_compression(true).build();
    for _ in 0..times {
        encoder.encode_symbol(&mut model, symbol).unwrap();
    }
    encoder.done().unwrap();
    encoder.into_inner()
}

/// Times of records one after the other that are said to belong to another sequence without end.
struct Endless;

impl laz::record::FieldCompressor<Vec<u8>> for Endless {
    fn size_of_field(&self) -> usize {
        8
    }

    fn compress_first(&mut self, out: &mut Vec<u8>, bytes: &[u8]) -> std::io::Result<()> {
        out.extend(bytes);
        Ok(())
    }

    fn compress_with(
        &mut self,
        encoder: &mut laz::encoders::ArithmeticEncoder<Vec<u8>>,
        _: &[u8],
    ) -> std::io::Result<()> {
        let mut builder = laz::models::ArithmeticModelBuilder::new(6);
        let mut model = builder.with_compression(true).build();
        for _ in 0..STEPS {
            encoder.encode_symbol(&mut model, 3)?;
        }
        Ok(())
    }
}

const STEPS: usize = 10_000_000;

#[test]
fn times_that_go_from_sequence_to_sequence_without_end_are_told() {
    use laz::record::RecordCompressor;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.laz");
    let points_at = |bytes: &[u8]| u32::from_le_bytes(*bytes[96..].first_chunk().unwrap()) as usize;
    // Records one after the other.
    let mut packed = laz::record::SequentialPointRecordCompressor::new(Vec::new());
    packed.add_field_compressor(laz::las::v2::LasPoint0Compressor::default());
    packed.add_field_compressor(Endless);
    packed.compress_next(&[0; 28]).unwrap();
    packed.compress_next(&[0; 28]).unwrap();
    packed.done().unwrap();
    let mut bytes = las(1, true);
    let start = points_at(&bytes);
    bytes.truncate(start + 8);
    bytes.extend(Box::new(packed).box_into_inner());
    let table_at = bytes.len() as u64;
    bytes[start..start + 8].copy_from_slice(&table_at.to_le_bytes());
    bytes.extend([0; 8]);
    std::fs::write(&file, &bytes).unwrap();
    let message = read(&file, &ReadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("without end") && message.contains("byte offset"),
        "{message}"
    );

    // Records in layers: places are read all the same, and the records are not copied.
    let mut bytes = las(6, true);
    let start = points_at(&bytes);
    let sizes = start + 8 + 30 + 4;
    let size = |bytes: &[u8], layer: usize| {
        u32::from_le_bytes(*bytes[sizes + 4 * layer..].first_chunk().unwrap()) as usize
    };
    let times_at = sizes + 36 + (0..8).map(|layer| size(&bytes, layer)).sum::<usize>();
    let times = endless(5, 4, STEPS);
    let before = size(&bytes, 8);
    bytes.splice(times_at..times_at + before, times.iter().copied());
    bytes[sizes + 32..sizes + 36].copy_from_slice(&(times.len() as u32).to_le_bytes());
    let grown = times.len() as i64 - before as i64;
    for at in [start, 235] {
        let moved = i64::from_le_bytes(*bytes[at..].first_chunk().unwrap()) + grown;
        bytes[at..at + 8].copy_from_slice(&moved.to_le_bytes());
    }
    std::fs::write(&file, &bytes).unwrap();
    let points = read(&file, &ReadOptions::default()).unwrap();
    assert_eq!(points.coordinates[24..], [8.0, 64.0, 0.5]);
    let content = Content::Table {
        original: Some(&file),
        columns: 1,
    };
    let message = check_output(&folder.path().join("out.las"), content, None)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("without end") && message.contains(&format!("byte offset {times_at}")),
        "{message}"
    );
}

#[test]
fn layers_that_end_behind_the_file_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.laz");
    let mut bytes = las(6, true);
    let start = u32::from_le_bytes(*bytes[96..].first_chunk().unwrap()) as usize;
    let sizes = start + 8 + 30 + 4;
    bytes[sizes + 4..sizes + 8].copy_from_slice(&0xf000_0000_u32.to_le_bytes());
    std::fs::write(&file, &bytes).unwrap();
    let message = read(&file, &ReadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("layers of 402"), "{message}");
}

proptest! {
    #[test]
    fn random_bytes_end(name in prop::sample::select(NAMES.clone()), bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        feed(&name, &bytes);
    }

    #[test]
    fn changed_files_end(
        seed in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        end in prop::option::of(any::<prop::sample::Index>()),
    ) {
        static SEEDS: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(seeds);
        let (name, mut bytes) = SEEDS[seed.index(SEEDS.len())].clone();
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if name == "e57" {
            reseal(&mut bytes);
        }
        if let Some(end) = end {
            bytes.truncate(end.index(bytes.len() + 1));
        }
        feed(name, &bytes);
    }

    #[test]
    fn random_pairs_end(text in "[0-9a-z.,;# \\n-]{0,80}") {
        if let Err(error) = read_pairs_from(text.as_bytes(), "pairs") {
            prop_assert!(error.to_string().contains("pairs"));
        }
    }
}
