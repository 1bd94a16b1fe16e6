//! Accuracy and speed of distance fields on clouds with known truth: `cargo run --release -p
//! taut-compare --features measure --bin fields -- sphere:100000 torus:10000 roll:100000:8
//! sphere:10000:1`, with holes, notches, outliers and uneven density `hole:10000 triangle:10000
//! notches:10000 strewn:10000 uneven:10000`, and of other dimensions `sphere3:100000 sphere4:100000
//! spherinder:50000 curve:1000 clifford:100000 roll10:20000`.
//!
//! A case is SHAPE:POINTS, and after another colon the noise in spacings, for the roll the gap
//! between its layers in spacings, and for sheets with holes and notches the seed of the points, of
//! which the first is the source. Prints a line a case: seconds of the atlas, of what all fields
//! share, of the first field at all points and (best of five) of later ones; relative errors over
//! points at least 5 spacings away; what the estimates cover.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};
use std::time::Instant;

use rayon::prelude::*;
use taut_compare::outline::Outline;
use taut_compare::shooting::Fan;
use taut_compare::surface::Torus;
use taut_compare::{closed_form, generate};
use taut_core::cloud::Cloud;
use taut_core::field::{Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

/// A cloud of a surface of some dimension with its mean spacing, and the true distances of some
/// rows from row 0.
struct Case<const D: usize> {
    points: Vec<[f64; D]>,
    dimension: usize,
    spacing: f64,
    truth: Vec<(usize, f64)>,
}

/// Points whose distance on the torus is shot.
const SHOT: usize = 4000;

fn sphere(count: usize, noise: f64) -> Case<3> {
    let clean = generate::sphere::<3>(count, 1.0, 1);
    let truth = (1..count)
        .map(|i| (i, closed_form::sphere(1.0, &clean[0], &clean[i])))
        .collect();
    let spacing = (4.0 * PI / count as f64).sqrt();
    let points = if noise > 0.0 {
        generate::radial_noise(&clean, noise * spacing, 3)
    } else {
        clean
    };
    Case {
        points,
        dimension: 2,
        spacing,
        truth,
    }
}

fn torus(count: usize) -> Case<3> {
    let shape = Torus {
        major: 1.0,
        minor: 0.4,
    };
    let points = generate::torus(count, &shape, 1).points;
    let longest = 5.0;
    let fan = Fan::new(&shape, points[0], longest);
    let stride = (count / SHOT).max(1);
    let truth = (1..count)
        .step_by(stride)
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|i| {
            let shortest = fan.geodesics(points[i], longest).first().copied()?;
            Some((i, shortest.length))
        })
        .collect();
    let area = 4.0 * PI * PI * shape.major * shape.minor;
    Case {
        points,
        dimension: 2,
        spacing: (area / count as f64).sqrt(),
        truth,
    }
}

/// A square of side 2 with a round hole of radius 0.4 in its middle, which hides half of it from
/// the source.
fn hole(count: usize, seed: u64) -> Case<3> {
    let sample = generate::plane_with_hole(count, 1.0, 0.4, seed);
    let truth = (1..count)
        .map(|i| {
            let ends = (&sample.parameters[0], &sample.parameters[i]);
            (i, closed_form::plane_with_hole(0.4, ends.0, ends.1))
        })
        .collect();
    Case {
        points: sample.points,
        dimension: 2,
        spacing: ((4.0 - 0.16 * PI) / count as f64).sqrt(),
        truth,
    }
}

/// A part of the square of side 2 with a polygonal edge, of an area.
fn outlined(count: usize, rings: Vec<Vec<[f64; 2]>>, area: f64, seed: u64) -> Case<3> {
    let outline = Outline { rings };
    let sample = generate::plane(count, &outline, 1.0, seed);
    let places = &sample.parameters;
    let truth = (1..count).zip(outline.distances(places[0], &places[1..]));
    Case {
        truth: truth.collect(),
        points: sample.points,
        dimension: 2,
        spacing: (area / count as f64).sqrt(),
    }
}

