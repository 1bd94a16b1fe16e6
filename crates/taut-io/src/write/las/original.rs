//! The parts of a LAS or LAZ file besides its records, as bytes.
//!
//! Whatever is not understood is copied as it stands, so that nothing gets lost on the way:
//! identifiers, time and wave form flags, records of coordinate systems.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use crate::error::Fault;
use crate::read::las::header;
use crate::read::las::raw::{EVLR_HEADER, EXPORT_REMEDY, RawHeader, VLR_HEADER, read_u64};
use crate::read::las::records::{is_layered, laszip};
use crate::read::las::times;

/// The record that describes extra bytes: LAS 1.4, table 24.
pub(super) const USER: &str = "LASF_Spec";
pub(super) const EXTRA_BYTES: u16 = 4;
/// What other software keeps about how the points lie in the file, which they no longer do.
const ORDER: &str = "copc";

/// Offsets of fields of the header, in bytes.
pub(super) mod place {
    pub const ENCODING: usize = 6;
    pub const MINOR_VERSION: usize = 25;
    pub const POINTS_OFFSET: usize = 96;
    pub const RECORDS: usize = 100;
    pub const FORMAT: usize = 104;
    pub const RECORD_LENGTH: usize = 105;
    pub const COUNT: usize = 107;
    pub const RETURNS: usize = 111;
    pub const SCALES: usize = 131;
    pub const OFFSETS: usize = 155;
    pub const BOUNDS: usize = 179;
    pub const WAVES: usize = 227;
    pub const FIRST_EXTENDED: usize = 235;
    pub const EXTENDED: usize = 243;
    pub const LONG_COUNT: usize = 247;
    pub const LONG_RETURNS: usize = 255;
}

/// A variable length record.
pub(super) struct Record {
    pub user: String,
    pub id: u16,
    /// With its header.
    pub bytes: Vec<u8>,
}

impl Record {
    fn is(&self, user: &str, id: u16) -> bool {
        self.user == user && self.id == id
    }

    fn is_order(&self) -> bool {
        self.user == ORDER || self.is(laz::LazVlr::USER_ID, laz::LazVlr::RECORD_ID)
    }
}

/// A file whose records are to be copied.
pub(super) struct Original {
    pub source: BufReader<File>,
    pub length: u64,
    pub raw: RawHeader,
    pub parsed: las::Header,
    pub header: Vec<u8>,
    /// All but those that say how the points are packed or ordered, and those that describe extra
    /// bytes.
    pub records: Vec<Record>,
    /// Descriptors of extra bytes.
    pub descriptors: Vec<u8>,
    /// What stands between the records and the points.
    pub padding: Vec<u8>,
    /// Extended records, without those left out above, as ranges of the file.
    pub extended: Vec<Range<u64>>,
    /// Wave forms that are no extended record: LAS 1.3.
    pub waves: Option<Range<u64>>,
}

impl Original {
    pub fn open(file: &Path) -> Result<Self, Fault> {
        let file = File::open(file)?;
        let length = file.metadata()?.len();
        let mut source = BufReader::new(file);
        let (raw, parsed) = header(&mut source, length)?;
        if raw.is_compressed {
            laszip(&parsed)?;
        }
        source.rewind()?;
        let header = bytes(&mut source, raw.header_size)?;
        let mut original = Self {
            source,
            length,
            raw,
            parsed,
            header,
            records: Vec::new(),
            descriptors: Vec::new(),
            padding: Vec::new(),
            extended: Vec::new(),
            waves: None,
        };
        original.read_records()?;
        original.find_extended()?;
        original.find_waves()?;
        Ok(original)
    }

    /// Refuses packed times that cannot be unpacked, which readers of places alone do not see.
    pub fn check_times(&mut self) -> Result<(), Fault> {
        if !self.raw.is_compressed {
            return Ok(());
        }
        let laszip = laszip(&self.parsed)?;
        if is_layered(&laszip) {
            times::check(&mut self.source, self.length, &self.raw, &laszip)?;
        }
        Ok(())
    }

