//! All pairs of sources on clouds with known truth, paths kept: `cargo run --release -p
//! taut-compare --features measure --bin pairs -- torus:50000 sphere:50000 [--sources 272] [--tol
//! 1e-6] [--unchecked]`.

use std::time::Instant;

use rayon::prelude::*;
use taut_compare::shooting::Fan;
use taut_compare::surface::{Surface, Torus};
use taut_compare::{closed_form, generate};
use taut_core::cloud::Cloud;
use taut_core::correction::Settings;
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

type Failure = Box<dyn std::error::Error>;

const TORUS: Torus = Torus {
    major: 1.0,
    minor: 0.4,
};

/// True distances from a point to others.
fn truth(shape: &str, from: [f64; 3], to: &[[f64; 3]]) -> Vec<f64> {
    if shape == "sphere" {
        let distance = |end: &[f64; 3]| closed_form::sphere(1.0, &from, end);
        return to.iter().map(distance).collect();
    }
    let bound = |end: &[f64; 3]| TORUS.length_bound(&from.into(), &(*end).into()) * (1.0 + 1e-9);
    let longest = to.iter().map(bound).fold(0.0, f64::max);
    let fan = Fan::new(&TORUS, from, longest);
    let distance = |end: &[f64; 3]| {
        let shortest = fan.geodesics(*end, bound(end)).first().copied();
        shortest.map_or(f64::NAN, |geodesic| geodesic.length)
    };
    to.iter().map(distance).collect()
}

fn measure(
    shape: &str,
    count: usize,
    sources: usize,
    tolerance: f64,
    checked: bool,
) -> Result<(), Failure> {
    let points = match shape {
        "sphere" => generate::sphere::<3>(count, 1.0, 1),
        "torus" => generate::torus(count, &TORUS, 1).points,
        other => return Err(format!("unknown shape {other}").into()),
    };
    let start = Instant::now();
    let geodesics = Geodesics::of_atlas(Atlas::new(Cloud::<3>::new(points.as_flattened(), 3)?, 2)?);
    let setup = start.elapsed().as_secs_f64();
    // The cloud is in random order: its first rows are random points.
    let nodes = (0..sources).map(|row| geodesics.surface().node_of_row(row));
    let nodes: Vec<_> = nodes.collect::<Result<_, _>>()?;
    let settings = Settings {
        tolerance,
        ..Settings::default()
    };
    let start = Instant::now();
    let answers = geodesics.all_pairs(&nodes, &settings, |pair, path| (pair, path));
    let seconds = start.elapsed().as_secs_f64();
    let pairs = answers.len();
    let converged = answers.iter().filter(|(_, path)| path.converged()).count();
    let steps: usize = answers.iter().map(|(_, path)| path.steps).sum();
    let kept: usize = answers.iter().map(|(_, path)| path.points.len()).sum();
    println!(
        "{shape}:{count}: set-up {setup:.2} s, {pairs} pairs in {seconds:.2} s ({:.0} us each), converged {converged}, nodes {:.1}, steps {:.1}",
        1e6 * seconds / pairs as f64,
        kept as f64 / pairs as f64,
        steps as f64 / pairs as f64
    );
    if !checked {
        return Ok(());
    }
    let truths: Vec<Vec<f64>> = (0..sources)
        .into_par_iter()
        .map(|j| truth(shape, points[j], &points[..j]))
        .collect();
    let mut covered = 0;
    let mut errors: Vec<(f64, [usize; 2])> = answers
        .iter()
        .map(|([i, j], path)| {
            let true_length = truths[*j][*i];
            let error = (path.length - true_length).abs();
            covered += usize::from(error <= path.length_error + path.surface_error);
            (error / true_length, [*i, *j])
        })
        .collect();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    println!(
        "  error median {:.1e} p99 {:.1e} max {:.1e}, covered {covered}",
        errors[pairs / 2].0,
        errors[pairs * 99 / 100].0,
        errors[pairs - 1].0
    );
    if std::env::var_os("WORST").is_some() {
        for (error, pair) in errors.iter().rev().take(8) {
            let [i, j] = *pair;
            let all = geodesics.alternatives(&nodes[i], &nodes[j], &settings, 4);
            let lengths: Vec<f64> = all.iter().map(|path| path.length).collect();
            println!(
                "   {pair:?} {error:.1e}: true {}, found {lengths:?}",
                truths[j][i]
            );
        }
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    let (mut sources, mut tolerance, mut checked) = (272, 1e-6, true);
    let mut cases = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--sources" => sources = arguments.next().ok_or("--sources needs a value")?.parse()?,
            "--tol" => tolerance = arguments.next().ok_or("--tol needs a value")?.parse()?,
            "--unchecked" => checked = false,
            _ => cases.push(argument),
        }
    }
    for case in cases {
        let (shape, count) = case.split_once(':').ok_or("SHAPE:POINTS")?;
        measure(shape, count.parse()?, sources, tolerance, checked)?;
    }
    Ok(())
}
