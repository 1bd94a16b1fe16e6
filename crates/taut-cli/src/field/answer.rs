//! Distances at points, their dimension forgotten.

use std::io::{self, Write};

use serde::Serialize;
use taut::size::coordinates;
use taut_core::Vector;
use taut_core::field::{Value, least};
use taut_io::Column;

use crate::numbers::{largest, median_and_most, significant};
use crate::output::{errors_line, line, moved_lines};
use crate::picture::Levels;
use crate::progress::Progress;

/// A field at points, in the coordinates and units of the input.
pub struct FieldAnswer {
    pub surface: String,
    /// Coordinates of a point.
    pub dimension: usize,
    /// Row-major.
    pub points: Vec<f64>,
    /// From the nearest source, its start value added; infinite where unreached, not a number where
    /// the point has no place on the surface or where it is unknown whether anything leads there.
    pub distance: Vec<f64>,
    /// Estimated error of the distance.
    pub error: Vec<f64>,
    /// The nearest source, the first is 0; -1 where there is none.
    pub source: Vec<f64>,
    /// By how much the distance grows along each axis, row-major; zero where there is no direction.
    pub gradient: Vec<f64>,
    /// How far each point was moved onto the surface; `None` for points of the surface itself.
    pub moved: Option<Vec<f64>>,
    /// The number of points without a place on the surface.
    unusable: usize,
}

impl FieldAnswer {
    /// The number of its columns, where points are the surface's own.
    pub const COLUMNS: usize = 3;

    pub fn new(surface: &str, dimension: usize, points: Vec<f64>, moved: Option<Vec<f64>>) -> Self {
        let rows = points.len() / dimension;
        Self {
            surface: surface.to_owned(),
            dimension,
            points,
            distance: Vec::with_capacity(rows),
            error: Vec::with_capacity(rows),
            source: Vec::with_capacity(rows),
            gradient: Vec::with_capacity(rows * dimension),
            moved,
            unusable: 0,
        }
    }

    /// The value at the next point; `None` where it has no place on the surface.
    pub fn push<const D: usize>(&mut self, value: Option<&Value<D>>) {
        self.unusable += usize::from(value.is_none());
        let value = value.copied().unwrap_or(Value {
            distance: f64::NAN,
            error: f64::NAN,
            source: u32::MAX,
            direction: Vector::zeros(),
        });
        self.distance.push(value.distance);
        self.error.push(value.error);
        let reached = value.source != u32::MAX;
        self.source.push(if reached {
            f64::from(value.source)
        } else {
            -1.0
        });
        self.gradient
            .extend(coordinates(&value.direction, self.dimension));
    }

    /// What a picture shows of it.
    pub fn levels(&self) -> Levels {
        Levels::new(self.distance.clone(), self.gradient.clone())
    }

    /// Forgets all but the `count` nearest points, of equally near ones the first.
    pub fn keep_nearest(&mut self, count: usize) {
        let mut kept = vec![false; self.distance.len()];
        for row in least(&self.distance, count) {
            kept[row] = true;
        }
        for (row, _) in kept.iter().enumerate().filter(|(_, kept)| !**kept) {
            if !self.distance[row].is_nan() {
                self.distance[row] = f64::INFINITY;
                self.error[row] = 0.0;
                self.source[row] = -1.0;
                self.gradient[row * self.dimension..][..self.dimension].fill(0.0);
            }
        }
    }

    /// The number of points of which it is unknown whether anything leads there.
    pub fn unknown(&self) -> usize {
        let not_numbers = self.distance.iter().filter(|distance| distance.is_nan());
        not_numbers.count() - self.unusable
    }

