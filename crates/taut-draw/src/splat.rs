//! Discs to pixels: which surface lies behind each sample of the picture.

use rayon::prelude::*;

use crate::camera::Camera;
use crate::scene::Scene;

/// Rows that one task draws.
const BAND: usize = 32;
/// The half width of discs seen edge on, in samples: they do not vanish.
const EDGE_ON: f32 = 1.0;
/// No disc is smaller than this, in samples: every point leaves a trace.
const SMALLEST_RADIUS: f32 = 0.75;
/// Discs this share of their radius behind the front still belong to the same surface.
const SAME_SURFACE: f32 = 1.0;
/// The share of a disc's radius that covers what lies behind it; the rest only smooths. So the
/// rim of a sheet is less of a scallop.
const COVERING: f32 = 0.95;
/// Discs whose normal is this far from the line of sight (cosine) are steep.
const STEEP: f32 = 0.5;
/// How far behind the front, in their radii, steep discs are taken for its far side.
const FAR_SIDE: std::ops::Range<f32> = 0.6..4.0;

/// The weight of a disc at the end of its covering part.
const RIM: f32 = (1.0 - COVERING * COVERING) * (1.0 - COVERING * COVERING);

/// What lies behind a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surfel {
    /// Unit normal: to the right, down, toward the viewer (the last is never negative).
    pub normal: [f32; 3],
    /// sRGB.
    pub colour: [u8; 3],
    /// Radius of the discs here, in samples.
    pub radius: f32,
    /// In intervals of the scene's levels; not a number where there is none.
    pub level: f32,
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
    /// Growth of the depth per sample to the right and down.
    slope: [f32; 2],
    colour: [u8; 3],
    /// In intervals of the scene's levels, and its growth per sample to the right and down.
    level: f32,
    level_slope: [f32; 2],
}

/// Draws all discs.
pub(crate) fn splat(scene: &Scene, camera: &Camera, samples: usize) -> Surface {
    let (width, height) = (camera.width() * samples, camera.height() * samples);
    let splats: Vec<Splat> = (0..scene.points.len())
        .into_par_iter()
        .filter_map(|index| project(scene, camera, samples, index))
        .collect();
    let fronts = Fronts::new(&splats, width, height);
    let splats: Vec<Splat> = splats
        .into_par_iter()
        .filter(|splat| !fronts.far_side_peeps_out(splat))
        .collect();
    let Fronts { mut depth, .. } = Fronts::new(&splats, width, height);
    let surfels = blend(&splats, width, &mut depth);
    Surface {
        samples,
        width,
        height,
        depth,
        surfels,
    }
}

/// The front of the discs: the first pass.
struct Fronts {
    width: usize,
    height: usize,
    depth: Vec<f32>,
}

impl Fronts {
    fn new(splats: &[Splat], width: usize, height: usize) -> Self {
        let mut depth = vec![f32::INFINITY; width * height];
        depth
            .par_chunks_mut(width * BAND)
            .zip(assign_to_bands(splats, height))
            .enumerate()
            .for_each(|(band, (depth, members))| {
                for &index in &members {
                    let hit = |place: usize, at: f32, weight: f32| {
                        if weight > RIM {
                            depth[place] = depth[place].min(at);
                        }
                    };
                    splats[index as usize].for_band(band, width, height, hit);
                }
            });
        Self {
            width,
            height,
            depth,
        }
    }

    /// Whether a steep disc lies with its middle behind a surface, but not far: then it belongs
    /// to the far side of what it lies behind, and only blurs its outline.
    fn far_side_peeps_out(&self, splat: &Splat) -> bool {
        let [column, row] = splat.centre.map(f32::floor);
        let inside =
            column >= 0.0 && row >= 0.0 && column < self.width as f32 && row < self.height as f32;
        if splat.normal[2] > STEEP || !inside {
            return false;
        }
        let rise = splat.rise(column + 0.5 - splat.centre[0], row + 0.5 - splat.centre[1]);
        let front = self.depth[row as usize * self.width + column as usize];
        let behind = (splat.depth + rise - front) / splat.radius;
        FAR_SIDE.contains(&behind)
    }
}

/// The second pass: averages the discs that lie on the front. Turns the front's depth into the
/// averaged one.
fn blend(splats: &[Splat], width: usize, depth: &mut [f32]) -> Vec<Surfel> {
    let height = depth.len() / width;
    let nothing = Surfel {
        normal: [0.0, 0.0, 1.0],
        colour: [0; 3],
        radius: 0.0,
        level: f32::NAN,
    };
    let mut surfels = vec![nothing; depth.len()];
    depth
        .par_chunks_mut(width * BAND)
        .zip(surfels.par_chunks_mut(width * BAND))
        .zip(assign_to_bands(splats, height))
        .enumerate()
        .for_each(|(band, ((depth, surfels), members))| {
            let mut blends = vec![Blend::default(); depth.len()];
            for &index in &members {
                let splat = &splats[index as usize];
                let tolerance = SAME_SURFACE * splat.radius;
                splat.for_band(band, width, height, |place, at, weight| {
                    if depth[place] < f32::INFINITY && at <= depth[place] + tolerance {
                        let level = splat.level_at(band * BAND, place, width);
                        blends[place].add(splat, at, level, weight);
                    }
                });
            }
            for (place, blend) in blends.iter().enumerate() {
                if blend.weight > 0.0 {
                    (depth[place], surfels[place]) = blend.finish();
                }
            }
        });
    surfels
}

