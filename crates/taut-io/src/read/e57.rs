//! E57: every scan's positions in the coordinates of the file, that is, moved by the scan's pose.
//!
//! Parsed by the `e57` crate, which checks each page's sum. Its XML section and its records are
//! compared with the file's length first.

use std::io::{Read, Seek, SeekFrom};

use e57::{CartesianCoordinate, E57Reader, PointCloud, RecordDataType};

use crate::error::{Fault, quoted};
use crate::point_set::PointSet;

const EXPORT_REMEDY: &str = "the file is cut off or damaged: export it again";

pub(super) fn read(mut source: impl Read + Seek, length: u64) -> Result<PointSet, Fault> {
    check_header(&mut source, length)?;
    source.rewind()?;
    let mut reader = E57Reader::new(source).map_err(|error| damaged(0, &error, "an E57 file"))?;
    let mut coordinates = Vec::new();
    let mut rows_kept = Vec::new();
    let mut rows = 0;
    let scans = reader.pointclouds();
    for (index, scan) in scans.iter().enumerate() {
        check_records(index, scan, length)?;
        let expected = format!("the declared {} records of scan {index}", scan.records);
        let mut records = reader
            .pointcloud_simple(scan)
            .map_err(|error| damaged(scan.file_offset, &error, &expected))?;
        records.intensity_to_color(false);
        for record in records {
            let record = record.map_err(|error| damaged(scan.file_offset, &error, &expected))?;
            if let CartesianCoordinate::Valid { x, y, z } = record.cartesian {
                coordinates.extend([x, y, z]);
                rows_kept.push(rows);
            }
            rows += 1;
        }
    }
    let mut points = PointSet::three_dimensional(coordinates, None);
    points.note_ignored(reader.images().len(), "images");
    if scans.len() > 1 {
        points.notes.push(format!(
            "{} scans read as one, each moved by its pose",
            scans.len()
        ));
    }
    if rows_kept.len() < rows {
        points.notes.push(format!(
            "{} of {rows} points left out: marked invalid in the file",
            rows - rows_kept.len()
        ));
        points.rows_kept = Some(rows_kept);
    }
    Ok(points)
}

fn damaged(offset: u64, error: &e57::Error, expected: &str) -> Fault {
    Fault::byte(offset, error.to_string(), expected, EXPORT_REMEDY)
}

fn check_header(source: &mut (impl Read + Seek), length: u64) -> Result<(), Fault> {
    const SIZE: u64 = 48;
    const XML_LENGTH_AT: usize = 32;
    source.seek(SeekFrom::Start(0))?;
    let mut header = Vec::new();
    source.take(SIZE).read_to_end(&mut header)?;
    if !header.starts_with(b"ASTM-E57") {
        let found = quoted(&String::from_utf8_lossy(&header[..header.len().min(8)]));
        return Err(Fault::byte(
            0,
            found,
            "the E57 signature \"ASTM-E57\"",
            "export it as E57, or name its format with --format NAME",
        ));
    }
    let Some(xml_length) = header
        .get(XML_LENGTH_AT..)
        .and_then(|bytes| bytes.first_chunk())
    else {
        return Err(Fault::byte(
            header.len() as u64,
            "the end of the file",
            "a header of 48 bytes",
            EXPORT_REMEDY,
        ));
    };
    let xml_length = u64::from_le_bytes(*xml_length);
    if xml_length > length {
        return Err(Fault::byte(
            XML_LENGTH_AT as u64,
            format!("an XML section of {xml_length} bytes"),
            format!("at most the file's {length}"),
            EXPORT_REMEDY,
        ));
    }
    Ok(())
}

/// Compares a scan's records with the file's length. Records of no bits at all, which could be
/// declared in any number, are refused: the crate would never end.
fn check_records(index: usize, scan: &PointCloud, length: u64) -> Result<(), Fault> {
    let bits = |data_type: &RecordDataType| match data_type {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            u64::from(64 - (*max).max(*min).abs_diff(*min).leading_zeros())
        }
    };
    let record: u64 = scan
        .prototype
        .iter()
        .map(|field| bits(&field.data_type))
        .sum();
    let room = length.saturating_mul(8).checked_div(record).unwrap_or(0);
    if scan.records > room {
        return Err(Fault::byte(
            scan.file_offset,
            format!(
                "{} records of {record} bits declared in scan {index}",
                scan.records
            ),
            format!("at most {room} in a file of {length} bytes"),
            EXPORT_REMEDY,
        ));
    }
    Ok(())
}
