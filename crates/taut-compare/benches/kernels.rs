//! What the library spends its time in: `cargo bench -p taut-compare`.

use divan::Bencher;
use std::sync::LazyLock;

use taut_compare::generate;
use taut_compare::surface::Torus;
use taut_core::cloud::Cloud;
use taut_core::correction;
use taut_core::field::{Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;
use taut_core::surface::{Geometry, Surface};

const POINTS: usize = 10_000;

fn cloud() -> Cloud<3> {
    let torus = Torus {
        major: 1.0,
        minor: 0.4,
    };
    let points = generate::torus(POINTS, &torus, 1).points;
    Cloud::new(points.as_flattened(), 3).expect("finite points")
}

fn geodesics() -> Geodesics<3, Atlas<3>> {
    Geodesics::of_atlas(Atlas::new(cloud(), 2).expect("a surface"))
}

static READY: LazyLock<Geodesics<3, Atlas<3>>> = LazyLock::new(geodesics);

fn main() {
    divan::main();
}

#[divan::bench]
fn rows_to_cloud(bencher: Bencher) {
    let cloud = cloud();
    let rows: Vec<f64> = cloud
        .points
        .iter()
        .flat_map(|p| p.iter().copied())
        .collect();
    bencher.bench(|| Cloud::<3>::new(&rows, 3));
}

/// Tree, fits, links and rims of all charts.
#[divan::bench]
fn atlas(bencher: Bencher) {
    bencher
        .with_inputs(cloud)
        .bench_values(|cloud| Atlas::new(cloud, 2));
}

#[divan::bench]
fn graph(bencher: Bencher) {
    let atlas = || Atlas::new(cloud(), 2).expect("a surface");
    bencher.with_inputs(atlas).bench_values(Geodesics::of_atlas);
}

/// The geometry of one chart.
#[divan::bench]
fn chart(bencher: Bencher) {
    let node = READY.surface().nodes()[0];
    let mut geometry = Geometry::new(1);
    bencher.bench_local(|| {
        READY
            .surface()
            .cheap_geometry(&node.point, node.place, &mut geometry)
    });
}

/// The geometry of all charts at a point, blended.
#[divan::bench]
fn blend(bencher: Bencher) {
    let node = READY.surface().nodes()[0];
    let mut geometry = Geometry::new(1);
    bencher.bench_local(|| {
        READY
            .surface()
            .geometry(&node.point, node.place, &mut geometry)
    });
}

#[divan::bench]
fn foot(bencher: Bencher) {
    let node = READY.surface().nodes()[0];
    let x = node.point * 1.001;
    let mut geometry = Geometry::new(1);
    bencher.bench_local(|| {
        let mut place = node.place;
        READY.surface().foot(&x, &mut place, &mut geometry)
    });
}

#[divan::bench]
fn path(bencher: Bencher) {
    let atlas = READY.surface();
    let ends = [0, POINTS / 2].map(|row| atlas.node_of_row(row).expect("a foot"));
    bencher.bench(|| READY.path(&ends[0], &ends[1], &correction::Settings::default()));
}

/// What all fields share: frames at the graph's nodes.
#[divan::bench]
fn frames(bencher: Bencher) {
    let geodesics = &*READY;
    bencher.bench(|| Fields::new(geodesics));
}

/// Rays, their Jacobi fields and jets, and the branches at the nodes.
#[divan::bench]
fn rays(bencher: Bencher) {
    let fields = Fields::new(&READY);
    let node = READY.surface().node_of_row(0).expect("a foot");
    let source = [Source { node, start: 0.0 }];
    bencher.bench(|| fields.from(&source, &Settings::default()));
}

#[divan::bench]
fn at_points(bencher: Bencher) {
    let fields = Fields::new(&READY);
    let node = READY.surface().node_of_row(0).expect("a foot");
    let source = [Source { node, start: 0.0 }];
    let field = fields.from(&source, &Settings::default()).expect("a field");
    bencher.bench(|| fields.at_points(&field));
}
