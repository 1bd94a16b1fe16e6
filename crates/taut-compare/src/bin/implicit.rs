//! Accuracy and speed of paths on F = 0 with known truth:
//! `cargo run --release -p taut-compare --features measure --bin implicit [-- NAME ...]`.
//!
//! Prints a line per surface and tolerance: how many of 200 random pairs converged, the largest
//! true relative error among those, how many error estimates cover the error, median microseconds a
//! path.

use std::time::Instant;

use rayon::prelude::*;
use taut_compare::surface::{Ellipsoid, Torus};
use taut_compare::{closed_form, generate, revolution, shooting};
use taut_core::Vector;
use taut_core::correction::Settings;
use taut_core::geodesics::Geodesics;
use taut_core::surface::implicit::ImplicitSurface;
use taut_formula::Formula;

type Failure = Box<dyn std::error::Error>;

const PAIRS: usize = 200;

fn measure<const D: usize>(
    name: &str,
    equations: &[&str],
    points: &[[f64; D]],
    truth: &[f64],
) -> Result<(), Failure> {
    let formula = Formula::parse(equations, Some(D))?;
    let nodes: Vec<Vector<D>> = points.iter().map(|p| Vector::from(*p)).collect();
    let start = Instant::now();
    let surface = ImplicitSurface::new(formula, 1.0);
    let geodesics = Geodesics::of_implicit(surface, &nodes, None)?;
    println!(
        "{name}: set-up {:.3} s, samples {:?}",
        start.elapsed().as_secs_f64(),
        geodesics.component_sizes()
    );
    for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
        let settings = Settings {
            tolerance,
            ..Settings::default()
        };
        let answers: Vec<_> = nodes
            .par_chunks(2)
            .zip(truth)
            .map(|(pair, truth)| {
                let ends = (
                    geodesics.surface().node_near(&pair[0]),
                    geodesics.surface().node_near(&pair[1]),
                );
                let (Ok(from), Ok(to)) = ends else {
                    return None;
                };
                let start = Instant::now();
                let path = geodesics.path(&from.0, &to.0, &settings);
                let seconds = start.elapsed().as_secs_f64();
                let error = (path.length - truth).abs();
                if std::env::var_os("WORST").is_some()
                    && (!path.converged() || error > tolerance * truth || error > path.length_error)
                {
                    println!(
                        "   {:?} {:?} truth {truth} length {} error {error:e} estimate {:e} {} steps {} nodes {}",
                        pair[0].as_slice(),
                        pair[1].as_slice(),
                        path.length,
                        path.length_error,
                        path.status,
                        path.steps,
                        path.points.len()
                    );
                }
                Some((error / truth, path.converged(), error <= path.length_error, seconds, path.points.len()))
            })
            .collect();
        let known: Vec<_> = answers.iter().flatten().collect();
        let converged = known.iter().filter(|a| a.1).count();
        let worst = known
            .iter()
            .filter(|a| a.1)
            .map(|a| a.0)
            .fold(0.0, f64::max);
        let kept = known.iter().filter(|a| a.1 && a.0 <= tolerance).count();
        let covered = known.iter().filter(|a| a.2).count();
        let mut seconds: Vec<f64> = known.iter().map(|a| a.3).collect();
        seconds.sort_by(f64::total_cmp);
        println!(
            "  tol {tolerance:.0e}: converged {converged}/{PAIRS}, largest error of those {worst:.1e}, within tolerance {kept}, covered {covered}, median {:.0} us, {} nodes",
            1e6 * seconds.get(seconds.len() / 2).copied().unwrap_or(f64::NAN),
            known.iter().map(|a| a.4).sum::<usize>() / known.len().max(1)
        );
    }
    Ok(())
}

fn truths<const D: usize>(
    points: &[[f64; D]],
    distance: impl Fn(&[f64; D], &[f64; D]) -> f64,
) -> Vec<f64> {
    points
        .chunks(2)
        .map(|pair| distance(&pair[0], &pair[1]))
        .collect()
}

fn shot(surface: &impl taut_compare::surface::Surface, points: &[[f64; 3]]) -> Vec<f64> {
    let pairs: Vec<_> = points.chunks(2).map(|pair| (pair[0], pair[1])).collect();
    let lengths = shooting::distances(surface, &pairs);
    lengths.into_iter().map(|d| d.unwrap_or(f64::NAN)).collect()
}

fn case(name: &str) -> Result<(), Failure> {
    let count = 2 * PAIRS;
    match name {
        "sphere" => {
            let points = generate::sphere::<3>(count, 1.0, 11);
            let truth = truths(&points, |a, b| closed_form::sphere(1.0, a, b));
            measure(name, &["x^2+y^2+z^2-1"], &points, &truth)
        }
        "torus" => {
            let shape = Torus {
                major: 1.0,
                minor: 0.4,
            };
            let points = generate::torus(count, &shape, 12).points;
            measure(
                name,
                &["(sqrt(x^2+y^2)-1)^2+z^2-0.16"],
                &points,
                &shot(&shape, &points),
            )
        }
        "ellipsoid" => {
            let points = generate::ellipsoid(count, [3.0, 2.0, 1.0], 13);
            let shape = Ellipsoid {
                semi_axes: [3.0, 2.0, 1.0],
            };
            measure(
                name,
                &["x^2/9+y^2/4+z^2-1"],
                &points,
                &shot(&shape, &points),
            )
        }
        "spheroid" => {
            // Flattening 1/60: the series behind the truth holds to 4e-15 there.
            let polar = 1.0 - 1.0 / 60.0;
            let points = generate::ellipsoid(count, [1.0, 1.0, polar], 14);
            let shape = revolution::Spheroid::new(1.0, polar);
            let truth = truths(&points, |a, b| shape.distance(a, b));
            let equation = format!("x^2+y^2+(z/{polar})^2-1");
            measure(name, &[&equation], &points, &truth)
        }
        "sphere3" => {
            let points = generate::sphere::<4>(count, 1.0, 15);
            let truth = truths(&points, |a, b| closed_form::sphere(1.0, a, b));
            measure(name, &["x1^2+x2^2+x3^2+x4^2-1"], &points, &truth)
        }
        "clifford" => {
            let radius = std::f64::consts::FRAC_1_SQRT_2;
            let points = generate::flat_torus(count, [radius, radius], 16).points;
            let truth = truths(&points, |a, b| {
                closed_form::flat_torus([radius, radius], a, b)
            });
            measure(name, &["x1^2+x2^2-0.5", "x3^2+x4^2-0.5"], &points, &truth)
        }
        "rotations" => {
            let points = generate::rotations(count, 17);
            let truth = truths(&points, closed_form::rotations);
            let equations = [
                "x1^2+x4^2+x7^2-1",
                "x2^2+x5^2+x8^2-1",
                "x3^2+x6^2+x9^2-1",
                "x1*x2+x4*x5+x7*x8",
                "x1*x3+x4*x6+x7*x9",
                "x2*x3+x5*x6+x8*x9",
            ];
            measure(name, &equations, &points, &truth)
        }
        other => Err(format!("unknown surface {other}").into()),
    }
}

fn main() -> Result<(), Failure> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    if names.is_empty() {
        names = [
            "sphere",
            "torus",
            "ellipsoid",
            "spheroid",
            "sphere3",
            "clifford",
            "rotations",
        ]
        .map(String::from)
        .to_vec();
    }
    names.iter().try_for_each(|name| case(name))
}
