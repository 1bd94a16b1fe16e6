//! Pictures of a surface with paths or distances over it.

use std::path::Path;

use taut_draw::{Camera, DrawError, Projection, Radii, Scene, Style, render};

use crate::answer::FoundPath;
use crate::exit::Failure;
use crate::numbers::significant;
use crate::output::with_errors;
use crate::surface::FlatSamples;

const WIDTH: u32 = 1600;
const HEIGHT: u32 = 1200;
/// Points drawn for each piece of a path between two nodes.
const FINENESS: u32 = 8;

/// Draws samples of a surface and the paths over them into a PNG file.
pub fn draw(file: &Path, samples: &FlatSamples, paths: &[FoundPath]) -> Result<(), Failure> {
    write(file, try_draw(samples, paths))
}

/// Puts a picture in its place.
fn write(file: &Path, drawn: Result<Vec<u8>, DrawError>) -> Result<(), Failure> {
    let bytes = drawn.map_err(|error| Failure::Draw {
        file: file.to_owned(),
        error,
    })?;
    Ok(taut_io::write_whole(file, |out| out.write_all(&bytes))?)
}

/// Distances at the points of a surface, and how they grow, in the coordinates of the input.
pub struct Levels {
    values: Vec<f64>,
    /// Row-major.
    gradients: Vec<f64>,
}

impl Levels {
    pub fn new(values: Vec<f64>, gradients: Vec<f64>) -> Self {
        Self { values, gradients }
    }

    /// A round number, some sixteenth of the largest value: isolines lie that far apart.
    pub fn interval(&self) -> f64 {
        taut_draw::round_length(highest(&self.values) / ISOLINES)
    }

    /// The multiples of the interval below the largest value.
    pub fn rounds(&self) -> Vec<f64> {
        let (interval, highest) = (self.interval(), highest(&self.values));
        // Of an interval below 1 the inverse is whole, and a quotient of whole numbers nearest to
        // the fraction.
        let multiple = |i: u32| match interval {
            ..1.0 => f64::from(i) / interval.recip().round(),
            _ => f64::from(i) * interval,
        };
        (1..)
            .map(multiple)
            .take_while(|level| *level < highest)
            .collect()
    }
}

/// Isolines in a picture, about.
const ISOLINES: f64 = 16.0;

/// Draws samples of a surface, coloured by distances, with isolines, into a PNG file.
pub fn draw_levels(file: &Path, samples: &FlatSamples, levels: &Levels) -> Result<(), Failure> {
    write(file, try_draw_levels(samples, levels))
}

fn try_draw_levels(samples: &FlatSamples, levels: &Levels) -> Result<Vec<u8>, DrawError> {
    let projection = Projection::new(samples.dimension, &samples.points)?;
    let mut scene = scene_of(&projection, samples)?;
    let interval = levels.interval();
    scene.show_levels(taut_draw::Levels {
        values: levels.values.clone(),
        gradients: projection.apply(&levels.gradients)?,
        interval,
    });
    scene.caption = Some(format!(
        "distance to {}, a line every {interval}",
        significant(highest(&levels.values))
    ));
    finish(&scene)
}

fn highest(values: &[f64]) -> f64 {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    finite.fold(0.0, f64::max)
}

fn scene_of(projection: &Projection, samples: &FlatSamples) -> Result<Scene, DrawError> {
    let points = projection.apply(&samples.points)?;
    match &samples.discs {
        Some((normals, radii)) if samples.dimension == 3 => {
            let normals = projection.apply(normals)?;
            let mut scene = Scene::with_normals(points, normals)?;
            scene.radii = Radii::PerPoint(radii.clone());
            Ok(scene)
        }
        _ => Scene::new(points),
    }
}

fn finish(scene: &Scene) -> Result<Vec<u8>, DrawError> {
    let camera = Camera::automatic(scene, [0.0, 0.0, 1.0], WIDTH, HEIGHT)?;
    render(scene, &camera, &Style::default())?.to_png_bytes()
}

fn try_draw(samples: &FlatSamples, paths: &[FoundPath]) -> Result<Vec<u8>, DrawError> {
    let projection = Projection::new(samples.dimension, &samples.points)?;
    let mut scene = scene_of(&projection, samples)?;
    for path in paths {
        scene.add_path(smooth(&projection.apply(&path.points)?, &path.arc_length));
    }
    if let [only] = paths {
        let caption = |length| format!("length {}", with_errors(length, only));
        scene.caption = only.length.map(caption);
    }
    finish(&scene)
}

/// A curve through the nodes of a path: cubic Hermite pieces over the arc length.
fn smooth(nodes: &[[f64; 3]], arc_length: &[f64]) -> Vec<[f64; 3]> {
    let mut curve: Vec<[f64; 3]> = nodes.first().copied().into_iter().collect();
    for i in 1..nodes.len() {
        let span = arc_length[i] - arc_length[i - 1];
        let (from, to) = (nodes[i - 1], nodes[i]);
        let slopes = [i - 1, i].map(|node| slope(nodes, arc_length, node));
        for step in 1..=FINENESS {
            let t = f64::from(step) / f64::from(FINENESS);
            let s = 1.0 - t;
            curve.push(std::array::from_fn(|c| {
                s * s * (1.0 + 2.0 * t) * from[c]
                    + t * t * (1.0 + 2.0 * s) * to[c]
                    + s * t * span * (s * slopes[0][c] - t * slopes[1][c])
            }));
        }
    }
    curve
}

/// The derivative at a node of the parabola through it and the two nodes nearest along the path.
fn slope(nodes: &[[f64; 3]], arc_length: &[f64], node: usize) -> [f64; 3] {
    if nodes.len() < 3 {
        let (last, span) = (nodes.len() - 1, arc_length[nodes.len() - 1]);
        return std::array::from_fn(|c| (nodes[last][c] - nodes[0][c]) / span);
    }
    let middle = node.clamp(1, nodes.len() - 2);
    let [a, b] = [middle - 1, middle].map(|i| arc_length[i + 1] - arc_length[i]);
    let at = arc_length[node] - arc_length[middle];
    std::array::from_fn(|c| {
        let before = (nodes[middle][c] - nodes[middle - 1][c]) / a;
        let after = (nodes[middle + 1][c] - nodes[middle][c]) / b;
        (before * b + after * a + 2.0 * at * (after - before)) / (a + b)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_stay_parabolas() {
        let at = [0.0, 0.3, 1.0, 1.4, 2.5];
        let curve = |t: f64| [t, 1.0 + t - t * t, 2.0 * t * t];
        let drawn = smooth(&at.map(curve), &at);
        assert_eq!(drawn.len(), 1 + 4 * FINENESS as usize);
        for [x, y, z] in drawn {
            let [_, true_y, true_z] = curve(x);
            assert!((y - true_y).abs() < 1e-12 && (z - true_z).abs() < 1e-12);
        }
    }

    #[test]
    fn short_paths_are_straight() {
        let nodes = [[0.0; 3], [2.0, 0.0, 0.0]];
        let drawn = smooth(&nodes, &[0.0, 2.0]);
        assert!(drawn.windows(2).all(|pair| pair[1][0] > pair[0][0]));
        assert_eq!(smooth(&nodes[..1], &[0.0]), [nodes[0]]);
    }
}
