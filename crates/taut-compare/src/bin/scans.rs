//! Paths on a scan or model against lengths known otherwise (exact polyhedral geodesics from
//! peers/polyhedral.py): `cargo run --release -p taut-compare --features measure --bin scans --
//! CLOUD PAIRS LENGTHS`.
//!
//! PAIRS holds two point indices a line, LENGTHS a length a line. Prints median and largest
//! relative difference, and every pair above 3 %.

use std::path::Path;

use rayon::prelude::*;
use taut_core::cloud::Cloud;
use taut_core::correction::Settings;
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

type Failure = Box<dyn std::error::Error>;

fn numbers<T: std::str::FromStr>(file: &str) -> Result<Vec<T>, Failure>
where
    T::Err: std::error::Error + 'static,
{
    let text = std::fs::read_to_string(file)?;
    Ok(text
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()?)
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, pairs, lengths] = arguments.as_slice() else {
        return Err("usage: scans CLOUD PAIRS LENGTHS".into());
    };
    let points = taut_io::read(Path::new(file), &taut_io::ReadOptions::default())?;
    let start = std::time::Instant::now();
    let atlas = Atlas::new(Cloud::<3>::new(&points.coordinates, points.dimension)?, 2)?;
    let geodesics = Geodesics::of_atlas(atlas);
    println!(
        "{file}: {} points, set-up {:.2} s, components {:?}",
        geodesics.surface().cloud().points.len(),
        start.elapsed().as_secs_f64(),
        &geodesics.component_sizes()[..geodesics.component_sizes().len().min(8)]
    );
    let ends: Vec<usize> = numbers(pairs)?;
    let known: Vec<f64> = numbers(lengths)?;
    let mut results: Vec<_> = ends
        .par_chunks(2)
        .zip(&known)
        .map(|(pair, truth)| {
            let atlas = geodesics.surface();
            match (atlas.node_of_row(pair[0]), atlas.node_of_row(pair[1])) {
                (Ok(from), Ok(to)) => {
                    let path = geodesics.path(&from, &to, &Settings::default());
                    let difference = path.length / truth - 1.0;
                    (
                        difference,
                        path.status.word(),
                        path.steps,
                        path.points.len(),
                        pair.to_vec(),
                        *truth,
                        path.surface_error / truth,
                    )
                }
                (from, to) => {
                    let error = from.err().or(to.err());
                    println!(
                        "   {pair:?}: {}",
                        error.map_or(String::new(), |e| e.to_string())
                    );
                    (f64::INFINITY, "no-foot", 0, 0, pair.to_vec(), *truth, 0.0)
                }
            }
        })
        .collect();
    results.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let converged = results.iter().filter(|r| r.1 == "converged").count();
    let covered = results.iter().filter(|r| r.0.abs() <= r.6).count();
    let mut signed: Vec<f64> = results.iter().map(|r| r.0).collect();
    signed.sort_by(f64::total_cmp);
    println!(
        "  {} pairs, converged {converged}, covered by surface_error {covered}, difference median {:.2e}, |difference| median {:.2e} p90 {:.2e} max {:.2e}",
        results.len(),
        signed[signed.len() / 2],
        results[results.len() / 2].0.abs(),
        results[results.len() * 9 / 10].0.abs(),
        results[results.len() - 1].0.abs()
    );
    for result in results
        .iter()
        .filter(|r| r.0.abs() > 0.03 || r.1 != "converged")
    {
        println!("   {result:?}");
    }
    Ok(())
}
