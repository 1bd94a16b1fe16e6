//! Isolines, their dimension forgotten.

use std::path::Path;

use taut::kind::Kind;
use taut::size::flat;
use taut_core::error::Error;
use taut_core::field::{Field, Fields, Isoline};
use taut_core::{Vector, parallel};
use taut_io::{Polyline, write_polylines};

use crate::exit::Failure;
use crate::picture::Levels;
use crate::settings::IsolineSettings;

/// A connected piece of an isoline, in the coordinates and units of the input.
pub struct Line {
    pub level: f64,
    /// Its first vertex is repeated at its end.
    pub closed: bool,
    /// By how much the distance at a vertex misses the level at most, as the field has it.
    pub miss: f64,
    /// The largest estimated error of the field at a vertex; `None` where it is not known at any.
    pub error: Option<f64>,
    dimension: usize,
    points: Vec<f64>,
    arc_length: Vec<f64>,
}

/// The isolines asked for, at round levels where none are given.
pub fn find<const D: usize>(
    settings: &IsolineSettings,
    levels: &Levels,
    fields: &Fields<'_, D, Kind<D>>,
    field: &Field<D>,
) -> Result<Vec<Isoline<D>>, Error> {
    if settings.levels.is_empty() {
        return fields.isolines(field, &levels.rounds());
    }
    fields.isolines(field, &settings.levels)
}

impl Line {
    pub fn flattened<const D: usize>(
        lines: &[Isoline<D>],
        centre: &Vector<D>,
        dimension: usize,
        error: impl Fn(&Vector<D>) -> Option<f64> + Sync,
    ) -> Vec<Self> {
        let line = |line: &Isoline<D>| Self {
            error: line.points.iter().filter_map(&error).reduce(f64::max),
            level: line.level,
            closed: line.closed,
            miss: line.miss,
            dimension,
            points: flat(&line.points, centre, dimension),
            arc_length: lengths(&line.points),
        };
        parallel::map(lines.len(), |i| line(&lines[i]))
    }

    fn polyline(&self) -> Polyline<'_> {
        Polyline {
            dimension: self.dimension,
            points: &self.points,
            normals: None,
            arc_length: &self.arc_length,
            level: Some(self.level),
        }
    }
}

/// The length of the polyline up to each vertex.
fn lengths<const D: usize>(points: &[Vector<D>]) -> Vec<f64> {
    let steps = points.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    let sums = steps.scan(0.0, |sum, step| {
        *sum += step;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

pub fn write(file: &Path, lines: &[Line]) -> Result<(), Failure> {
    let polylines: Vec<Polyline<'_>> = lines.iter().map(Line::polyline).collect();
    Ok(write_polylines(file, &polylines)?)
}
