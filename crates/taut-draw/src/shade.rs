//! Surface to picture: light, dark creases, haze.

use rayon::prelude::*;

use crate::canvas::{Canvas, coded, decode, encode};
use crate::splat::{Surface, Surfel};

/// Directions to the lights (right, down, toward the viewer), of length 1, and their strengths.
const KEY_LIGHT: [f32; 3] = [-0.477, -0.636, 0.606];
const KEY_STRENGTH: f32 = 0.66;
const HEAD_STRENGTH: f32 = 0.34;
const AMBIENT: f32 = 0.16;
/// From this cosine on, the side that a disc shows is beyond doubt.
const SURE_SIDE: f32 = 0.45;
/// Strength and sharpness of the highlight of the key light.
const GLOSS: f32 = 0.05;
const GLOSS_POWER: i32 = 24;
/// Reach of the two searches for what blocks ambient light, as shares of the picture's height.
const CREASE_REACHES: [f32; 2] = [0.008, 0.035];
/// How much each search counts.
const CREASE_WEIGHTS: [f32; 2] = [1.4, 0.8];
/// Samples of each search, evenly round the point.
const CREASE_SAMPLES: usize = 8;
/// Neighbours lower than this (sine over the tangent plane) block nothing: splats are not smooth.
const CREASE_BIAS: f32 = 0.12;
/// Darkness where ambient light is blocked on all sides, as an exponent.
const DARKENING: f32 = 2.4;
/// Width in pixels of the dark line along an edge, on the surface behind it, and its darkness.
const EDGE_WIDTH: f32 = 1.3;
const EDGE_DARKNESS: f32 = 0.4;
/// An edge shows where a surface rises this many disc radii over what lies behind, and fully at
/// twice as many.
const EDGE_RISE: f32 = 1.5;
/// Width in pixels of isolines, and the share of the light that they leave.
const ISOLINE_WIDTH: f32 = 1.4;
const ISOLINE_LIGHT: f32 = 0.35;
/// Levels of samples beside each other that differ by more belong to different layers.
const LARGEST_STEP: f32 = 0.5;
/// How much the farthest surface fades into the background.
const HAZE: f32 = 0.22;

/// How a picture looks, apart from what it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Style {
    /// Background, as sRGB.
    pub background: [u8; 3],
    /// Samples a pixel along each side, from 1 (draft) to 4; more gives smoother outlines, at the
    /// cost of its square in time and memory.
    pub supersampling: u8,
    /// Darkness of creases and of what lies close behind something: 0 none, 1 usual.
    pub crease_strength: f64,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            background: [255; 3],
            supersampling: 2,
            crease_strength: 1.0,
        }
    }
}

impl Style {
    pub(crate) fn samples(&self) -> usize {
        usize::from(self.supersampling.clamp(1, 4))
    }
}

/// Lights the surface and averages its samples into pixels.
pub(crate) fn shade(surface: &Surface, style: &Style) -> Canvas {
    let samples = surface.samples;
    let (width, height) = (surface.width / samples, surface.height / samples);
    let light = Light::new(surface, style);
    let mut pixels = vec![[0.0; 3]; width * height];
    pixels
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                *pixel = light.pixel(x, y).map(encode);
            }
        });
    Canvas {
        width,
        height,
        pixels,
    }
}

struct Light<'a> {
    surface: &'a Surface,
    background: [f32; 3],
    crease_strength: f32,
    /// Offsets in samples, for each reach.
    offsets: [[[i32; 2]; CREASE_SAMPLES]; 2],
    edge_offsets: [[i32; 2]; CREASE_SAMPLES],
    reaches: [f32; 2],
    nearest: f32,
    haze_per_depth: f32,
    decoded: [f32; 256],
}

