//! Formulas and generators, checked against each other and against unrolled or lifted coordinates.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use nalgebra::{Matrix3, Rotation3};
use taut_compare::closed_form::*;
use taut_compare::generate::{self, Roll};

fn close(found: f64, truth: f64, what: &str) {
    assert!(
        (found - truth).abs() <= 1e-14 * (1.0 + truth),
        "{what}: {found} for {truth}"
    );
}

#[test]
fn sphere_keeps_small_and_nearly_opposite_angles() {
    for angle in [1e-12_f64, 1e-6, 0.1, 2.0, PI - 1e-7] {
        let q = [2.0 * angle.cos(), 2.0 * angle.sin(), 0.0, 0.0];
        let found = sphere(2.0, &[2.0, 0.0, 0.0, 0.0], &q);
        assert!(
            (found / (2.0 * angle) - 1.0).abs() < 2e-15,
            "{angle}: {found}"
        );
    }
}

#[test]
fn rotations_agree_with_the_logarithm_and_the_double_cover() {
    let quaternions: Vec<[f64; 4]> = generate::sphere(200, 1.0, 1);
    for pair in quaternions.chunks_exact(2) {
        let [p, q] = [generate::rotation(pair[0]), generate::rotation(pair[1])];
        let found = rotations(&p, &q);
        // A rotation by t is the pair ± of unit quaternions at angle t/2; R^9 stretches t by √2.
        let opposite = pair[1].map(|x| -x);
        let cover = sphere(1.0, &pair[0], &pair[1]).min(sphere(1.0, &pair[0], &opposite));
        close(found, 2.0 * 2_f64.sqrt() * cover, "double cover");
        let relative = Matrix3::from_row_slice(&p).transpose() * Matrix3::from_row_slice(&q);
        let logarithm = Rotation3::from_matrix_unchecked(relative).scaled_axis();
        assert!(
            (found - 2_f64.sqrt() * logarithm.norm()).abs() < 1e-7,
            "{found}"
        );
    }
}

#[test]
fn rotations_keep_small_and_large_angles() {
    let identity = generate::rotation([1.0, 0.0, 0.0, 0.0]);
    for angle in [1e-9_f64, 1e-4, 1.0, 2.0, PI - 1e-6, PI] {
        let (sin, cos) = (0.5 * angle).sin_cos();
        let turned = generate::rotation([cos, 0.6 * sin, 0.0, 0.8 * sin]);
        let found = rotations(&identity, &turned) / 2_f64.sqrt();
        assert!(
            (found - angle).abs() < 1e-15 + 4e-16 * angle,
            "{angle}: {found}"
        );
    }
}

#[test]
fn flat_torus_takes_the_shorter_wraps() {
    let radii = [FRAC_1_SQRT_2, 0.5];
    let sample = generate::flat_torus(100, radii, 2);
    for (points, angles) in sample
        .points
        .chunks_exact(2)
        .zip(sample.parameters.chunks_exact(2))
    {
        let truth = (0..9)
            .map(|wrap| {
                let [i, j] = [wrap / 3, wrap % 3].map(|i| TAU * (f64::from(i) - 1.0));
                let (a, b) = (
                    angles[0][0] - angles[1][0] + i,
                    angles[0][1] - angles[1][1] + j,
                );
                (radii[0] * a).hypot(radii[1] * b)
            })
            .fold(f64::INFINITY, f64::min);
        close(
            flat_torus(radii, &points[0], &points[1]),
            truth,
            "flat torus",
        );
    }
}

#[test]
fn cylinder_and_cone_unroll_to_the_plane() {
    let tube = generate::cylinder(100, 0.7, 2.0, 3);
    let funnel = generate::cone(100, 0.9, 2.0, 3);
    for i in (0..100).step_by(2) {
        let turn = |angle: [[f64; 2]; 2]| {
            let difference = (angle[0][0] - angle[1][0]).abs();
            difference.min(TAU - difference)
        };
        let at = [tube.parameters[i], tube.parameters[i + 1]];
        let truth = (0.7 * turn(at)).hypot(at[0][1] - at[1][1]);
        close(
            cylinder(0.7, &tube.points[i], &tube.points[i + 1]),
            truth,
            "cylinder",
        );
        let at = [funnel.parameters[i], funnel.parameters[i + 1]];
        let (sin, cos) = (turn(at) * 0.9_f64.sin()).sin_cos();
        let truth = (at[0][1] - at[1][1] * cos).hypot(at[1][1] * sin);
        close(
            cone(0.9, &funnel.points[i], &funnel.points[i + 1]),
            truth,
            "cone",
        );
    }
    close(
        cone(0.9, &[0.0; 3], &funnel.points[0]),
        funnel.parameters[0][1],
        "apex",
    );
}

#[test]
fn hole_is_gone_round() {
    close(
        plane_with_hole(1.0, &[-2.0, 1.5], &[3.0, 1.5]),
        5.0,
        "clear of the hole",
    );
    close(
        plane_with_hole(1.0, &[2.0, 0.0], &[5.0, 0.0]),
        3.0,
        "away from the hole",
    );
    close(
        plane_with_hole(1.0, &[-1.0, 0.0], &[1.0, 0.0]),
        PI,
        "half round the rim",
    );
    // Tangents of length √3 from distance 2 touch 60° off the axis.
    let opposite = plane_with_hole(1.0, &[-2.0, 0.0], &[2.0, 0.0]);
    close(opposite, 2.0 * 3_f64.sqrt() + PI / 3.0, "opposite");
    let points = generate::plane_with_hole(200, 2.0, 1.0, 4).parameters;
    for pair in points.chunks_exact(2) {
        let found = plane_with_hole(1.0, &pair[0], &pair[1]);
        let crosses = !clear_of_disc(pair[0], pair[1]);
        let truth = if crosses {
            strung(pair[0], pair[1])
        } else {
            sheet(&pair[0], &pair[1])
        };
        assert!(
            (found - truth).abs() < 1e-6,
            "{pair:?}: {found} for {truth}"
        );
    }
}

