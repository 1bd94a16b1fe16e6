//! Accuracy and speed of distance fields on clouds with known truth:
//! `cargo run --release -p taut-compare --bin fields -- sphere:100000 torus:10000 roll:100000:8 sphere:10000:1`.
//!
//! A case is SHAPE:POINTS, and after another colon the noise in spacings or, for the roll, the gap between its layers
//! in spacings. Prints a line a case: seconds of the atlas, of what all fields share, of the first field at all points
//! and (best of five) of later ones; relative errors over points at least 5 spacings away; what the estimates cover.

use std::f64::consts::PI;
use std::time::Instant;

use rayon::prelude::*;
use taut::cloud::Cloud;
use taut::field::{Fields, Settings, Source};
use taut::geodesics::Geodesics;
use taut::surface::atlas::Atlas;
use taut_compare::shooting::Fan;
use taut_compare::surface::Torus;
use taut_compare::{closed_form, generate};

/// A cloud with its mean spacing, and the true distances of some rows from row 0.
struct Case {
    points: Vec<[f64; 3]>,
    spacing: f64,
    truth: Vec<(usize, f64)>,
}

/// Points whose distance on the torus is shot.
const SHOT: usize = 4000;

fn sphere(count: usize, noise: f64) -> Case {
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
        spacing,
        truth,
    }
}

fn torus(count: usize) -> Case {
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
        spacing: (area / count as f64).sqrt(),
        truth,
    }
}

/// A square of side 2 with a round hole of radius 0.4 in its middle, which hides half of it from the source.
fn hole(count: usize) -> Case {
    let sample = generate::plane_with_hole(count, 1.0, 0.4, 1);
    let truth = (1..count)
        .map(|i| {
            let ends = (&sample.parameters[0], &sample.parameters[i]);
            (i, closed_form::plane_with_hole(0.4, ends.0, ends.1))
        })
        .collect();
    Case {
        points: sample.points,
        spacing: ((4.0 - 0.16 * PI) / count as f64).sqrt(),
        truth,
    }
}

/// A sheet of 4 by 1 rolled up, layers `gap` spacings apart; the innermost radius is the larger of a gap and 15 spacings
/// for gaps below 8 spacings, and a gap else.
fn roll(count: usize, gap: f64) -> Case {
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
        spacing,
        truth,
    }
}

fn measure(name: &str, case: &Case, tolerance: f64) -> Result<(), Box<dyn std::error::Error>> {
    let start = Instant::now();
    let cloud = Cloud::<3>::new(case.points.as_flattened(), 3)?;
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2)?);
    let atlas_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let fields = Fields::new(&geodesics)?;
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
                &taut::correction::Settings::default(),
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
        let case = match shape {
            "sphere" => sphere(count, detail),
            "torus" => torus(count),
            "hole" => hole(count),
            "roll" => roll(count, if detail > 0.0 { detail } else { 8.0 }),
            other => return Err(format!("unknown shape {other}").into()),
        };
        measure(&argument, &case, tolerance)?;
    }
    Ok(())
}
