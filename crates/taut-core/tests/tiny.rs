//! Tiny and degenerate clouds through everything: an answer or a refusal, soon, and never a panic.

use std::time::{Duration, Instant};

use taut_core::cloud::Cloud;
use taut_core::correction::Settings;
use taut_core::field::{self, Cost, Fields, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::{Atlas, FitSettings};

/// A fixed linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }
}

/// A cloud of 3 to 60 points of one of many awkward kinds.
fn cloud(seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 77);
    random.next();
    let count = 3 + random.below(58);
    let kind = random.below(9);
    let line = [0; 3].map(|_| random.next() - 0.5);
    let mut points: Vec<[f64; 3]> = (0..count)
        .map(|i| match kind {
            0 => [0; 3].map(|_| random.next()),
            1 => [0; 3].map(|_| random.below(4) as f64),
            2 => [random.below(8) as f64, random.below(8) as f64, 0.0],
            3 => line.map(|v| v * i as f64),
            4 => line.map(|v| v * random.next() + 1e-9 * random.next()),
            5 => [0; 3].map(|_| random.next() * 10_f64.powi(random.below(601) as i32 - 300)),
            6 => [0; 3].map(|_| 10_f64.powi(random.below(40) as i32 - 20)),
            7 => [(0.7 * i as f64).cos(), (0.7 * i as f64).sin(), 0.0],
            _ => [i as f64, (i * i % 7) as f64, [0.0, 1e-14][i % 2]],
        })
        .collect();
    if random.below(3) == 0 {
        for _ in 0..count / 2 {
            let (from, to) = (random.below(count), random.below(count));
            points[to] = points[from];
        }
    }
    let scale = match random.below(5) {
        0 => 10_f64.powi(random.below(601) as i32 - 300),
        1 => 10_f64.powi(random.below(90) as i32 - 45),
        _ => 1.0,
    };
    points
        .iter()
        .map(|point| point.map(|v| v * scale))
        .collect()
}

/// Surface, path, fields and a fitted model of a cloud.
fn through(points: &[[f64; 3]], dimension: usize, rays: bool) {
    let made = || Cloud::<3>::new(points.as_flattened(), 3);
    let Ok(atlas) = made().and_then(|cloud| Atlas::new(cloud, dimension)) else {
        return;
    };
    let report = atlas.report();
    assert!(report.charts > 0);
    let geodesics = Geodesics::of_atlas(atlas);
    let surface = geodesics.surface();
    let mut nodes = (0..points.len()).filter_map(|row| surface.node_of_row(row).ok());
    let (Some(first), Some(last)) = (nodes.next(), nodes.next_back()) else {
        return;
    };
    let path = geodesics.path(&first, &last, &Settings::default());
    if path.converged() {
        let chord = (last.point - first.point).norm();
        let error = path.length_error + path.surface_error + 1e-12 * chord;
        assert!(path.length >= chord - error, "{} {chord}", path.length);
    }
    let source = [Source {
        node: first,
        start: 0.0,
    }];
    // Rays across surfaces as rough as these take seconds: few of them are looked at.
    let rays = rays.then(|| Fields::of_cloud(&geodesics));
    let march = Fields::with_cost(&geodesics, &Cost::default());
    for fields in rays.into_iter().chain([march]) {
        let fields = fields.expect("fields");
        let field = fields.from(&source, &field::Settings::default());
        let Ok(field) = field else { continue };
        for value in fields.at_points(&field) {
            assert!(!value.distance.is_nan() && !value.error.is_nan());
        }
    }
    if let Ok(cloud) = made() {
        let accuracy = 0.1 * (cloud.points[0] - cloud.points[1]).norm();
        let settings = FitSettings {
            accuracy: Some(accuracy),
            ..FitSettings::default()
        };
        let _ = Atlas::fit(cloud, dimension, &settings);
    }
}

/// Of so many clouds one is crossed by rays.
const RAYS: u64 = 400;

#[test]
fn tiny_clouds_are_answered_or_refused() {
    let count = std::env::var("CLOUDS").map_or(600, |v| v.parse().expect("a number"));
    for seed in 0..count {
        let points = cloud(seed);
        for dimension in [1, 2] {
            let rays = seed % RAYS == 0;
            let started = Instant::now();
            let done = std::panic::catch_unwind(|| through(&points, dimension, rays));
            assert!(
                done.is_ok(),
                "seed {seed}, dimension {dimension}: {points:?}"
            );
            let took = started.elapsed();
            assert!(
                rays || took < Duration::from_secs(2),
                "seed {seed} took {took:?}"
            );
        }
    }
}
