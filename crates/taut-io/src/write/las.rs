//! LAS and LAZ: the records of another such file with further dimensions behind them.

use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;

use las::{Builder, Header, Reader, Vlr, Writer};

use super::{Column, atomic};
use crate::error::WriteError;
use crate::format::Format;

/// The variable length record that describes extra bytes: LAS 1.4, table 24.
const USER: &str = "LASF_Spec";
const EXTRA_BYTES: u16 = 4;
const DESCRIPTOR: usize = 192;
/// Records read at a time.
const BLOCK: u64 = 1 << 14;
/// Where in a descriptor the data type stands, and that of doubles.
const TYPE_AT: usize = 2;
const DOUBLE: u8 = 10;
const NAME: std::ops::Range<usize> = 4..36;

/// Writes the records of `original` in the given rows (all where `None`) with a double for each column.
pub(super) fn write_beside(
    path: &Path,
    columns: &[Column<'_>],
    original: Option<&Path>,
    rows: Option<&[usize]>,
) -> Result<(), WriteError> {
    let original = original.filter(|file| Format::from_path(file) == Some(Format::Las));
    let Some(original) = original else {
        return Err(WriteError::Original {
            file: path.to_path_buf(),
        });
    };
    let failed = |error: las::Error| WriteError::Las {
        file: path.to_path_buf(),
        original: original.to_path_buf(),
        reason: error.to_string(),
    };
    let compressed = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("laz"));
    let bytes = extended(original, compressed, columns, rows).map_err(failed)?;
    atomic::write(path, |out| out.write_all(&bytes))
}

fn extended(
    original: &Path,
    compressed: bool,
    columns: &[Column<'_>],
    rows: Option<&[usize]>,
) -> las::Result<Vec<u8>> {
    let mut reader = Reader::new(BufReader::new(File::open(original)?))?;
    let header = with_columns(reader.header().clone(), compressed, columns)?;
    let mut writer = Writer::new(Cursor::new(Vec::new()), header)?;
    let mut place = 0;
    let mut row = 0;
    loop {
        let records = reader.read_points(BLOCK)?;
        if records.is_empty() {
            break;
        }
        for record in records.points() {
            let mut record = record?;
            if rows.is_none_or(|rows| rows.get(place) == Some(&row)) {
                for column in columns {
                    let value = column.values.get(place).copied().unwrap_or(f64::NAN);
                    record.extra_bytes.extend_from_slice(&value.to_le_bytes());
                }
                writer.write_point(record)?;
                place += 1;
            }
            row += 1;
        }
    }
    Ok(writer.into_inner()?.into_inner())
}

/// The header with a descriptor for each column.
fn with_columns(header: Header, compressed: bool, columns: &[Column<'_>]) -> las::Result<Header> {
    let mut builder = Builder::from(header);
    builder.point_format.is_compressed = compressed;
    builder.point_format.extra_bytes += (columns.len() * size_of::<f64>()) as u16;
    let known = |vlr: &&mut Vlr| vlr.user_id == USER && vlr.record_id == EXTRA_BYTES;
    let descriptors = columns.iter().flat_map(|column| descriptor(column.name));
    match builder.vlrs.iter_mut().find(known) {
        Some(vlr) => vlr.data.extend(descriptors),
        None => builder.vlrs.push(Vlr {
            user_id: USER.to_owned(),
            record_id: EXTRA_BYTES,
            description: "extra dimensions".to_owned(),
            data: descriptors.collect(),
        }),
    }
    builder.into_header()
}

fn descriptor(name: &str) -> [u8; DESCRIPTOR] {
    let mut bytes = [0; DESCRIPTOR];
    bytes[TYPE_AT] = DOUBLE;
    for (byte, letter) in bytes[NAME].iter_mut().zip(name.bytes()) {
        *byte = letter;
    }
    bytes
}
