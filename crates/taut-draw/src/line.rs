//! Paths and dots over the picture.

use crate::camera::Camera;
use crate::canvas::{Canvas, coded, mix};
use crate::scene::{Scene, is_finite};
use crate::shade::Style;
use crate::splat::Surface;

/// Line width as a share of the picture's smaller side, for paths that name none.
const WIDTH: f64 = 0.0055;
/// Radius of a dot, in line widths.
const DOT: f64 = 1.35;
/// A line this many disc radii behind the surface still lies on it.
const BIAS_RADII: f32 = 1.5;
/// And so does one this many pixels behind it.
const BIAS_PIXELS: f32 = 2.0;
/// Parts shorter than about twice this many line widths take the visibility of what is round them.
const STEADY: f32 = 1.6;
/// Hidden lines: width against visible ones, opacity, and dash and gap in line widths.
const HIDDEN_WIDTH: f32 = 0.6;
const HIDDEN_OPACITY: f32 = 0.55;
const DASH: f32 = 1.9;
const GAP: f32 = 1.5;

/// Draws all paths and dots of the scene, hidden parts first, then from far to near.
pub(crate) fn draw_paths(
    canvas: &mut Canvas,
    scene: &Scene,
    camera: &Camera,
    surface: &Surface,
    style: &Style,
) {
    let usual_width = WIDTH * camera.width().min(camera.height()) as f64;
    let background = coded(style.background);
    let mut runs = Vec::new();
    for path in &scene.paths {
        let width = path.width_pixels.unwrap_or(usual_width).max(0.5) as f32;
        for places in screen_pieces(&path.points, camera) {
            let visible = steady(&visibility(&places, surface), (STEADY * width) as usize);
            split_runs(&places, &visible, width, coded(path.colour), &mut runs);
        }
    }
    for run in runs.iter().filter(|run| !run.visible) {
        run.draw_hidden(canvas);
    }
    runs.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    for run in runs.iter().filter(|run| run.visible) {
        run.draw_visible(canvas, background);
    }
    draw_dots(
        canvas,
        scene,
        camera,
        surface,
        usual_width * DOT,
        background,
    );
}

/// A point of a line in the picture.
#[derive(Clone, Copy)]
struct Place {
    x: f32,
    y: f32,
    depth: f32,
    /// How far the chord may lie below the curve it stands for, in pixels.
    sag: f32,
}

/// The path in steps of at most a pixel, cut where a node is not finite.
fn screen_pieces(nodes: &[[f64; 3]], camera: &Camera) -> Vec<Vec<Place>> {
    nodes
        .split(|node| !is_finite(*node))
        .filter(|piece| !piece.is_empty())
        .map(|piece| {
            let nodes: Vec<[f64; 3]> = piece.iter().map(|&node| camera.project(node)).collect();
            subdivide(&nodes)
        })
        .collect()
}

fn subdivide(nodes: &[[f64; 3]]) -> Vec<Place> {
    let mut places = vec![place(nodes[0], 0.0)];
    for (start, pair) in nodes.windows(2).enumerate() {
        let sag = bend(nodes, start).max(bend(nodes, start + 1)) / 4.0;
        let length = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        let steps = length.ceil().clamp(1.0, 1e5);
        for step in 1..=steps as u32 {
            let share = f64::from(step) / steps;
            let point = std::array::from_fn(|c| pair[0][c] + (pair[1][c] - pair[0][c]) * share);
            places.push(place(point, sag));
        }
    }
    places
}

/// Length of the second difference at a node: eight times the sagitta of its chords.
fn bend(nodes: &[[f64; 3]], node: usize) -> f64 {
    if node == 0 || node + 1 >= nodes.len() {
        return 0.0;
    }
    let [before, here, after] = [nodes[node - 1], nodes[node], nodes[node + 1]];
    let terms = (0..3).map(|c| (before[c] - 2.0 * here[c] + after[c]).powi(2));
    terms.sum::<f64>().sqrt()
}

fn place(point: [f64; 3], sag: f64) -> Place {
    Place {
        x: point[0] as f32,
        y: point[1] as f32,
        depth: point[2] as f32,
        sag: sag as f32,
    }
}

fn visibility(places: &[Place], surface: &Surface) -> Vec<bool> {
    places
        .iter()
        .map(|place| is_visible(place, surface))
        .collect()
}

