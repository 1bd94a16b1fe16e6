//! Seeded points on shapes: uniform by area, the same on every machine and with any number of
//! threads.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::outline::Outline;
use crate::surface::{StarShaped, Surface, Torus};

/// Points with the two parameters of each.
pub struct Sample<const D: usize> {
    /// Points in R^D.
    pub points: Vec<[f64; D]>,
    /// Parameters, as the generator says.
    pub parameters: Vec<[f64; 2]>,
}

fn generator(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}

fn normal<const D: usize>(random: &mut Pcg64) -> [f64; D] {
    std::array::from_fn(|_| StandardNormal.sample(random))
}

fn unit<const D: usize>(random: &mut Pcg64) -> [f64; D] {
    let vector: [f64; D] = normal(random);
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    vector.map(|x| x / length)
}

fn sample<const D: usize>(
    count: usize,
    seed: u64,
    mut parameters: impl FnMut(&mut Pcg64) -> [f64; 2],
    point: impl Fn([f64; 2]) -> [f64; D],
) -> Sample<D> {
    let mut random = generator(seed);
    let parameters: Vec<[f64; 2]> = (0..count).map(|_| parameters(&mut random)).collect();
    Sample {
        points: parameters.iter().map(|&p| point(p)).collect(),
        parameters,
    }
}

/// Sphere of dimension D - 1 about the origin of R^D.
pub fn sphere<const D: usize>(count: usize, radius: f64, seed: u64) -> Vec<[f64; D]> {
    let mut random = generator(seed);
    (0..count)
        .map(|_| unit(&mut random).map(|x: f64| x * radius))
        .collect()
}

/// `count` random vectors of R^D at right angles to each other, of unit length.
pub fn orthonormal<const D: usize>(count: usize, seed: u64) -> Vec<[f64; D]> {
    let mut random = generator(seed);
    let mut axes: Vec<[f64; D]> = Vec::new();
    for _ in 0..count {
        let mut axis: [f64; D] = unit(&mut random);
        for other in &axes {
            let share: f64 = axis.iter().zip(other).map(|(a, b)| a * b).sum();
            for (a, b) in axis.iter_mut().zip(other) {
                *a -= share * b;
            }
        }
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        axes.push(axis.map(|x| x / length));
    }
    axes
}

/// Torus; parameters u round the axis and v round the tube.
pub fn torus(count: usize, torus: &Torus, seed: u64) -> Sample<3> {
    let angles = |random: &mut Pcg64| {
        let u = TAU * random.random::<f64>();
        loop {
            let v = PI * (2.0 * random.random::<f64>() - 1.0);
            let width = torus.major + torus.minor * v.cos();
            if random.random::<f64>() * (torus.major + torus.minor) <= width {
                return [u, v];
            }
        }
    };
    sample(count, seed, angles, |angles| torus.point(angles).into())
}

/// Ellipsoid with semi-axes along the coordinates.
pub fn ellipsoid(count: usize, semi_axes: [f64; 3], seed: u64) -> Vec<[f64; 3]> {
    let mut random = generator(seed);
    let least = semi_axes.iter().copied().fold(f64::INFINITY, f64::min);
    (0..count)
        .map(|_| {
            loop {
                // The scaling of the unit sphere stretches area by abc |s / axes| at s.
                let s: [f64; 3] = unit(&mut random);
                let stretch = s
                    .iter()
                    .zip(semi_axes)
                    .map(|(x, a)| (x / a).powi(2))
                    .sum::<f64>()
                    .sqrt();
                if random.random::<f64>() <= least * stretch {
                    return std::array::from_fn(|i| semi_axes[i] * s[i]);
                }
            }
        })
        .collect()
}

/// Points of a star-shaped surface; `most` bounds its area for a solid angle, r^2 / cos of the
/// angle between ray and normal.
pub fn star_shaped(count: usize, shape: &StarShaped, most: f64, seed: u64) -> Vec<[f64; 3]> {
    let mut random = generator(seed);
    let draw = |random: &mut Pcg64| {
        loop {
            let direction = Vector3::from(unit::<3>(random));
            let point = shape.point(&direction);
            let area = point.norm_squared() / shape.normal(&point).dot(&direction);
            assert!(
                area <= most,
                "an area of {area} for a solid angle, at most {most} expected"
            );
            if random.random::<f64>() * most <= area {
                return point.into();
            }
        }
    };
    (0..count).map(|_| draw(&mut random)).collect()
}

