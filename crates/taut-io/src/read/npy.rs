//! NPY, one NumPy array: versions 1 to 3, `f4` or `f8` of either byte order, C or Fortran order,
//! shape (n, d), d >= 2.
//!
//! Source: NEP 1, "A simple file format for NumPy arrays".

use crate::error::{Fault, quoted};
use crate::point_set::PointSet;

const SAVE_REMEDY: &str = "save it with numpy.save(file, points.astype('<f8'))";

/// The header as it stands in the file.
struct Raw<'a> {
    dictionary: &'a str,
    dictionary_offset: u64,
    body: &'a [u8],
    body_offset: u64,
}

/// The header's meaning.
struct Layout {
    element: Element,
    fortran_order: bool,
    rows: usize,
    dimension: usize,
}

#[derive(Clone, Copy)]
enum Element {
    F4Little,
    F4Big,
    F8Little,
    F8Big,
}

pub(super) fn read(bytes: &[u8]) -> Result<PointSet, Fault> {
    let raw = Raw::parse(bytes)?;
    let layout = Layout::of(&raw)?;
    let values = layout.element.decode(raw.body);
    let coordinates = if layout.fortran_order {
        let mut row_major = vec![0.0; values.len()];
        for (index, value) in values.into_iter().enumerate() {
            row_major[index % layout.rows * layout.dimension + index / layout.rows] = value;
        }
        row_major
    } else {
        values
    };
    Ok(PointSet {
        dimension: layout.dimension,
        coordinates,
        ..PointSet::default()
    })
}

impl<'a> Raw<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, Fault> {
        let truncated = || {
            Fault::byte(
                bytes.len() as u64,
                "the end of the file inside the header",
                "a complete NPY header",
                SAVE_REMEDY,
            )
        };
        let Some(rest) = bytes.strip_prefix(b"\x93NUMPY") else {
            return Err(Fault::byte(
                0,
                quoted(&String::from_utf8_lossy(&bytes[..bytes.len().min(6)])),
                "the NPY signature \\x93NUMPY",
                SAVE_REMEDY,
            ));
        };
        let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(truncated)?;
        let (length, rest) = match version[0] {
            1 => {
                let (length, rest) = rest.split_first_chunk().ok_or_else(truncated)?;
                (usize::from(u16::from_le_bytes(*length)), rest)
            }
            2 | 3 => {
                let (length, rest) = rest.split_first_chunk().ok_or_else(truncated)?;
                (u32::from_le_bytes(*length) as usize, rest)
            }
            other => {
                return Err(Fault::byte(
                    6,
                    format!("version {other}"),
                    "version 1, 2 or 3",
                    SAVE_REMEDY,
                ));
            }
        };
        let dictionary_offset = (bytes.len() - rest.len()) as u64;
        let (dictionary, body) = rest.split_at_checked(length).ok_or_else(truncated)?;
        let dictionary = std::str::from_utf8(dictionary).map_err(|_| {
            Fault::byte(
                dictionary_offset,
                "bytes that are not text",
                "a header in UTF-8",
                SAVE_REMEDY,
            )
        })?;
        Ok(Self {
            dictionary,
            dictionary_offset,
            body,
            body_offset: dictionary_offset + length as u64,
        })
    }

    /// The text behind a key of the header's dictionary, such as `'<f8', ...` behind `'descr':`.
    fn value_of(&self, key: &str) -> Result<&'a str, Fault> {
        let quotations = [format!("'{key}'"), format!("\"{key}\"")];
        let behind_key = quotations
            .iter()
            .find_map(|quotation| self.dictionary.split_once(quotation.as_str()));
        match behind_key {
            Some((_, rest)) if rest.trim_start().starts_with(':') => {
                Ok(rest.trim_start()[1..].trim_start())
            }
            _ => Err(self.wrong(
                quoted(self.dictionary),
                format!("a dictionary with the key {key:?}"),
            )),
        }
    }

    fn wrong(&self, found: String, expected: impl Into<String>) -> Fault {
        Fault::byte(self.dictionary_offset, found, expected, SAVE_REMEDY)
    }
}

impl Layout {
    fn of(raw: &Raw<'_>) -> Result<Self, Fault> {
        let descr = raw.value_of("descr")?;
        let element = Element::of(descr).ok_or_else(|| {
            let found = descr.split(',').next().unwrap_or(descr);
            raw.wrong(
                format!(
                    "the element type {}",
                    quoted(found.trim_matches(['\'', '"']))
                ),
                "f4 or f8",
            )
        })?;
        let fortran_order = raw.value_of("fortran_order")?.starts_with("True");
        let (rows, dimension) = shape(raw)?;
        let layout = Self {
            element,
            fortran_order,
            rows,
            dimension,
        };
        layout.check_length(raw)?;
        Ok(layout)
    }

