//! PLY: ASCII, binary little and big endian; the properties x, y, z and nx, ny, nz of the element `vertex`.
//!
//! Header and binary records are parsed by `ply-rs-bw`, after its counts have been compared with the file's length.
//! ASCII rows are parsed here: they keep the digits of `f64` even where a property is declared `float`.

use std::collections::HashSet;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use crate::error::{Fault, quoted};
use crate::point_set::PointSet;
use crate::text::{as_text, number};

const EXPORT_REMEDY: &str = "the file is cut off or its header is wrong: export it again";

/// A vertex of the file. A property that is absent stays zero.
#[derive(Debug, Default, Clone, Copy)]
struct Vertex {
    values: [f64; 6],
}

/// A record that is passed over.
struct Skipped;

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
    ["x", "y", "z", "nx", "ny", "nz"]
        .iter()
        .position(|name| *name == property)
}

/// The header's meaning.
struct Layout<'a> {
    encoding: Encoding,
    vertex: &'a ElementDef,
    /// The elements whose records stand before the vertices.
    before: Vec<&'a ElementDef>,
    has_normals: bool,
    /// Number of records behind the vertices or before them, with the element's name.
    ignored: Vec<(usize, &'a str)>,
}

pub(super) fn read(bytes: &[u8]) -> Result<PointSet, Fault> {
    let mut reader = Reader::new(bytes);
    let header = read_header(&mut reader, bytes)?;
    let body = *reader.get_ref();
    let header_bytes = bytes.len() - body.len();
    let layout = Layout::of(&header)?;
    let mut points = match layout.encoding {
        Encoding::Ascii => read_text(
            body,
            bytes[..header_bytes]
                .iter()
                .filter(|byte| **byte == b'\n')
                .count(),
            &layout,
        )?,
        Encoding::BinaryLittleEndian | Encoding::BinaryBigEndian => {
            check_length(body, header_bytes, &layout)?;
            read_binary(body, header_bytes, &layout)?
        }
    };
    for (count, name) in &layout.ignored {
        points.note_ignored(*count, &format!("records of the element {name:?}"));
    }
    Ok(points)
}

fn read_header(reader: &mut Reader<&[u8]>, bytes: &[u8]) -> Result<Header, Fault> {
    let header = Parser::<Skipped>::new().read_header(reader).map_err(|error| {
        let line = error.line().unwrap_or(1);
        let found = bytes.split(|byte| *byte == b'\n').nth(line - 1).unwrap_or_default();
        let expected = match line {
            1 => "the word ply",
            _ => "a line of a PLY header (format, comment, element, property) and end_header at its end",
        };
        Fault::line(line, quoted(&String::from_utf8_lossy(found)), expected, EXPORT_REMEDY)
    })?;
    refuse_repeated_names(&bytes[..bytes.len() - reader.get_ref().len()])?;
    Ok(header)
}

/// The header's maps keep one of two properties of the same name, which would shift every value behind it.
fn refuse_repeated_names(text: &[u8]) -> Result<(), Fault> {
    let mut elements = HashSet::new();
    let mut properties = HashSet::new();
    for (index, line) in text.split(|byte| *byte == b'\n').enumerate() {
        let mut words = line
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty());
        let is_new = match words.next() {
            Some(b"element") => {
                properties.clear();
                words.next().is_none_or(|name| elements.insert(name))
            }
            Some(b"property") => words.next_back().is_none_or(|name| properties.insert(name)),
            _ => true,
        };
        if !is_new {
            return Err(Fault::line(
                index + 1,
                quoted(&String::from_utf8_lossy(line)),
                "a name of its own for every element and property",
                "rename or remove the second one",
            ));
        }
    }
    Ok(())
}

