//! Clouds to be honest on: smooth ones, ones with rims, and rough ones, each with the true
//! distances from any of its points.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use num_dual::DualNum;
use rayon::prelude::*;

use crate::shooting::Fan;
use crate::surface::{Ellipsoid, StarShaped, Surface, Torus};
use crate::{closed_form, generate};

/// What a cloud asks of those who answer on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A smooth surface without rims, points on it.
    Clean,
    /// The surface ends.
    Rimmed,
    /// Noise or outliers.
    Rough,
}

/// The distances from one point to others, by their rows.
type Distances<'a> = Box<dyn Fn(usize) -> Option<f64> + Sync + 'a>;

/// A cloud of a surface in space.
pub struct Case {
    /// Its points, those of the surface before outliers.
    pub points: Vec<[f64; 3]>,
    /// Mean distance between neighbouring points.
    pub spacing: f64,
    /// The rows that have a truth: those before this.
    pub rows: usize,
    truth: Truth,
}

/// Where the truth comes from; parameters are each row's.
enum Truth {
    Sphere(Vec<[f64; 3]>),
    Shot(Shape),
    Sheet(Vec<[f64; 2]>),
    Hole(f64, Vec<[f64; 2]>),
    /// The inner slant, and angle and distance from the apex in the cone unrolled.
    Frustum(f64, Vec<[f64; 2]>),
    /// A place on one of two sheets.
    Slab(Vec<[f64; 2]>),
}

#[derive(Clone, Copy)]
enum Shape {
    Torus(Torus),
    Ellipsoid(Ellipsoid),
    StarShaped(StarShaped),
}

/// The name of each case and its kind.
pub const NAMES: [(&str, Kind); 18] = [
    ("sphere", Kind::Clean),
    ("ellipsoid", Kind::Clean),
    ("spheroid", Kind::Clean),
    ("torus", Kind::Clean),
    ("ring", Kind::Clean),
    ("wavy", Kind::Clean),
    ("peanut", Kind::Clean),
    ("roll", Kind::Clean),
    ("uneven", Kind::Clean),
    ("hemisphere", Kind::Rimmed),
    ("hole", Kind::Rimmed),
    ("frustum", Kind::Rimmed),
    ("outliers1", Kind::Rough),
    ("outliers3", Kind::Rough),
    ("noise0.25", Kind::Rough),
    ("noise0.5", Kind::Rough),
    ("noise1", Kind::Rough),
    ("slab", Kind::Rough),
];

impl Case {
    /// A case by its name, of about so many points.
    pub fn new(name: &str, count: usize, seed: u64) -> Option<Self> {
        let unit = (4.0 * PI / count as f64).sqrt();
        Some(match name {
            "sphere" => Self::sphere(generate::sphere::<3>(count, 1.0, seed), unit),
            "uneven" => Self::sphere(generate::uneven_sphere(count, 1.0, 30.0, seed), unit),
            "hemisphere" => {
                let mut points = generate::sphere::<3>(2 * count, 1.0, seed);
                points.retain(|point| point[2] >= 0.0);
                Self::sphere(points, unit * 0.5_f64.sqrt())
            }
            "outliers1" => Self::strewn(count, 0.01, seed),
            "outliers3" => Self::strewn(count, 0.03, seed),
            "noise0.25" => Self::noisy(count, 0.25, seed),
            "noise0.5" => Self::noisy(count, 0.5, seed),
            "noise1" => Self::noisy(count, 1.0, seed),
            "ellipsoid" => Self::ellipsoid([2.0, 1.3, 0.8], 23.2, count, seed),
            "spheroid" => Self::ellipsoid([1.0, 1.0, 0.5], 8.67, count, seed),
            "torus" => Self::torus([2.0, 0.7], count, seed),
            "ring" => Self::torus([1.0, 0.4], count, seed),
            "wavy" => Self::star_shaped(wavy(), 13.6, count, seed),
            "peanut" => Self::star_shaped(peanut(), 14.0, count, seed),
            "roll" => Self::roll(count, seed),
            "hole" => Self::hole(count, seed),
            "frustum" => Self::frustum(count, seed),
            "slab" => Self::slab(count, seed),
            _ => return None,
        })
    }