/// Whether the segment keeps out of the unit disc, by samples.
fn clear_of_disc(a: [f64; 2], b: [f64; 2]) -> bool {
    (0..=1000).map(|i| f64::from(i) / 1000.0).all(|t| {
        let [x, y] = [0, 1].map(|i| a[i] + t * (b[i] - a[i]));
        x.hypot(y) > 1.0 - 1e-6
    })
}

/// Shortest of the paths straight to a point of the rim in sight, along the rim, and straight on,
/// by search.
fn strung(a: [f64; 2], b: [f64; 2]) -> f64 {
    let [from, to] = [a, b].map(|p| p[1].atan2(p[0]));
    let turn = (to - from + PI).rem_euclid(TAU) - PI;
    let to_rim = |p: [f64; 2], bearing: f64, side: f64| {
        (0..4000)
            .map(|i| f64::from(i) * 0.5 * PI / 4000.0)
            .filter(|t| clear_of_disc(p, [(bearing + side * t).cos(), (bearing + side * t).sin()]))
            .map(|t| {
                sheet(
                    &p,
                    &[(bearing + side * t).cos(), (bearing + side * t).sin()],
                ) - t
            })
            .fold(f64::INFINITY, f64::min)
    };
    turn.abs() + to_rim(a, from, turn.signum()) + to_rim(b, to, -turn.signum())
}

#[test]
fn roll_is_an_isometry() {
    let roll = Roll {
        inner_radius: 0.3,
        gap: 0.065,
        turns: 7.0,
    };
    let end = roll.point([roll.length(), 0.25]);
    close(end[0].hypot(end[1]), 0.3 + 7.0 * 0.065, "outer radius");
    let h = 1e-5;
    for i in 1..50 {
        let u = roll.length() * f64::from(i) / 50.0;
        let [before, after] = [u - h, u + h].map(|u| roll.point([u, 0.5]));
        let speed: [f64; 3] = std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * h));
        let normal = roll.normal(u);
        assert!((speed[0].hypot(speed[1]) - 1.0).abs() < 1e-8, "{speed:?}");
        assert!((speed[0] * normal[0] + speed[1] * normal[1]).abs() < 1e-8);
    }
    let sample = roll.jittered(0.02, 1);
    assert_eq!(
        sample.points.len(),
        (roll.length() / 0.02).round() as usize * 50
    );
    assert!(
        sample
            .points
            .iter()
            .zip(&sample.parameters)
            .all(|(x, p)| *x == roll.point(*p))
    );
}

#[test]
fn samples_are_uniform_by_area() {
    // The share of points with x > 0.9 (ellipsoid 3, 2, 1) and outside the tube's axis (torus)
    // against quadrature.
    let axes = [3.0, 2.0, 1.0];
    let points = generate::ellipsoid(40_000, axes, 5);
    let found = points.iter().filter(|p| p[0] > 0.9).count() as f64 / 40_000.0;
    let (mut above, mut all) = (0.0, 0.0);
    for i in 0..400 {
        let x = (f64::from(i) + 0.5) / 200.0 - 1.0;
        for j in 0..400 {
            let (sin, cos) = (TAU * f64::from(j) / 400.0).sin_cos();
            let rim = (1.0 - x * x).sqrt();
            let stretch =
                ((x / 3.0).powi(2) + (rim * cos / 2.0).powi(2) + (rim * sin).powi(2)).sqrt();
            all += stretch;
            above += if 3.0 * x > 0.9 { stretch } else { 0.0 };
        }
    }
    assert!(
        (found - above / all).abs() < 0.01,
        "{found} for {}",
        above / all
    );
    let torus = taut_compare::surface::Torus {
        major: 1.0,
        minor: 0.4,
    };
    let outer = generate::torus(40_000, &torus, 5);
    let found = outer.parameters.iter().filter(|p| p[1].cos() > 0.0).count() as f64 / 40_000.0;
    assert!((found - (0.5 + 0.4 / PI)).abs() < 0.01, "{found}");
}

#[test]
fn noise_and_pairs_are_seeded_and_as_asked() {
    let points: Vec<[f64; 3]> = generate::sphere(10_000, 1.0, 6);
    let noisy = generate::radial_noise(&points, 0.01, 7);
    assert_eq!(noisy, generate::radial_noise(&points, 0.01, 7));
    let radius = |p: &[f64; 3]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
    let variance = noisy.iter().map(|p| (radius(p) - 1.0).powi(2)).sum::<f64>() / 1e4;
    assert!((variance.sqrt() / 0.01 - 1.0).abs() < 0.03);
    let outliers = generate::outliers(&points, 500, 8);
    let inside = outliers.iter().filter(|p| radius(p) < 0.9).count();
    assert!((150..250).contains(&inside) && outliers.iter().flatten().all(|x| x.abs() <= 1.0));
    assert!(
        generate::pairs(5, 1000, 9)
            .iter()
            .all(|[i, j]| i != j && i.max(j) < &5)
    );
}
