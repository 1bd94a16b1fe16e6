//! VTK XML polydata, text: lines or vertices with point data.

use std::io::{self, Write};

use super::{PointTable, Polyline, have_levels, have_normals, levels, write_row};

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    let nodes: usize = paths.iter().map(Polyline::nodes).sum();
    write_head(out, nodes, 0, paths.len())?;
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
    if have_levels(paths) {
        let levels: Vec<f64> = levels(paths).collect();
        write_doubles(out, "level", 1, [levels.as_slice()].into_iter())?;
    }
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
    writeln!(out, "</Lines>\n{FOOT}")
}

/// Each point is a vertex of its own, so that viewers show them.
pub(super) fn write_points(out: &mut dyn Write, points: &PointTable<'_>) -> io::Result<()> {
    let count = points.rows_count();
    write_head(out, count, count, 0)?;
    match points.columns.first() {
        Some(first) => writeln!(out, r#"<PointData Scalars="{}">"#, first.name)?,
        None => writeln!(out, "<PointData>")?,
    }
    for column in points.columns {
        write_doubles(out, column.name, 1, std::iter::once(column.values))?;
    }
    if let Some(normals) = points.normals {
        write_doubles(out, "normals", 3, std::iter::once(normals))?;
    }
    writeln!(out, "</PointData>\n<Points>")?;
    write_doubles(out, "points", 3, std::iter::once(points.coordinates))?;
    writeln!(out, "</Points>\n<Verts>")?;
    write_integers(out, "connectivity", 0..count)?;
    write_integers(out, "offsets", 1..=count)?;
    writeln!(out, "</Verts>\n{FOOT}")
}

const FOOT: &str = "</Piece>\n</PolyData>\n</VTKFile>";

fn write_head(out: &mut dyn Write, points: usize, vertices: usize, lines: usize) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(
        out,
        r#"<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">"#
    )?;
    writeln!(out, "<PolyData>")?;
    writeln!(
        out,
        r#"<Piece NumberOfPoints="{points}" NumberOfVerts="{vertices}" NumberOfLines="{lines}" NumberOfStrips="0" NumberOfPolys="0">"#
    )
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
