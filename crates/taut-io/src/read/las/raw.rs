//! The lengths that the header of a LAS file declares, compared with the file's own.

use std::io::{Read, Seek, SeekFrom};

use crate::error::{Fault, quoted};

pub(crate) const EXPORT_REMEDY: &str = "the file is cut off or damaged: export it again";
pub(crate) const VLR_HEADER: u64 = 54;
pub(crate) const EVLR_HEADER: u64 = 60;

/// The numbers of the public header block that say how long things are.
pub(crate) struct RawHeader {
    pub header_size: u64,
    pub points_offset: u64,
    pub vlrs: u64,
    pub is_compressed: bool,
    /// Bytes of a record.
    pub record: u64,
    pub points: u64,
    /// Whether it has the fields of version 1.4.
    pub is_long: bool,
    /// Start of the first extended variable length record, LAS 1.4.
    pub evlr: Option<u64>,
}

impl RawHeader {
    pub(crate) const SIZE: usize = 227;
    pub(crate) const SIZE_1_4: usize = 375;

    pub(crate) fn parse(source: &mut impl Read) -> Result<Self, Fault> {
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
        let is_long = (bytes[24], bytes[25]) >= (1, 4) && bytes.len() == Self::SIZE_1_4;
        let number = |offset: usize, size: usize| {
            let mut wide = [0; 8];
            wide[..size].copy_from_slice(&bytes[offset..offset + size]);
            u64::from_le_bytes(wide)
        };
        // Files of version 1.4 count in eight bytes, and may count in four besides.
        let legacy_points = number(107, 4);
        let points = if is_long { number(247, 8) } else { 0 };
        if legacy_points != 0 && points != 0 && legacy_points != points {
            return Err(Fault::byte(
                247,
                format!("{points} records declared, and {legacy_points} at byte 107"),
                "the same number twice, or 0 at byte 107",
                EXPORT_REMEDY,
            ));
        }
        Ok(Self {
            header_size: number(94, 2),
            points_offset: number(96, 4),
            vlrs: number(100, 4),
            is_compressed: bytes[104] & 0b1100_0000 != 0,
            record: number(105, 2),
            points: points.max(legacy_points),
            is_long,
            evlr: (is_long && number(243, 4) > 0).then(|| number(235, 8)),
        })
    }

    pub(crate) fn check(&self, source: &mut (impl Read + Seek), length: u64) -> Result<(), Fault> {
        let wrong = |offset: u64, found: String, expected: String| {
            Err(Fault::byte(offset, found, expected, EXPORT_REMEDY))
        };
        let least = if self.is_long {
            Self::SIZE_1_4
        } else {
            Self::SIZE
        };
        if self.header_size < least as u64 {
            let found = format!("a header of {} bytes", self.header_size);
            return wrong(94, found, format!("at least {least}"));
        }
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

    /// A chunk starts with a whole record, so there cannot be more chunks than records fit before
    /// their table.
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

pub(crate) fn check_evlr(
    source: &mut (impl Read + Seek),
    start: u64,
    length: u64,
) -> Result<(), Fault> {
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

pub(crate) fn read_u64(source: &mut (impl Read + Seek), offset: u64) -> Result<u64, Fault> {
    let mut bytes = [0; 8];
    source.seek(SeekFrom::Start(offset))?;
    source
        .read_exact(&mut bytes)
        .map_err(|_| Fault::byte(offset, "the end of the file", "8 more bytes", EXPORT_REMEDY))?;
    Ok(u64::from_le_bytes(bytes))
}
