//! PLY, binary little endian, every number a double.

use std::io::{self, Write};

use super::{PointTable, Polyline, have_levels, have_normals};

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    let nodes = paths.iter().map(Polyline::nodes).sum();
    let edges: usize = paths
        .iter()
        .map(|path| path.nodes().saturating_sub(1))
        .sum();
    let normals = have_normals(paths);
    write_vertex_header(out, nodes, normals)?;
    let levels = have_levels(paths);
    writeln!(out, "property double arc_length")?;
    if levels {
        writeln!(out, "property double level")?;
    }
    writeln!(out, "element edge {edges}")?;
    writeln!(
        out,
        "property int vertex1\nproperty int vertex2\nend_header"
    )?;
    for path in paths {
        for node in 0..path.nodes() {
            let normal = path.normal(node).filter(|_| normals).unwrap_or_default();
            write_doubles(
                out,
                path.point(node)
                    .iter()
                    .chain(normal)
                    .chain(&[path.arc_length[node]])
                    .chain(&path.level.filter(|_| levels)),
            )?;
        }
    }
    let mut first = 0;
    for path in paths {
        let end = first + path.nodes();
        for node in first + 1..end {
            out.write_all(&index(node - 1)?.to_le_bytes())?;
            out.write_all(&index(node)?.to_le_bytes())?;
        }
        first = end;
    }
    Ok(())
}

pub(super) fn write_points(out: &mut dyn Write, points: &PointTable<'_>) -> io::Result<()> {
    write_vertex_header(out, points.rows_count(), points.normals.is_some())?;
    for column in points.columns {
        writeln!(out, "property double {}", column.name)?;
    }
    if points.colours.is_some() {
        for name in ["red", "green", "blue"] {
            writeln!(out, "property uchar {name}")?;
        }
    }
    writeln!(out, "end_header")?;
    for (row, (point, normal)) in points.rows().enumerate() {
        write_doubles(out, point.iter().chain(normal).chain(points.values(row)))?;
        if let Some(colours) = points.colours {
            out.write_all(&colours[row])?;
        }
    }
    Ok(())
}

fn write_vertex_header(out: &mut dyn Write, vertices: usize, normals: bool) -> io::Result<()> {
    writeln!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}"
    )?;
    let names: &[&str] = if normals {
        &["x", "y", "z", "nx", "ny", "nz"]
    } else {
        &["x", "y", "z"]
    };
    for name in names {
        writeln!(out, "property double {name}")?;
    }
    Ok(())
}

fn write_doubles<'a>(out: &mut dyn Write, values: impl Iterator<Item = &'a f64>) -> io::Result<()> {
    for value in values {
        out.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}

fn index(node: usize) -> io::Result<i32> {
    i32::try_from(node)
        .map_err(|_| io::Error::other("PLY edges count at most 2^31 nodes; write .csv or .npy"))
}
