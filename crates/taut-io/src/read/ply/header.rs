//! The header of a PLY file.

use std::collections::HashSet;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyType};

use super::EXPORT_REMEDY;
use super::body::Skipped;
use crate::error::{Fault, quoted};
use crate::text::{LONGEST_LINE, too_long};

/// The header's meaning.
pub(super) struct Layout<'a> {
    pub(super) encoding: Encoding,
    pub(super) vertex: &'a ElementDef,
    /// The elements whose records stand before the vertices.
    pub(super) before: Vec<&'a ElementDef>,
    pub(super) has_normals: bool,
    pub(super) has_column: bool,
    /// Number of records behind the vertices or before them, with the element's name.
    pub(super) ignored: Vec<(usize, &'a str)>,
}

pub(super) fn read_header(reader: &mut Reader<&[u8]>, bytes: &[u8]) -> Result<Header, Fault> {
    refuse_long_lines(bytes)?;
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

/// The parser copies lines as it goes.
fn refuse_long_lines(bytes: &[u8]) -> Result<(), Fault> {
    let lines = bytes.split(|byte| *byte == b'\n').enumerate();
    for (index, line) in lines {
        if line.trim_ascii() == b"end_header" {
            break;
        }
        if line.len() > LONGEST_LINE {
            return Err(too_long(index + 1));
        }
    }
    Ok(())
}

/// The header's maps keep one of two properties of the same name, which would shift every value
/// behind it.
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

/// The name that the property asked for goes by: no property's own, as those have no spaces.
pub(super) const COLUMN: &str = "the column";
/// The properties that mean something already.
pub(super) const KNOWN: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// Gives a property of the vertices the name by which it is read.
pub(super) fn mark_column(header: &mut Header, column: &str) -> Result<(), Fault> {
    let Some(vertex) = header.elements.get_mut("vertex") else {
        return Ok(());
    };
    let is_scalar = |kind: &PropertyType| matches!(kind, PropertyType::Scalar(_));
    let numbers = || {
        let all = vertex.properties.iter();
        let numbers = all.filter(|(_, property)| is_scalar(&property.data_type));
        let names = numbers.map(|(name, _)| name.as_str());
        names.filter(|name| !KNOWN.contains(name))
    };
    if !numbers().any(|name| name == column) {
        return Err(Fault::no_column(column, numbers()));
    }
    let properties = std::mem::take(&mut vertex.properties).into_iter();
    vertex.properties = properties
        .map(|(name, property)| {
            let name = if name == column {
                COLUMN.to_owned()
            } else {
                name
            };
            (name, property)
        })
        .collect();
    Ok(())
}

impl<'a> Layout<'a> {
    pub(super) fn of(header: &'a Header) -> Result<Self, Fault> {
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
            has_column: scalar(COLUMN).is_some(),
            ignored: ignored
                .map(|element| (element.count, element.name.as_str()))
                .collect(),
        })
    }
}
