//! LAS and LAZ: positions, with a filter by classification.
//!
//! Records are parsed by the `las` crate, in blocks: it would ask for the memory of every declared point at once. Before
//! it sees the file, the header's counts and lengths are compared with the file's length, since it trusts them too.
//! `laz`, which unpacks LAZ, was seen to panic on damaged files: on items that do not add up to a record (checked here
//! before) and on chunk tables that end too soon (turned into an error by [`unpacking`]).

mod dimension;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::error::{Fault, quoted};
use crate::point_set::{PointSet, ReadOptions};
use dimension::Dimension;

const EXPORT_REMEDY: &str = "the file is cut off or damaged: export it again";
/// Bytes of records unpacked at a time.
const BLOCK: u64 = 1 << 22;
const VLR_HEADER: u64 = 54;
const EVLR_HEADER: u64 = 60;

/// The numbers of the public header block that say how long things are.
struct RawHeader {
    header_size: u64,
    points_offset: u64,
    vlrs: u64,
    is_compressed: bool,
    record: u64,
    points: u64,
    /// Start of the first extended variable length record, LAS 1.4.
    evlr: Option<u64>,
}

pub(super) fn read<R>(mut source: R, length: u64, options: &ReadOptions) -> Result<PointSet, Fault>
where
    R: Read + Seek + Send + Sync + 'static,
{
    let raw = RawHeader::parse(&mut source)?;
    raw.check(&mut source, length)?;
    source.rewind()?;
    let header = las::Header::new(&mut source).map_err(|error| wrong_header(&error))?;
    check_transforms(&header)?;
    if raw.is_compressed {
        check_items(&header)?;
    }
    let column = options.column.as_deref();
    let column = column.map(|name| Dimension::of_name(&header, name));
    source.rewind()?;
    let mut reader =
        unpacking(|| las::Reader::new(source)).map_err(|found| wrong_header(&found))?;
    let mut selection = Selection::new(&options.classes, column.transpose()?);
    let block = (BLOCK / raw.record).max(1);
    let mut row = 0;
    while (row as u64) < raw.points {
        let cut_off = |found: String| {
            Fault::byte(
                raw.points_offset,
                format!("{row} records, then {found}"),
                format!("the declared {}", raw.points),
                EXPORT_REMEDY,
            )
        };
        let records = unpacking(|| reader.read_points(block)).map_err(cut_off)?;
        if records.is_empty() {
            return Err(cut_off("the end of the points".to_owned()));
        }
        selection.take(row, &records);
        row += records.len();
    }
    selection.finish(raw.points_offset)
}

fn wrong_header(found: &dyn Display) -> Fault {
    Fault::byte(0, found.to_string(), "a LAS header", EXPORT_REMEDY)
}

/// Runs a part of the `las` crate that may panic on damaged compressed points, and answers its error in words.
fn unpacking<T>(run: impl FnOnce() -> las::Result<T>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(result) => result.map_err(|error| error.to_string()),
        Err(_) => Err("compressed points that cannot be unpacked".to_owned()),
    }
}

impl RawHeader {
    const SIZE: usize = 227;
    const SIZE_1_4: usize = 375;

    fn parse(source: &mut impl Read) -> Result<Self, Fault> {
        let mut bytes = Vec::with_capacity(Self::SIZE_1_4);
        source.take(Self::SIZE_1_4 as u64).read_to_end(&mut bytes)?;
        if !bytes.starts_with(b"LASF") {
            let found = quoted(&String::from_utf8_lossy(&bytes[..bytes.len().min(4)]));
            return Err(Fault::byte(
                0,
                found,
                "the LAS signature \"LASF\"",
                "export it as LAS, or name its format with --format NAME",
            ));
        }
        if bytes.len() < Self::SIZE {
            return Err(Fault::byte(
                bytes.len() as u64,
                "the end of the file",
                "a LAS header of at least 227 bytes",
                EXPORT_REMEDY,
            ));
        }
        let is_1_4 = (bytes[24], bytes[25]) >= (1, 4) && bytes.len() == Self::SIZE_1_4;
        let number = |offset: usize, size: usize| {
            let mut wide = [0; 8];
            wide[..size].copy_from_slice(&bytes[offset..offset + size]);
            u64::from_le_bytes(wide)
        };
        let legacy_points = number(107, 4);
        Ok(Self {
            header_size: number(94, 2),
            points_offset: number(96, 4),
            vlrs: number(100, 4),
            is_compressed: bytes[104] & 0b1100_0000 != 0,
            record: number(105, 2),
            points: if legacy_points == 0 && is_1_4 {
                number(247, 8)
            } else {
                legacy_points
            },
            evlr: (is_1_4 && number(243, 4) > 0).then(|| number(235, 8)),
        })
    }

