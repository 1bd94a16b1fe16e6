//! Wavefront OBJ: the `v` lines, and the `vn` lines where there is one for each vertex in the same
//! order.

use std::io::BufRead;

use crate::error::Fault;
use crate::point_set::PointSet;
use crate::text::{Lines, next_number};

#[derive(Default)]
struct Raw {
    vertices: Vec<f64>,
    normals: Vec<f64>,
    faces: usize,
    /// Some face gives a vertex the normal of another number.
    normals_shuffled: bool,
}

pub(super) fn read(source: impl BufRead) -> Result<PointSet, Fault> {
    let raw = Raw::parse(source)?;
    let paired =
        !raw.normals.is_empty() && raw.normals.len() == raw.vertices.len() && !raw.normals_shuffled;
    let unpaired = if paired { 0 } else { raw.normals.len() / 3 };
    let mut points = PointSet::three_dimensional(raw.vertices, paired.then_some(raw.normals));
    points.note_ignored(raw.faces, "faces and lines");
    points.note_ignored(unpaired, "normals that are not one for each vertex");
    Ok(points)
}

impl Raw {
    fn parse(source: impl BufRead) -> Result<Self, Fault> {
        let mut raw = Self::default();
        let mut lines = Lines::new(source);
        while let Some((line, row)) = lines.next()? {
            let mut fields = row.split_ascii_whitespace();
            match fields.next() {
                Some("v") => {
                    for _ in 0..3 {
                        raw.vertices
                            .push(next_number(&mut fields, line, "3 coordinates after v")?);
                    }
                }
                Some("vn") => {
                    for _ in 0..3 {
                        raw.normals
                            .push(next_number(&mut fields, line, "3 components after vn")?);
                    }
                }
                Some("f" | "l") => {
                    raw.faces += 1;
                    raw.normals_shuffled |= fields.any(pairs_unequal_numbers);
                }
                _ => {}
            }
        }
        if lines.read() == 0 {
            return Err(Fault::Empty);
        }
        Ok(raw)
    }
}

/// Whether a face's corner `vertex/texture/normal` names a normal of another number than its
/// vertex.
fn pairs_unequal_numbers(corner: &str) -> bool {
    let mut numbers = corner.split('/');
    let vertex = numbers.next();
    let normal = numbers.nth(1);
    normal.is_some() && normal != vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_need_their_vertex() {
        let vertices = "v 0 0 0 1\nv 1 0 0\nvn 0 0 1\nvn 0 1 0\n";
        let paired = read(format!("{vertices}f 1//1 2//2 1//1\n").as_bytes()).unwrap();
        assert_eq!(paired.normals, Some(vec![0.0, 0.0, 1.0, 0.0, 1.0, 0.0]));
        let shuffled = read(format!("{vertices}f 1//2 2//2 1//1\n").as_bytes()).unwrap();
        assert_eq!((shuffled.rows(), shuffled.normals), (2, None));
    }

    #[test]
    fn short_vertex_is_refused() {
        assert!(read(&b"v 0 0\n"[..]).is_err());
    }
}
