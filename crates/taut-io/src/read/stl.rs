//! STL: corners of triangles, welded where they are identical, in order of first appearance.
//!
//! The binary body is parsed by `stl_io`. Text is parsed here: its numbers keep the digits of
//! `f64`, and errors name the line. A file is binary if its length is what its count of triangles
//! demands, whatever its first word.

use std::collections::HashSet;
use std::io::Cursor;

use crate::error::{Fault, quoted};
use crate::point_set::PointSet;
use crate::text::{Lines, next_number};

const HEADER: usize = 80;
const BODY: usize = HEADER + 4;
const TRIANGLE: usize = 50;

pub(super) fn read(bytes: Vec<u8>) -> Result<PointSet, Fault> {
    let mut weld = Weld::default();
    let is_text = bytes.starts_with(b"solid");
    let triangles = match declared_triangles(&bytes) {
        Some(count) if bytes.len() == BODY + count * TRIANGLE => read_binary(bytes, &mut weld)?,
        Some(count) if !is_text && bytes.len() > BODY + count * TRIANGLE => {
            read_binary(bytes, &mut weld)?
        }
        _ if is_text => read_text(&bytes, &mut weld)?,
        declared => return Err(wrong_length(&bytes, declared)),
    };
    let mut points = PointSet::three_dimensional(weld.coordinates, None);
    points.note_ignored(triangles, "triangles");
    Ok(points)
}

fn declared_triangles(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count) as usize)
}

fn wrong_length(bytes: &[u8], declared: Option<usize>) -> Fault {
    const REMEDY: &str =
        "the file is cut off or no STL: export it again, or name its format with --format NAME";
    match declared {
        Some(count) => Fault::byte(
            HEADER as u64,
            format!(
                "{count} triangles declared, {} in the file",
                (bytes.len() - BODY) / TRIANGLE
            ),
            "as many as declared, or text that starts with \"solid\"",
            REMEDY,
        ),
        None => Fault::byte(
            bytes.len() as u64,
            "the end of the file",
            format!("a header of {BODY} bytes, or text that starts with \"solid\""),
            REMEDY,
        ),
    }
}

fn read_binary(mut bytes: Vec<u8>, weld: &mut Weld) -> Result<usize, Fault> {
    // Some writers begin the binary header with "solid", which stl_io takes for text; the header
    // means nothing.
    bytes[..HEADER].fill(0);
    let mut source = Cursor::new(bytes);
    let mut triangles = 0;
    for triangle in stl_io::create_stl_reader(&mut source)? {
        for corner in triangle?.vertices {
            weld.add(corner.0.map(f64::from));
        }
        triangles += 1;
    }
    Ok(triangles)
}

fn read_text(bytes: &[u8], weld: &mut Weld) -> Result<usize, Fault> {
    const EXPECTED: &str = "3 coordinates after vertex";
    let mut lines = Lines::new(bytes);
    let mut corners = 0;
    let mut is_ended = false;
    while let Some((line, row)) = lines.next()? {
        is_ended |= row.starts_with("endsolid");
        let mut fields = row.split_ascii_whitespace();
        match fields.next() {
            Some("vertex") => {
                let mut next = || next_number(&mut fields, line, EXPECTED);
                weld.add([next()?, next()?, next()?]);
                corners += 1;
            }
            Some("solid" | "facet" | "outer" | "endloop" | "endfacet" | "endsolid") => {}
            _ => {
                return Err(Fault::line(
                    line,
                    quoted(row),
                    "solid, facet, outer loop, vertex, endloop, endfacet or endsolid",
                    "correct the line or export the file again",
                ));
            }
        }
    }
    if corners % 3 != 0 || !is_ended {
        return Err(Fault::line(
            lines.read(),
            format!("the end of the file after {corners} corners"),
            "three corners a triangle and endsolid at the end",
            "the file is cut off: export it again",
        ));
    }
    Ok(corners / 3)
}

#[derive(Default)]
struct Weld {
    coordinates: Vec<f64>,
    known: HashSet<[u64; 3]>,
}

impl Weld {
    /// Adds the corner unless one at the same place is there; both zeros are the same place.
    fn add(&mut self, corner: [f64; 3]) {
        let place = corner.map(|value| (value + 0.0).to_bits());
        if self.known.insert(place) {
            self.coordinates.extend_from_slice(&corner);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0.1\nvertex 1 0 0\nvertex -0.0 0 0.1\nendloop\nendfacet\nendsolid s\n";

    #[test]
    fn text_is_welded_with_its_digits() {
        let points = read(TEXT.into()).unwrap();
        assert_eq!(points.coordinates, [0.0, 0.0, 0.1, 1.0, 0.0, 0.0]);
        assert!(read(TEXT.replace("endsolid s\n", "").into()).is_err());
        assert!(read(TEXT.replace("vertex 1 0 0", "vertex 1 0").into()).is_err());
    }

    #[test]
    fn binary_that_begins_with_solid_is_binary() {
        let mut bytes = vec![b' '; HEADER];
        bytes[..6].copy_from_slice(b"solid ");
        bytes.extend(1_u32.to_le_bytes());
        for value in [
            0.0_f32, 0.0, 1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1.0, 2.0, 3.0,
        ] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0, 0]);
        assert_eq!(
            read(bytes.clone()).unwrap().coordinates,
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        );
        bytes.truncate(100);
        bytes[..6].copy_from_slice(b"binary");
        assert!(read(bytes).is_err());
    }
}