    fn check(&self, source: &mut (impl Read + Seek), length: u64) -> Result<(), Fault> {
        let wrong = |offset: u64, found: String, expected: String| {
            Err(Fault::byte(offset, found, expected, EXPORT_REMEDY))
        };
        let room_before_points = self.points_offset.checked_sub(self.header_size);
        if self.points_offset > length
            || room_before_points.is_none_or(|room| self.vlrs * VLR_HEADER > room)
        {
            let found = format!(
                "points from byte {}, behind {} variable length records",
                self.points_offset, self.vlrs
            );
            return wrong(
                96,
                found,
                format!("room for the records and a place in the file's {length} bytes"),
            );
        }
        if self.record == 0 {
            return wrong(
                105,
                "records of 0 bytes".to_owned(),
                "at least 20 bytes".to_owned(),
            );
        }
        let room = length - self.points_offset;
        let needed = self.points.checked_mul(self.record);
        if self.is_compressed {
            if needed
                .and_then(|bytes| bytes.checked_add(self.points_offset))
                .is_none()
            {
                return wrong(
                    107,
                    format!("{} records declared", self.points),
                    format!("what {room} bytes can hold"),
                );
            }
            self.check_chunk_table(source, length)?;
        } else if needed.is_none_or(|bytes| bytes > room) {
            let found = format!("{} records before the file ends", room / self.record);
            return wrong(
                length,
                found,
                format!(
                    "the declared {}, each of {} bytes",
                    self.points, self.record
                ),
            );
        }
        match self.evlr {
            Some(start) => check_evlr(source, start, length),
            None => Ok(()),
        }
    }

    /// A chunk starts with a whole record, so there cannot be more chunks than records fit before their table.
    fn check_chunk_table(&self, source: &mut (impl Read + Seek), length: u64) -> Result<(), Fault> {
        let mut table = read_u64(source, self.points_offset)?;
        if table as i64 <= self.points_offset as i64 {
            table = read_u64(source, length.saturating_sub(8))?;
            if table as i64 <= self.points_offset as i64 {
                // A stream without a table: its chunks are read one after the other.
                return Ok(());
            }
        }
        let places = table.saturating_sub(self.points_offset) / self.record;
        let chunks = match table.checked_add(8).is_some_and(|end| end <= length) {
            true => read_u64(source, table)? >> 32,
            false => u64::MAX,
        };
        if chunks > places {
            return Err(Fault::byte(
                self.points_offset,
                format!("a chunk table at byte {table} of a file of {length} bytes"),
                format!("a table inside the file, of at most {places} chunks"),
                EXPORT_REMEDY,
            ));
        }
        Ok(())
    }
}

fn check_evlr(source: &mut (impl Read + Seek), start: u64, length: u64) -> Result<(), Fault> {
    let holds = |start: u64, size: u64| start.checked_add(size).is_some_and(|end| end <= length);
    if holds(start, EVLR_HEADER) {
        let size = read_u64(source, start + 20)?;
        if holds(start + EVLR_HEADER, size) {
            return Ok(());
        }
    }
    Err(Fault::byte(
        start,
        "an extended variable length record that ends behind the file",
        format!("an end before byte {length}"),
        EXPORT_REMEDY,
    ))
}

fn read_u64(source: &mut (impl Read + Seek), offset: u64) -> Result<u64, Fault> {
    let mut bytes = [0; 8];
    source.seek(SeekFrom::Start(offset))?;
    source
        .read_exact(&mut bytes)
        .map_err(|_| Fault::byte(offset, "the end of the file", "8 more bytes", EXPORT_REMEDY))?;
    Ok(u64::from_le_bytes(bytes))
}