fn project(scene: &Scene, camera: &Camera, samples: usize, index: usize) -> Option<Splat> {
    let point = scene.points[index];
    if !crate::scene::is_finite(point) {
        return None;
    }
    let factor = samples as f64;
    let place = camera.project(point).map(|c| (c * factor) as f32);
    let radius = (scene.radius(index) * camera.pixels_per_unit() * factor) as f32;
    let radius = radius.max(SMALLEST_RADIUS);
    let normal = scene
        .normal(index)
        .map_or([0.0, 0.0, 1.0], |normal| facing(camera.view().turn(normal)));
    let steepest = normal[2].max((EDGE_ON / radius).min(1.0));
    let slope = [normal[0] / steepest, normal[1] / steepest];
    let (level, level_slope) = scene
        .levels
        .as_ref()
        .map_or((f32::NAN, [0.0; 2]), |levels| {
            let per_sample = 1.0 / (camera.pixels_per_unit() * factor * levels.interval);
            let growth = camera.view().turn(levels.gradients[index]);
            let growth = growth.map(|g| (g * per_sample) as f32);
            let level = (levels.values[index] / levels.interval) as f32;
            let along = [0, 1].map(|axis| growth[axis] - growth[2] * slope[axis]);
            (if level.is_finite() { level } else { f32::NAN }, along)
        });
    Some(Splat {
        centre: [place[0], place[1]],
        depth: place[2],
        radius,
        normal,
        slope,
        colour: scene.colour(index),
        level,
        level_slope,
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
        let Some((first, last)) = splat.rows(height) else {
            continue;
        };
        for band in &mut bands[first / BAND..=last / BAND] {
            band.push(index);
        }
    }
    bands
}

impl Splat {
    /// First and last row that the disc may touch.
    fn rows(&self, height: usize) -> Option<(usize, usize)> {
        let tilt = self.normal[1];
        let reach = self.radius * (1.0 - tilt * tilt).max(0.0).sqrt();
        samples_between(self.centre[1], reach.max(EDGE_ON), height)
    }

    /// First and last column of a row, `dy` below the middle, that the disc touches: a quadratic
    /// inequality for the offset from the middle.
    fn columns(&self, dy: f32, width: usize) -> Option<(usize, usize)> {
        let [sx, sy] = self.slope;
        let square = 1.0 + sx * sx;
        let half_linear = dy * sx * sy;
        let constant = dy * dy * (1.0 + sy * sy) - self.radius * self.radius;
        let discriminant = half_linear * half_linear - square * constant;
        if discriminant < 0.0 {
            return None;
        }
        let middle = self.centre[0] - half_linear / square;
        samples_between(middle, discriminant.sqrt() / square, width)
    }

    /// How much deeper the disc is at an offset from its middle.
    fn rise(&self, dx: f32, dy: f32) -> f32 {
        self.slope[0] * dx + self.slope[1] * dy
    }

    /// The level at a place that counts from the first sample of a row.
    fn level_at(&self, first_row: usize, place: usize, width: usize) -> f32 {
        let dx = (place % width) as f32 + 0.5 - self.centre[0];
        let dy = (first_row + place / width) as f32 + 0.5 - self.centre[1];
        self.level + self.level_slope[0] * dx + self.level_slope[1] * dy
    }

    /// Calls `hit(place, depth, weight)` for the samples of a band inside the disc; places count
    /// from the band's first sample, and the weight falls from 1 at the middle to 0 at the rim.
    fn for_band(
        &self,
        band: usize,
        width: usize,
        height: usize,
        mut hit: impl FnMut(usize, f32, f32),
    ) {
        let Some((first, last)) = self.rows(height) else {
            return;
        };
        let (top, bottom) = (band * BAND, (band + 1) * BAND - 1);
        let per_square = 1.0 / (self.radius * self.radius);
        for row in first.max(top)..=last.min(bottom) {
            let dy = row as f32 + 0.5 - self.centre[1];
            let Some((left, right)) = self.columns(dy, width) else {
                continue;
            };
            for column in left..=right {
                let dx = column as f32 + 0.5 - self.centre[0];
                let rise = self.rise(dx, dy);
                let open = 1.0 - (dx * dx + dy * dy + rise * rise) * per_square;
                if open > 0.0 {
                    hit((row - top) * width + column, self.depth + rise, open * open);
                }
            }
        }
    }
}

/// First and last sample whose middle is at most `reach` from `middle`.
fn samples_between(middle: f32, reach: f32, count: usize) -> Option<(usize, usize)> {
    let first = (middle - reach - 0.5).ceil().max(0.0);
    let last = (middle + reach - 0.5).floor().min(count as f32 - 1.0);
    (first <= last).then_some((first as usize, last as usize))
}

/// Sums over the discs that make up the surface at a sample.
#[derive(Clone, Copy, Default)]
struct Blend {
    weight: f32,
    depth: f32,
    normal: [f32; 3],
    colour: [f32; 3],
    radius: f32,
    level: f32,
}

impl Blend {
    fn add(&mut self, splat: &Splat, depth: f32, level: f32, weight: f32) {
        self.weight += weight;
        self.depth += weight * depth;
        self.radius += weight * splat.radius;
        self.level += weight * level;
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
            level: self.level * share,
        };
        (self.depth * share, surfel)
    }
}
