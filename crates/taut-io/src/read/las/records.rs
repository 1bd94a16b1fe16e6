//! The records of a LAS or LAZ file, block by block, as bytes.
//!
//! `laz`, which unpacks LAZ, trusts what it reads, and was seen to fail on damaged files in three
//! ways. It panics, on items that do not add up to a record (checked here before) and on chunk
//! tables that end too soon (turned into an error by [`unpacking`]). It asks for the memory of a
//! layer that the file does not hold (layers are checked here before). And where a GPS time is said
//! to belong to another of four sequences it calls itself, as often as the packed bits say so, and
//! a byte can say so some 40,000 times: the stack overflows, which nothing can catch. So records
//! are unpacked on a thread with a deep stack, and the bytes that they are made of are refused once
//! that stack is used up (see [`Shallow`]). Layered records, of point formats 6 and up, are
//! unpacked from memory, where nothing can be refused: positions are read without their times, and
//! who needs these looks at them before (see [`times`]).

use std::io::{self, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

use laz::laszip::ChunkTable;
use laz::{DecompressionSelection, LasZipDecompressor, LazItemRecordBuilder, LazItemType, LazVlr};

use super::raw::{EXPORT_REMEDY, RawHeader};
use super::times;
use crate::error::Fault;

/// What of a record is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fields {
    All,
    /// GPS times may be anything.
    WithoutTimes,
}

/// The records of a file from the first on.
pub(crate) struct Records<R: Read + Seek + Send + Sync + 'static> {
    source: Source<R>,
    points_offset: u64,
    /// Bytes of a record.
    record: u64,
    count: u64,
    /// Records that came already.
    read: u64,
}

enum Source<R: Read + Seek + Send + Sync + 'static> {
    Plain(R),
    Packed(Box<LasZipDecompressor<'static, Shallow<R>>>),
}

impl<R: Read + Seek + Send + Sync + 'static> Records<R> {
    /// Of a file whose header was checked. Packed records must be read on the thread that calls
    /// this.
    pub fn new(
        mut source: R,
        length: u64,
        raw: &RawHeader,
        header: &las::Header,
        fields: Fields,
    ) -> Result<Self, Fault> {
        let source = if raw.is_compressed {
            let laszip = laszip(header)?;
            match fields {
                _ if !is_layered(&laszip) => {}
                Fields::All => times::check(&mut source, length, raw, &laszip)?,
                Fields::WithoutTimes => {
                    each_chunk(&mut source, length, raw, &laszip, |_, _| Ok(()))?
                }
            }
            source.seek(SeekFrom::Start(raw.points_offset))?;
            let selection = match fields {
                Fields::All => DecompressionSelection::all(),
                Fields::WithoutTimes => DecompressionSelection::all().skip_gps_time(),
            };
            let source = Shallow::new(source);
            let unpacked = unpacking(|| LasZipDecompressor::selective(source, laszip, selection));
            let wrong =
                |found| Fault::byte(raw.points_offset, found, "packed points", EXPORT_REMEDY);
            Source::Packed(Box::new(unpacked.map_err(wrong)?))
        } else {
            source.seek(SeekFrom::Start(raw.points_offset))?;
            Source::Plain(source)
        };
        Ok(Self {
            source,
            points_offset: raw.points_offset,
            record: raw.record,
            count: raw.points,
            read: 0,
        })
    }

    /// The next records, as many as so many bytes hold and at least one; none at the end.
    pub fn next(&mut self, most_bytes: u64) -> Result<Vec<u8>, Fault> {
        let count = (most_bytes / self.record)
            .max(1)
            .min(self.count - self.read);
        let mut bytes = vec![0; (count * self.record) as usize];
        let filled = match &mut self.source {
            Source::Plain(source) => source.read_exact(&mut bytes).map_err(|e| e.to_string()),
            Source::Packed(packed) => unpacking(|| packed.decompress_many(&mut bytes)),
        };
        filled.map_err(|found| {
            Fault::byte(
                self.points_offset,
                format!("{} records, then {found}", self.read),
                format!("the declared {}", self.count),
                EXPORT_REMEDY,
            )
        })?;
        self.read += count;
        Ok(bytes)
    }
}

/// Runs a part of `laz` that may panic on damaged packed points, and answers its error in words.
pub(crate) fn unpacking<T, E: ToString>(run: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(result) => result.map_err(|error| error.to_string()),
        Err(_) => Err("compressed points that cannot be unpacked".to_owned()),
    }
}

/// What the file says of how its records are packed, if that suits the records.
pub(crate) fn laszip(header: &las::Header) -> Result<LazVlr, Fault> {
    let format = header.point_format();
    let declared = header.laz_vlr().ok();
    let demanded = format.to_u8().ok().and_then(|id| {
        LazItemRecordBuilder::default_for_point_format_id(id, format.extra_bytes).ok()
    });
    // Type and size; the version behind them is the compression's own affair.
    let fits = |declared: &LazVlr| {
        let parts = |items: &[laz::LazItem]| -> Vec<_> {
            let part = |item: &laz::LazItem| (item.item_type(), item.size());
            items.iter().map(part).collect()
        };
        demanded.is_some_and(|demanded| parts(&demanded) == parts(declared.items()))
    };
    declared.filter(fits).ok_or_else(|| {
        Fault::byte(
            104,
            "a LASzip record that is absent or does not describe this point format",
            format!("the parts of {format}"),
            EXPORT_REMEDY,
        )
    })
}

