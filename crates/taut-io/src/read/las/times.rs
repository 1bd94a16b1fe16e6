//! Looks at the GPS times of layered records, of point formats 6 and up, before `laz` unpacks them.
//!
//! A time may be said to belong to another of four sequences, and then to yet another. `laz` calls
//! itself for each of these, so that damaged files overflow the stack. Here the same packed bits
//! are followed in a loop: of a record only what decides which bits come next, that is neither
//! places nor times themselves.

use std::io::{self, Cursor, Read, Seek, SeekFrom};

use laz::LazVlr;
use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};

use super::raw::{EXPORT_REMEDY, RawHeader};
use super::records::{Chunk, each_chunk, unpacking};
use crate::error::Fault;

/// From sequence to sequence this often at most; a writer has no use for more than one such step.
const MOST_STEPS: usize = 100;
/// Of the nine layers of a record's first part: returns, channel, x and y are in the first, times
/// in the last.
const PLACES: usize = 0;
const TIMES: usize = 8;
/// Where in a record numbers of returns and the channel stand.
const RETURNS_AT: usize = 14;
const CHANNEL_AT: usize = 15;

/// Refuses times that go from sequence to sequence without end.
pub(crate) fn check<S: Read + Seek>(
    source: &mut S,
    length: u64,
    raw: &RawHeader,
    laszip: &LazVlr,
) -> Result<(), Fault> {
    let mut first = 0;
    each_chunk(source, length, raw, laszip, |source, chunk| {
        let points = chunk.points.min(raw.points - first);
        let start: u64 = chunk.layers[..TIMES]
            .iter()
            .map(|size| u64::from(*size))
            .sum();
        let start = chunk.layers_start + start;
        let times = part(source, start, chunk.layers[TIMES])?;
        if !times.is_empty() && is_endless(source, chunk, points, times)? {
            return Err(Fault::byte(
                start,
                format!(
                    "GPS times that go from sequence to sequence without end, in one of {points} records from {first} on"
                ),
                format!("at most {MOST_STEPS} such steps for a record"),
                EXPORT_REMEDY,
            ));
        }
        first += points;
        Ok(())
    })
}

