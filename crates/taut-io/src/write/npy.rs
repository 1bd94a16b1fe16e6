//! NPY version 1: float64, little endian, C order.

use std::io::{self, Write};

use super::{PointTable, Polyline};

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    for path in paths {
        write_rows(out, path.dimension, path.points)?;
    }
    Ok(())
}

pub(super) fn write_points(out: &mut dyn Write, samples: &PointTable<'_>) -> io::Result<()> {
    write_rows(out, samples.dimension, samples.coordinates)
}

/// The values of the first column, of shape (n,).
pub(super) fn write_first_column(out: &mut dyn Write, points: &PointTable<'_>) -> io::Result<()> {
    let values = points.columns.first().map_or(&[][..], |first| first.values);
    write_array(out, &format!("({},)", values.len()), values)
}

fn write_rows(out: &mut dyn Write, dimension: usize, values: &[f64]) -> io::Result<()> {
    let rows = values.len() / dimension;
    write_array(out, &format!("({rows}, {dimension})"), values)
}

fn write_array(out: &mut dyn Write, shape: &str, values: &[f64]) -> io::Result<()> {
    const ALIGNMENT: usize = 64;
    const BEFORE_HEADER: usize = 10;
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (BEFORE_HEADER + header.len() + 1).next_multiple_of(ALIGNMENT) - BEFORE_HEADER;
    header.extend(std::iter::repeat_n(' ', length - 1 - header.len()));
    header.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    // Two sizes of at most 20 digits each leave the header far below 2^16 bytes.
    out.write_all(&(length as u16).to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    for value in values {
        out.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}
