//! Readers answer an error or points, as many as the file has room for.

use std::io::Write;
use std::path::Path;

use taut_io::{Format, ReadOptions, read};

/// Coordinates that a byte may hold: one where each is written out.
const WRITTEN_OUT: usize = 1;
/// A byte of LZF unpacks to at most 264.
const LZF: usize = 264;
/// Three coordinates of a bit each.
const BITS: usize = 24;

pub fn ply(bytes: &[u8]) {
    check(Format::Ply, bytes, WRITTEN_OUT);
    check_column(Format::Ply, bytes, "cost");
}

pub fn obj(bytes: &[u8]) {
    check(Format::Obj, bytes, WRITTEN_OUT);
}

pub fn off(bytes: &[u8]) {
    check(Format::Off, bytes, WRITTEN_OUT);
}

pub fn stl(bytes: &[u8]) {
    check(Format::Stl, bytes, WRITTEN_OUT);
}

pub fn xyz(bytes: &[u8]) {
    check(Format::Xyz, bytes, WRITTEN_OUT);
    check_column(Format::Xyz, bytes, "cost");
}

pub fn csv(bytes: &[u8]) {
    check(Format::Csv, bytes, WRITTEN_OUT);
    check_column(Format::Csv, bytes, "cost");
}

pub fn pcd(bytes: &[u8]) {
    check(Format::Pcd, bytes, LZF);
}

pub fn npy(bytes: &[u8]) {
    check(Format::Npy, bytes, WRITTEN_OUT);
}

/// LAZ packs points that hardly differ into next to no bits, so a file says nothing of how many
/// there are.
pub fn las(bytes: &[u8]) {
    check(Format::Las, bytes, usize::MAX);
    check_column(Format::Las, bytes, "intensity");
    let options = ReadOptions {
        format: Some(Format::Las),
        classes: vec![2],
        ..ReadOptions::default()
    };
    check_with(&options, bytes, usize::MAX);
}

/// Pages are sealed anew, so that what was changed in them reaches the reader.
pub fn e57(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    reseal(&mut bytes);
    check(Format::E57, &bytes, BITS);
}

/// Renews the sum of each of an E57 file's pages.
fn reseal(bytes: &mut [u8]) {
    const PAGE: usize = 1024;
    const CASTAGNOLI: u32 = 0x82f6_3b78;
    for page in bytes.chunks_exact_mut(PAGE) {
        let (data, sum) = page.split_at_mut(PAGE - 4);
        let crc = !data.iter().fold(u32::MAX, |crc, byte| {
            let byte_in = crc ^ u32::from(*byte);
            (0..8).fold(byte_in, |crc, _| {
                (crc >> 1) ^ if crc & 1 == 1 { CASTAGNOLI } else { 0 }
            })
        });
        sum.copy_from_slice(&crc.to_be_bytes());
    }
}

fn check(format: Format, bytes: &[u8], per_byte: usize) {
    let options = ReadOptions {
        format: Some(format),
        ..ReadOptions::default()
    };
    check_with(&options, bytes, per_byte);
}

fn check_column(format: Format, bytes: &[u8], column: &str) {
    let options = ReadOptions {
        format: Some(format),
        column: Some(column.to_owned()),
        ..ReadOptions::default()
    };
    check_with(&options, bytes, usize::MAX);
}

fn check_with(options: &ReadOptions, bytes: &[u8], per_byte: usize) {
    in_file("points", bytes, |file| match read(file, options) {
        Ok(points) => {
            let (rows, numbers) = (points.rows(), points.coordinates.len());
            assert!(points.dimension >= 2 && rows > 0);
            assert_eq!(numbers, rows * points.dimension);
            assert!(numbers <= bytes.len().saturating_mul(per_byte));
            let normals = points.normals.as_ref();
            assert!(normals.is_none_or(|normals| normals.len() == numbers));
            let kept = points.rows_kept.as_ref();
            assert!(kept.is_none_or(|kept| kept.len() == rows && kept.is_sorted_by(|a, b| a < b)));
            assert_eq!(points.column.is_some(), options.column.is_some());
            let column = points.column.as_ref();
            assert!(column.is_none_or(|column| column.len() == rows));
        }
        Err(error) => assert!(error.to_string().contains("points"), "{error}"),
    });
}

/// Calls a function with a file of these bytes.
pub fn in_file<T>(suffix: &str, bytes: &[u8], work: impl FnOnce(&Path) -> T) -> T {
    let mut file = tempfile::Builder::new().suffix(suffix).tempfile().unwrap();
    file.write_all(bytes).unwrap();
    work(file.path())
}
