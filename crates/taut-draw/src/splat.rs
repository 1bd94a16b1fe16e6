//! Discs to pixels: which surface lies behind each sample of the picture.

use rayon::prelude::*;

use crate::camera::Camera;
use crate::scene::Scene;

/// Rows that one task draws.
const BAND: usize = 32;
/// Discs seen at a sharper angle than this (cosine) are drawn as if seen at it, so that they do
/// not vanish at the rim of a surface.
const SHARPEST: f32 = 0.2;
/// No disc is smaller than this, in samples: every point leaves a trace.
const SMALLEST_RADIUS: f32 = 0.75;
/// Discs this share of their radius behind the front still belong to the same surface.
const SAME_SURFACE: f32 = 1.0;

/// What lies behind a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surfel {
    /// Unit normal: to the right, down, toward the viewer (the last is never negative).
    pub normal: [f32; 3],
    /// sRGB.
    pub colour: [u8; 3],
    /// Radius of the discs here, in samples.
    pub radius: f32,
}

/// The visible surface, on a grid finer than the picture.
pub(crate) struct Surface {
    /// Samples a pixel along each side.
    pub samples: usize,
    /// Samples across and down.
    pub width: usize,
    pub height: usize,
    /// Distance from the viewer in samples, from an arbitrary origin; infinite where nothing lies.
    pub depth: Vec<f32>,
    pub surfels: Vec<Surfel>,
}

/// A disc in sample coordinates.
#[derive(Clone, Copy)]
struct Splat {
    centre: [f32; 2],
    depth: f32,
    radius: f32,
    normal: [f32; 3],
    colour: [u8; 3],
}

/// Draws all discs.
pub(crate) fn splat(scene: &Scene, camera: &Camera, samples: usize) -> Surface {
    let (width, height) = (camera.width() * samples, camera.height() * samples);
    let splats: Vec<Splat> = (0..scene.points.len())
        .into_par_iter()
        .filter_map(|index| project(scene, camera, samples, index))
        .collect();
    let bands = assign_to_bands(&splats, height);
    let nothing = Surfel {
        normal: [0.0, 0.0, 1.0],
        colour: [0; 3],
        radius: 0.0,
    };
    let mut depth = vec![f32::INFINITY; width * height];
    let mut surfels = vec![nothing; width * height];
    depth
        .par_chunks_mut(width * BAND)
        .zip(surfels.par_chunks_mut(width * BAND))
        .zip(bands)
        .enumerate()
        .for_each(|(band, ((depth, surfels), members))| {
            let members = members.iter().map(|&index| &splats[index as usize]);
            Band::new(band * BAND, width, depth).draw(members, surfels);
        });
    Surface {
        samples,
        width,
        height,
        depth,
        surfels,
    }
}

fn project(scene: &Scene, camera: &Camera, samples: usize, index: usize) -> Option<Splat> {
    let point = scene.points[index];
    if !crate::scene::is_finite(point) {
        return None;
    }
    let factor = samples as f64;
    let place = camera.project(point).map(|c| (c * factor) as f32);
    let radius = (scene.radius(index) * camera.pixels_per_unit() * factor) as f32;
    Some(Splat {
        centre: [place[0], place[1]],
        depth: place[2],
        radius: radius.max(SMALLEST_RADIUS),
        normal: scene
            .normal(index)
            .map_or([0.0, 0.0, 1.0], |normal| facing(camera.view().turn(normal))),
        colour: scene.colour(index),
    })
}

/// The normal on the viewer's side.
fn facing(normal: [f64; 3]) -> [f32; 3] {
    let sign = if normal[2] < 0.0 { -1.0 } else { 1.0 };
    normal.map(|component| (sign * component) as f32)
}

/// For each band of rows the discs that touch it, in the order of the points.
fn assign_to_bands(splats: &[Splat], height: usize) -> Vec<Vec<u32>> {
    let mut bands = vec![Vec::new(); height.div_ceil(BAND)];
    for (splat, index) in splats.iter().zip(0..) {
        let Some((first, last)) = splat.span(1, height) else {
            continue;
        };
        for band in &mut bands[first / BAND..=last / BAND] {
            band.push(index);
        }
    }
    bands
}