/// Whether a point lies on or before the surface.
fn is_visible(place: &Place, surface: &Surface) -> bool {
    let samples = surface.samples as f32;
    let (column, row) = ((place.x * samples).floor(), (place.y * samples).floor());
    if column < 0.0 || row < 0.0 || column >= surface.width as f32 || row >= surface.height as f32 {
        return true;
    }
    let sample = row as usize * surface.width + column as usize;
    let bias = BIAS_RADII * surface.surfels[sample].radius + (BIAS_PIXELS + place.sag) * samples;
    place.depth * samples <= surface.depth[sample] + bias
}

/// What most of the neighbours up to `reach` steps away say, so that single splats do not cut
/// the line.
fn steady(visible: &[bool], reach: usize) -> Vec<bool> {
    let mut sums = vec![0_usize];
    for &one in visible {
        sums.push(sums[sums.len() - 1] + usize::from(one));
    }
    (0..visible.len())
        .map(|middle| {
            let low = middle.saturating_sub(reach);
            let high = (middle + reach + 1).min(visible.len());
            2 * (sums[high] - sums[low]) >= high - low
        })
        .collect()
}

/// A stretch of a path that is all visible or all hidden.
struct Run {
    places: Vec<[f32; 2]>,
    visible: bool,
    depth: f32,
    width: f32,
    colour: [f32; 3],
}

fn split_runs(
    places: &[Place],
    visible: &[bool],
    width: f32,
    colour: [f32; 3],
    runs: &mut Vec<Run>,
) {
    let mut start = 0;
    while start < places.len() {
        let same = visible[start..]
            .iter()
            .take_while(|&&v| v == visible[start]);
        let end = start + same.count();
        // Neighbouring runs share a point, so that no gap opens between them.
        let members = &places[start..(end + 1).min(places.len())];
        runs.push(Run {
            places: members.iter().map(|place| [place.x, place.y]).collect(),
            visible: visible[start],
            depth: members.iter().map(|place| place.depth).sum::<f32>() / members.len() as f32,
            width,
            colour,
        });
        start = end;
    }
}

impl Run {
    fn draw_visible(&self, canvas: &mut Canvas, background: [f32; 3]) {
        let half = self.width / 2.0;
        let rim = (0.28 * self.width).max(1.0);
        let dark = self.colour.map(|channel| channel * 0.72);
        stroke(canvas, &self.places, half + rim, |distance| {
            (background, 0.8 * coverage(half + rim, distance))
        });
        stroke(canvas, &self.places, half, |distance| {
            let round = (1.0 - (distance / (half + 0.5)).powi(2)).max(0.0).sqrt();
            (mix(dark, self.colour, round), coverage(half, distance))
        });
    }

    fn draw_hidden(&self, canvas: &mut Canvas) {
        let half = HIDDEN_WIDTH * self.width / 2.0;
        for dash in dashes(&self.places, DASH * self.width, GAP * self.width) {
            stroke(canvas, &dash, half, |distance| {
                (self.colour, HIDDEN_OPACITY * coverage(half, distance))
            });
        }
    }
}

/// Share of a pixel inside a line of the given half width whose middle is `distance` away.
fn coverage(half_width: f32, distance: f32) -> f32 {
    (half_width + 0.5 - distance).clamp(0.0, 1.0)
}

/// Every other piece of the line, by its length in pixels.
fn dashes(line: &[[f32; 2]], dash: f32, gap: f32) -> Vec<Vec<[f32; 2]>> {
    let mut pieces: Vec<Vec<[f32; 2]>> = Vec::new();
    let mut along = 0.0;
    let mut drawing = false;
    for (index, &point) in line.iter().enumerate() {
        if index > 0 {
            along += (point[0] - line[index - 1][0]).hypot(point[1] - line[index - 1][1]);
        }
        let inside = along % (dash + gap) < dash;
        match pieces.last_mut() {
            Some(piece) if inside && drawing => piece.push(point),
            _ if inside => pieces.push(vec![point]),
            _ => {}
        }
        drawing = inside;
    }
    pieces
}