    fn check_length(&self, raw: &Raw<'_>) -> Result<(), Fault> {
        let declared = self
            .rows
            .checked_mul(self.dimension)
            .and_then(|elements| elements.checked_mul(self.element.size()));
        if declared == Some(raw.body.len()) {
            return Ok(());
        }
        let row = self.dimension.saturating_mul(self.element.size());
        Err(Fault::byte(
            raw.body_offset,
            format!(
                "{} bytes, that is {} rows",
                raw.body.len(),
                raw.body.len() / row
            ),
            format!("the declared {} rows of {row} bytes", self.rows),
            "the file is cut off or its shape is wrong: save it again",
        ))
    }
}

fn shape(raw: &Raw<'_>) -> Result<(usize, usize), Fault> {
    let text = raw.value_of("shape")?;
    let inside = text
        .strip_prefix('(')
        .and_then(|rest| rest.split_once(')'))
        .map(|(inside, _)| inside);
    let sizes: Option<Vec<usize>> = inside.and_then(|inside| {
        inside
            .split(',')
            .map(str::trim)
            .filter(|size| !size.is_empty())
            .map(|size| size.parse().ok())
            .collect()
    });
    match sizes.as_deref() {
        Some([rows, dimension]) if *dimension >= 2 => Ok((*rows, *dimension)),
        _ => {
            let found = text.split_inclusive(')').next().unwrap_or(text);
            Err(raw.wrong(
                format!("the shape {}", quoted(found)),
                "(n, d): n points of d coordinates, d at least 2",
            ))
        }
    }
}

impl Element {
    fn of(descr: &str) -> Option<Self> {
        let name = descr.strip_prefix(['\'', '"'])?;
        let end = name.find(['\'', '"'])?;
        match &name[..end] {
            "<f4" | "=f4" | "f4" => Some(Self::F4Little),
            ">f4" => Some(Self::F4Big),
            "<f8" | "=f8" | "f8" => Some(Self::F8Little),
            ">f8" => Some(Self::F8Big),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::F4Little | Self::F4Big => 4,
            Self::F8Little | Self::F8Big => 8,
        }
    }

    fn decode(self, body: &[u8]) -> Vec<f64> {
        let f4 = |read: fn([u8; 4]) -> f32| {
            body.as_chunks()
                .0
                .iter()
                .map(|bytes| f64::from(read(*bytes)))
                .collect()
        };
        let f8 = |read: fn([u8; 8]) -> f64| {
            body.as_chunks()
                .0
                .iter()
                .map(|bytes| read(*bytes))
                .collect()
        };
        match self {
            Self::F4Little => f4(f32::from_le_bytes),
            Self::F4Big => f4(f32::from_be_bytes),
            Self::F8Little => f8(f64::from_le_bytes),
            Self::F8Big => f8(f64::from_be_bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, body: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((header.len() as u16).to_le_bytes()),
            _ => bytes.extend((header.len() as u32).to_le_bytes()),
        }
        bytes.extend(header.as_bytes());
        bytes.extend(body);
        bytes
    }

    #[test]
    fn orders_and_types_agree() {
        let rows = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let columns = [1.0, 4.0, 2.0, 5.0, 3.0, 6.0];
        let little: Vec<u8> = rows
            .iter()
            .flat_map(|value: &f64| value.to_le_bytes())
            .collect();
        let big: Vec<u8> = columns
            .iter()
            .flat_map(|value: &f32| value.to_be_bytes())
            .collect();
        let c_order = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n";
        let fortran = "{'descr': '>f4', 'fortran_order': True, 'shape': (2, 3), }\n";
        for (version, header, body) in [
            (1, c_order, &little),
            (3, fortran, &big),
            (2, c_order, &little),
        ] {
            let points = read(&file(version, header, body)).unwrap();
            assert_eq!(
                (points.dimension, points.coordinates.as_slice()),
                (3, rows.as_slice())
            );
        }
    }

    #[test]
    fn other_shapes_are_refused() {
        for shape in [
            "(6,)",
            "(6, 1)",
            "(1, 2, 3)",
            "6",
            "(-2, 3)",
            "(2305843009213693952, 8)",
        ] {
            let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
            assert!(read(&file(1, &header, &[0; 48])).is_err(), "{shape}");
        }
    }
}