impl<'a> Light<'a> {
    fn new(surface: &'a Surface, style: &Style) -> Self {
        let finite = || surface.depth.iter().copied().filter(|d| d.is_finite());
        let nearest = finite().fold(f32::INFINITY, f32::min);
        let farthest = finite().fold(f32::NEG_INFINITY, f32::max);
        let size = surface.height.min(surface.width) as f32;
        let reaches = CREASE_REACHES.map(|share| share * size);
        Self {
            surface,
            background: coded(style.background).map(decode),
            crease_strength: style.crease_strength.clamp(0.0, 4.0) as f32,
            offsets: std::array::from_fn(|ring| ring_offsets(reaches[ring], ring)),
            edge_offsets: ring_offsets(EDGE_WIDTH * surface.samples as f32, 0),
            reaches,
            nearest,
            haze_per_depth: HAZE / (farthest - nearest).max(1.0),
            decoded: std::array::from_fn(|byte| decode(byte as f32 / 255.0)),
        }
    }

    /// Mean light of a pixel's samples. How open the surface is, is asked once a pixel, where it
    /// is nearest.
    fn pixel(&self, x: usize, y: usize) -> [f32; 3] {
        let places = self.places(x, y);
        let nearest = places.clone().fold(None, |nearest: Option<usize>, place| {
            let depth = self.surface.depth[place];
            match nearest {
                Some(other) if self.surface.depth[other] <= depth => nearest,
                _ => depth.is_finite().then_some(place).or(nearest),
            }
        });
        let Some(nearest) = nearest else {
            return self.background;
        };
        let open = self.openness(nearest);
        let mut sum = [0.0; 3];
        for place in places {
            let light = self.sample(place, open);
            for channel in 0..3 {
                sum[channel] += light[channel];
            }
        }
        let samples = self.surface.samples;
        sum.map(|channel| channel / (samples * samples) as f32)
    }

    /// The samples of a pixel.
    fn places(&self, x: usize, y: usize) -> impl Iterator<Item = usize> + Clone {
        let (samples, width) = (self.surface.samples, self.surface.width);
        (y * samples..(y + 1) * samples)
            .flat_map(move |row| (x * samples..(x + 1) * samples).map(move |c| row * width + c))
    }

    fn sample(&self, place: usize, open: f32) -> [f32; 3] {
        let depth = self.surface.depth[place];
        if depth == f32::INFINITY {
            return self.background;
        }
        let surfel = &self.surface.surfels[place];
        let (diffuse, gloss) = reflect(surfel.normal);
        let haze = (depth - self.nearest) * self.haze_per_depth;
        let open = open * (1.0 - (1.0 - ISOLINE_LIGHT) * self.on_isoline(place));
        self.lit(surfel, diffuse * open, gloss * open, haze)
    }

    /// The share of a sample that an isoline covers.
    fn on_isoline(&self, place: usize) -> f32 {
        let surface = self.surface;
        let level = surface.surfels[place].level;
        if level.is_nan() {
            return 0.0;
        }
        let step = |offset: usize, inside: bool| {
            let other = inside.then(|| surface.surfels[place + offset].level - level)?;
            (other.abs() < LARGEST_STEP).then_some(other)
        };
        let right = step(1, place % surface.width + 1 < surface.width);
        let down = step(surface.width, place + surface.width < surface.surfels.len());
        let (Some(right), Some(down)) = (right, down) else {
            return 0.0;
        };
        let off = (level - level.round()).abs() / right.hypot(down).max(f32::MIN_POSITIVE);
        (0.5 * ISOLINE_WIDTH * surface.samples as f32 + 0.5 - off).clamp(0.0, 1.0)
    }

    fn lit(&self, surfel: &Surfel, diffuse: f32, gloss: f32, haze: f32) -> [f32; 3] {
        std::array::from_fn(|channel| {
            let albedo = self.decoded[usize::from(surfel.colour[channel])];
            let light = albedo * diffuse + gloss;
            light + (self.background[channel] - light) * haze
        })
    }

