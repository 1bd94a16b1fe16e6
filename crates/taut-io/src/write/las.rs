//! LAS and LAZ: the records of another such file with further dimensions behind them.
//!
//! Records are copied byte by byte, as are the header and the records beside the points; what
//! changes with the file is counted anew. Of the crates only `laz` takes part, which packs the
//! bytes.

mod head;
mod original;

use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;

use laz::LasZipCompressor;

use super::{Column, atomic};
use crate::error::{Fault, WriteError};
use crate::read::Format;
use crate::read::las::BLOCK;
use crate::read::las::records::{Fields, Records, with_deep_stack};
use head::{Head, put};
use original::{Original, place};

/// The first point format of LAS 1.4.
const EXTENDED_FORMAT: u8 = 6;
const RETURN_AT: usize = 14;

/// Says whether the records of `original` can be written with so many columns more.
pub(super) fn check(
    path: &Path,
    original: Option<&Path>,
    columns: usize,
) -> Result<(), WriteError> {
    let original = las_file(path, original)?;
    let failed = |fault: Fault| refused(path, original, fault.in_file(original).to_string());
    let mut found = Original::open(original).map_err(failed)?;
    found.check_times().map_err(failed)?;
    let names = vec![""; columns];
    Head::new(&found, &names, is_packed(path))
        .map(|_| ())
        .map_err(|reason| refused(path, original, reason))
}

/// Writes the records of `original` in the given rows (all where `None`) with a double for each
/// column.
pub(super) fn write_beside(
    path: &Path,
    columns: &[Column<'_>],
    original: Option<&Path>,
    rows: Option<&[usize]>,
) -> Result<(), WriteError> {
    let original = las_file(path, original)?;
    let failed = |fault: Fault| refused(path, original, fault.in_file(original).to_string());
    let found = Original::open(original).map_err(failed)?;
    let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
    let head = Head::new(&found, &names, is_packed(path))
        .map_err(|reason| refused(path, original, reason))?;
    let in_words = |fault: Fault| io::Error::other(fault.in_file(original).to_string());
    atomic::replace(path, |out| {
        with_deep_stack(|| copy(found, head, columns, rows, out, &in_words))
    })
    .map_err(|source| WriteError::Io {
        file: path.to_path_buf(),
        source,
    })
}

fn las_file<'a>(path: &Path, original: Option<&'a Path>) -> Result<&'a Path, WriteError> {
    original
        .filter(|file| Format::from_path(file) == Some(Format::Las))
        .ok_or_else(|| WriteError::Original {
            file: path.to_path_buf(),
        })
}

fn refused(path: &Path, original: &Path, reason: String) -> WriteError {
    WriteError::Las {
        file: path.to_path_buf(),
        original: original.to_path_buf(),
        reason,
    }
}

fn is_packed(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("laz"))
}

/// Where records go.
enum Packing<'a, W: Write + Seek + Send + Sync> {
    Plain(&'a mut W),
    Packed(Box<LasZipCompressor<'a, &'a mut W>>),
}

impl<W: Write + Seek + Send + Sync> Packing<'_, W> {
    fn write(&mut self, record: &[u8]) -> io::Result<()> {
        match self {
            Self::Plain(out) => out.write_all(record),
            Self::Packed(packed) => packed.compress_one(record),
        }
    }

    fn finish(self) -> io::Result<()> {
        match self {
            Self::Plain(_) => Ok(()),
            Self::Packed(mut packed) => packed.done(),
        }
    }
}

