//! OFF, the object file format of Geomview, in text: OFF, COFF, NOFF, CNOFF. Colours and faces are
//! ignored.

use std::io::BufRead;

use crate::error::{Fault, quoted};
use crate::point_set::PointSet;
use crate::text::{Lines, number};

const KEYWORDS: &str = "OFF, COFF, NOFF or CNOFF";
const REMEDY: &str = "export the mesh as plain OFF, or name its format with --format NAME";

struct Header {
    has_normals: bool,
    vertices: usize,
    faces: usize,
}

pub(super) fn read(source: impl BufRead) -> Result<PointSet, Fault> {
    let mut lines = Lines::new(source);
    let header = Header::parse(&mut lines)?;
    let wanted = if header.has_normals { 6 } else { 3 };
    let mut coordinates = Vec::new();
    let mut normals = Vec::new();
    let mut columns = None;
    for index in 0..header.vertices {
        let read = lines.read();
        let Some((line, row)) = lines.next()? else {
            return Err(Fault::line(
                read,
                format!("{index} vertices before the file ends"),
                format!("the declared {}", header.vertices),
                "correct the count in the header or export the file again",
            ));
        };
        let mut count = 0;
        for field in row.split_ascii_whitespace() {
            match count {
                0..3 => coordinates.push(number(field, line)?),
                3..6 if header.has_normals => normals.push(number(field, line)?),
                _ => {}
            }
            count += 1;
        }
        let expected = *columns.get_or_insert(count);
        if count < wanted || count != expected {
            return Err(Fault::line(
                line,
                format!(
                    "{count} numbers in vertex {index} (the first is 0) of the declared {}",
                    header.vertices
                ),
                if expected < wanted {
                    format!("at least {wanted}")
                } else {
                    format!("{expected} as in vertex 0")
                },
                "correct the line, or the count in the header",
            ));
        }
    }
    let mut points =
        PointSet::three_dimensional(coordinates, header.has_normals.then_some(normals));
    points.note_ignored(header.faces, "faces");
    Ok(points)
}

impl Header {
    fn parse(lines: &mut Lines<impl BufRead>) -> Result<Self, Fault> {
        let Some((line, row)) = lines.next()? else {
            return match lines.read() {
                0 => Err(Fault::Empty),
                read => Err(Fault::line(read, "no keyword", KEYWORDS, REMEDY)),
            };
        };
        let mut fields = row.split_ascii_whitespace();
        let has_normals = match fields.next() {
            Some("OFF" | "COFF") => false,
            Some("NOFF" | "CNOFF") => true,
            _ => {
                return Err(Fault::line(line, quoted(row), KEYWORDS, REMEDY));
            }
        };
        let mut line = line;
        let mut counts: Vec<String> = fields.map(str::to_owned).collect();
        if counts.is_empty()
            && let Some((next, row)) = lines.next()?
        {
            line = next;
            counts.extend(row.split_ascii_whitespace().map(str::to_owned));
        }
        let count = |index: usize| {
            counts
                .get(index)
                .and_then(|field| field.parse::<usize>().ok())
                .ok_or_else(|| {
                    Fault::line(
                        line,
                        quoted(&counts.join(" ")),
                        "the numbers of vertices, faces and edges",
                        "export the mesh again as text OFF",
                    )
                })
        };
        Ok(Self {
            has_normals,
            vertices: count(0)?,
            faces: count(1)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_ignored_and_normals_kept() {
        let colours =
            read(&b"# c\nCOFF\n# c\n2 0 0\n1 2 3 255 0 0 255\n\n4 5 6 0 0 0 255\n"[..]).unwrap();
        assert_eq!(colours.coordinates, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let normals = read(&b"NOFF 1 0 0\n1 2 3 0 0 1\n"[..]).unwrap();
        assert_eq!(normals.normals, Some(vec![0.0, 0.0, 1.0]));
    }

    #[test]
    fn faces_are_never_taken_for_vertices() {
        assert!(read(&b"OFF\n3 1 0\n0 0 0\n1 0 0\n3 0 1 2\n"[..]).is_err());
        assert!(read(&b"OFF BINARY\n"[..]).is_err());
        assert!(read(&b"OFF\n"[..]).is_err());
    }
}