/// Cylinder round the z axis, z from 0 to `height`; parameters are the angle and z.
pub fn cylinder(count: usize, radius: f64, height: f64, seed: u64) -> Sample<3> {
    let parameters = |random: &mut Pcg64| {
        [
            TAU * random.random::<f64>(),
            height * random.random::<f64>(),
        ]
    };
    sample(count, seed, parameters, |[u, z]| {
        [radius * u.cos(), radius * u.sin(), z]
    })
}

/// Cone with apex at the origin, `half_angle` from the +z axis; parameters are the angle and the
/// distance from the apex, up to `slant`.
pub fn cone(count: usize, half_angle: f64, slant: f64, seed: u64) -> Sample<3> {
    let parameters = |random: &mut Pcg64| {
        [
            TAU * random.random::<f64>(),
            slant * random.random::<f64>().sqrt(),
        ]
    };
    let (sin, cos) = half_angle.sin_cos();
    sample(count, seed, parameters, |[u, s]| {
        [s * sin * u.cos(), s * sin * u.sin(), s * cos]
    })
}

/// Torus of two circles in R^4, (r0 cos a, r0 sin a, r1 cos b, r1 sin b); parameters a and b.
pub fn flat_torus(count: usize, radii: [f64; 2], seed: u64) -> Sample<4> {
    let parameters =
        |random: &mut Pcg64| [TAU * random.random::<f64>(), TAU * random.random::<f64>()];
    let point = |[a, b]: [f64; 2]| {
        [
            radii[0] * a.cos(),
            radii[0] * a.sin(),
            radii[1] * b.cos(),
            radii[1] * b.sin(),
        ]
    };
    sample(count, seed, parameters, point)
}

/// Rotation matrix (row-major) of a unit quaternion.
pub fn rotation([w, x, y, z]: [f64; 4]) -> [f64; 9] {
    [
        w * w + x * x - y * y - z * z,
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        w * w - x * x + y * y - z * z,
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        w * w - x * x - y * y + z * z,
    ]
}

/// Rotation matrices, row-major, uniform by the invariant measure.
pub fn rotations(count: usize, seed: u64) -> Vec<[f64; 9]> {
    sphere(count, 1.0, seed).into_iter().map(rotation).collect()
}

/// Square [-half_side, half_side]² in the plane z = 0 less the disc of `radius` about the origin;
/// parameters x and y.
pub fn plane_with_hole(count: usize, half_side: f64, radius: f64, seed: u64) -> Sample<3> {
    let parameters = |random: &mut Pcg64| {
        loop {
            let [x, y] = [0; 2].map(|_| half_side * (2.0 * random.random::<f64>() - 1.0));
            if x.hypot(y) >= radius {
                return [x, y];
            }
        }
    };
    sample(count, seed, parameters, |[x, y]| [x, y, 0.0])
}

/// The part of the plane z = 0 within an outline inside [-half_side, half_side]²; parameters x and
/// y.
pub fn plane(count: usize, outline: &Outline, half_side: f64, seed: u64) -> Sample<3> {
    let parameters = |random: &mut Pcg64| {
        loop {
            let place = [0; 2].map(|_| half_side * (2.0 * random.random::<f64>() - 1.0));
            if outline.holds(place) {
                return place;
            }
        }
    };
    sample(count, seed, parameters, |[x, y]| [x, y, 0.0])
}

/// Sphere about the origin whose density, exponential in z, is `ratio` times as high at one pole as
/// at the other.
pub fn uneven_sphere(count: usize, radius: f64, ratio: f64, seed: u64) -> Vec<[f64; 3]> {
    let mut random = generator(seed);
    let draw = |random: &mut Pcg64| {
        loop {
            let x: [f64; 3] = unit(random);
            if random.random::<f64>() <= ratio.powf(0.5 * (x[2] - 1.0)) {
                return x.map(|x| x * radius);
            }
        }
    };
    (0..count).map(|_| draw(&mut random)).collect()
}

/// Sheet rolled up along the spiral of Archimedes r = inner_radius + gap θ / 2π, of width 1 along
/// z. Its parameters are u, arc length along the spiral from 0 to [`Roll::length`], and v = z from
/// 0 to 1: an isometry.
#[derive(Clone, Copy, Debug)]
pub struct Roll {
    /// Radius at the inner end.
    pub inner_radius: f64,
    /// Distance between layers along a radius.
    pub gap: f64,
    /// Number of turns.
    pub turns: f64,
}

impl Roll {
    fn growth(&self) -> f64 {
        self.gap / TAU
    }

    /// Arc length from θ = -inner_radius / growth, where the radius would be 0.
    fn arc(&self, radius: f64) -> f64 {
        let b = self.growth();
        0.5 * (radius * radius.hypot(b) / b + b * (radius / b).asinh())
    }

