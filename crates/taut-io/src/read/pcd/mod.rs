//! PCD of the Point Cloud Library, version 0.7 and before: ASCII, binary, binary_compressed.
//!
//! The reader is our own: `pcd-rs` 0.13 allocates what the header claims and indexes past the end
//! of a compressed body that is shorter than its points.

mod body;
mod header;
mod lzf;

use crate::error::Fault;
use crate::point_set::PointSet;
use header::Header;

/// Reads the fields x, y, z and, where all are there, normal_x, normal_y, normal_z.
pub(super) fn read(bytes: &[u8]) -> Result<PointSet, Fault> {
    let header = Header::parse(bytes)?;
    let [coordinates, normals] = body::decode(bytes, &header)?;
    let has_normals = header.normals().is_some();
    Ok(PointSet::three_dimensional(
        coordinates,
        has_normals.then_some(normals),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(data: &str, body: &[u8]) -> Vec<u8> {
        let mut bytes = format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z normal_x normal_y normal_z\nSIZE 1 4 4 8 4 4 4\n\
             TYPE U F F F F F F\nCOUNT 3 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA {data}\n"
        )
        .into_bytes();
        bytes.extend(body);
        bytes
    }

    fn columns() -> [Vec<u8>; 7] {
        let f4 = |values: [f32; 2]| {
            values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect::<Vec<u8>>()
        };
        let z: Vec<u8> = [3.0_f64, f64::NAN]
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        [
            vec![1, 2, 3, 4, 5, 6],
            f4([1.0, 4.0]),
            f4([2.0, 5.0]),
            z,
            f4([0.0, 0.0]),
            f4([0.0, 1.0]),
            f4([1.0, 0.0]),
        ]
    }

    fn check(bytes: &[u8]) {
        let points = read(bytes).unwrap();
        assert_eq!(points.coordinates[..5], [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert!(points.coordinates[5].is_nan());
        assert_eq!(points.normals, Some(vec![0.0, 0.0, 1.0, 0.0, 1.0, 0.0]));
    }

    #[test]
    fn three_encodings_agree() {
        check(&file("ascii", b"1 2 3 1 2 3 0 0 1\n4 5 6 4 5 nan 0 1 0\n"));
        let columns = columns();
        let mut rows = Vec::new();
        for row in 0..2 {
            for column in &columns {
                let size = column.len() / 2;
                rows.extend(&column[row * size..(row + 1) * size]);
            }
        }
        check(&file("binary", &rows));
        let flat = columns.concat();
        let mut packed = Vec::new();
        for literal in flat.chunks(32) {
            packed.push(literal.len() as u8 - 1);
            packed.extend(literal);
        }
        let mut body = (packed.len() as u32).to_le_bytes().to_vec();
        body.extend((flat.len() as u32).to_le_bytes());
        body.extend(&packed);
        check(&file("binary_compressed", &body));
        assert!(read(&file("binary", &rows[..rows.len() - 1])).is_err());
        assert!(read(&file("binary_compressed", &body[..body.len() - 1])).is_err());
        assert!(read(&file("ascii", b"1 2 3 1 2 3 0 0 1\n")).is_err());
    }
}