fn check_transforms(header: &las::Header) -> Result<(), Fault> {
    let transforms = header.transforms();
    for (axis, transform) in [
        ("x", transforms.x),
        ("y", transforms.y),
        ("z", transforms.z),
    ] {
        if !transform.scale.is_finite() || transform.scale == 0.0 || !transform.offset.is_finite() {
            return Err(Fault::byte(
                131,
                format!(
                    "scale {} and offset {} in {axis}",
                    transform.scale, transform.offset
                ),
                "finite numbers, and a scale that is not zero",
                EXPORT_REMEDY,
            ));
        }
    }
    Ok(())
}

/// Compares the items of which a compressed record is said to consist with those that the point format demands.
fn check_items(header: &las::Header) -> Result<(), Fault> {
    let items = |header: &las::Header| {
        let laszip = header
            .vlrs()
            .iter()
            .rfind(|vlr| las::laz::is_laszip_vlr(vlr))?;
        let count = usize::from(u16::from_le_bytes(*laszip.data.get(32..)?.first_chunk()?));
        let (items, _) = laszip.data.get(34..)?.as_chunks::<6>();
        // Type and size; the version behind them is the compression's own affair.
        let named: Vec<[u8; 4]> = items
            .get(..count)?
            .iter()
            .map(|item| [item[0], item[1], item[2], item[3]])
            .collect();
        Some(named)
    };
    let mut plain = header.clone();
    let demanded = plain.add_laz_vlr().ok().and_then(|()| items(&plain));
    if items(header) == demanded {
        return Ok(());
    }
    Err(Fault::byte(
        104,
        "a LASzip record that is absent or does not describe this point format",
        format!("the parts of {}", header.point_format()),
        EXPORT_REMEDY,
    ))
}

/// The points of the wanted classes.
struct Selection<'a> {
    classes: &'a [u8],
    coordinates: Vec<f64>,
    rows: Vec<usize>,
    /// The dimension asked for, and its values.
    column: Option<(Dimension, Vec<f64>)>,
    /// Number of points of each class in the file.
    present: BTreeMap<u8, usize>,
}

impl<'a> Selection<'a> {
    fn new(classes: &'a [u8], column: Option<Dimension>) -> Self {
        Self {
            classes,
            column: column.map(|dimension| (dimension, Vec::new())),
            coordinates: Vec::new(),
            rows: Vec::new(),
            present: BTreeMap::new(),
        }
    }

    fn take(&mut self, first_row: usize, records: &las::PointData) {
        if let Some((dimension, values)) = &mut self.column {
            let classes = records.classification();
            let all = dimension.values(records).zip(classes);
            let kept =
                all.filter(|(_, class)| self.classes.is_empty() || self.classes.contains(class));
            values.extend(kept.map(|(value, _)| value));
        }
        let positions = records.x().zip(records.y()).zip(records.z());
        for (offset, (((x, y), z), class)) in positions.zip(records.classification()).enumerate() {
            if self.classes.is_empty() {
                self.coordinates.extend([x, y, z]);
                continue;
            }
            *self.present.entry(class).or_default() += 1;
            if self.classes.contains(&class) {
                self.coordinates.extend([x, y, z]);
                self.rows.push(first_row + offset);
            }
        }
    }

    fn finish(self, points_offset: u64) -> Result<PointSet, Fault> {
        let mut points = PointSet::three_dimensional(self.coordinates, None);
        points.column = self.column.map(|(_, values)| values);
        if self.classes.is_empty() {
            return Ok(points);
        }
        if points.rows() == 0 {
            let counts: Vec<String> = self
                .present
                .iter()
                .map(|(class, count)| format!("{class} ({count} points)"))
                .collect();
            return Err(Fault::byte(
                points_offset,
                format!("the classes {}", counts.join(", ")),
                format!("a point of class {:?}", self.classes),
                "choose one of the classes found",
            ));
        }
        let total: usize = self.present.values().sum();
        points.notes.push(format!(
            "{} of {total} points kept: those of class {:?}",
            points.rows(),
            self.classes
        ));
        points.rows_kept = Some(self.rows);
        Ok(points)
    }
}