/// A square of side 2 with a triangle of side 1 cut out of its middle.
fn triangle(count: usize, seed: u64) -> Case<3> {
    let corner = |i: i32| {
        let (sin, cos) = (0.3 + TAU / 3.0 * f64::from(i)).sin_cos();
        [cos / 3_f64.sqrt(), sin / 3_f64.sqrt()]
    };
    let hole = (0..3).map(corner).collect();
    let square = Outline::rectangle([-1.0; 2], [1.0; 2]);
    outlined(count, vec![square, hole], 4.0 - 0.25 * 3_f64.sqrt(), seed)
}

fn notches(count: usize, seed: u64) -> Case<3> {
    outlined(count, Outline::notches().rings, 4.0 - 2.0 * 0.2 * 1.3, seed)
}

/// A sphere with points uniform in the cube round it beside its own, these a hundredth of those.
fn strewn(count: usize) -> Case<3> {
    let mut case = sphere(count, 0.0);
    case.points
        .extend(generate::outliers(&case.points, count / 100, 5));
    case
}

/// A sphere sampled 20 times as densely at one pole as at the other.
fn uneven(count: usize) -> Case<3> {
    let points = generate::uneven_sphere(count, 1.0, 20.0, 1);
    let truth = (1..count).map(|i| (i, closed_form::sphere(1.0, &points[0], &points[i])));
    Case {
        truth: truth.collect(),
        points,
        dimension: 2,
        spacing: (4.0 * PI / count as f64).sqrt(),
    }
}

/// A sheet of 4 by 1 rolled up, layers `gap` spacings apart; the innermost radius is the larger of
/// a gap and 15 spacings for gaps below 8 spacings, and a gap else.
fn roll(count: usize, gap: f64) -> Case<3> {
    let spacing = (4.0 / count as f64).sqrt();
    let inner_radius = if gap < 8.0 { 15.0 } else { gap } * spacing;
    let of_turns = |turns| generate::Roll {
        inner_radius,
        gap: gap * spacing,
        turns,
    };
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..60 {
        let turns = 0.5 * (low + high);
        if of_turns(turns).length() < 4.0 {
            low = turns;
        } else {
            high = turns;
        }
    }
    let sample = of_turns(low).random(count, 1);
    let source = (0..count)
        .min_by(|a, b| {
            let off =
                |i: usize| (sample.parameters[i][0] - 0.2).hypot(sample.parameters[i][1] - 0.5);
            off(*a).total_cmp(&off(*b))
        })
        .unwrap_or(0);
    let (mut points, mut parameters) = (sample.points, sample.parameters);
    points.swap(0, source);
    parameters.swap(0, source);
    let truth = (1..count)
        .map(|i| (i, closed_form::sheet(&parameters[0], &parameters[i])))
        .collect();
    Case {
        points,
        dimension: 2,
        spacing,
        truth,
    }
}

/// The unit sphere of dimension D - 1, whose area is `area`.
fn sphere_in<const D: usize>(count: usize, area: f64) -> Case<D> {
    let points = generate::sphere::<D>(count, 1.0, 1);
    let truth = (1..count)
        .map(|i| (i, closed_form::sphere(1.0, &points[0], &points[i])))
        .collect();
    Case {
        points,
        dimension: D - 1,
        spacing: (area / count as f64).powf(1.0 / (D - 1) as f64),
        truth,
    }
}

/// Clifford's torus in the unit sphere of R^4.
fn clifford(count: usize) -> Case<4> {
    let radii = [FRAC_1_SQRT_2; 2];
    let points = generate::flat_torus(count, radii, 1).points;
    let truth = (1..count)
        .map(|i| (i, closed_form::flat_torus(radii, &points[0], &points[i])))
        .collect();
    Case {
        points,
        dimension: 2,
        spacing: (2.0 * PI * PI / count as f64).sqrt(),
        truth,
    }
}

