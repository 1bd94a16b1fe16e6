//! VTK XML polydata, text: lines with the point data arc_length and normals.

use std::io::{self, Write};

use super::{Polyline, have_normals, write_row};

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    let nodes: usize = paths.iter().map(Polyline::nodes).sum();
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(
        out,
        r#"<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">"#
    )?;
    writeln!(out, "<PolyData>")?;
    writeln!(
        out,
        r#"<Piece NumberOfPoints="{nodes}" NumberOfVerts="0" NumberOfLines="{}" NumberOfStrips="0" NumberOfPolys="0">"#,
        paths.len()
    )?;
    let normals = have_normals(paths);
    let normals_attribute = if normals { r#" Normals="normals""# } else { "" };
    writeln!(
        out,
        r#"<PointData Scalars="arc_length"{normals_attribute}>"#
    )?;
    write_doubles(
        out,
        "arc_length",
        1,
        paths.iter().map(|path| path.arc_length),
    )?;
    if normals {
        write_doubles(
            out,
            "normals",
            3,
            paths.iter().filter_map(|path| path.normals),
        )?;
    }
    writeln!(out, "</PointData>\n<Points>")?;
    write_doubles(out, "points", 3, paths.iter().map(|path| path.points))?;
    writeln!(out, "</Points>\n<Lines>")?;
    write_integers(out, "connectivity", 0..nodes)?;
    let ends = paths.iter().scan(0, |end, path| {
        *end += path.nodes();
        Some(*end)
    });
    write_integers(out, "offsets", ends)?;
    writeln!(out, "</Lines>\n</Piece>\n</PolyData>\n</VTKFile>")
}

fn write_doubles<'a>(
    out: &mut dyn Write,
    name: &str,
    components: usize,
    arrays: impl Iterator<Item = &'a [f64]>,
) -> io::Result<()> {
    writeln!(
        out,
        r#"<DataArray type="Float64" Name="{name}" NumberOfComponents="{components}" format="ascii">"#
    )?;
    for vector in arrays.flat_map(|array| array.chunks_exact(components)) {
        write_row(out, ' ', vector.iter().copied())?;
        writeln!(out)?;
    }
    writeln!(out, "</DataArray>")
}

fn write_integers(
    out: &mut dyn Write,
    name: &str,
    values: impl Iterator<Item = usize>,
) -> io::Result<()> {
    writeln!(
        out,
        r#"<DataArray type="Int64" Name="{name}" format="ascii">"#
    )?;
    for value in values {
        write!(out, "{value} ")?;
    }
    writeln!(out, "\n</DataArray>")
}