/// Lays `paint(distance to the line) -> (colour, opacity)` over all pixels nearer than
/// `half_width` and a rim; each pixel is painted once, however the line winds.
fn stroke(
    canvas: &mut Canvas,
    line: &[[f32; 2]],
    half_width: f32,
    paint: impl Fn(f32) -> ([f32; 3], f32),
) {
    let reach = half_width + 1.0;
    let Some(mut field) = DistanceField::new(canvas, line, reach) else {
        return;
    };
    if let [point] = line {
        field.add_segment(*point, *point);
    }
    for pair in line.windows(2) {
        field.add_segment(pair[0], pair[1]);
    }
    for (index, &distance) in field.distances.iter().enumerate() {
        if distance < reach {
            let x = field.left + (index % field.width) as i64;
            let y = field.top + (index / field.width) as i64;
            let (colour, opacity) = paint(distance);
            canvas.blend(x, y, colour, opacity);
        }
    }
}

/// Distance to a line for the pixels of a box round it.
struct DistanceField {
    left: i64,
    top: i64,
    width: usize,
    height: usize,
    reach: f32,
    distances: Vec<f32>,
}

impl DistanceField {
    /// `None` where the box lies outside the picture.
    fn new(canvas: &Canvas, line: &[[f32; 2]], reach: f32) -> Option<Self> {
        let bounds = |axis: usize, size: usize| {
            let values = || line.iter().map(|point| point[axis]);
            let low = values().fold(f32::INFINITY, f32::min) - reach;
            let high = values().fold(f32::NEG_INFINITY, f32::max) + reach;
            let (low, high) = (low.floor().max(0.0), high.ceil().min(size as f32));
            (low < high).then_some((low as i64, (high - low) as usize))
        };
        let (left, width) = bounds(0, canvas.width)?;
        let (top, height) = bounds(1, canvas.height)?;
        Some(Self {
            left,
            top,
            width,
            height,
            reach,
            distances: vec![f32::INFINITY; width * height],
        })
    }

    fn add_segment(&mut self, start: [f32; 2], end: [f32; 2]) {
        let range = |axis: usize, origin: i64, size: usize| {
            let low = start[axis].min(end[axis]) - self.reach - origin as f32;
            let high = start[axis].max(end[axis]) + self.reach - origin as f32;
            low.floor().clamp(0.0, size as f32) as usize
                ..high.ceil().clamp(0.0, size as f32) as usize
        };
        let columns = range(0, self.left, self.width);
        for row in range(1, self.top, self.height) {
            for column in columns.clone() {
                let x = self.left as f32 + column as f32 + 0.5;
                let y = self.top as f32 + row as f32 + 0.5;
                let distance = distance_to_segment([x, y], start, end);
                let nearest = &mut self.distances[row * self.width + column];
                *nearest = nearest.min(distance);
            }
        }
    }
}

fn distance_to_segment(point: [f32; 2], start: [f32; 2], end: [f32; 2]) -> f32 {
    let [sx, sy] = [end[0] - start[0], end[1] - start[1]];
    let [px, py] = [point[0] - start[0], point[1] - start[1]];
    let square = sx * sx + sy * sy;
    let share = if square > 0.0 {
        ((px * sx + py * sy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (px - share * sx).hypot(py - share * sy)
}

/// Dots, far to near: full where visible, a ring where hidden.
fn draw_dots(
    canvas: &mut Canvas,
    scene: &Scene,
    camera: &Camera,
    surface: &Surface,
    usual_radius: f64,
    background: [f32; 3],
) {
    let mut dots: Vec<_> = scene
        .markers
        .iter()
        .filter(|marker| is_finite(marker.position))
        .map(|marker| {
            let radius = marker.radius_pixels.unwrap_or(usual_radius).max(0.5);
            let spot = place(camera.project(marker.position), radius / 2.0);
            (marker, spot, radius as f32)
        })
        .collect();
    dots.sort_by(|a, b| b.1.depth.total_cmp(&a.1.depth));
    for (marker, spot, radius) in dots {
        let colour = coded(marker.colour);
        let line = [[spot.x, spot.y]];
        if !is_visible(&spot, surface) {
            let ring = 0.35 * radius;
            stroke(canvas, &line, radius, |distance| {
                let inside = coverage(radius, distance) - coverage(radius - ring, distance);
                (colour, HIDDEN_OPACITY * inside)
            });
            continue;
        }
        let rim = (0.3 * radius).max(1.0);
        let dark = colour.map(|channel| channel * 0.55);
        stroke(canvas, &line, radius + rim, |distance| {
            (background, coverage(radius + rim, distance))
        });
        stroke(canvas, &line, radius, |distance| {
            let edge = coverage(0.72 * radius, distance);
            (mix(dark, colour, edge), coverage(radius, distance))
        });
    }
}