/// The product of the unit sphere with a line of length 2, in R^4: its fronts bend in one direction
/// only.
fn spherinder(count: usize) -> Case<4> {
    let base = generate::sphere::<3>(count, 1.0, 1);
    let heights = generate::sphere::<3>(count, 1.0, 2);
    let points: Vec<[f64; 4]> = base
        .iter()
        .zip(&heights)
        // By Archimedes a coordinate of a random point of the sphere is uniform.
        .map(|([x, y, z], [h, _, _])| [*x, *y, *z, *h])
        .collect();
    let truth = (1..count)
        .map(|i| {
            let along = closed_form::sphere(1.0, &base[0], &base[i]);
            (i, along.hypot(points[i][3] - points[0][3]))
        })
        .collect();
    Case {
        points,
        dimension: 3,
        spacing: (8.0 * PI / count as f64).cbrt(),
        truth,
    }
}

/// The closed curve of a helix round a torus in R^3, three times round the tube, by arc length.
fn curve(count: usize) -> Case<3> {
    let place = |t: f64| {
        let (ring, tube) = ((TAU * t).sin_cos(), (3.0 * TAU * t).sin_cos());
        let radius = 1.0 + 0.3 * tube.1;
        [radius * ring.1, radius * ring.0, 0.3 * tube.0]
    };
    let speed = |t: f64| TAU * (1.0 + 0.3 * (3.0 * TAU * t).cos()).hypot(0.9);
    // The speed is periodic: the trapezium rule finds its Fourier series, and lengths follow.
    let samples = 512;
    let modes: Vec<f64> = (0..32)
        .map(|mode| {
            let term = |i: usize| {
                let t = i as f64 / samples as f64;
                speed(t) * (TAU * (3 * mode) as f64 * t).cos()
            };
            (0..samples).map(term).sum::<f64>() / samples as f64
        })
        .collect();
    let arc = |t: f64| {
        let waves = modes.iter().zip(0..).skip(1).map(|(mode, i)| {
            let frequency = TAU * f64::from(3 * i);
            2.0 * mode * (frequency * t).sin() / frequency
        });
        modes[0] * t + waves.sum::<f64>()
    };
    let heights = generate::sphere::<3>(count, 1.0, 2);
    // One point in each of `count` equal parts: gaps of random points on a curve would part it.
    let places: Vec<f64> = heights
        .iter()
        .zip(0..)
        .map(|([h, _, _], i)| (f64::from(i) + 0.5 * (h + 1.0)) / count as f64)
        .collect();
    let truth = (1..count)
        .map(|i| {
            let along = (arc(places[i]) - arc(places[0])).abs();
            (i, along.min(modes[0] - along))
        })
        .collect();
    Case {
        points: places.iter().map(|t| place(*t)).collect(),
        dimension: 1,
        spacing: modes[0] / count as f64,
        truth,
    }
}

/// A roll with wide gaps, turned at random into R^10.
fn roll_in_ten(count: usize) -> Case<10> {
    let flat = roll(count, 8.0);
    let axes = generate::orthonormal::<10>(3, 7);
    let points = flat
        .points
        .iter()
        .map(|p| std::array::from_fn(|i| (0..3).map(|a| p[a] * axes[a][i]).sum()))
        .collect();
    Case {
        points,
        dimension: 2,
        spacing: flat.spacing,
        truth: flat.truth,
    }
}

