//! The direction from which a scene is best seen.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use crate::camera::View;
use crate::error::DrawError;
use crate::scene::{Scene, dot, is_finite, subtract};

/// Directions tried.
const DIRECTIONS: usize = 96;
/// Cells of the coarse picture along its longer side.
const CELLS: f64 = 120.0;
/// Points looked at, evenly taken from all.
const POINTS: usize = 60_000;
/// Places looked at along all paths together.
const STEPS: usize = 600;
/// The elevations tried (their sines).
const HIGHEST: f64 = 0.85;
const LOWEST: f64 = -0.25;
/// The elevation over the horizon (its sine) that pictures are usually taken from.
const USUAL_ELEVATION: f64 = 0.45;
/// How much of the score is lost for each squared unit of distance from it.
const ELEVATION_WEIGHT: f64 = 0.7;
/// What a hidden piece of a path counts against a visible one.
const HIDDEN_WORTH: f64 = 0.3;
/// Clouds thinner than this share of their length are flat, and seen face on.
const FLAT: f64 = 1e-3;

/// The best of several dozen directions, from the scene to the viewer.
pub(crate) fn best_direction(scene: &Scene, up: [f64; 3]) -> Result<[f64; 3], DrawError> {
    let across = View::new([0.6, -1.0, 0.4], up)?.right;
    let upright = View::new(across, up)?;
    let sample = Sample::new(scene);
    if let Some(normal) = sample.flat_normal() {
        let side = -dot(normal, upright.down) - 0.5 * dot(normal, upright.toward);
        return Ok(normal.map(|c| c * 1.0_f64.copysign(side)));
    }
    let steps = path_steps(scene);
    let scores = (0..DIRECTIONS)
        .into_par_iter()
        .map(|number| {
            let direction = spiral(number, &upright);
            let view = View::new(direction, up)?;
            Ok((score(&sample, &steps, &view, &upright), direction))
        })
        .collect::<Result<Vec<_>, DrawError>>()?;
    let best = scores
        .into_iter()
        .reduce(|best, other| if other.0 > best.0 { other } else { best });
    Ok(best.map_or(upright.toward, |(_, direction)| direction))
}

/// Evenly spread directions (a Fibonacci spiral), from well above the horizon to a little below.
fn spiral(number: usize, upright: &View) -> [f64; 3] {
    let share = (number as f64 + 0.5) / DIRECTIONS as f64;
    let height = HIGHEST - (HIGHEST - LOWEST) * share;
    let across = (1.0 - height * height).sqrt();
    let turn = number as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let (sine, cosine) = turn.sin_cos();
    std::array::from_fn(|c| {
        across * (cosine * upright.toward[c] + sine * upright.right[c]) - height * upright.down[c]
    })
}

/// Some of the points.
struct Sample {
    points: Vec<([f64; 3], f64)>,
    /// By how much discs grow so that fewer of them cover the surface.
    growth: f64,
}

impl Sample {
    fn new(scene: &Scene) -> Self {
        let stride = scene.points.len().div_ceil(POINTS).max(1);
        let points = scene
            .finite_points()
            .step_by(stride)
            .map(|index| (scene.points[index], scene.radius(index)))
            .collect();
        Self {
            points,
            growth: (stride as f64).sqrt(),
        }
    }

    /// The normal of the plane that all points lie in, if there is one.
    fn flat_normal(&self) -> Option<[f64; 3]> {
        let count = self.points.len() as f64;
        let origin = self.points[0].0;
        let offsets = || {
            self.points
                .iter()
                .map(|point| Vector3::from(subtract(point.0, origin)))
        };
        let mean = offsets().sum::<Vector3<f64>>() / count;
        let scale = offsets().fold(0.0, |largest, offset| offset.amax().max(largest));
        let covariance = offsets().fold(Matrix3::zeros(), |sum, offset| {
            let relative = (offset - mean) / scale;
            sum + relative * relative.transpose()
        });
        let eigen = SymmetricEigen::try_new(covariance, f64::EPSILON, 64)?;
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let [thin, middle, long] = order.map(|axis| eigen.eigenvalues[axis].max(0.0).sqrt());
        (thin < FLAT * long && middle > FLAT * long)
            .then(|| eigen.eigenvectors.column(order[0]).into_owned().into())
    }
}

/// A short piece of a path: its middle and its vector.
struct Step {
    middle: [f64; 3],
    along: [f64; 3],
}

