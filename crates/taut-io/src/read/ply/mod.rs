//! PLY: ASCII, binary little and big endian; the properties x, y, z and nx, ny, nz of the element
//! `vertex`.
//!
//! Header and binary records are parsed by `ply-rs-bw`, after its counts have been compared with
//! the file's length. ASCII rows are parsed here: they keep the digits of `f64` even where a
//! property is declared `float`.

mod body;
mod header;

use ply_rs_bw::parser::Reader;
use ply_rs_bw::ply::Encoding;

use crate::error::Fault;
use crate::point_set::PointSet;
use header::Layout;

const EXPORT_REMEDY: &str = "the file is cut off or its header is wrong: export it again";

pub(super) fn read(bytes: &[u8], column: Option<&str>) -> Result<PointSet, Fault> {
    let mut reader = Reader::new(bytes);
    let mut header = header::read_header(&mut reader, bytes)?;
    if let Some(column) = column {
        header::mark_column(&mut header, column)?;
    }
    let records = *reader.get_ref();
    let header_bytes = bytes.len() - records.len();
    let layout = Layout::of(&header)?;
    let mut points = match layout.encoding {
        Encoding::Ascii => body::read_text(bytes, header_bytes, &layout)?,
        Encoding::BinaryLittleEndian | Encoding::BinaryBigEndian => {
            body::check_length(records, header_bytes, &layout)?;
            body::read_binary(records, header_bytes, &layout)?
        }
    };
    for (count, name) in &layout.ignored {
        points.note_ignored(*count, &format!("records of the element {name:?}"));
    }
    Ok(points)
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
        assert_eq!(read(&ascii, None).unwrap().coordinates, [0.1, 2.5, 3.0]);
        let mut binary = header("binary_big_endian", &elements);
        binary.extend([1, 0, 7, 0]);
        binary.extend(0.5_f32.to_be_bytes());
        binary.extend(2.5_f64.to_be_bytes());
        binary.extend([3, 0]);
        assert_eq!(read(&binary, None).unwrap().coordinates, [0.5, 2.5, 3.0]);
        binary.pop();
        assert!(read(&binary, None).is_err());
    }

    #[test]
    fn repeated_names_are_refused() {
        let elements = "element vertex 1\nproperty float x\nproperty float x\nproperty float y\nproperty float z\n";
        let mut file = header("ascii", elements);
        file.extend(b"1 1 2 3\n");
        let Err(Fault::Malformed { place, .. }) = read(&file, None) else {
            panic!("a repeated property must be refused");
        };
        assert_eq!(place, crate::Place::Line(5));
    }

    #[test]
    fn records_without_properties_end_at_once() {
        let elements = format!("element void 1099511627776\n{XYZ}");
        assert!(read(&header("binary_little_endian", &elements), None).is_err());
    }
}