fn copy(
    original: Original,
    mut head: Head,
    columns: &[Column<'_>],
    rows: Option<&[usize]>,
    out: &mut BufWriter<std::fs::File>,
    in_words: &(dyn Fn(Fault) -> io::Error + Sync),
) -> io::Result<()> {
    let Original {
        source,
        length,
        raw,
        parsed,
        extended,
        waves,
        ..
    } = original;
    let tail = source.get_ref().try_clone()?;
    out.write_all(&head.header)?;
    out.write_all(&head.behind)?;
    let mut count = Count::new(&head);
    {
        let mut packing = match &head.laszip {
            None => Packing::Plain(&mut *out),
            Some(laszip) => {
                let packed = LasZipCompressor::new(&mut *out, laszip.clone());
                Packing::Packed(Box::new(packed.map_err(io::Error::other)?))
            }
        };
        let records = Records::new(source, length, &raw, &parsed, Fields::All);
        let mut records = records.map_err(in_words)?;
        let record = raw.record as usize;
        let (mut row, mut place) = (0, 0);
        let mut longer = Vec::new();
        loop {
            let block = records.next(BLOCK).map_err(in_words)?;
            if block.is_empty() {
                break;
            }
            for bytes in block.chunks_exact(record) {
                if rows.is_none_or(|rows| rows.get(place) == Some(&row)) {
                    longer.clear();
                    longer.extend_from_slice(bytes);
                    for column in columns {
                        let value = column.values.get(place).copied().unwrap_or(f64::NAN);
                        longer.extend_from_slice(&value.to_le_bytes());
                    }
                    packing.write(&longer)?;
                    count.add(bytes);
                    place += 1;
                }
                row += 1;
            }
        }
        packing.finish()?;
    }
    copy_tail(tail, &mut head, waves, &extended, out)?;
    count.put(&mut head);
    out.seek(SeekFrom::Start(0))?;
    out.write_all(&head.header)
}

/// Copies what stands behind the points, and notes in the header where it stands now.
fn copy_tail(
    mut source: std::fs::File,
    head: &mut Head,
    waves: Option<Range<u64>>,
    extended: &[Range<u64>],
    out: &mut BufWriter<std::fs::File>,
) -> io::Result<()> {
    let header = &mut head.header;
    let waves_before = header
        .get(place::WAVES..place::WAVES + 8)
        .and_then(|bytes| bytes.first_chunk())
        .map(|bytes| u64::from_le_bytes(*bytes));
    let mut first = None;
    for range in waves.iter().chain(extended) {
        let start = out.seek(SeekFrom::End(0))?;
        if Some(range) != waves.as_ref() {
            first = first.or(Some(start));
        }
        if waves_before == Some(range.start) {
            put(header, place::WAVES, &start.to_le_bytes());
        }
        source.seek(SeekFrom::Start(range.start))?;
        io::copy(&mut (&mut source).take(range.end - range.start), out)?;
    }
    if head.is_long {
        put(
            header,
            place::FIRST_EXTENDED,
            &first.unwrap_or(0).to_le_bytes(),
        );
        put(
            header,
            place::EXTENDED,
            &(extended.len() as u32).to_le_bytes(),
        );
    }
    Ok(())
}

/// What a header says of all records.
struct Count {
    points: u64,
    /// By number of return, the first is 1.
    returns: [u64; 15],
    low: [i32; 3],
    high: [i32; 3],
    return_mask: u8,
}

impl Count {
    fn new(head: &Head) -> Self {
        Self {
            points: 0,
            returns: [0; 15],
            low: [i32::MAX; 3],
            high: [i32::MIN; 3],
            return_mask: if head.format < EXTENDED_FORMAT {
                0b111
            } else {
                0b1111
            },
        }
    }

    fn add(&mut self, record: &[u8]) {
        self.points += 1;
        let number = usize::from(record[RETURN_AT] & self.return_mask);
        if let Some(count) = number.checked_sub(1).and_then(|i| self.returns.get_mut(i)) {
            *count += 1;
        }
        for (axis, bytes) in record.as_chunks::<4>().0.iter().take(3).enumerate() {
            let value = i32::from_le_bytes(*bytes);
            self.low[axis] = self.low[axis].min(value);
            self.high[axis] = self.high[axis].max(value);
        }
    }

    fn put(&self, head: &mut Head) {
        // Point formats of version 1.4 are counted in eight bytes alone, where the header has
        // these.
        let is_short = head.format < EXTENDED_FORMAT || !head.is_long;
        let short = |count: u64| match u32::try_from(count) {
            Ok(count) if is_short => count,
            _ => 0,
        };
        let header = &mut head.header;
        put(header, place::COUNT, &short(self.points).to_le_bytes());
        for (i, count) in self.returns.iter().enumerate() {
            if i < 5 {
                put(header, place::RETURNS + 4 * i, &short(*count).to_le_bytes());
            }
            if head.is_long {
                put(header, place::LONG_RETURNS + 8 * i, &count.to_le_bytes());
            }
        }
        if head.is_long {
            put(header, place::LONG_COUNT, &self.points.to_le_bytes());
        }
        for axis in 0..3 {
            let number = |at: usize| {
                let bytes = header
                    .get(at + 8 * axis..)
                    .and_then(|rest| rest.first_chunk());
                bytes.map_or(0.0, |bytes| f64::from_le_bytes(*bytes))
            };
            let (scale, offset) = (number(place::SCALES), number(place::OFFSETS));
            let value = |count: i32| match self.points {
                0 => 0.0,
                _ => f64::from(count) * scale + offset,
            };
            let (low, high) = (value(self.low[axis]), value(self.high[axis]));
            let (low, high) = (low.min(high), low.max(high));
            put(header, place::BOUNDS + 16 * axis, &high.to_le_bytes());
            put(header, place::BOUNDS + 16 * axis + 8, &low.to_le_bytes());
        }
    }
}
