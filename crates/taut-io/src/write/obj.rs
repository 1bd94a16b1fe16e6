//! Wavefront OBJ: v and vn for each node, l for each path.

use std::io::{self, Write};

use super::{PointTable, Polyline, have_normals, write_row};

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    write_lines(out, "v", paths.iter().map(|path| path.points))?;
    if have_normals(paths) {
        write_lines(out, "vn", paths.iter().filter_map(|path| path.normals))?;
    }
    let mut first = 1;
    for path in paths {
        write!(out, "l")?;
        for node in first..first + path.nodes() {
            write!(out, " {node}")?;
        }
        writeln!(out)?;
        first += path.nodes();
    }
    Ok(())
}

pub(super) fn write_points(out: &mut dyn Write, samples: &PointTable<'_>) -> io::Result<()> {
    write_lines(out, "v", [samples.coordinates])?;
    write_lines(out, "vn", samples.normals)
}

fn write_lines<'a>(
    out: &mut dyn Write,
    keyword: &str,
    arrays: impl IntoIterator<Item = &'a [f64]>,
) -> io::Result<()> {
    for vector in arrays.into_iter().flat_map(|array| array.chunks_exact(3)) {
        write!(out, "{keyword} ")?;
        write_row(out, ' ', vector.iter().copied())?;
        writeln!(out)?;
    }
    Ok(())
}
