//! Polygons that nothing passes through, against the way round them.

use taut_core::cloud::Cloud;
use taut_core::field::{Cost, Fields, Settings, Source, Value};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

/// Random points of the square [-1, 1]^2 at height 0.3 x, some 0.02 apart; the first two are given.
fn square(seed: u64, ends: [[f64; 2]; 2]) -> Vec<[f64; 3]> {
    let mut state = seed;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        2.0 * (state >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
    };
    let mut places: Vec<[f64; 2]> = (0..10_000).map(|_| [random(), random()]).collect();
    places[..2].copy_from_slice(&ends);
    places.iter().map(|[x, y]| [*x, *y, 0.3 * x]).collect()
}

/// The field from the first point, and the barriers that change nothing.
fn field(points: &[[f64; 3]], barriers: &[Vec<[f64; 2]>]) -> (Vec<Value<3>>, Vec<usize>) {
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2).expect("a surface"));
    let cost = Cost {
        barriers: barriers.to_vec(),
        ..Cost::default()
    };
    let fields = Fields::with_cost(&geodesics, &cost).expect("costs");
    let node = geodesics.surface().node_of_row(0).expect("a foot");
    let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default());
    (
        fields.at_points(&field.expect("a field")),
        fields.idle_barriers(),
    )
}

/// Length on the tilted plane.
fn length(a: [f64; 2], b: [f64; 2]) -> f64 {
    (1.09 * (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt()
}

#[test]
fn nothing_passes_strips_however_thin() {
    for (seed, width) in [(1, 1e-9), (2, 0.004), (3, 0.02), (4, 0.04), (5, 0.08)] {
        let points = square(seed, [[0.1, -0.8], [0.2, 0.9]]);
        // Bent, and aslant to rows of points.
        let [low, high] = [-0.5 * width, 0.5 * width];
        let strip = vec![
            [-2.0, low - 0.3],
            [0.0, low],
            [2.0, low + 0.2],
            [2.0, high + 0.2],
            [0.0, high],
            [-2.0, high - 0.3],
        ];
        let middle = |x: f64| if x < 0.0 { 0.15 * x } else { 0.1 * x };
        let (values, idle) = field(&points, &[strip]);
        assert_eq!(idle, [0; 0]);
        for (value, [x, y, _]) in values.iter().zip(&points) {
            let reached = *y < middle(*x) + low;
            assert_eq!(
                value.distance.is_finite(),
                reached,
                "width {width} at {x} {y}"
            );
        }
    }
}

#[test]
fn ways_go_round_the_ends_of_strips() {
    for (seed, width) in [(1, 1e-9), (2, 0.02), (3, 0.2)] {
        let ends = [[0.6, -0.5], [0.5, 0.4]];
        let points = square(seed, ends);
        let strip = vec![[-0.1, 0.0], [2.0, 0.0], [2.0, width], [-0.1, width]];
        let (values, _) = field(&points, &[strip]);
        let corners = [[-0.1, 0.0], [-0.1, width]];
        let truth = length(ends[0], corners[0]) + width + length(corners[1], ends[1]);
        let value = values[1];
        let error = value.distance - truth;
        assert!(
            error.abs() <= value.error && value.error < 0.1,
            "{width} {error} {}",
            value.error
        );
        assert!(
            error > -1e-3,
            "no way is shorter than round the strip: {error}"
        );
    }
}

#[test]
fn polygons_that_change_nothing_are_told() {
    let points = square(1, [[0.0, -0.8], [0.1, 0.8]]);
    let triangle = |x: f64, y: f64, size: f64| vec![[x, y], [x + size, y], [x, y + size]];
    let barriers = [
        triangle(3.0, 0.0, 0.5),
        triangle(0.2, 0.2, 0.3),
        triangle(-1.0, 1.2, 0.1),
    ];
    assert_eq!(field(&points, &barriers).1, [0, 2]);
}
