//! What stands before the points of a LAS or LAZ file with further dimensions.

use std::ops::Range;

use laz::{LazItemRecordBuilder, LazVlr};

use super::original::{EXTRA_BYTES, Original, USER, place};
use crate::read::las::raw::VLR_HEADER;
use crate::read::las::{DESCRIPTOR, descriptors_size, names as names_of};

/// Where in a descriptor the data type stands, and that of doubles; of bytes without a meaning,
/// their number.
const TYPE_AT: usize = 2;
const DOUBLE: u8 = 10;
const OPTIONS_AT: usize = 3;
const NAME: Range<usize> = 4..36;
/// The bit of the point format that says that records are packed.
const PACKED: u8 = 1 << 7;
const FORMAT_BITS: u8 = 0b0011_1111;

/// What stands before the points of the new file.
pub(super) struct Head {
    /// The header, with the counts still to come.
    pub header: Vec<u8>,
    /// The variable length records and what follows them.
    pub behind: Vec<u8>,
    /// How records are packed, if they are.
    pub laszip: Option<LazVlr>,
    pub format: u8,
    /// Whether it counts in eight bytes.
    pub is_long: bool,
}

impl Head {
    /// Of a file with columns more, or why there cannot be one.
    pub fn new(original: &Original, names: &[&str], packed: bool) -> Result<Self, String> {
        let extra = usize::from(original.parsed.point_format().extra_bytes);
        let added = names.len() * size_of::<f64>();
        let record = u16::try_from(original.raw.record as usize + added)
            .map_err(|_| format!("a record of more than {} bytes", u16::MAX))?;
        let format = original.header[place::FORMAT] & FORMAT_BITS;
        let mut records: Vec<Vec<u8>> = Vec::new();
        records.extend(original.records.iter().map(|record| record.bytes.clone()));
        let descriptors = with_columns(&original.descriptors, extra, names)?;
        records.push(variable_record(
            USER,
            EXTRA_BYTES,
            "extra dimensions",
            &descriptors,
        )?);
        let laszip = packed
            .then(|| laszip(format, (extra + added) as u16))
            .transpose()?;
        if let Some(laszip) = &laszip {
            let mut data = Vec::new();
            laszip
                .write_to(&mut data)
                .map_err(|error| error.to_string())?;
            let (user, id) = (LazVlr::USER_ID, LazVlr::RECORD_ID);
            records.push(variable_record(user, id, LazVlr::DESCRIPTION, &data)?);
        }
        let count = records.len() as u32;
        let mut behind = records.concat();
        behind.extend(&original.padding);
        let mut header = original.header.clone();
        let points_offset = u32::try_from(header.len() + behind.len())
            .map_err(|_| "more than 4 GB before the points".to_owned())?;
        put(
            &mut header,
            place::POINTS_OFFSET,
            &points_offset.to_le_bytes(),
        );
        put(&mut header, place::RECORDS, &count.to_le_bytes());
        put(&mut header, place::RECORD_LENGTH, &record.to_le_bytes());
        header[place::FORMAT] = format | if packed { PACKED } else { 0 };
        Ok(Self {
            header,
            behind,
            laszip,
            format,
            is_long: original.raw.is_long,
        })
    }
}

/// Writes bytes into a header, where it is long enough for them.
pub(super) fn put(header: &mut [u8], at: usize, bytes: &[u8]) {
    if let Some(place) = header.get_mut(at..at + bytes.len()) {
        place.copy_from_slice(bytes);
    }
}

/// How records of a format are packed.
fn laszip(format: u8, extra: u16) -> Result<LazVlr, String> {
    /// Where the number of items stands, before them, and the parts of an item, each of two bytes.
    const ITEMS_AT: usize = 34;
    const WAVES: [u8; 2] = [9, 0];
    let items = LazItemRecordBuilder::default_for_point_format_id(format, extra);
    let items = items.map_err(|error| error.to_string())?;
    let mut data = Vec::new();
    let written = LazVlr::from_laz_items(items).write_to(&mut data);
    written.map_err(|error| error.to_string())?;
    for item in data[ITEMS_AT..].as_chunks_mut::<6>().0 {
        // `laz` calls the packing of wave forms the second version, of which LASzip knows only the
        // first: the same.
        if item.starts_with(&WAVES) {
            item[4..].copy_from_slice(&1_u16.to_le_bytes());
        }
    }
    LazVlr::from_buffer(data).map_err(|error| error.to_string())
}

fn variable_record(user: &str, id: u16, description: &str, data: &[u8]) -> Result<Vec<u8>, String> {
    let size = u16::try_from(data.len()).map_err(|_| {
        format!(
            "{} bytes that describe extra dimensions, more than {}",
            data.len(),
            u16::MAX
        )
    })?;
    let mut bytes = vec![0; VLR_HEADER as usize];
    put(&mut bytes, 2, user.as_bytes());
    put(&mut bytes, 18, &id.to_le_bytes());
    put(&mut bytes, 20, &size.to_le_bytes());
    put(&mut bytes, 22, description.as_bytes());
    bytes.extend(data);
    Ok(bytes)
}

/// Descriptors of all extra bytes: those that there were, of bytes that none of them describes, and
/// of the columns.
fn with_columns(known: &[u8], extra: usize, names: &[&str]) -> Result<Vec<u8>, String> {
    let (known, rest) = known.as_chunks::<DESCRIPTOR>();
    let described: usize = descriptors_size(known);
    let undescribed = extra.checked_sub(described).filter(|_| rest.is_empty());
    let Some(mut undescribed) = undescribed else {
        return Err(format!(
            "descriptors of {described} extra bytes where records have {extra}"
        ));
    };
    let mut all = known.to_vec();
    while undescribed > 0 {
        let size = undescribed.min(u8::MAX.into());
        let mut bytes = descriptor("undescribed");
        (bytes[TYPE_AT], bytes[OPTIONS_AT]) = (0, size as u8);
        all.push(bytes);
        undescribed -= size;
    }
    let mut taken = names_of(&all);
    for name in names {
        let name = free_name(name, &taken);
        all.push(descriptor(&name));
        taken.push(name);
    }
    Ok(all.concat())
}

/// A name that no dimension has yet.
fn free_name(name: &str, taken: &[String]) -> String {
    let numbered = (2_u32..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.to_owned())
        .chain(numbered)
        .find(|name| !taken.contains(name))
        .unwrap_or_default()
}

fn descriptor(name: &str) -> [u8; DESCRIPTOR] {
    let mut bytes = [0; DESCRIPTOR];
    bytes[TYPE_AT] = DOUBLE;
    for (byte, letter) in bytes[NAME].iter_mut().zip(name.bytes()) {
        *byte = letter;
    }
    bytes
}
