//! Paths on clouds against closed forms, and what must not change them.

use std::f64::consts::{PI, TAU};

use taut_core::cloud::Cloud;
use taut_core::correction::{Scheme, Settings};
use taut_core::geodesics::Geodesics;
use taut_core::result::{Path, Status};
use taut_core::surface::atlas::Atlas;

/// Uniform deviates from a fixed linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn sphere(count: usize) -> Vec<[f64; 3]> {
    let mut random = Random(5);
    (0..count)
        .map(|_| {
            let (z, angle) = (2.0 * random.next() - 1.0, TAU * random.next());
            let radius = (1.0 - z * z).sqrt();
            [radius * angle.cos(), radius * angle.sin(), z]
        })
        .collect()
}

fn geodesics(points: &[[f64; 3]]) -> Geodesics<3, Atlas<3>> {
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
    Geodesics::of_atlas(Atlas::new(cloud, 2).expect("a surface"))
}

fn path(
    geodesics: &Geodesics<3, Atlas<3>>,
    from: usize,
    to: usize,
    settings: &Settings,
) -> Path<3> {
    let atlas = geodesics.surface();
    let from = atlas.node_of_row(from).expect("a foot");
    let to = atlas.node_of_row(to).expect("a foot");
    geodesics.path(&from, &to, settings)
}

fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let chord = a
        .iter()
        .zip(b)
        .map(|(x, y)| (x - y).powi(2))
        .sum::<f64>()
        .sqrt();
    2.0 * (chord / 2.0).asin()
}

#[test]
fn sphere_lengths_are_good_to_1e_7_and_covered() {
    let points = sphere(10_000);
    let geodesics = geodesics(&points);
    assert_eq!(geodesics.component_sizes().len(), 1);
    let mut covered = 0;
    for i in 0..100 {
        let (from, to) = (97 * i, 9_999 - 53 * i);
        let path = path(&geodesics, from, to, &Settings::default());
        let error = (path.length - angle(&points[from], &points[to])).abs();
        assert_eq!(path.status, Status::Converged);
        assert!(path.stable, "{from} {to}");
        assert!(error <= 1e-7 * path.length, "{from} {to}: {error:e}");
        covered += usize::from(error <= path.length_error + path.surface_error);
        assert!(path.max_off_surface < 1e-12 && path.max_geodesic_curvature < 1e-3);
    }
    assert!(covered >= 99, "{covered} of 100 covered");
}

#[test]
fn closed_surface_has_no_rim_and_a_report_in_spacings() {
    let geodesics = geodesics(&sphere(10_000));
    let report = geodesics.surface().report();
    let spacing = (4.0 * PI / 10_000.0).sqrt();
    assert!(
        (report.spacing[1] / spacing - 1.0).abs() < 0.1,
        "{report:?}"
    );
    assert!(report.noise < 1e-3 * spacing, "{report:?}");
    assert_eq!(report.other_sheet, None);
    assert!(report.rim_length < 10.0 * spacing, "{report:?}");
    assert_eq!(report.degrees.iter().sum::<usize>(), report.charts);
}

#[test]
fn the_rim_of_a_square_is_its_perimeter() {
    let points: Vec<[f64; 3]> = (0..51 * 51)
        .map(|i| [0.01 * f64::from(i % 51), 0.01 * f64::from(i / 51), 0.0])
        .collect();
    let report = geodesics(&points).surface().report();
    assert!((report.rim_length / 2.0 - 1.0).abs() < 0.15, "{report:?}");
}

#[test]
fn the_papers_flow_agrees_with_newton() {
    let points = sphere(5_000);
    let geodesics = geodesics(&points);
    let flow = Settings {
        tolerance: 1e-4,
        scheme: Scheme::Flow,
        ..Settings::default()
    };
    for (from, to) in [(0, 4_000), (17, 900), (1_234, 3_210)] {
        let truth = path(&geodesics, from, to, &Settings::default()).length;
        let path = path(&geodesics, from, to, &flow);
        assert!((path.length / truth - 1.0).abs() < 1e-4, "{from} {to}");
    }
}