/// Whether the fields of a chunk's records are packed one after the other.
pub(crate) fn is_layered(laszip: &LazVlr) -> bool {
    laszip
        .items()
        .first()
        .is_some_and(|item| item.version() >= 3)
}

/// How many layers each part of a layered record has.
fn layers(item: LazItemType) -> usize {
    match item {
        LazItemType::Point14 => 9,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => count.into(),
        _ => 1,
    }
}

/// Where a chunk of layered records has its parts.
pub(crate) struct Chunk {
    /// Its first record, which is not packed.
    pub start: u64,
    pub points: u64,
    /// Bytes of each layer.
    pub layers: Vec<u32>,
    /// Where the first layer begins.
    pub layers_start: u64,
}

/// Does something with each chunk of layered records, whose layers must lie inside the file.
pub(crate) fn each_chunk<S: Read + Seek>(
    source: &mut S,
    length: u64,
    raw: &RawHeader,
    laszip: &LazVlr,
    mut work: impl FnMut(&mut S, &Chunk) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let wrong = |offset: u64, found: String, expected: String| {
        Fault::byte(offset, found, expected, EXPORT_REMEDY)
    };
    let table = if laszip.uses_variable_size_chunks() {
        source.seek(SeekFrom::Start(raw.points_offset))?;
        let table = unpacking(|| ChunkTable::read_from(&mut *source, laszip));
        Some(
            table
                .map_err(|found| wrong(raw.points_offset, found, "a table of chunks".to_owned()))?,
        )
    } else {
        None
    };
    let count: usize = laszip
        .items()
        .iter()
        .map(|item| layers(item.item_type()))
        .sum();
    let mut start = raw.points_offset + ChunkTable::OFFSET_SIZE as u64;
    let mut covered = 0_u64;
    for index in 0.. {
        if covered >= raw.points {
            break;
        }
        let points = match &table {
            Some(table) => table
                .as_ref()
                .get(index)
                .map_or(0, |entry| entry.point_count),
            None => laszip.chunk_size().into(),
        };
        let sizes_at = start + raw.record + 4;
        let mut sizes = vec![0; 4 * count];
        source.seek(SeekFrom::Start(sizes_at))?;
        if points == 0 || source.read_exact(&mut sizes).is_err() {
            return Err(wrong(
                start,
                format!("{covered} records in {index} chunks"),
                format!("the declared {}", raw.points),
            ));
        }
        let (sizes, _) = sizes.as_chunks::<4>();
        let layers: Vec<u32> = sizes.iter().map(|size| u32::from_le_bytes(*size)).collect();
        let layers_start = sizes_at + 4 * count as u64;
        let bytes: u64 = layers.iter().map(|size| u64::from(*size)).sum();
        let end = layers_start + bytes;
        if end > length {
            return Err(wrong(
                sizes_at,
                format!("layers of {bytes} bytes in chunk {index}"),
                format!(
                    "at most the {} bytes behind them",
                    length - layers_start.min(length)
                ),
            ));
        }
        let chunk = Chunk {
            start,
            points,
            layers,
            layers_start,
        };
        work(source, &chunk)?;
        covered = covered.saturating_add(points);
        start = end;
    }
    Ok(())
}

/// Stack of the thread that unpacks. Only what is used of it takes memory.
const STACK: usize = 256 << 20;
/// Bytes of stack at which no more are read. Between two bytes the unpacking goes some 40,000 calls
/// deeper at most.
const DEEPEST: usize = 16 << 20;

/// Runs on a thread whose stack is deep enough for a [`Shallow`] source to refuse before it
/// overflows.
pub(crate) fn with_deep_stack<T: Send, E: From<io::Error> + Send>(
    run: impl FnOnce() -> Result<T, E> + Send,
) -> Result<T, E> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new()
            .stack_size(STACK)
            .spawn_scoped(scope, run)?;
        thread.join().unwrap_or_else(|_| {
            Err(io::Error::other("the thread that unpacks points ended").into())
        })
    })
}

/// A source that gives no more bytes to whom it was called by from too deep in the stack.
pub(crate) struct Shallow<R> {
    source: R,
    base: usize,
}

impl<R> Shallow<R> {
    fn new(source: R) -> Self {
        Self {
            source,
            base: here(),
        }
    }

    #[inline]
    fn check(&self) -> io::Result<()> {
        if self.base.abs_diff(here()) > DEEPEST {
            return Err(io::Error::other(
                "GPS times that go from sequence to sequence without end",
            ));
        }
        Ok(())
    }
}

/// An address in the stack.
#[inline]
fn here() -> usize {
    let here = 0_u8;
    std::hint::black_box(std::ptr::from_ref(&here)).addr()
}

impl<R: Read> Read for Shallow<R> {
    #[inline]
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.check()?;
        self.source.read(buffer)
    }

    #[inline]
    fn read_exact(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.check()?;
        self.source.read_exact(buffer)
    }
}

impl<R: Seek> Seek for Shallow<R> {
    fn seek(&mut self, place: SeekFrom) -> io::Result<u64> {
        self.source.seek(place)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.source.stream_position()
    }
}