fn part(source: &mut (impl Read + Seek), start: u64, size: u32) -> Result<Vec<u8>, Fault> {
    let mut bytes = Vec::new();
    source.seek(SeekFrom::Start(start))?;
    source.by_ref().take(size.into()).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Whether times of a chunk take too many steps. What cannot be unpacked at all does not: that is
/// found out later.
fn is_endless(
    source: &mut (impl Read + Seek),
    chunk: &Chunk,
    points: u64,
    times: Vec<u8>,
) -> Result<bool, Fault> {
    let record = part(source, chunk.start, CHANNEL_AT as u32 + 1)?;
    let places = part(source, chunk.layers_start, chunk.layers[PLACES])?;
    let follow = || -> io::Result<bool> {
        let mut follower = Follower::new(&record, places, times)?;
        for _ in 1..points {
            if follower.next()? > MOST_STEPS {
                return Ok(true);
            }
        }
        Ok(false)
    };
    Ok(unpacking(follow).unwrap_or(false))
}

type Decoder = ArithmeticDecoder<Cursor<Vec<u8>>>;

fn decoder(bytes: Vec<u8>) -> io::Result<Decoder> {
    let is_empty = bytes.is_empty();
    let mut decoder = ArithmeticDecoder::new(Cursor::new(bytes));
    if !is_empty {
        decoder.read_init_bytes()?;
    }
    Ok(decoder)
}

fn model(symbols: u32) -> ArithmeticModel {
    ArithmeticModelBuilder::new(symbols).build()
}

fn integers(contexts: u32) -> IntegerDecompressor {
    let mut builder = IntegerDecompressorBuilder::new();
    builder.bits(32).contexts(contexts).build_initialized()
}

/// A walk along the records of a chunk.
struct Follower {
    places: Decoder,
    times: Decoder,
    channels: [Option<Box<Channel>>; 4],
    current: usize,
}

/// What a scanner's channel remembers.
struct Channel {
    number: u32,
    returns: u32,
    time_changed: bool,
    changes: Vec<ArithmeticModel>,
    other_channel: ArithmeticModel,
    returns_models: [Option<ArithmeticModel>; 16],
    number_models: [Option<ArithmeticModel>; 16],
    number_same_time: ArithmeticModel,
    x: IntegerDecompressor,
    y: IntegerDecompressor,
    times: Times,
}

impl Channel {
    fn new(number: u32, returns: u32) -> Box<Self> {
        Box::new(Self {
            number,
            returns,
            time_changed: false,
            changes: (0..8).map(|_| model(128)).collect(),
            other_channel: model(3),
            returns_models: Default::default(),
            number_models: Default::default(),
            number_same_time: model(13),
            x: integers(2),
            y: integers(22),
            times: Times::new(),
        })
    }
}

impl Follower {
    /// Begins at a chunk's first record.
    fn new(record: &[u8], places: Vec<u8>, times: Vec<u8>) -> io::Result<Self> {
        let byte = |at: usize| record.get(at).copied().ok_or(io::ErrorKind::UnexpectedEof);
        let (returns, channel) = (byte(RETURNS_AT)?, byte(CHANNEL_AT)?);
        let current = usize::from(channel >> 4 & 3);
        let mut channels = [const { None }; 4];
        channels[current] = Some(Channel::new(
            u32::from(returns & 15),
            u32::from(returns >> 4),
        ));
        Ok(Self {
            places: decoder(places)?,
            times: decoder(times)?,
            channels,
            current,
        })
    }

    /// Goes on to the next record; the steps that its time takes.
    fn next(&mut self) -> io::Result<usize> {
        let channel = self.channels[self.current].get_or_insert_with(|| Channel::new(0, 0));
        let (number, returns) = (channel.number, channel.returns);
        let context = usize::from(number == 1)
            + 2 * usize::from(number >= returns)
            + 4 * usize::from(channel.time_changed);
        let changed = self.places.decode_symbol(&mut channel.changes[context])?;
        let has = |bit: u32| changed >> bit & 1 == 1;
        if has(6) {
            let step = self.places.decode_symbol(&mut channel.other_channel)? as usize;
            self.current = (self.current + step + 1) % 4;
        }
        let places = &mut self.places;
        let channel =
            self.channels[self.current].get_or_insert_with(|| Channel::new(number, returns));
        if has(2) {
            let model_of = &mut channel.returns_models[channel.returns as usize];
            channel.returns = places.decode_symbol(model_of.get_or_insert_with(|| model(16)))?;
        }
        let last = channel.number;
        channel.number = match (changed & 3, has(4)) {
            (0, _) => last,
            (1, _) => (last + 1) % 16,
            (2, _) => (last + 15) % 16,
            (_, true) => {
                let model_of = &mut channel.number_models[last as usize];
                places.decode_symbol(model_of.get_or_insert_with(|| model(16)))?
            }
            (_, false) => {
                let step = places.decode_symbol(&mut channel.number_same_time)?;
                (last + step + 2) % 16
            }
        };
        let is_only = u32::from(channel.returns == 1);
        channel.x.decompress(places, 0, is_only)?;
        let bits = channel.x.k().min(20) & !1;
        channel.y.decompress(places, 0, is_only + bits)?;
        channel.time_changed = has(4);
        if !channel.time_changed {
            return Ok(0);
        }
        channel.times.next(&mut self.times)
    }
}

/// The four sequences of times.
struct Times {
    current: usize,
    newest: usize,
    differences: [i32; 4],
    extremes: [u32; 4],
    from_zero: ArithmeticModel,
    multiple: ArithmeticModel,
    integers: IntegerDecompressor,
}

impl Times {
    /// Multiples of the last difference from 0 on, negative ones behind them, then other sequences.
    const MOST: u32 = 500;
    const LEAST: u32 = Self::MOST + 10;
    const NEW: u32 = Self::LEAST + 1;

    fn new() -> Self {
        Self {
            current: 0,
            newest: 0,
            differences: [0; 4],
            extremes: [0; 4],
            from_zero: model(5),
            multiple: model(Self::NEW + 4),
            integers: integers(9),
        }
    }

    /// The steps that the next time takes, no more counted than are allowed.
    fn next(&mut self, decoder: &mut Decoder) -> io::Result<usize> {
        for steps in 0..=MOST_STEPS {
            let step = if self.differences[self.current] == 0 {
                self.after_zero(decoder)?
            } else {
                self.after_difference(decoder)?
            };
            match step {
                None => return Ok(steps),
                Some(step) => self.current = (self.current + step) & 3,
            }
        }
        Ok(MOST_STEPS + 1)
    }

    /// How many sequences further on, if the time is not here.
    fn after_zero(&mut self, decoder: &mut Decoder) -> io::Result<Option<usize>> {
        match decoder.decode_symbol(&mut self.from_zero)? {
            0 => {
                self.differences[self.current] = self.integers.decompress(decoder, 0, 0)?;
                self.extremes[self.current] = 0;
            }
            1 => self.begin(decoder)?,
            symbol => return Ok(Some(symbol as usize - 1)),
        }
        Ok(None)
    }

    fn after_difference(&mut self, decoder: &mut Decoder) -> io::Result<Option<usize>> {
        let last = self.differences[self.current];
        let symbol = decoder.decode_symbol(&mut self.multiple)?;
        // The multiple, the context, and whether it is an extreme that may become the difference.
        let (multiple, context, is_extreme) = match symbol {
            1 => {
                self.integers.decompress(decoder, last, 1)?;
                self.extremes[self.current] = 0;
                return Ok(None);
            }
            0 => (0, 7, true),
            2..10 => (symbol as i32, 2, false),
            10..Self::MOST => (symbol as i32, 3, false),
            Self::MOST => (symbol as i32, 4, true),
            501..Self::LEAST => (Self::MOST as i32 - symbol as i32, 5, false),
            Self::LEAST => (Self::MOST as i32 - symbol as i32, 6, true),
            Self::NEW => {
                self.begin(decoder)?;
                return Ok(None);
            }
            symbol => return Ok(Some((symbol - Self::NEW) as usize)),
        };
        let predicted = multiple.wrapping_mul(last);
        let difference = self.integers.decompress(decoder, predicted, context)?;
        if is_extreme {
            let extremes = &mut self.extremes[self.current];
            *extremes += 1;
            if *extremes > 3 {
                *extremes = 0;
                self.differences[self.current] = difference;
            }
        }
        Ok(None)
    }

    /// Begins a sequence in the place of the oldest.
    fn begin(&mut self, decoder: &mut Decoder) -> io::Result<()> {
        self.newest = (self.newest + 1) & 3;
        self.integers.decompress(decoder, 0, 8)?;
        decoder.read_int()?;
        self.current = self.newest;
        self.differences[self.current] = 0;
        self.extremes[self.current] = 0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr};

    use super::*;

    /// Records of point format 6 whose fields all jump about, with times of several sequences.
    fn records(count: usize) -> Vec<[u8; 30]> {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 56) as u8
        };
        (0..count)
            .map(|row| {
                let mut record = [0; 30];
                record.fill_with(&mut random);
                let time = f64::from(random() % 5) * 1e5 + (row / 3) as f64 * 0.01;
                record[22..].copy_from_slice(&time.to_le_bytes());
                record
            })
            .collect()
    }

    #[test]
    fn the_walk_meets_every_record() {
        let records = records(2000);
        let items = LazItemRecordBuilder::default_for_point_format_id(6, 0).unwrap();
        let mut packed =
            LasZipCompressor::new(Cursor::new(Vec::new()), LazVlr::from_laz_items(items)).unwrap();
        for record in &records {
            packed.compress_one(record).unwrap();
        }
        packed.done().unwrap();
        let bytes = packed.into_inner().into_inner();
        let sizes_at = 8 + 30 + 4;
        let size = |layer: usize| {
            u32::from_le_bytes(*bytes[sizes_at + 4 * layer..].first_chunk().unwrap()) as usize
        };
        let layers_at = sizes_at + 36;
        let times_at = layers_at + (0..TIMES).map(size).sum::<usize>();
        let places = bytes[layers_at..][..size(PLACES)].to_vec();
        let times = bytes[times_at..][..size(TIMES)].to_vec();
        let mut follower = Follower::new(&records[0], places, times).unwrap();
        let mut most_steps = 0;
        for record in &records[1..] {
            most_steps = most_steps.max(follower.next().unwrap());
            let channel = follower.channels[follower.current].as_ref().unwrap();
            let returns = (channel.number | channel.returns << 4) as u8;
            assert_eq!(returns, record[RETURNS_AT]);
            assert_eq!(follower.current, usize::from(record[CHANNEL_AT] >> 4 & 3));
        }
        assert_eq!(most_steps, 1);
    }
}
