//! Accuracy and speed of paths on clouds with known truth: `cargo run --release -p taut-compare
//! --features measure --bin clouds -- sphere:10000 torus:10000 roll:4.3 [--tol 1e-6]`.
//!
//! Prints a line a case: set-up seconds, median microseconds a path, median, 99th percentile and
//! largest relative error of 200 lengths, how many converged, how many error estimates cover the
//! error.

use std::time::Instant;

use rayon::prelude::*;
use taut_compare::surface::Torus;
use taut_compare::{closed_form, generate, shooting};
use taut_core::cloud::Cloud;
use taut_core::correction::Settings;
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

/// A cloud, pairs of its rows, and their true distances.
struct Case {
    points: Vec<[f64; 3]>,
    pairs: Vec<[usize; 2]>,
    truth: Vec<f64>,
}

const PAIRS: usize = 200;

fn sphere(count: usize, noise: f64) -> Case {
    let clean = generate::sphere::<3>(count, 1.0, 1);
    let pairs = generate::pairs(count, PAIRS, 2);
    let truth = pairs
        .iter()
        .map(|[a, b]| closed_form::sphere(1.0, &clean[*a], &clean[*b]))
        .collect();
    let spacing = (4.0 * std::f64::consts::PI / count as f64).sqrt();
    let points = if noise > 0.0 {
        generate::radial_noise(&clean, noise * spacing, 3)
    } else {
        clean
    };
    Case {
        points,
        pairs,
        truth,
    }
}

fn torus(count: usize) -> Case {
    let shape = Torus {
        major: 1.0,
        minor: 0.4,
    };
    let points = generate::torus(count, &shape, 1).points;
    let pairs = generate::pairs(count, PAIRS, 2);
    let ends: Vec<_> = pairs
        .iter()
        .map(|[a, b]| (points[*a], points[*b]))
        .collect();
    let truth = shooting::distances(&shape, &ends)
        .into_iter()
        .map(|d| d.unwrap_or(f64::NAN))
        .collect();
    Case {
        points,
        pairs,
        truth,
    }
}

/// The roll of seven turns on a jittered grid of step 0.02 (median distance to the nearest point
/// 0.01526), with layers `gap` such distances apart.
fn roll(gap: f64) -> Case {
    let shape = generate::Roll {
        inner_radius: 0.3,
        gap: gap * 0.01526,
        turns: 7.0,
    };
    let sample = shape.jittered(0.02, 1);
    let pairs = generate::pairs(sample.points.len(), PAIRS, 2);
    let truth = pairs
        .iter()
        .map(|[a, b]| closed_form::sheet(&sample.parameters[*a], &sample.parameters[*b]))
        .collect();
    Case {
        points: sample.points,
        pairs,
        truth,
    }
}

/// A square of side 2 with a round hole of radius 0.4; pairs whose straight line it blocks half the
/// time.
fn hole(count: usize) -> Case {
    let sample = generate::plane_with_hole(count, 1.0, 0.4, 1);
    let pairs = generate::pairs(count, PAIRS, 2);
    let truth = pairs
        .iter()
        .map(|[a, b]| {
            closed_form::plane_with_hole(0.4, &sample.parameters[*a], &sample.parameters[*b])
        })
        .collect();
    Case {
        points: sample.points,
        pairs,
        truth,
    }
}

fn measure(name: &str, case: &Case, tolerance: f64) -> Result<(), Box<dyn std::error::Error>> {
    let start = Instant::now();
    let cloud = Cloud::<3>::new(case.points.as_flattened(), 3)?;
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2)?);
    let setup = start.elapsed().as_secs_f64();
    if std::env::var_os("SETUP").is_some() {
        println!("{name}: set-up {setup:.3} s");
        return Ok(());
    }
    let settings = Settings {
        tolerance,
        ..Settings::default()
    };
    let answers: Vec<_> = case
        .pairs
        .par_iter()
        .zip(&case.truth)
        .filter(|(_, truth)| truth.is_finite())
        .map(|([a, b], truth)| {
            let atlas = geodesics.surface();
            let (Ok(from), Ok(to)) = (atlas.node_of_row(*a), atlas.node_of_row(*b)) else {
                return (f64::INFINITY, false, false, 0.0, [*a, *b], *truth, 0);
            };
            let start = Instant::now();
            let path = geodesics.path(&from, &to, &settings);
            let seconds = start.elapsed().as_secs_f64();
            let error = (path.length - truth).abs();
            let covered = error <= path.length_error + path.surface_error;
            (
                error / truth,
                path.converged(),
                covered,
                seconds,
                [*a, *b],
                *truth,
                path.points.len(),
            )
        })
        .collect();
    let mut errors: Vec<f64> = answers.iter().map(|a| a.0).collect();
    errors.sort_by(f64::total_cmp);
    let mut seconds: Vec<f64> = answers.iter().map(|a| a.3).collect();
    seconds.sort_by(f64::total_cmp);
    let nodes = answers.iter().map(|a| a.6).sum::<usize>() / answers.len();
    println!(
        "{name}: set-up {setup:.3} s, components {:?}, path {:.0} us, {nodes} nodes, error median {:.2e} p99 {:.2e} max {:.2e}, converged {}/{}, covered {}",
        &geodesics.component_sizes()[..geodesics.component_sizes().len().min(5)],
        1e6 * seconds[seconds.len() / 2],
        errors[errors.len() / 2],
        errors[errors.len() * 99 / 100],
        errors[errors.len() - 1],
        answers.iter().filter(|a| a.1).count(),
        answers.len(),
        answers.iter().filter(|a| a.2).count(),
    );
    if std::env::var_os("WORST").is_some() {
        let mut worst = answers;
        worst.sort_by(|a, b| b.0.total_cmp(&a.0));
        for w in worst.iter().take(8) {
            println!("   {w:?}");
            let atlas = geodesics.surface();
            if let (Ok(from), Ok(to)) = (atlas.node_of_row(w.4[0]), atlas.node_of_row(w.4[1])) {
                for path in geodesics.alternatives(&from, &to, &settings, 5) {
                    println!(
                        "      {} {} steps {} error {:.1e} curvature {:.1e} stable {}",
                        path.length,
                        path.status,
                        path.steps,
                        path.length_error,
                        path.max_geodesic_curvature,
                        path.stable
                    );
                }
            }
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut tolerance = 1e-6;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--tol" {
            tolerance = arguments.next().ok_or("--tol needs a value")?.parse()?;
            continue;
        }
        let mut parts = argument.split(':');
        let shape = parts.next().unwrap_or_default();
        let size: f64 = parts.next().ok_or("SHAPE:SIZE")?.parse()?;
        let noise: f64 = parts.next().map_or(Ok(0.0), str::parse)?;
        let case = match shape {
            "sphere" => sphere(size as usize, noise),
            "torus" => torus(size as usize),
            "roll" => roll(size),
            "hole" => hole(size as usize),
            other => return Err(format!("unknown shape {other}").into()),
        };
        measure(&argument, &case, tolerance)?;
    }
    Ok(())
}
