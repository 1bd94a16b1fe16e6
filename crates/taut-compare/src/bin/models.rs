//! Surfaces fitted to scans, measured: `cargo run --release -p taut-compare --features measure
//! --bin models -- FILE SOURCES PARTICLES [ACCURACY]`.
//!
//! Fits an implicit surface, evaluates it, spreads particles over it, connects evenly spread
//! sources by Algorithm 1, and corrects the paths of all their pairs. ACCURACY is in diagonals of
//! the points' box.

use std::path::Path;
use std::time::Instant;

use taut_core::Vector;
use taut_core::cloud::Cloud;
use taut_core::correction;
use taut_core::geodesics::Geodesics;
use taut_core::guess::particles::{Settings, Spread, sample};
use taut_core::surface::atlas::{Atlas, FitSettings};
use taut_core::surface::{Geometry, Node, Surface};
use taut_io::ReadOptions;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, sources, particles, accuracy @ ..] = arguments.as_slice() else {
        return Err("usage: models FILE SOURCES PARTICLES [ACCURACY]".into());
    };
    let read = taut_io::read(Path::new(file), &ReadOptions::default())?;
    let cloud = Cloud::<3>::new(&read.coordinates, 3)?;
    let size = cloud.points.iter().map(|x| x.norm()).fold(0.0, f64::max) * 2.0;
    let accuracy = accuracy.first().map(|text| text.parse::<f64>());
    let settings = FitSettings {
        accuracy: accuracy.transpose()?.map(|share| share * size),
        normals: read.normals.as_deref(),
    };
    let start = Instant::now();
    let (atlas, fit) = Atlas::fit(cloud, 2, &settings)?;
    let report = atlas.report();
    println!(
        "{file}: {} points, {} charts in {:.2} s, rims {:.3} long\n  {fit:?}",
        atlas.cloud().points.len(),
        report.charts,
        start.elapsed().as_secs_f64(),
        report.rim_length,
    );
    evaluate(&atlas)?;
    let start = atlas.node_of_row(0)?;
    density(&atlas, start, particles.parse()?, size)?;
    connect(atlas, start, sources.parse()?, particles.parse()?, size)
}

/// Time of F, gradient and Hessian at the points.
fn evaluate(atlas: &Atlas<3>) -> Result<(), Failure> {
    let cloud = atlas.cloud();
    let start = Instant::now();
    let mut sum = 0.0;
    for x in &cloud.points {
        sum += atlas
            .level(&(x + cloud.centre))
            .map_or(0.0, |level| level.value.abs());
    }
    let searched = start.elapsed().as_secs_f64() / cloud.points.len() as f64;
    let rows = cloud.rows.iter().step_by(cloud.rows.len().div_ceil(1000));
    let nodes: Vec<_> = rows
        .filter_map(|row| atlas.node_of_row(*row as usize).ok())
        .collect();
    let mut geometry = Geometry::new(1);
    let start = Instant::now();
    for node in nodes.iter().cycle().take(100_000) {
        atlas.geometry(&node.point, node.place, &mut geometry);
    }
    println!(
        "  evaluation: {:.2} us anywhere (mean |F| {:.1e}), {:.2} us where the chart is known",
        1e6 * searched,
        sum / cloud.points.len() as f64,
        10.0 * start.elapsed().as_secs_f64(),
    );
    Ok(())
}

fn density(atlas: &Atlas<3>, start: Node<3, u32>, count: usize, size: f64) -> Result<(), Failure> {
    let clock = Instant::now();
    let sampling = sample(atlas, &[start], false, count, &Settings::new(size))?;
    let seconds = clock.elapsed().as_secs_f64();
    let mut scratch = Geometry::new(1);
    let off = sampling.nodes.iter().map(|node| {
        let mut place = node.place;
        let foot = atlas.foot(&node.point, &mut place, &mut scratch);
        foot.map_or(f64::INFINITY, |foot: Vector<3>| (foot - node.point).norm())
    });
    println!(
        "  {count} particles in {seconds:.2} s, off by {:.0e} of the size: {:?}",
        off.fold(0.0, f64::max) / size,
        sampling.quality
    );
    Ok(())
}

/// Algorithm 1 and the correction of all pairs.
fn connect(
    atlas: Atlas<3>,
    start: Node<3, u32>,
    sources: usize,
    particles: usize,
    size: f64,
) -> Result<(), Failure> {
    let even = Settings {
        spread: Spread::Even,
        ..Settings::new(size)
    };
    let sources = sample(&atlas, &[start], false, sources, &even)?.nodes;
    let clock = Instant::now();
    let geodesics = Geodesics::of_particles(atlas, &sources, particles, &Settings::new(size))?;
    let network = geodesics.surface();
    println!(
        "  {} sources, {} particles after {} steps in {:.2} s, connected: {}",
        sources.len(),
        network.particles().count(),
        network.steps(),
        clock.elapsed().as_secs_f64(),
        network.classes().iter().all(|class| *class == 0)
    );
    let clock = Instant::now();
    let paths = geodesics.all_pairs(&sources, &correction::Settings::default(), |_, path| path);
    let seconds = clock.elapsed().as_secs_f64();
    let mean = |of: fn(&taut_core::result::Path<3>) -> f64| {
        paths.iter().map(of).sum::<f64>() / paths.len() as f64
    };
    println!(
        "  {} pairs in {seconds:.2} s ({:.2} ms each), {} converged; nodes {:.0}, steps {:.1}, mean length {:.6}",
        paths.len(),
        1e3 * seconds / paths.len() as f64,
        paths.iter().filter(|path| path.converged()).count(),
        mean(|path| path.points.len() as f64),
        mean(|path| path.steps as f64),
        mean(|path| path.length)
    );
    Ok(())
}