fn path_steps(scene: &Scene) -> Vec<Step> {
    let segments = scene.paths.iter().flat_map(|path| path.points.windows(2));
    let finite: Vec<_> = segments
        .filter(|pair| is_finite(pair[0]) && is_finite(pair[1]))
        .collect();
    let pieces = (STEPS / finite.len().max(1)).max(1);
    let cut = |pair: &[[f64; 3]], piece: usize| {
        let along = subtract(pair[1], pair[0]).map(|c| c / pieces as f64);
        Step {
            middle: std::array::from_fn(|c| pair[0][c] + along[c] * (piece as f64 + 0.5)),
            along,
        }
    };
    finite
        .iter()
        .flat_map(|pair| (0..pieces).map(|piece| cut(pair, piece)))
        .collect()
}

/// How good a direction is: the visible length of the paths as projected, against the whole
/// length; without paths, the share of the picture that the cloud covers. Usual elevations are
/// preferred a little.
fn score(sample: &Sample, steps: &[Step], view: &View, upright: &View) -> f64 {
    let relief = Relief::new(sample, view);
    let shown = if steps.is_empty() {
        relief.covered_share()
    } else {
        relief.shown_share(steps, view)
    };
    let elevation = -dot(view.toward, upright.down);
    shown * (1.0 - ELEVATION_WEIGHT * (elevation - USUAL_ELEVATION).powi(2))
}

/// A coarse picture of how near the cloud comes to the viewer.
struct Relief {
    origin: [f64; 3],
    low: [f64; 2],
    cell: f64,
    columns: usize,
    rows: usize,
    /// Largest component toward the viewer in each cell.
    front: Vec<f64>,
    /// A place so much behind the front still lies on it.
    tolerance: f64,
}

impl Relief {
    fn new(sample: &Sample, view: &View) -> Self {
        let origin = sample.points[0].0;
        let places: Vec<[f64; 3]> = sample
            .points
            .iter()
            .map(|point| view.turn(subtract(point.0, origin)))
            .collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in &places {
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
        let extent = f64::max(high[0] - low[0], high[1] - low[1]);
        let cell = if extent > 0.0 { extent / CELLS } else { 1.0 };
        let count = |axis: usize| ((high[axis] - low[axis]) / cell) as usize + 1;
        let (columns, rows) = (count(0), count(1));
        let mut relief = Self {
            origin,
            low,
            cell,
            columns,
            rows,
            front: vec![f64::NEG_INFINITY; columns * rows],
            tolerance: 1.5 * cell,
        };
        for (place, (_, radius)) in places.iter().zip(&sample.points) {
            relief.cover(*place, (radius * sample.growth).min(4.0 * cell));
        }
        relief
    }

    fn cell_range(&self, value: f64, reach: f64, axis: usize) -> std::ops::RangeInclusive<usize> {
        let count = [self.columns, self.rows][axis] as f64;
        let at =
            |value: f64| ((value - self.low[axis]) / self.cell).clamp(0.0, count - 1.0) as usize;
        at(value - reach)..=at(value + reach)
    }

    fn cover(&mut self, place: [f64; 3], reach: f64) {
        let columns = self.cell_range(place[0], reach, 0);
        for row in self.cell_range(place[1], reach, 1) {
            for column in columns.clone() {
                let front = &mut self.front[row * self.columns + column];
                *front = front.max(place[2]);
            }
        }
    }

    fn covered_share(&self) -> f64 {
        let covered = self.front.iter().filter(|front| front.is_finite()).count();
        covered as f64 / (CELLS * CELLS)
    }

    /// Visible length as projected, against the whole length.
    fn shown_share(&self, steps: &[Step], view: &View) -> f64 {
        let (mut shown, mut total) = (0.0, f64::MIN_POSITIVE);
        for step in steps {
            let [x, y, toward] = view.turn(subtract(step.middle, self.origin));
            let [dx, dy, dz] = view.turn(step.along);
            let row = *self.cell_range(y, 0.0, 1).start();
            let column = *self.cell_range(x, 0.0, 0).start();
            total += dx.hypot(dy).hypot(dz);
            let visible = toward + self.tolerance >= self.front[row * self.columns + column];
            shown += dx.hypot(dy) * if visible { 1.0 } else { HIDDEN_WORTH };
        }
        shown / total
    }
}
