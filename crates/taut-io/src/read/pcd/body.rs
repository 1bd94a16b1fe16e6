//! The points of a PCD file.

use super::header::{Data, Field, Header};
use super::lzf;
use crate::error::Fault;
use crate::text::{number, text_behind};

const EXPORT_REMEDY: &str = "the file is cut off or its header is wrong: export it again";

/// Positions and normals, row-major; no normals where the file has none.
pub(super) fn decode(bytes: &[u8], header: &Header) -> Result<[Vec<f64>; 2], Fault> {
    let body = &bytes[header.body_offset..];
    match header.data {
        Data::Ascii => decode_text(text_behind(bytes, header.body_offset)?, header),
        Data::Binary => {
            if body.len() / header.record < header.points {
                return Err(too_short(bytes.len(), body.len(), header));
            }
            decode_records(body, header, |field, point| {
                point * header.record + field.offset
            })
        }
        Data::BinaryCompressed => {
            let columns = decompress(body, header)?;
            let count = header.points;
            decode_records(&columns, header, |field, point| {
                field.offset * count + point * field.kind.size() * field.count
            })
        }
    }
}

fn too_short(end: usize, found: usize, header: &Header) -> Fault {
    Fault::byte(
        end as u64,
        format!("{} points before the file ends", found / header.record),
        format!(
            "the declared {}, each of {} bytes",
            header.points, header.record
        ),
        EXPORT_REMEDY,
    )
}

/// Reads each point's numbers at the byte that `place` answers for a field and a point.
fn decode_records(
    body: &[u8],
    header: &Header,
    place: impl Fn(&Field, usize) -> usize,
) -> Result<[Vec<f64>; 2], Fault> {
    let column = |wanted: [usize; 3]| {
        let mut values = Vec::with_capacity(3 * header.points);
        for point in 0..header.points {
            for index in wanted {
                let field = &header.fields[index];
                let start = place(field, point);
                let value = body.get(start..).and_then(|bytes| field.kind.decode(bytes));
                values.push(value.ok_or_else(|| {
                    too_short(header.body_offset + body.len(), body.len(), header)
                })?);
            }
        }
        Ok::<_, Fault>(values)
    };
    let normals = header.normals().map(column).transpose()?;
    Ok([column(header.positions)?, normals.unwrap_or_default()])
}

/// The body's two sizes are compared with the file and with the header before anything is unpacked.
fn decompress(body: &[u8], header: &Header) -> Result<Vec<u8>, Fault> {
    let start = header.body_offset as u64;
    let sizes = body.split_first_chunk::<4>().and_then(|(packed, rest)| {
        let (unpacked, rest) = rest.split_first_chunk::<4>()?;
        Some((
            u32::from_le_bytes(*packed) as usize,
            u32::from_le_bytes(*unpacked) as usize,
            rest,
        ))
    });
    let Some((packed, unpacked, rest)) = sizes else {
        return Err(Fault::byte(
            start,
            format!("{} bytes", body.len()),
            "the compressed and the uncompressed size, 4 bytes each",
            EXPORT_REMEDY,
        ));
    };
    let declared = header.record.checked_mul(header.points);
    if declared != Some(unpacked) {
        return Err(Fault::byte(
            start + 4,
            format!("an uncompressed size of {unpacked} bytes"),
            format!(
                "{} points of {} bytes as in the header",
                header.points, header.record
            ),
            EXPORT_REMEDY,
        ));
    }
    let Some(packed_bytes) = rest.get(..packed) else {
        return Err(Fault::byte(
            start,
            format!(
                "a compressed size of {packed} bytes, {} in the file",
                rest.len()
            ),
            "as many bytes as declared",
            EXPORT_REMEDY,
        ));
    };
    lzf::decompress(packed_bytes, unpacked).map_err(|error| {
        Fault::byte(
            start + 8 + error.offset as u64,
            error.found,
            "LZF data",
            EXPORT_REMEDY,
        )
    })
}

fn decode_text(text: &str, header: &Header) -> Result<[Vec<f64>; 2], Fault> {
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, row)| !row.trim_ascii().is_empty());
    let columns_of = |fields: [usize; 3]| fields.map(|index| header.fields[index].column);
    let positions = columns_of(header.positions);
    let normal_columns = header.normals().map(columns_of);
    let mut values = [Vec::new(), Vec::new()];
    for index in 0..header.points {
        let Some((offset, row)) = lines.next() else {
            return Err(Fault::line(
                header.lines + text.lines().count(),
                format!("{index} points before the file ends"),
                format!("the declared {}", header.points),
                EXPORT_REMEDY,
            ));
        };
        let line = header.lines + offset + 1;
        let mut position = [0.0; 3];
        let mut normal = [0.0; 3];
        let mut count = 0;
        for (column, field) in row.split_ascii_whitespace().enumerate() {
            if let Some(axis) = positions.iter().position(|wanted| *wanted == column) {
                position[axis] = number(field, line)?;
            } else if let Some(axis) =
                normal_columns.and_then(|wanted| wanted.iter().position(|wanted| *wanted == column))
            {
                normal[axis] = number(field, line)?;
            }
            count = column + 1;
        }
        if count != header.columns {
            return Err(Fault::line(
                line,
                format!("{count} numbers"),
                format!("{} as the fields demand", header.columns),
                "correct the line, or FIELDS and COUNT in the header",
            ));
        }
        values[0].extend_from_slice(&position);
        if normal_columns.is_some() {
            values[1].extend_from_slice(&normal);
        }
    }
    Ok(values)
}
