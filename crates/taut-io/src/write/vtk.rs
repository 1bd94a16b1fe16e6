//! Legacy VTK, text: polydata of lines with the point data arc_length and normals.

use std::io::{self, Write};

use super::{Polyline, have_levels, have_normals, levels, write_row};

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    let nodes: usize = paths.iter().map(Polyline::nodes).sum();
    writeln!(
        out,
        "# vtk DataFile Version 3.0\ngeodesics\nASCII\nDATASET POLYDATA\nPOINTS {nodes} double"
    )?;
    for path in paths {
        write_vectors(out, path.points)?;
    }
    writeln!(out, "LINES {} {}", paths.len(), paths.len() + nodes)?;
    let mut first = 0;
    for path in paths {
        write!(out, "{}", path.nodes())?;
        for node in first..first + path.nodes() {
            write!(out, " {node}")?;
        }
        writeln!(out)?;
        first += path.nodes();
    }
    writeln!(
        out,
        "POINT_DATA {nodes}\nSCALARS arc_length double 1\nLOOKUP_TABLE default"
    )?;
    for length in paths.iter().flat_map(|path| path.arc_length) {
        writeln!(out, "{length:?}")?;
    }
    if have_levels(paths) {
        writeln!(out, "SCALARS level double 1\nLOOKUP_TABLE default")?;
        for level in levels(paths) {
            writeln!(out, "{level:?}")?;
        }
    }
    if have_normals(paths) {
        writeln!(out, "NORMALS normals double")?;
        for normals in paths.iter().filter_map(|path| path.normals) {
            write_vectors(out, normals)?;
        }
    }
    Ok(())
}

fn write_vectors(out: &mut dyn Write, values: &[f64]) -> io::Result<()> {
    for vector in values.chunks_exact(3) {
        write_row(out, ' ', vector.iter().copied())?;
        writeln!(out)?;
    }
    Ok(())
}