    pub fn number(&self, at: usize, size: usize) -> u64 {
        let mut wide = [0; 8];
        if let Some(bytes) = self.header.get(at..at + size) {
            wide[..size].copy_from_slice(bytes);
        }
        u64::from_le_bytes(wide)
    }

    fn read_records(&mut self) -> Result<(), Fault> {
        let mut at = self.raw.header_size;
        for _ in 0..self.raw.vlrs {
            let mut record = bytes(&mut self.source, VLR_HEADER)?;
            let size = u16::from_le_bytes([record[20], record[21]]);
            record.extend(bytes(&mut self.source, size.into())?);
            at += record.len() as u64;
            let record = record_of(record);
            if record.is(USER, EXTRA_BYTES) {
                self.descriptors
                    .extend(&record.bytes[VLR_HEADER as usize..]);
            } else if !record.is_order() {
                self.records.push(record);
            }
        }
        let room = self.raw.points_offset.checked_sub(at).ok_or_else(|| {
            let found = format!("records up to byte {at}");
            let expected = format!(
                "an end before the points at byte {}",
                self.raw.points_offset
            );
            Fault::byte(place::RECORDS as u64, found, expected, EXPORT_REMEDY)
        })?;
        self.padding = bytes(&mut self.source, room)?;
        Ok(())
    }

    fn find_extended(&mut self) -> Result<(), Fault> {
        if !self.raw.is_long {
            return Ok(());
        }
        let mut start = self.number(place::FIRST_EXTENDED, 8);
        for _ in 0..self.number(place::EXTENDED, 4) {
            let range = self.extended_at(start)?;
            self.source.seek(SeekFrom::Start(range.start))?;
            let record = record_of(bytes(&mut self.source, EVLR_HEADER)?);
            start = range.end;
            if record.is(USER, EXTRA_BYTES) {
                let size = range.end - range.start - EVLR_HEADER;
                let more = bytes(&mut self.source, size)?;
                self.descriptors.extend(more);
            } else if !record.is_order() {
                self.extended.push(range);
            }
        }
        Ok(())
    }

    fn find_waves(&mut self) -> Result<(), Fault> {
        const INTERNAL: u64 = 1 << 1;
        let start = self.number(place::WAVES, 8);
        let is_known = self.extended.iter().any(|range| range.start == start);
        let is_inside = self.header[place::MINOR_VERSION] >= 3
            && self.number(place::ENCODING, 2) & INTERNAL != 0
            && start != 0;
        if is_inside && !is_known {
            self.waves = Some(self.extended_at(start)?);
        }
        Ok(())
    }

    /// An extended record, header included.
    fn extended_at(&mut self, start: u64) -> Result<Range<u64>, Fault> {
        let size = start
            .checked_add(20)
            .map(|at| read_u64(&mut self.source, at))
            .transpose()?;
        let end = size.and_then(|size| start.checked_add(EVLR_HEADER)?.checked_add(size));
        match end {
            Some(end) if end <= self.length => Ok(start..end),
            _ => Err(Fault::byte(
                start,
                "an extended variable length record that ends behind the file",
                format!("an end before byte {}", self.length),
                EXPORT_REMEDY,
            )),
        }
    }
}

fn bytes(source: &mut impl Read, count: u64) -> Result<Vec<u8>, Fault> {
    let mut bytes = Vec::new();
    source.by_ref().take(count).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == count {
        return Ok(bytes);
    }
    let found = "the end of the file";
    Err(Fault::byte(
        0,
        found,
        "a LAS header and its records",
        EXPORT_REMEDY,
    ))
}

/// Of a record's bytes, or those of its header.
fn record_of(bytes: Vec<u8>) -> Record {
    let name = bytes[2..18].split(|byte| *byte == 0).next();
    Record {
        user: String::from_utf8_lossy(name.unwrap_or_default()).into_owned(),
        id: u16::from_le_bytes([bytes[18], bytes[19]]),
        bytes,
    }
}