#[test]
fn scale_offset_and_rotation_change_nothing() {
    let points = sphere(4_000);
    let reference = geodesics(&points);
    let rotation = nalgebra::Rotation3::from_euler_angles(0.7, -0.4, 2.1);
    let turn = |p: [f64; 3]| (rotation * nalgebra::Vector3::from(p)).into();
    let moved = |f: &dyn Fn([f64; 3]) -> [f64; 3]| {
        geodesics(&points.iter().map(|p| f(*p)).collect::<Vec<_>>())
    };
    let cases: [(&str, f64, f64, Geodesics<3, Atlas<3>>); 4] = [
        ("times 1e-6", 1e-6, 1e-9, moved(&|p| p.map(|x| 1e-6 * x))),
        ("times 1e6", 1e6, 1e-9, moved(&|p| p.map(|x| 1e6 * x))),
        ("rotated", 1.0, 1e-9, moved(&turn)),
        // f64 leaves 1e-9 of a coordinate of 5e6.
        ("plus 5e6", 1.0, 1e-7, moved(&|p| p.map(|x| x + 5e6))),
    ];
    for (name, scale, tolerance, other) in &cases {
        for (from, to) in (0..20).map(|i| (97 * i, 3_999 - 53 * i)) {
            let truth = path(&reference, from, to, &Settings::default()).length;
            let length = path(other, from, to, &Settings::default()).length / scale;
            let difference = (length / truth - 1.0).abs();
            assert!(difference <= *tolerance, "{name}: {difference:e}");
        }
    }
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let points = sphere(3_000);
    let lengths = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let geodesics = geodesics(&points);
            let length = |i| {
                path(&geodesics, i, 2_999 - i, &Settings::default())
                    .length
                    .to_bits()
            };
            (0..20).map(|i| length(67 * i)).collect::<Vec<u64>>()
        })
    };
    assert_eq!(lengths(1), lengths(3));
}

#[test]
fn two_components_are_infinitely_far_apart() {
    let near = sphere(1_000);
    let far = near.iter().map(|[x, y, z]| [x + 5.0, *y, *z]);
    let points: Vec<[f64; 3]> = near.iter().copied().chain(far).collect();
    let geodesics = geodesics(&points);
    assert_eq!(geodesics.component_sizes().len(), 2);
    let path = path(&geodesics, 0, 1_500, &Settings::default());
    assert_eq!(path.status, Status::NoPath);
    assert!(path.length.is_infinite() && path.points.is_empty());
    assert_ne!(
        geodesics.component_of_row(0),
        geodesics.component_of_row(1_500)
    );
}

#[test]
fn a_path_goes_round_a_hole() {
    let mut random = Random(9);
    let mut points = vec![[-0.9, 0.05, 0.0], [0.9, -0.03, 0.0]];
    while points.len() < 6_000 {
        let (x, y) = (2.0 * random.next() - 1.0, 2.0 * random.next() - 1.0);
        if x.hypot(y) > 0.5 {
            points.push([x, y, 0.0]);
        }
    }
    let geodesics = geodesics(&points);
    let path = path(&geodesics, 0, 1, &Settings::default());
    // Tangent, arc, tangent.
    let (a, b): (f64, f64) = (0.9_f64.hypot(0.05), 0.9_f64.hypot(0.03));
    let between = (-(0.9 * 0.9 + 0.05 * 0.03) / (a * b)).acos();
    let arc = between - (0.5 / a).acos() - (0.5 / b).acos();
    let truth = (a * a - 0.25).sqrt() + (b * b - 0.25).sqrt() + 0.5 * arc;
    let error = (path.length - truth).abs();
    assert!(
        error < 0.02 * truth,
        "{} {truth} {}",
        path.length,
        path.status
    );
    assert!(
        error <= path.length_error + path.surface_error,
        "{} {truth}",
        path.length
    );
    let deepest = path
        .points
        .iter()
        .map(|p| (p + geodesics.surface().cloud().centre).norm());
    assert!(
        deepest.fold(f64::INFINITY, f64::min) > 0.47,
        "the path crosses the hole"
    );
}

