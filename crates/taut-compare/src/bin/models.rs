//! All pairs of sources on models: `cargo run --release -p taut-compare --bin models -- CLOUD:COUNT ... genus2:COUNT`.
//!
//! COUNT rows of CLOUD, evenly spaced, are the sources. Prints a line a model: pairs, seconds for all of
//! them, microseconds each, how many converged, mean nodes and Newton steps of a path, and the sum of the
//! lengths, to be compared between versions.

use std::path::Path;
use std::time::Instant;

use taut::Vector;
use taut::cloud::Cloud;
use taut::correction::Settings;
use taut::geodesics::Geodesics;
use taut::guess::Guide;
use taut::guess::particles::{self, Spread, sample};
use taut::surface::atlas::Atlas;
use taut::surface::implicit::ImplicitSurface;
use taut::surface::{Geometry, Node, Surface};
use taut_formula::Formula;

type Failure = Box<dyn std::error::Error>;

/// The boundary of a thickened lemniscate x^2 (1 - x^2) = y^2: genus 2.
const GENUS_2: &str = "(x^2*(1-x^2)-y^2)^2+z^2=0.01";

fn measure<S: Guide<3>>(name: &str, geodesics: &Geodesics<3, S>, sources: &[Node<3, S::Place>]) {
    let start = Instant::now();
    let paths = geodesics.all_pairs(sources, &Settings::default(), |_, path| {
        (path.converged(), path.points.len(), path.steps, path.length)
    });
    let seconds = start.elapsed().as_secs_f64();
    let count = paths.len();
    let mean = |sum: usize| sum as f64 / count as f64;
    println!(
        "{name}: {count} pairs in {seconds:.2} s, {:.0} us each, converged {}, {:.1} nodes, {:.2} steps, sum of lengths {:.9}",
        1e6 * seconds / count as f64,
        paths.iter().filter(|path| path.0).count(),
        mean(paths.iter().map(|path| path.1).sum()),
        mean(paths.iter().map(|path| path.2).sum()),
        paths
            .iter()
            .map(|path| path.3)
            .filter(|length| length.is_finite())
            .sum::<f64>(),
    );
}

fn cloud(file: &str, count: usize) -> Result<(), Failure> {
    let points = taut_io::read(Path::new(file), &taut_io::ReadOptions::default())?;
    let atlas = Atlas::new(Cloud::<3>::new(&points.coordinates, points.dimension)?, 2)?;
    let geodesics = Geodesics::of_atlas(atlas);
    let rows = geodesics.surface().cloud().point_of_row.len();
    let sources: Vec<_> = (0..count)
        .filter_map(|i| geodesics.surface().node_of_row(i * rows / count).ok())
        .collect();
    measure(file, &geodesics, &sources);
    Ok(())
}

fn genus2(count: usize) -> Result<(), Failure> {
    let size = 1.0;
    let surface = ImplicitSurface::<3, _>::new(Formula::parse(&[GENUS_2], Some(3))?, size);
    let near = Vector::from([1.05, 0.0, 0.0]);
    let point = surface
        .foot(&near, &mut (), &mut Geometry::new(1))
        .ok_or("no foot")?;
    let settings = particles::Settings::new(size);
    let even = particles::Settings {
        spread: Spread::Even,
        ..settings
    };
    let first = [Node { point, place: () }];
    let sources = sample(&surface, &first, false, count, &even)?.nodes;
    let geodesics = Geodesics::of_particles(surface, &sources, 4000, &settings)?;
    measure("genus2", &geodesics, &sources);
    Ok(())
}

fn main() -> Result<(), Failure> {
    for argument in std::env::args().skip(1) {
        let (name, count) = argument.rsplit_once(':').ok_or("NAME:COUNT")?;
        match name {
            "genus2" => genus2(count.parse()?)?,
            file => cloud(file, count.parse()?)?,
        }
    }
    Ok(())
}
