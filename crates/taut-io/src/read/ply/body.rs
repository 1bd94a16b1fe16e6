//! The vertices of a PLY file.

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{
    ElementDef, Encoding, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::EXPORT_REMEDY;
use super::header::{COLUMN, KNOWN, Layout};
use crate::error::{Fault, quoted};
use crate::point_set::PointSet;
use crate::text::{number, text_behind};

/// A vertex of the file. A property that is absent stays zero.
#[derive(Debug, Default, Clone, Copy)]
struct Vertex {
    values: [f64; 7],
}

/// A record that is passed over.
pub(super) struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

impl Vertex {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        match slot(name) {
            Some(slot) => {
                self.values[slot] = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::Ignored,
        }
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }
}

/// The place of a property in [`Vertex::values`].
fn slot(property: &str) -> Option<usize> {
    let mut names = KNOWN.iter().chain([&COLUMN]);
    names.position(|name| *name == property)
}

/// What is kept of the vertices.
#[derive(Default)]
struct Kept {
    coordinates: Vec<f64>,
    normals: Vec<f64>,
    column: Vec<f64>,
}

impl Layout<'_> {
    fn points(&self, kept: Kept) -> PointSet {
        let normals = self.has_normals.then_some(kept.normals);
        PointSet {
            column: self.has_column.then_some(kept.column),
            ..PointSet::three_dimensional(kept.coordinates, normals)
        }
    }

    fn push(&self, vertex: &Vertex, kept: &mut Kept) {
        let [position @ .., _, _, _, column] = &vertex.values;
        kept.coordinates.extend_from_slice(position);
        if self.has_normals {
            kept.normals.extend_from_slice(&vertex.values[3..6]);
        }
        if self.has_column {
            kept.column.push(*column);
        }
    }

    fn too_few(&self, found: usize, end: u64) -> Fault {
        Fault::byte(
            end,
            format!("{found} vertices before the file ends"),
            format!("the declared {}", self.vertex.count),
            EXPORT_REMEDY,
        )
    }
}

/// The fewest bytes of a binary record: a list may be empty.
fn least_size(element: &ElementDef) -> usize {
    let size = |scalar: &ScalarType| match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let least = |property: &PropertyType| match property {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => size(scalar),
    };
    element
        .properties
        .values()
        .map(|property| least(&property.data_type))
        .sum()
}

/// Compares the declared counts with the length of a binary body.
pub(super) fn check_length(
    body: &[u8],
    header_bytes: usize,
    layout: &Layout<'_>,
) -> Result<(), Fault> {
    let mut left = body.len();
    for element in layout.before.iter().copied().chain([layout.vertex]) {
        let size = least_size(element);
        let Some(rest) = size
            .checked_mul(element.count)
            .and_then(|needed| left.checked_sub(needed))
        else {
            return Err(Fault::byte(
                (header_bytes + body.len()) as u64,
                format!(
                    "{} {} records before the file ends",
                    left / size,
                    element.name
                ),
                format!(
                    "the declared {}, each of {size} bytes or more",
                    element.count
                ),
                EXPORT_REMEDY,
            ));
        };
        left = rest;
    }
    Ok(())
}

pub(super) fn read_binary(
    mut body: &[u8],
    header_bytes: usize,
    layout: &Layout<'_>,
) -> Result<PointSet, Fault> {
    let end = (header_bytes + body.len()) as u64;
    let little = layout.encoding == Encoding::BinaryLittleEndian;
    let skip = Parser::<Skipped>::new();
    for element in &layout.before {
        for _ in 0..element.count {
            match little {
                true => skip.read_little_endian_element(&mut body, element),
                false => skip.read_big_endian_element(&mut body, element),
            }
            .map_err(|_| layout.too_few(0, end))?;
        }
    }
    let parser = Parser::<Vertex>::new();
    let mut kept = Kept::default();
    kept.coordinates.reserve_exact(3 * layout.vertex.count);
    for index in 0..layout.vertex.count {
        let vertex = match little {
            true => parser.read_little_endian_element(&mut body, layout.vertex),
            false => parser.read_big_endian_element(&mut body, layout.vertex),
        }
        .map_err(|_| layout.too_few(index, end))?;
        layout.push(&vertex, &mut kept);
    }
    Ok(layout.points(kept))
}

pub(super) fn read_text(
    file: &[u8],
    header_bytes: usize,
    layout: &Layout<'_>,
) -> Result<PointSet, Fault> {
    let text = text_behind(file, header_bytes)?;
    let header_lines = file[..header_bytes]
        .iter()
        .filter(|byte| **byte == b'\n')
        .count();
    let passed: usize = layout
        .before
        .iter()
        .fold(0, |sum, element| sum.saturating_add(element.count));
    let mut lines = text.lines().enumerate().skip(passed);
    let mut kept = Kept::default();
    let properties: Vec<(Option<usize>, &PropertyType)> = layout
        .vertex
        .properties
        .iter()
        .map(|(name, property)| (slot(name), &property.data_type))
        .collect();
    for index in 0..layout.vertex.count {
        let Some((offset, row)) = lines.next() else {
            return Err(Fault::line(
                header_lines + text.lines().count(),
                format!("{index} vertices before the file ends"),
                format!("the declared {}", layout.vertex.count),
                EXPORT_REMEDY,
            ));
        };
        let vertex = text_vertex(row, header_lines + offset + 1, &properties)?;
        layout.push(&vertex, &mut kept);
    }
    Ok(layout.points(kept))
}

fn text_vertex(
    row: &str,
    line: usize,
    properties: &[(Option<usize>, &PropertyType)],
) -> Result<Vertex, Fault> {
    let wrong = || {
        Fault::line(
            line,
            quoted(row),
            format!("the {} values of a vertex", properties.len()),
            "correct the line, or the properties in the header",
        )
    };
    let mut vertex = Vertex::default();
    let mut fields = row.split_ascii_whitespace();
    for (slot, data_type) in properties {
        let field = fields.next().ok_or_else(wrong)?;
        match (data_type, slot) {
            (PropertyType::Scalar(_), Some(slot)) => vertex.values[*slot] = number(field, line)?,
            (PropertyType::Scalar(_), None) => {}
            (PropertyType::List(..), _) => {
                let length: usize = field.parse().map_err(|_| wrong())?;
                if length > 0 {
                    fields.nth(length - 1).ok_or_else(wrong)?;
                }
            }
        }
    }
    match fields.next() {
        None => Ok(vertex),
        Some(_) => Err(wrong()),
    }
}