/// The points of the unit sphere moved along their radii by noise of that many spacings.
fn noisy(clean: &[[f64; 3]], spacings: f64) -> Vec<[f64; 3]> {
    let sigma = spacings * (4.0 * PI / clean.len() as f64).sqrt();
    let mut random = Random(21);
    clean
        .iter()
        .map(|p| {
            // Sum of twelve uniform deviates: nearly normal.
            let deviate: f64 = (0..12).map(|_| random.next()).sum::<f64>() - 6.0;
            p.map(|x| x * (1.0 + sigma * deviate))
        })
        .collect()
}

#[test]
fn a_path_over_bumps_is_the_shortest_to_half_a_per_cent() {
    // An egg box has many ways that are nearly as short, which a coarse polyline cannot tell apart.
    let mut random = Random(8);
    let points: Vec<[f64; 3]> = (0..8_000)
        .map(|_| {
            let (x, y) = (random.next(), random.next());
            [x, y, 0.05 * (40.0 * x).sin() * (40.0 * y).sin()]
        })
        .collect();
    let geodesics = geodesics(&points);
    let atlas = geodesics.surface();
    for i in 0..15 {
        let [from, to] =
            [71 * i, 7_999 - 59 * i].map(|row| atlas.node_of_row(row).expect("a foot"));
        let path = geodesics.path(&from, &to, &Settings::default());
        let all = geodesics.alternatives(&from, &to, &Settings::default(), 1);
        let shortest = all.iter().filter(|path| path.converged());
        let shortest = shortest
            .map(|path| path.length)
            .fold(f64::INFINITY, f64::min);
        assert!(
            !path.converged() || path.length <= shortest * 1.005,
            "{i}: {} {shortest}",
            path.length
        );
    }
}

#[test]
fn noise_of_half_a_spacing_leaves_lengths_good_to_half_a_per_cent() {
    let clean = sphere(6_000);
    let geodesics = geodesics(&noisy(&clean, 0.5));
    let mut errors: Vec<f64> = (0..31)
        .map(|i| {
            let (from, to) = (101 * i, 5_999 - 89 * i);
            let length = path(&geodesics, from, to, &Settings::default()).length;
            (length / angle(&clean[from], &clean[to]) - 1.0).abs()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    assert!(errors[15] < 5e-3, "{errors:?}");
}

#[test]
fn a_thin_limb_sampled_in_rings_is_one_sheet() {
    // A cylinder of radius 1: 20 points a ring, 0.31 apart, rings 0.8 apart and jittered a little.
    let mut random = Random(3);
    let mut points = Vec::new();
    let mut unrolled = Vec::new();
    for ring in 0..40 {
        for i in 0..20 {
            let angle = TAU * (f64::from(i) + 0.3 * random.next()) / 20.0;
            let height = 0.8 * (f64::from(ring) + 0.05 * random.next());
            points.push([angle.cos(), angle.sin(), height]);
            unrolled.push((angle, height));
        }
    }
    let geodesics = geodesics(&points);
    assert_eq!(geodesics.component_sizes().len(), 1);
    for (from, to) in [(105, 113), (110, 503), (207, 690), (300, 385), (401, 650)] {
        let (a, b) = (unrolled[from], unrolled[to]);
        let around = (a.0 - b.0).abs().min(TAU - (a.0 - b.0).abs());
        let truth = around.hypot(a.1 - b.1);
        let found = path(&geodesics, from, to, &Settings::default());
        let error = (found.length - truth).abs();
        assert!(found.converged(), "{from} {to}: {:?}", found.status);
        assert!(error < 0.003 * truth, "{from} {to}: {error}");
        assert!(error <= found.length_error + found.surface_error);
    }
}