impl<'a> Layout<'a> {
    fn of(header: &'a Header) -> Result<Self, Fault> {
        let names: Vec<&str> = header.elements.keys().map(String::as_str).collect();
        let Some((position, _, vertex)) = header.elements.get_full("vertex") else {
            return Err(Fault::line(
                1,
                format!("the elements {names:?}"),
                "an element named vertex",
                "export the file with its vertices",
            ));
        };
        let scalar = |name: &str| {
            let property = vertex.properties.get(name)?;
            matches!(property.data_type, PropertyType::Scalar(_)).then_some(())
        };
        if let Some(missing) = ["x", "y", "z"]
            .into_iter()
            .find(|name| scalar(name).is_none())
        {
            let found: Vec<&str> = vertex.properties.keys().map(String::as_str).collect();
            return Err(Fault::line(
                1,
                format!("the vertex properties {found:?}"),
                format!("x, y and z, each a number ({missing} is missing)"),
                "export the file with all three coordinates",
            ));
        }
        let before: Vec<&ElementDef> = header.elements.values().take(position).collect();
        if let Some(element) = before
            .iter()
            .find(|element| element.properties.is_empty() && element.count > 0)
        {
            return Err(Fault::line(
                1,
                format!(
                    "the element {:?} of {} records without properties",
                    element.name, element.count
                ),
                "at least one property",
                EXPORT_REMEDY,
            ));
        }
        let ignored = header
            .elements
            .values()
            .filter(|element| element.name != "vertex");
        Ok(Self {
            encoding: header.encoding,
            vertex,
            before,
            has_normals: ["nx", "ny", "nz"]
                .into_iter()
                .all(|name| scalar(name).is_some()),
            ignored: ignored
                .map(|element| (element.count, element.name.as_str()))
                .collect(),
        })
    }

    fn points(&self, vertices: Vec<f64>, normals: Vec<f64>) -> PointSet {
        PointSet::three_dimensional(vertices, self.has_normals.then_some(normals))
    }

    fn push(&self, vertex: &Vertex, coordinates: &mut Vec<f64>, normals: &mut Vec<f64>) {
        let (position, normal) = vertex.values.split_at(3);
        coordinates.extend_from_slice(position);
        if self.has_normals {
            normals.extend_from_slice(normal);
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
fn check_length(body: &[u8], header_bytes: usize, layout: &Layout<'_>) -> Result<(), Fault> {
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

fn read_binary(
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
    let mut coordinates = Vec::with_capacity(3 * layout.vertex.count);
    let mut normals = Vec::new();
    for index in 0..layout.vertex.count {
        let vertex = match little {
            true => parser.read_little_endian_element(&mut body, layout.vertex),
            false => parser.read_big_endian_element(&mut body, layout.vertex),
        }
        .map_err(|_| layout.too_few(index, end))?;
        layout.push(&vertex, &mut coordinates, &mut normals);
    }
    Ok(layout.points(coordinates, normals))
}

fn read_text(body: &[u8], header_lines: usize, layout: &Layout<'_>) -> Result<PointSet, Fault> {
    let text = as_text(body)?;
    let passed: usize = layout
        .before
        .iter()
        .fold(0, |sum, element| sum.saturating_add(element.count));
    let mut lines = text.lines().enumerate().skip(passed);
    let mut coordinates = Vec::new();
    let mut normals = Vec::new();
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
        layout.push(&vertex, &mut coordinates, &mut normals);
    }
    Ok(layout.points(coordinates, normals))
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

#[cfg(test)]
mod tests {
    use super::*;

    fn header(format: &str, elements: &str) -> Vec<u8> {
        format!("ply\nformat {format} 1.0\n{elements}end_header\n").into_bytes()
    }

    const XYZ: &str = "element vertex 1\nproperty float x\nproperty double y\nproperty uchar z\n";

    #[test]
    fn lists_before_and_inside_are_passed_over() {
        let elements = format!(
            "element face 2\nproperty list uchar short a\n{XYZ}property list uchar float w\n"
        );
        let mut ascii = header("ascii", &elements);
        ascii.extend(b"1 7\n0\n0.1 2.5 3 2 8 9\n");
        assert_eq!(read(&ascii).unwrap().coordinates, [0.1, 2.5, 3.0]);
        let mut binary = header("binary_big_endian", &elements);
        binary.extend([1, 0, 7, 0]);
        binary.extend(0.5_f32.to_be_bytes());
        binary.extend(2.5_f64.to_be_bytes());
        binary.extend([3, 0]);
        assert_eq!(read(&binary).unwrap().coordinates, [0.5, 2.5, 3.0]);
        binary.pop();
        assert!(read(&binary).is_err());
    }

    #[test]
    fn repeated_names_are_refused() {
        let elements = "element vertex 1\nproperty float x\nproperty float x\nproperty float y\nproperty float z\n";
        let mut file = header("ascii", elements);
        file.extend(b"1 1 2 3\n");
        let Err(Fault::Malformed { place, .. }) = read(&file) else {
            panic!("a repeated property must be refused");
        };
        assert_eq!(place, crate::Place::Line(5));
    }

    #[test]
    fn records_without_properties_end_at_once() {
        let elements = format!("element void 1099511627776\n{XYZ}");
        assert!(read(&header("binary_little_endian", &elements)).is_err());
    }
}
