//! CSV: one line of names, one line a node.

use std::io::{self, Write};
use std::iter;

use super::{PointTable, Polyline, column_names, have_levels, have_normals, write_row};

const SEPARATOR: char = ',';

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    let dimension = paths.first().map_or(3, |path| path.dimension);
    let normals = have_normals(paths);
    let levels = have_levels(paths);
    let level = if levels { "level," } else { "" };
    writeln!(out, "path,arc_length,{level}{}", header(dimension, normals))?;
    for (index, path) in paths.iter().enumerate() {
        for node in 0..path.nodes() {
            let normal = path.normal(node).filter(|_| normals).unwrap_or_default();
            write!(out, "{index}{SEPARATOR}")?;
            let position = path.point(node).iter().chain(normal).copied();
            let level = path.level.filter(|_| levels);
            let values = iter::once(path.arc_length[node])
                .chain(level)
                .chain(position);
            write_row(out, SEPARATOR, values)?;
            writeln!(out)?;
        }
    }
    Ok(())
}

pub(super) fn write_points(out: &mut dyn Write, points: &PointTable<'_>) -> io::Result<()> {
    write!(
        out,
        "{}",
        header(points.dimension, points.normals.is_some())
    )?;
    for column in points.columns {
        write!(out, "{SEPARATOR}{}", column.name)?;
    }
    writeln!(out)?;
    for (row, (point, normal)) in points.rows().enumerate() {
        let values = point.iter().chain(normal).chain(points.values(row));
        write_row(out, SEPARATOR, values.copied())?;
        writeln!(out)?;
    }
    Ok(())
}

fn header(dimension: usize, normals: bool) -> String {
    column_names(dimension, normals).join(",")
}
