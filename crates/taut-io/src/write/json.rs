//! JSON: an array with one object a path. A number that is not finite becomes null.

use std::io::{self, Write};

use serde::Serialize;

use super::Polyline;

#[derive(Serialize)]
struct Object<'a> {
    points: Vec<&'a [f64]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    normals: Option<Vec<&'a [f64]>>,
    arc_length: &'a [f64],
    #[serde(skip_serializing_if = "Option::is_none")]
    level: Option<f64>,
}

pub(super) fn write_paths(out: &mut dyn Write, paths: &[Polyline<'_>]) -> io::Result<()> {
    let objects: Vec<Object<'_>> = paths
        .iter()
        .map(|path| Object {
            points: path.points.chunks_exact(path.dimension).collect(),
            normals: path
                .normals
                .map(|normals| normals.chunks_exact(path.dimension).collect()),
            arc_length: path.arc_length,
            level: path.level,
        })
        .collect();
    serde_json::to_writer(&mut *out, &objects)?;
    writeln!(out)
}