    /// The columns of a table: the distance first, which formats of one column hold alone.
    pub fn columns(&self) -> Vec<Column<'_>> {
        let known = [
            ("distance", &self.distance),
            ("error", &self.error),
            ("source", &self.source),
        ];
        let moved = self.moved.as_ref().map(|moved| ("moved", moved));
        let all = known.into_iter().chain(moved);
        all.map(|(name, values)| Column { name, values }).collect()
    }

    /// What is told of the field. `sources` were asked for, and where it ends with them the
    /// `nearest` points.
    pub fn facts(&self, sources: usize, nearest: Option<usize>) -> FieldFacts {
        let reached = || {
            self.distance
                .iter()
                .zip(&self.error)
                .filter(|v| v.0.is_finite())
        };
        let [error_median, error_most] = median_and_most(reached().map(|(_, error)| *error));
        let count = |matches: fn(f64) -> bool| {
            self.distance
                .iter()
                .filter(|distance| matches(**distance))
                .count()
        };
        FieldFacts {
            surface: self.surface.clone(),
            points: self.distance.len(),
            sources,
            sources_moved: Vec::new(),
            farthest: reached().map(|(distance, _)| *distance).reduce(f64::max),
            error_median,
            error_most,
            nearest,
            unreached: count(f64::is_infinite),
            unusable: self.unusable,
            unknown: self.unknown(),
            moved_most: self.moved.as_deref().map(largest),
        }
    }
}

/// What is told of a field. Lengths are in the units of the input.
#[derive(Serialize)]
pub struct FieldFacts {
    pub surface: String,
    pub points: usize,
    pub sources: usize,
    /// How far each source, or vertex of the curve, was moved onto the surface.
    pub sources_moved: Vec<f64>,
    /// The largest distance; `None` where no point is reached.
    pub farthest: Option<f64>,
    /// Estimated errors over the points reached.
    pub error_median: Option<f64>,
    pub error_most: Option<f64>,
    /// The number of points that were asked for, the nearest ones; all others count as not reached.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest: Option<usize>,
    /// Points that are infinitely far.
    pub unreached: usize,
    /// Points without a place on the surface.
    pub unusable: usize,
    /// Points of which it is unknown whether anything leads there.
    #[serde(skip_serializing_if = "is_zero")]
    pub unknown: usize,
    /// The most that a point was moved onto the surface; `None` for points of the surface itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moved_most: Option<f64>,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl FieldFacts {
    /// Notes what has no distance.
    pub fn note(&self, progress: &Progress) {
        let FieldFacts {
            surface,
            points,
            nearest,
            unreached,
            unusable,
            unknown,
            ..
        } = self;
        if *unreached > 0 {
            let why = nearest.map_or(String::new(), |nearest| {
                format!(", because only the {nearest} nearest were asked for")
            });
            progress.note(&format!(
                "{surface}: {unreached} of {points} points are not reached{why}: their distance is inf"
            ));
        }
        if *unusable > 0 {
            progress.note(&format!(
                "{surface}: {unusable} of {points} points have no place on the surface: their distance is NaN"
            ));
        }
        if *unknown > 0 {
            progress.note(&format!(
                "{surface}: it is unknown whether anything leads to {unknown} of {points} points, because no ray came there or the surface was not sampled all the way: their distance is NaN; of an equation, name the part that you mean with --bounds"
            ));
        }
    }

    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        line(out, "surface", &self.surface)?;
        line(out, "points", &self.points.to_string())?;
        let moved = self.sources_moved.iter().copied().fold(0.0, f64::max);
        let sources = match moved {
            0.0 => self.sources.to_string(),
            moved => format!(
                "{} (moved onto the surface by at most {moved:.1e})",
                self.sources
            ),
        };
        line(out, "sources", &sources)?;
        let farthest = self.farthest.map_or("none reached".to_owned(), significant);
        line(out, "farthest", &farthest)?;
        errors_line(out, [self.error_median, self.error_most])?;
        if let Some(nearest) = self.nearest {
            line(out, "nearest asked for", &nearest.to_string())?;
        }
        line(out, "not reached", &self.unreached.to_string())?;
        moved_lines(out, self.moved_most, self.unusable)?;
        if self.unknown > 0 {
            line(out, "unknown", &self.unknown.to_string())?;
        }
        Ok(())
    }
}