    /// The distances from a row, which need some seconds to be made ready where they are shot.
    pub fn distances(&self, from: usize) -> Distances<'_> {
        let p = self.points[from];
        match &self.truth {
            Truth::Sphere(clean) => {
                Box::new(move |to| Some(closed_form::sphere(1.0, &clean[from], &clean[to])))
            }
            Truth::Sheet(places) => {
                Box::new(move |to| Some(closed_form::sheet(&places[from], &places[to])))
            }
            Truth::Hole(radius, places) => Box::new(move |to| {
                let (p, q) = (&places[from], &places[to]);
                Some(closed_form::plane_with_hole(*radius, p, q))
            }),
            Truth::Frustum(inner, places) => Box::new(move |to| {
                let ([u, s], [v, t]) = (places[from], places[to]);
                let angle = ((u - v + PI).rem_euclid(TAU) - PI).abs() * HALF_ANGLE.sin();
                let q = [t * angle.cos(), t * angle.sin()];
                Some(closed_form::plane_with_hole(*inner, &[s, 0.0], &q))
            }),
            Truth::Slab(places) => Box::new(move |to| {
                let is_same = from % 2 == to % 2;
                let length = closed_form::sheet(&places[from], &places[to]);
                Some(if is_same { length } else { f64::INFINITY })
            }),
            Truth::Shot(Shape::Torus(shape)) => self.shot(shape, p),
            Truth::Shot(Shape::Ellipsoid(shape)) => self.shot(shape, p),
            Truth::Shot(Shape::StarShaped(shape)) => self.shot(shape, p),
        }
    }

    /// Points nearer than this to a source are not judged.
    pub fn near(&self) -> f64 {
        8.0 * self.spacing
    }

    /// The pairs of points within 2 spacings of each other whose distances differ by more than the
    /// way between them and a number of spacings.
    pub fn jumps(&self, distances: &[f64], slack: f64) -> usize {
        let reach = 2.0 * self.spacing;
        let cell = |p: &[f64; 3]| p.map(|x| (x / reach).floor() as i64);
        let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (row, point) in self.points[..self.rows].iter().enumerate() {
            cells.entry(cell(point)).or_default().push(row);
        }
        let is_far = |row: usize| distances[row] >= self.near() && distances[row].is_finite();
        let of_row = |row: usize| {
            let [x, y, z] = cell(&self.points[row]);
            let around = (0..27).map(|i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
            let others = around.filter_map(|cell| cells.get(&cell)).flatten();
            let jumps = |other: &&usize| {
                let offset = Vector3::from(self.points[row]) - Vector3::from(self.points[**other]);
                let (chord, excess) = (offset.norm(), slack * self.spacing);
                // An arc is longer than its chord.
                let way = 1.002 * chord + excess;
                chord <= reach && (distances[row] - distances[**other]).abs() > way
            };
            let after = others.filter(|other| **other > row && is_far(**other));
            after.filter(jumps).count()
        };
        let rows = (0..self.rows).into_par_iter().filter(|row| is_far(*row));
        rows.map(of_row).sum()
    }

    fn shot<'a, S: Surface>(&'a self, shape: &'a S, from: [f64; 3]) -> Distances<'a> {
        let start = Vector3::from(from);
        let bounds = self.points.iter().step_by(97);
        let bounds = bounds.map(|q| shape.length_bound(&start, &Vector3::from(*q)));
        let longest = 1.1 * bounds.fold(0.0, f64::max);
        let fan = Fan::new(shape, from, longest);
        Box::new(move |to| fan.distance(self.points[to], longest))
    }

    fn sphere(points: Vec<[f64; 3]>, spacing: f64) -> Self {
        Self {
            rows: points.len(),
            truth: Truth::Sphere(points.clone()),
            points,
            spacing,
        }
    }

    fn strewn(count: usize, share: f64, seed: u64) -> Self {
        let mut case = Self::sphere(
            generate::sphere::<3>(count, 1.0, seed),
            (4.0 * PI / count as f64).sqrt(),
        );
        let strewn = (share * count as f64) as usize;
        let outliers = generate::outliers(&case.points, strewn, seed + 100);
        case.points.extend(outliers);
        case
    }

    fn noisy(count: usize, sigma: f64, seed: u64) -> Self {
        let spacing = (4.0 * PI / count as f64).sqrt();
        let mut case = Self::sphere(generate::sphere::<3>(count, 1.0, seed), spacing);
        case.points = generate::radial_noise(&case.points, sigma * spacing, seed + 100);
        case
    }

    fn of_shape(points: Vec<[f64; 3]>, area: f64, shape: Shape) -> Self {
        Self {
            rows: points.len(),
            spacing: (area / points.len() as f64).sqrt(),
            points,
            truth: Truth::Shot(shape),
        }
    }

    fn ellipsoid(semi_axes: [f64; 3], area: f64, count: usize, seed: u64) -> Self {
        let points = generate::ellipsoid(count, semi_axes, seed);
        Self::of_shape(points, area, Shape::Ellipsoid(Ellipsoid { semi_axes }))
    }

    fn torus([major, minor]: [f64; 2], count: usize, seed: u64) -> Self {
        let shape = Torus { major, minor };
        let points = generate::torus(count, &shape, seed).points;
        let area = 4.0 * PI * PI * major * minor;
        Self::of_shape(points, area, Shape::Torus(shape))
    }

    fn star_shaped(shape: StarShaped, area: f64, count: usize, seed: u64) -> Self {
        let points = generate::star_shaped(count, &shape, 3.0, seed);
        Self::of_shape(points, area, Shape::StarShaped(shape))
    }

    /// Layers 5 spacings apart.
    fn roll(count: usize, seed: u64) -> Self {
        let spacing = (4.0 / count as f64).sqrt();
        let shape = |turns| generate::Roll {
            inner_radius: 15.0 * spacing,
            gap: 5.0 * spacing,
            turns,
        };
        // The length grows with the turns.
        let (mut low, mut high) = (0.0, 100.0);
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if shape(middle).length() < 4.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let sample = shape(low).random(count, seed);
        Self {
            rows: count,
            points: sample.points,
            spacing,
            truth: Truth::Sheet(sample.parameters),
        }
    }

    fn hole(count: usize, seed: u64) -> Self {
        let sample = generate::plane_with_hole(count, 1.0, 0.4, seed);
        Self {
            rows: count,
            points: sample.points,
            spacing: ((4.0 - 0.16 * PI) / count as f64).sqrt(),
            truth: Truth::Hole(0.4, sample.parameters),
        }
    }

    fn frustum(count: usize, seed: u64) -> Self {
        let share = 1.0 - INNER * INNER;
        let sample = generate::cone((count as f64 / share) as usize, HALF_ANGLE, 1.0, seed);
        let kept = sample.parameters.iter().zip(&sample.points);
        let kept = kept.filter(|(place, _)| place[1] >= INNER);
        let (places, points): (Vec<_>, Vec<_>) = kept.map(|(a, b)| (*a, *b)).unzip();
        Self {
            rows: points.len(),
            spacing: (PI * HALF_ANGLE.sin() * share / points.len() as f64).sqrt(),
            points,
            truth: Truth::Frustum(INNER, places),
        }
    }

    /// Two sheets 3 spacings apart, rows in turn on one and the other, with noise of a quarter of a
    /// spacing.
    fn slab(count: usize, seed: u64) -> Self {
        let half = generate::plane_with_hole(count, 1.0, 0.0, seed);
        let spacing = (4.0 / (count / 2) as f64).sqrt();
        let lifted = half.points.iter().enumerate().map(|(row, point)| {
            let [x, y, _] = *point;
            [x, y, 3.0 * spacing * (row % 2) as f64]
        });
        let lifted: Vec<[f64; 3]> = lifted.collect();
        let up = |_| [0.0, 0.0, 1.0];
        Self {
            rows: count,
            points: generate::noise(&lifted, 0.25 * spacing, seed + 100, up),
            spacing,
            truth: Truth::Slab(half.parameters),
        }
    }
}

/// Of the cone frustum.
const HALF_ANGLE: f64 = 0.6;
/// Its inner slant; the outer one is 1.
const INNER: f64 = 0.3;

/// r = 1 + 0.1 sin 4x sin(3y + 1) sin 4z.
fn wavy() -> StarShaped {
    StarShaped {
        radius: |u| (u[0] * 4.0).sin() * (u[1] * 3.0 + 1.0).sin() * (u[2] * 4.0).sin() * 0.1 + 1.0,
        reach: 0.2,
    }
}

/// A surface of revolution with a waist: r = 1 + 0.25 (2 z^2 - 1).
fn peanut() -> StarShaped {
    StarShaped {
        radius: |u| (u[2] * u[2] * 2.0 - 1.0) * 0.25 + 1.0,
        reach: 0.3,
    }
}
