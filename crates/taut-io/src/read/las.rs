//! LAS and LAZ: positions, with a filter by classification.
//!
//! The header is parsed by the `las` crate, after the counts and lengths that it declares were
//! compared with the file's length, since the crate trusts them. Records come in blocks.

mod dimension;
pub(crate) mod raw;
pub(crate) mod records;
pub(crate) mod times;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{Read, Seek};

use las::{PointData, PointDataBuilder};

use crate::error::Fault;
use crate::point_set::PointSet;
use dimension::Dimension;
pub(crate) use dimension::{DESCRIPTOR, descriptors_size, names};
use raw::{EXPORT_REMEDY, RawHeader};
use records::{Fields, Records, with_deep_stack};

/// Bytes of records unpacked at a time.
pub(crate) const BLOCK: u64 = 1 << 22;

/// Reads and checks a header.
pub(crate) fn header(
    source: &mut (impl Read + Seek),
    length: u64,
) -> Result<(RawHeader, las::Header), Fault> {
    let raw = RawHeader::parse(source)?;
    raw.check(source, length)?;
    source.rewind()?;
    let header = las::Header::new(&mut *source).map_err(|error| wrong_header(&error))?;
    check_transforms(&header)?;
    Ok((raw, header))
}

pub(super) fn read<R>(
    mut source: R,
    length: u64,
    classes: &[u8],
    column: Option<&str>,
) -> Result<PointSet, Fault>
where
    R: Read + Seek + Send + Sync + 'static,
{
    let (raw, header) = header(&mut source, length)?;
    let column = column.map(|name| Dimension::of_name(&header, name));
    let selection = Selection::new(classes, column.transpose()?);
    let is_compressed = raw.is_compressed;
    let select = || select(source, length, &raw, &header, selection);
    if is_compressed {
        with_deep_stack(select)
    } else {
        select()
    }
}

fn select<R>(
    source: R,
    length: u64,
    raw: &RawHeader,
    header: &las::Header,
    mut selection: Selection<'_>,
) -> Result<PointSet, Fault>
where
    R: Read + Seek + Send + Sync + 'static,
{
    let mut records = Records::new(source, length, raw, header, Fields::WithoutTimes)?;
    let builder = PointDataBuilder::new().for_header(header);
    let mut row = 0;
    loop {
        let bytes = records.next(BLOCK)?;
        if bytes.is_empty() {
            return selection.finish(raw.points_offset);
        }
        let block = builder.clone().build_from_bytes(bytes);
        let block = block.map_err(|error| wrong_header(&error))?;
        selection.take(row, &block);
        row += block.len();
    }
}

fn wrong_header(found: &dyn Display) -> Fault {
    Fault::byte(0, found.to_string(), "a LAS header", EXPORT_REMEDY)
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

    fn take(&mut self, first_row: usize, records: &PointData) {
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
