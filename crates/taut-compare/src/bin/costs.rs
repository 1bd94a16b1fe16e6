//! Accuracy of fields of least cost against known truth: `cargo run --release -p taut-compare
//! --features measure --bin costs -- constant:20000 speed:20000 refraction:20000 factors:20000
//! hiking:20000 gap:20000`.
//!
//! A case is NAME:POINTS, on random points of a square of side 2 (`constant`: of the unit sphere).
//! Prints seconds of what all fields share and of one at all points, relative errors over points at
//! least 5 spacings away, and what the estimates cover.

use std::time::Instant;

use taut_compare::cost::{Norm, linear_speed, refraction, wall_with_gap};
use taut_compare::{closed_form, generate};
use taut_core::cloud::Cloud;
use taut_core::field::{Cost, Fields, Settings, Slope, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

/// Points with costs, and the true cost of getting from row 0 to each.
struct Case {
    points: Vec<[f64; 3]>,
    cost: Cost,
    truth: Box<dyn Fn(usize) -> f64>,
}

/// Random points of the square [-1, 1]^2, the first at `source`, lifted to z = tilt x.
fn square(count: usize, source: [f64; 2], tilt: f64) -> (Vec<[f64; 2]>, Vec<[f64; 3]>) {
    let mut places = generate::plane_with_hole(count, 1.0, 0.0, 1).parameters;
    places[0] = source;
    let points = places.iter().map(|[x, y]| [*x, *y, tilt * x]).collect();
    (places, points)
}

fn case(name: &str, count: usize) -> Option<Case> {
    let rows = |places: &[[f64; 2]], rate: &dyn Fn([f64; 2]) -> f64| -> Vec<f64> {
        places.iter().map(|p| rate(*p)).collect()
    };
    let level = |at_rows| Cost {
        at_rows,
        ..Cost::default()
    };
    match name {
        "constant" => {
            let points = generate::sphere::<3>(count, 1.0, 1);
            let cost = level(vec![3.0; count]);
            let copy = points.clone();
            let truth = move |i: usize| 3.0 * closed_form::sphere(1.0, &copy[0], &copy[i]);
            Some(Case {
                points,
                cost,
                truth: Box::new(truth),
            })
        }
        "speed" => {
            let (places, points) = square(count, [-0.6, -0.5], 0.0);
            let cost = level(rows(&places, &|[x, _]| 1.0 / (1.0 + 0.5 * x)));
            let truth = move |i: usize| linear_speed(0.5, places[0], places[i]);
            Some(Case {
                points,
                cost,
                truth: Box::new(truth),
            })
        }
        "refraction" => {
            let (places, points) = square(count, [-0.4, -0.5], 0.0);
            let cost = level(rows(&places, &|[_, y]| if y < 0.0 { 1.0 } else { 2.0 }));
            let truth = move |i: usize| refraction([1.0, 2.0], places[0], places[i]);
            Some(Case {
                points,
                cost,
                truth: Box::new(truth),
            })
        }
        "factors" | "hiking" => {
            let tilt = 0.5;
            let (places, points) = square(count, [-0.1, 0.2], tilt);
            let slope = if name == "hiking" {
                Slope::Hiking
            } else {
                Slope::Factors { up: 4.0, down: 1.0 }
            };
            let law = move |[x, y]: [f64; 2]| {
                let (run, rise) = (x.hypot(y), tilt * x);
                let grade = rise / run;
                let factor = match slope {
                    Slope::Factors { up, down } => {
                        1.0 + up * grade.max(0.0) + down * (-grade).max(0.0)
                    }
                    _ => (3.5 * (grade + 0.05).abs() - 3.5 * 0.05).exp(),
                };
                run.hypot(rise) * factor
            };
            let norm = Norm::new(law);
            let truth = move |i: usize| {
                norm.cost([places[i][0] - places[0][0], places[i][1] - places[0][1]])
            };
            let cost = Cost {
                slope,
                ..Cost::default()
            };
            Some(Case {
                points,
                cost,
                truth: Box::new(truth),
            })
        }
        "gap" => {
            let (half, gap) = (0.1, [0.2, 0.5]);
            let (places, points) = square(count, [-0.3, -0.6], 0.0);
            let inside = move |[x, y]: [f64; 2]| y.abs() <= half && !(x >= gap[0] && x <= gap[1]);
            let cost = level(rows(&places, &|p| {
                if inside(p) { f64::INFINITY } else { 1.0 }
            }));
            let truth = move |i: usize| {
                if inside(places[i]) {
                    f64::INFINITY
                } else {
                    wall_with_gap(half, gap, places[0], places[i])
                }
            };
            Some(Case {
                points,
                cost,
                truth: Box::new(truth),
            })
        }
        _ => None,
    }
}

fn measure(name: &str, case: &Case) -> Result<(), Box<dyn std::error::Error>> {
    let cloud = Cloud::<3>::new(case.points.as_flattened(), 3)?;
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2)?);
    let start = Instant::now();
    let fields = Fields::with_cost(&geodesics, &case.cost)?;
    let shared = start.elapsed().as_secs_f64();
    let node = geodesics.surface().node_of_row(0)?;
    let start = Instant::now();
    let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default())?;
    let values = fields.at_points(&field);
    let seconds = start.elapsed().as_secs_f64();
    let near = 5.0 * (4.0 / case.points.len() as f64).sqrt();
    let far = |i: &usize| {
        closed_form::sheet(
            &[case.points[0][0], case.points[0][1]],
            &[case.points[*i][0], case.points[*i][1]],
        ) >= near
    };
    let (mut errors, mut covered, mut wrong, mut estimates) = (Vec::new(), 0, 0, 0.0);
    for i in (1..case.points.len()).filter(far) {
        let (truth, value) = ((case.truth)(i), &values[i]);
        if truth.is_finite() != value.distance.is_finite() {
            wrong += 1;
        } else if truth.is_finite() {
            let error = value.distance - truth;
            errors.push((error.abs() / truth, error, i));
            estimates += value.error / truth;
            covered += u32::from(error.abs() <= value.error);
        }
    }
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = errors.len() as f64;
    println!(
        "{name}: shared {shared:.3} s, field {seconds:.3} s, error mean {:.2e} median {:.2e} p99 {:.2e} max {:.2e}, estimate mean {:.2e}, covered {:.3}, {wrong} reached wrongly or not",
        errors.iter().map(|e| e.0).sum::<f64>() / count,
        errors[errors.len() / 2].0,
        errors[errors.len() * 99 / 100].0,
        errors[errors.len() - 1].0,
        estimates / count,
        f64::from(covered) / count,
    );
    if std::env::var_os("WORST").is_some() {
        for (relative, error, i) in errors.iter().rev().take(12) {
            println!(
                "   {relative:.2e} {error:+.2e} {:?} {:?}",
                case.points[*i], values[*i]
            );
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for argument in std::env::args().skip(1) {
        let (name, count) = argument.split_once(':').ok_or("NAME:POINTS")?;
        let case = case(name, count.parse()?).ok_or("unknown case")?;
        measure(&argument, &case)?;
    }
    Ok(())
}
