//! XYZ: one line a point, its normal behind it. Other dimensions than 3 get a line of names, by which they are known.

use std::io::{self, Write};

use super::{Samples, column_names, write_row};

pub(super) fn write_points(out: &mut dyn Write, samples: &Samples<'_>) -> io::Result<()> {
    if samples.dimension != 3 {
        let mut names = column_names(["x", "y", "z"], "x", samples.dimension);
        if samples.normals.is_some() {
            names.extend(column_names(["nx", "ny", "nz"], "n", samples.dimension));
        }
        writeln!(out, "{}", names.join(" "))?;
    }
    for (point, normal) in samples.rows() {
        write_row(out, ' ', point.iter().chain(normal).copied())?;
        writeln!(out)?;
    }
    Ok(())
}