impl Splat {
    /// First and last sample along an axis (0: columns, 1: rows) that the disc may touch.
    fn span(&self, axis: usize, size: usize) -> Option<(usize, usize)> {
        let tilt = self.normal[axis];
        let reach = self.radius * (1.0 - tilt * tilt).max(SHARPEST * SHARPEST).sqrt();
        let first = (self.centre[axis] - reach - 0.5).ceil().max(0.0);
        let last = (self.centre[axis] + reach - 0.5)
            .floor()
            .min(size as f32 - 1.0);
        (first <= last).then_some((first as usize, last as usize))
    }

    /// Calls `hit(column, depth, weight)` for the samples of a row inside the disc; the weight
    /// falls from 1 at the centre to 0 at the rim.
    fn for_row(&self, row: usize, width: usize, mut hit: impl FnMut(usize, f32, f32)) {
        let Some((first, last)) = self.span(0, width) else {
            return;
        };
        let [nx, ny, nz] = self.normal;
        let steepness = 1.0 / nz.max(SHARPEST);
        let per_square = 1.0 / (self.radius * self.radius);
        let dy = row as f32 + 0.5 - self.centre[1];
        for column in first..=last {
            let dx = column as f32 + 0.5 - self.centre[0];
            let rise = (nx * dx + ny * dy) * steepness;
            let share = (dx * dx + dy * dy + rise * rise) * per_square;
            if share < 1.0 {
                hit(column, self.depth + rise, (1.0 - share) * (1.0 - share));
            }
        }
    }
}

/// Sums over the discs that make up the surface at a sample.
#[derive(Clone, Copy, Default)]
struct Blend {
    weight: f32,
    depth: f32,
    normal: [f32; 3],
    colour: [f32; 3],
    radius: f32,
}

impl Blend {
    fn add(&mut self, splat: &Splat, depth: f32, weight: f32) {
        self.weight += weight;
        self.depth += weight * depth;
        self.radius += weight * splat.radius;
        for channel in 0..3 {
            self.normal[channel] += weight * splat.normal[channel];
            self.colour[channel] += weight * f32::from(splat.colour[channel]);
        }
    }

    fn finish(&self) -> (f32, Surfel) {
        let share = 1.0 / self.weight;
        let [x, y, z] = self.normal;
        let length = (x * x + y * y + z * z).sqrt().max(f32::MIN_POSITIVE);
        let surfel = Surfel {
            normal: self.normal.map(|component| component / length),
            colour: self.colour.map(|channel| (channel * share).round() as u8),
            radius: self.radius * share,
        };
        (self.depth * share, surfel)
    }
}

/// A band of rows, drawn by one task.
struct Band<'a> {
    first_row: usize,
    rows: usize,
    width: usize,
    /// First the front of the surface, at last its blended depth.
    depth: &'a mut [f32],
}

impl<'a> Band<'a> {
    fn new(first_row: usize, width: usize, depth: &'a mut [f32]) -> Self {
        Self {
            first_row,
            rows: depth.len() / width,
            width,
            depth,
        }
    }

    fn draw<'s>(
        &mut self,
        splats: impl Iterator<Item = &'s Splat> + Clone,
        surfels: &mut [Surfel],
    ) {
        for splat in splats.clone() {
            self.for_samples(splat, |front, _, depth, _| *front = front.min(depth));
        }
        let mut blends = vec![Blend::default(); self.depth.len()];
        for splat in splats {
            let tolerance = SAME_SURFACE * splat.radius;
            self.for_samples(splat, |front, place, depth, weight| {
                if depth <= *front + tolerance {
                    blends[place].add(splat, depth, weight);
                }
            });
        }
        for (place, blend) in blends.iter().enumerate() {
            if blend.weight > 0.0 {
                (self.depth[place], surfels[place]) = blend.finish();
            }
        }
    }

    /// Calls `hit(front, place, depth, weight)` for the samples of this band inside the disc.
    fn for_samples(&mut self, splat: &Splat, mut hit: impl FnMut(&mut f32, usize, f32, f32)) {
        let Some((first, last)) = splat.span(1, self.first_row + self.rows) else {
            return;
        };
        for row in first.max(self.first_row)..=last {
            let start = (row - self.first_row) * self.width;
            splat.for_row(row, self.width, |column, depth, weight| {
                let place = start + column;
                hit(&mut self.depth[place], place, depth, weight);
            });
        }
    }
}