    /// Length of the spiral.
    pub fn length(&self) -> f64 {
        self.arc(self.inner_radius + self.gap * self.turns) - self.arc(self.inner_radius)
    }

    /// Radius where the arc length from the inner end is `u`: Newton on a convex function, from
    /// above.
    fn radius(&self, u: f64) -> f64 {
        let b = self.growth();
        let wanted = u + self.arc(self.inner_radius);
        (0..60).fold((2.0 * b * wanted).sqrt(), |r, _| {
            r - (self.arc(r) - wanted) * b / r.hypot(b)
        })
    }

    /// Point of the parameters u and v.
    pub fn point(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let radius = self.radius(u);
        let theta = (radius - self.inner_radius) / self.growth();
        [radius * theta.cos(), radius * theta.sin(), v]
    }

    /// Unit normal at arc length `u`, away from the axis.
    pub fn normal(&self, u: f64) -> [f64; 3] {
        let (radius, b) = (self.radius(u), self.growth());
        let (sin, cos) = ((radius - self.inner_radius) / b).sin_cos();
        let speed = radius.hypot(b);
        [
            (b * sin + radius * cos) / speed,
            (radius * sin - b * cos) / speed,
            0.0,
        ]
    }

    /// Uniform random points.
    pub fn random(&self, count: usize, seed: u64) -> Sample<3> {
        let length = self.length();
        let parameters =
            |random: &mut Pcg64| [length * random.random::<f64>(), random.random::<f64>()];
        sample(count, seed, parameters, |p| self.point(p))
    }

    /// One point at random in each cell of a grid of about `step`.
    pub fn jittered(&self, step: f64, seed: u64) -> Sample<3> {
        let length = self.length();
        let along = (length / step).round().max(1.0) as usize;
        let across = (1.0 / step).round().max(1.0) as usize;
        let mut cells = (0..along * across).map(|i| [(i / across) as f64, (i % across) as f64]);
        let parameters = |random: &mut Pcg64| {
            let [i, j] = cells.next().unwrap_or_default();
            let (a, b) = (random.random::<f64>(), random.random::<f64>());
            [length * (i + a) / along as f64, (j + b) / across as f64]
        };
        sample(along * across, seed, parameters, |p| self.point(p))
    }
}

/// The points moved by normal deviates of standard deviation `sigma` along `direction(row)`, a unit
/// vector.
pub fn noise<const D: usize>(
    points: &[[f64; D]],
    sigma: f64,
    seed: u64,
    direction: impl Fn(usize) -> [f64; D],
) -> Vec<[f64; D]> {
    let mut random = generator(seed);
    let moved = |(row, point): (usize, &[f64; D])| {
        let [deviate] = normal::<1>(&mut random);
        let along = direction(row);
        std::array::from_fn(|i| point[i] + sigma * deviate * along[i])
    };
    points.iter().enumerate().map(moved).collect()
}

/// [`noise`] along the ray from the origin.
pub fn radial_noise<const D: usize>(points: &[[f64; D]], sigma: f64, seed: u64) -> Vec<[f64; D]> {
    noise(points, sigma, seed, |row| {
        let length = points[row].iter().map(|x| x * x).sum::<f64>().sqrt();
        points[row].map(|x| x / length)
    })
}

/// `count` points uniform in the bounding box of `points`, for use as outliers.
pub fn outliers<const D: usize>(points: &[[f64; D]], count: usize, seed: u64) -> Vec<[f64; D]> {
    let mut random = generator(seed);
    let fold =
        |i: usize, start: f64, f: fn(f64, f64) -> f64| points.iter().map(|p| p[i]).fold(start, f);
    let low: [f64; D] = std::array::from_fn(|i| fold(i, f64::INFINITY, f64::min));
    let high: [f64; D] = std::array::from_fn(|i| fold(i, f64::NEG_INFINITY, f64::max));
    let draw = |random: &mut Pcg64| {
        std::array::from_fn(|i| low[i] + (high[i] - low[i]) * random.random::<f64>())
    };
    (0..count).map(|_| draw(&mut random)).collect()
}

/// Random pairs of different rows out of `rows` (at least 2).
pub fn pairs(rows: usize, count: usize, seed: u64) -> Vec<[usize; 2]> {
    let mut random = generator(seed);
    let draw = |random: &mut Pcg64| {
        let first = random.random_range(0..rows);
        let second = random.random_range(0..rows - 1);
        [first, second + usize::from(second >= first)]
    };
    (0..count).map(|_| draw(&mut random)).collect()
}
