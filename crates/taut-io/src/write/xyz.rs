//! XYZ: one line a point, its normal behind it. Other dimensions than 3 get a line of names, by
//! which they are known.

use std::io::{self, Write};

use super::{PointTable, column_names, write_row};

pub(super) fn write_points(out: &mut dyn Write, samples: &PointTable<'_>) -> io::Result<()> {
    if samples.dimension != 3 {
        let names = column_names(samples.dimension, samples.normals.is_some());
        writeln!(out, "{}", names.join(" "))?;
    }
    for (point, normal) in samples.rows() {
        write_row(out, ' ', point.iter().chain(normal).copied())?;
        writeln!(out)?;
    }
    Ok(())
}