    /// The share of ambient light that reaches a sample.
    fn openness(&self, place: usize) -> f32 {
        let mut blocked = 0.0;
        for ring in 0..2 {
            for offset in self.offsets[ring] {
                let share = self.blocked(place, offset, self.reaches[ring]);
                blocked += CREASE_WEIGHTS[ring] * share;
            }
        }
        let share = blocked / (2 * CREASE_SAMPLES) as f32;
        let edge = (EDGE_DARKNESS * self.crease_strength * self.edge(place)).min(1.0);
        (-DARKENING * self.crease_strength * share).exp() * (1.0 - edge)
    }

    /// How much of an edge lies just beside `place`, from 0 to 1.
    fn edge(&self, place: usize) -> f32 {
        let surfel = &self.surface.surfels[place];
        let highest = self
            .edge_offsets
            .iter()
            .filter_map(|&offset| self.offset_to(place, offset))
            .map(|offset| over_plane(surfel, offset))
            .fold(0.0, f32::max);
        let rise = (self.surface.samples as f32).max(EDGE_RISE * surfel.radius);
        (highest / rise - 1.0).clamp(0.0, 1.0)
    }

    /// How steeply the surface at an offset rises over the tangent plane at `place`, less for
    /// farther away.
    fn blocked(&self, place: usize, offset: [i32; 2], reach: f32) -> f32 {
        let Some(offset) = self.offset_to(place, offset) else {
            return 0.0;
        };
        let square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        let over = over_plane(&self.surface.surfels[place], offset) / square.sqrt();
        let near = 1.0 / (1.0 + square / (4.0 * reach * reach));
        (over - CREASE_BIAS).max(0.0) * near
    }

    /// The vector from `place` to the surface some samples away, if there is any.
    fn offset_to(&self, place: usize, [dx, dy]: [i32; 2]) -> Option<[f32; 3]> {
        let surface = self.surface;
        let (column, row) = (place % surface.width, place / surface.width);
        let x = column.checked_add_signed(dx as isize)?;
        let y = row.checked_add_signed(dy as isize)?;
        if x >= surface.width || y >= surface.height || (dx == 0 && dy == 0) {
            return None;
        }
        let rise = surface.depth[place] - surface.depth[y * surface.width + x];
        rise.is_finite().then_some([dx as f32, dy as f32, rise])
    }
}

/// Height over a tangent plane.
fn over_plane(surfel: &Surfel, offset: [f32; 3]) -> f32 {
    let [nx, ny, nz] = surfel.normal;
    nx * offset[0] + ny * offset[1] + nz * offset[2]
}

/// Diffuse and glossy light that a surface sends to the viewer.
///
/// Normals have no sign of their own, so the side of a disc seen edge on is a guess: there both
/// sides are averaged, and no seam shows where the discs of the far side peep out at an outline.
fn reflect(normal: [f32; 3]) -> (f32, f32) {
    let [lx, ly, lz] = KEY_LIGHT;
    let toward_key = normal[0] * lx + normal[1] * ly + normal[2] * lz;
    let sure = (normal[2] / SURE_SIDE).min(1.0);
    let wrapped = 0.25 * (1.0 + toward_key * (2.0 * sure + toward_key));
    let half = ((1.0 + lz) * 2.0).sqrt();
    let toward_half = (normal[0] * lx + normal[1] * ly + normal[2] * (lz + 1.0)) / half;
    let diffuse = AMBIENT + HEAD_STRENGTH * normal[2] + KEY_STRENGTH * wrapped;
    (diffuse, GLOSS * toward_half.max(0.0).powi(GLOSS_POWER))
}

/// Offsets spread round a point; the rings are turned against each other and their distances
/// alternate, so that no direction shows.
fn ring_offsets(reach: f32, ring: usize) -> [[i32; 2]; CREASE_SAMPLES] {
    std::array::from_fn(|sample| {
        let turn = sample as f32 + 0.5 * ring as f32;
        let angle = std::f32::consts::TAU * turn / CREASE_SAMPLES as f32;
        let distance = reach * if sample % 2 == 0 { 1.0 } else { 0.55 };
        [distance * angle.cos(), distance * angle.sin()].map(|offset| offset.round() as i32)
    })
}