fn measure<const D: usize>(
    name: &str,
    case: &Case<D>,
    tolerance: f64,
) -> Result<(), Box<dyn std::error::Error>> {
    let start = Instant::now();
    let cloud = Cloud::<D>::new(case.points.as_flattened(), D)?;
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, case.dimension)?);
    let atlas_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let fields = Fields::of_cloud(&geodesics)?;
    let shared_seconds = start.elapsed().as_secs_f64();
    let settings = Settings {
        tolerance,
        ..Settings::default()
    };
    let mut seconds = Vec::new();
    let mut at_nodes = f64::INFINITY;
    let mut found = None;
    for _ in 0..6 {
        let start = Instant::now();
        let node = geodesics.surface().node_of_row(0)?;
        let field = fields.from(&[Source { node, start: 0.0 }], &settings)?;
        at_nodes = at_nodes.min(start.elapsed().as_secs_f64());
        let values = fields.at_points(&field);
        seconds.push(start.elapsed().as_secs_f64());
        found = Some((field, values));
    }
    let (field, values) = found.ok_or("no field")?;
    let far = |row: &&(usize, f64)| row.1 >= 5.0 * case.spacing;
    let mut errors: Vec<(f64, usize)> = case
        .truth
        .iter()
        .filter(far)
        .map(|(row, truth)| ((values[*row].distance / truth - 1.0).abs(), *row))
        .collect();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let covered = case
        .truth
        .iter()
        .filter(far)
        .filter(|(row, truth)| (values[*row].distance - truth).abs() <= values[*row].error);
    let mean = errors.iter().map(|e| e.0).sum::<f64>() / errors.len() as f64;
    let later = seconds[1..].iter().copied().fold(f64::INFINITY, f64::min);
    println!(
        "{name}: atlas {atlas_seconds:.3} s, shared {shared_seconds:.4} s, field {:.4} s, later {later:.4} s ({at_nodes:.4} at nodes), error mean {mean:.2e} median {:.2e} p99 {:.2e} max {:.2e}, covered {:.3}, {} unreached and {} carried of {} nodes",
        seconds[0],
        errors[errors.len() / 2].0,
        errors[errors.len() * 99 / 100].0,
        errors[errors.len() - 1].0,
        covered.count() as f64 / errors.len() as f64,
        field.unreached_nodes(),
        field.carried_nodes(),
        geodesics.components().len(),
    );
    if std::env::var_os("WORST").is_some() {
        for (error, row) in errors.iter().rev().take(12) {
            let atlas = geodesics.surface();
            let path = geodesics.path(
                &atlas.node_of_row(0)?,
                &atlas.node_of_row(*row)?,
                &taut_core::correction::Settings::default(),
            );
            println!(
                "   {error:.2e} {:?} {:?} path {} {}",
                case.points[*row], values[*row], path.length, path.status
            );
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut tolerance = Settings::default().tolerance;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--tol" {
            tolerance = arguments.next().ok_or("--tol needs a value")?.parse()?;
            continue;
        }
        let mut parts = argument.split(':');
        let shape = parts.next().unwrap_or_default();
        let count: usize = parts.next().ok_or("SHAPE:POINTS")?.parse()?;
        let detail: f64 = parts.next().map_or(Ok(0.0), str::parse)?;
        let gap = if detail > 0.0 { detail } else { 8.0 };
        let seed = if detail > 0.0 { detail as u64 } else { 1 };
        let name = argument.as_str();
        match shape {
            "sphere" => measure(name, &sphere(count, detail), tolerance)?,
            "torus" => measure(name, &torus(count), tolerance)?,
            "hole" => measure(name, &hole(count, seed), tolerance)?,
            "triangle" => measure(name, &triangle(count, seed), tolerance)?,
            "notches" => measure(name, &notches(count, seed), tolerance)?,
            "strewn" => measure(name, &strewn(count), tolerance)?,
            "uneven" => measure(name, &uneven(count), tolerance)?,
            "roll" => measure(name, &roll(count, gap), tolerance)?,
            "sphere3" => measure(name, &sphere_in::<4>(count, 2.0 * PI * PI), tolerance)?,
            "sphere4" => measure(name, &sphere_in::<5>(count, 8.0 / 3.0 * PI * PI), tolerance)?,
            "clifford" => measure(name, &clifford(count), tolerance)?,
            "spherinder" => measure(name, &spherinder(count), tolerance)?,
            "curve" => measure(name, &curve(count), tolerance)?,
            "roll10" => measure(name, &roll_in_ten(count), tolerance)?,
            other => return Err(format!("unknown shape {other}").into()),
        }
    }
    Ok(())
}
