//! Distances at points, their dimension forgotten.

use serde::Serialize;
use taut::size::coordinates;
use taut_core::Vector;
use taut_core::field::{Value, least};

use crate::field::isolines::Line;
use crate::picture::Levels;
use crate::surface::FlatSamples;

/// A field, its dimension forgotten, with what a picture shows of it.
pub struct Found {
    pub answer: Answer,
    pub sources: usize,
    /// How far each source, or vertex of the curve, was moved onto the surface.
    pub sources_moved: Vec<f64>,
    /// The file's rows that the points come from, where some were left out.
    pub rows_kept: Option<Vec<usize>>,
    pub drawn: Option<(FlatSamples, Levels)>,
    pub isolines: Option<Vec<Line>>,
}

/// A field at points, in the coordinates and units of the input.
pub struct Answer {
    pub surface: String,
    /// Coordinates of a point.
    pub dimension: usize,
    /// Row-major.
    pub points: Vec<f64>,
    /// From the nearest source, its start value added; infinite where unreached, not a number where the
    /// point has no place on the surface or where it is unknown whether anything leads there.
    pub distance: Vec<f64>,
    /// Estimated error of the distance.
    pub error: Vec<f64>,
    /// The nearest source, the first is 0; -1 where there is none.
    pub source: Vec<f64>,
    /// By how much the distance grows along each axis, row-major; zero where there is no direction.
    pub gradient: Vec<f64>,
    /// How far each point was moved onto the surface; `None` for points of the surface itself.
    pub moved: Option<Vec<f64>>,
    /// What speaks against the distances, in sentences.
    pub warnings: Vec<String>,
    /// The number of points without a place on the surface.
    unusable: usize,
}

impl Answer {
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
            warnings: Vec::new(),
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

    /// What is told of the field. `sources` were asked for, and where it ends with them the `nearest` points.
    pub fn facts(&self, sources: usize, nearest: Option<usize>) -> Facts {
        let reached = || {
            self.distance
                .iter()
                .zip(&self.error)
                .filter(|v| v.0.is_finite())
        };
        let mut errors: Vec<f64> = reached().map(|(_, error)| *error).collect();
        let most = errors.iter().copied().max_by(f64::total_cmp);
        let middle = errors.len() / 2;
        let median =
            (most.is_some()).then(|| *errors.select_nth_unstable_by(middle, f64::total_cmp).1);
        let count = |matches: fn(f64) -> bool| {
            self.distance
                .iter()
                .filter(|distance| matches(**distance))
                .count()
        };
        let largest_move = self.moved.as_ref().map(|moved| {
            let known = moved.iter().copied().filter(|moved| !moved.is_nan());
            known.fold(0.0, f64::max)
        });
        Facts {
            surface: self.surface.clone(),
            points: self.distance.len(),
            sources,
            sources_moved: Vec::new(),
            farthest: reached().map(|(distance, _)| *distance).reduce(f64::max),
            error_median: median,
            error_most: most,
            nearest,
            unreached: count(f64::is_infinite),
            unusable: self.unusable,
            unknown: self.unknown(),
            moved_most: largest_move,
            isolines: None,
            warnings: self.warnings.clone(),
        }
    }
}

/// What is told of a field. Lengths are in the units of the input.
#[derive(Serialize)]
pub struct Facts {
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub isolines: Option<IsolineFacts>,
    /// What speaks against the distances, in sentences.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// What is told of isolines.
#[derive(Serialize)]
pub struct IsolineFacts {
    pub lines: usize,
    /// Of these.
    pub closed: usize,
    /// By how much the field at a vertex misses its line's level at most.
    pub missed_most: f64,
    /// The largest estimated error of the field at a vertex, which the true distance may miss the level by besides.
    pub error_most: Option<f64>,
}

impl IsolineFacts {
    pub fn of(lines: &[Line]) -> Self {
        Self {
            lines: lines.len(),
            closed: lines.iter().filter(|line| line.closed).count(),
            missed_most: lines.iter().map(|line| line.miss).fold(0.0, f64::max),
            error_most: lines.iter().filter_map(|line| line.error).reduce(f64::max),
        }
    }
}
