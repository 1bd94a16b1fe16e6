//! Accuracy of logarithms and of parallel transport on clouds with known truth: `cargo run
//! --release -p taut-compare --features measure --bin directions -- sphere:100000 torus:100000`.
//!
//! Prints a line a case: seconds of the logarithms of all points, errors of the position over the
//! distance and of the transport's angle in radians, over points at least 5 spacings away, and what
//! the estimates cover.

use std::f64::consts::PI;
use std::time::Instant;

use rayon::prelude::*;
use taut_compare::direction::{Geodesic, errors};
use taut_compare::generate;
use taut_compare::shooting::Fan;
use taut_compare::surface::{Surface, Torus};
use taut_core::cloud::Cloud;
use taut_core::field::{Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

/// Points whose geodesic on the torus is shot.
const SHOT: usize = 2000;
const LONGEST: f64 = 5.0;

/// The points of a shape, its area, and the geodesics from row 0 to some rows.
type Case = (Vec<[f64; 3]>, f64, Vec<(usize, Geodesic)>);

fn sphere(count: usize) -> Case {
    let points = generate::sphere::<3>(count, 1.0, 1);
    let truth = (1..count).map(|i| (i, Geodesic::of_sphere(&points[0], &points[i])));
    let truth = truth.collect();
    (points, 4.0 * PI, truth)
}

fn torus(count: usize) -> Case {
    let shape = Torus {
        major: 1.0,
        minor: 0.4,
    };
    let points = generate::torus(count, &shape, 1).points;
    let fan = Fan::new(&shape, points[0], LONGEST);
    let rows: Vec<usize> = (1..count).step_by((count / SHOT).max(1)).collect();
    let truth = rows.into_par_iter().filter_map(|row| {
        let shortest = fan.geodesics(points[row], LONGEST).first().copied()?;
        let tangents = [shortest.direction, shortest.arrival].map(Into::into);
        let normals = [points[0], points[row]].map(|x| shape.normal(&x.into()));
        let length = shortest.length;
        Some((
            row,
            Geodesic {
                length,
                tangents,
                normals,
            },
        ))
    });
    let truth = truth.collect();
    (points, 4.0 * PI * PI * shape.major * shape.minor, truth)
}

fn told(name: &str, mut errors: Vec<f64>) {
    errors.sort_by(f64::total_cmp);
    let count = errors.len();
    print!(
        ", {name} mean {:.2e} median {:.2e} p99 {:.2e} max {:.2e}",
        errors.iter().sum::<f64>() / count as f64,
        errors[count / 2],
        errors[count * 99 / 100],
        errors[count - 1],
    );
}

fn measure(name: &str, case: &Case) -> Result<(), Box<dyn std::error::Error>> {
    let (points, area, truth) = case;
    let far = 5.0 * (area / points.len() as f64).sqrt();
    let cloud = Cloud::<3>::new(points.as_flattened(), 3)?;
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2)?);
    let fields = Fields::of_cloud(&geodesics)?;
    let node = geodesics.surface().node_of_row(0)?;
    let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default())?;
    let start = Instant::now();
    let found = fields.logarithms(&field)?;
    print!("{name}: {:.3} s", start.elapsed().as_secs_f64());
    let tangents = fields.source_tangents(&field, 0).ok_or("no source")?;
    let (mut positions, mut angles, mut covered) = (Vec::new(), Vec::new(), 0);
    for (row, geodesic) in truth.iter().filter(|truth| truth.1.length >= far) {
        let Some(found) = &found[*row] else { continue };
        let (position, angle) = errors(found, &tangents, geodesic);
        covered += usize::from(position * geodesic.length <= found.error);
        positions.push(position);
        angles.extend(angle);
    }
    let count = positions.len();
    told("position", positions);
    println!(", covered {:.3}", covered as f64 / count as f64);
    told("transport", angles);
    println!();
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for argument in std::env::args().skip(1) {
        let (shape, count) = argument.split_once(':').ok_or("SHAPE:POINTS")?;
        let count = count.parse()?;
        let case = match shape {
            "sphere" => sphere(count),
            "torus" => torus(count),
            other => return Err(format!("unknown shape {other}").into()),
        };
        measure(&argument, &case)?;
    }
    Ok(())
}
