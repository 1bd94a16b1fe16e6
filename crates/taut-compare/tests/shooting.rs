//! The truth by shooting, checked against symmetry, invariants, formulas and Karney's series.

use std::f64::consts::PI;

use rayon::prelude::*;
use taut_compare::revolution::Spheroid;
use taut_compare::shooting::{distances, geodesics, shoot, shortest};
use taut_compare::surface::{Ellipsoid, Surface, Torus};
use taut_compare::{closed_form, generate};

const TORUS: Torus = Torus {
    major: 1.0,
    minor: 0.4,
};
const TRIAXIAL: Ellipsoid = Ellipsoid {
    semi_axes: [3.0, 2.0, 1.0],
};

fn random_pairs(points: &[[f64; 3]]) -> Vec<([f64; 3], [f64; 3])> {
    points
        .chunks_exact(2)
        .map(|pair| (pair[0], pair[1]))
        .collect()
}

/// Largest difference of lengths; every pair must have both.
fn worst(a: &[Option<f64>], b: &[Option<f64>]) -> f64 {
    assert!(a.iter().chain(b).all(Option::is_some));
    let differences = a
        .iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max)
}

fn asymmetry(surface: &impl Surface, points: &[[f64; 3]]) -> f64 {
    let there = random_pairs(points);
    let back: Vec<_> = there.iter().map(|&(p, q)| (q, p)).collect();
    worst(&distances(surface, &there), &distances(surface, &back))
}

#[test]
fn torus_is_symmetric() {
    let points = generate::torus(200, &TORUS, 1).points;
    let worst = asymmetry(&TORUS, &points);
    assert!(worst < 1e-13, "{worst:e}");
}

#[test]
fn triaxial_ellipsoid_is_symmetric() {
    let points = generate::ellipsoid(100, TRIAXIAL.semi_axes, 1);
    let worst = asymmetry(&TRIAXIAL, &points);
    assert!(worst < 1e-13, "{worst:e}");
}

#[test]
fn residuals_are_near_rounding() {
    let torus = random_pairs(&generate::torus(60, &TORUS, 2).points);
    let ellipsoid = random_pairs(&generate::ellipsoid(60, TRIAXIAL.semi_axes, 2));
    let of_torus = torus
        .par_iter()
        .map(|&(p, q)| shortest(&TORUS, p, q).unwrap());
    let of_ellipsoid = ellipsoid
        .par_iter()
        .map(|&(p, q)| shortest(&TRIAXIAL, p, q).unwrap());
    let worst = of_torus
        .chain(of_ellipsoid)
        .map(|g| g.residual / (1.0 + g.length))
        .reduce(|| 0.0, f64::max);
    assert!(worst < 1e-13, "{worst:e}");
}

#[test]
fn unit_sphere_as_ellipsoid() {
    let sphere = Ellipsoid {
        semi_axes: [1.0; 3],
    };
    let pairs = random_pairs(&generate::sphere(60, 1.0, 3));
    let exact: Vec<_> = pairs
        .iter()
        .map(|(p, q)| Some(closed_form::sphere(1.0, p, q)))
        .collect();
    let worst = worst(&distances(&sphere, &pairs), &exact);
    assert!(worst < 1e-13, "{worst:e}");
}

#[test]
fn ellipsoids_of_revolution_agree_with_the_series() {
    for polar in [0.99, 1.01] {
        let (surface, series) = (
            Ellipsoid {
                semi_axes: [1.0, 1.0, polar],
            },
            Spheroid::new(1.0, polar),
        );
        let pairs = random_pairs(&generate::ellipsoid(60, surface.semi_axes, 4));
        let exact: Vec<_> = pairs
            .iter()
            .map(|(p, q)| Some(series.distance(p, q)))
            .collect();
        let worst = worst(&distances(&surface, &pairs), &exact);
        assert!(worst < 1e-13, "polar semi-axis {polar}: {worst:e}");
    }
}

#[test]
fn torus_circles_have_closed_forms() {
    for angle in [1e-6, 0.01, 0.7, 1.5] {
        let meridian = shortest(
            &TORUS,
            TORUS.point([0.3, 0.2]).into(),
            TORUS.point([0.3, 0.2 + angle]).into(),
        );
        assert!(
            (meridian.unwrap().length - 0.4 * angle).abs() < 1e-13,
            "meridian {angle}"
        );
        let inner = shortest(
            &TORUS,
            TORUS.point([0.3, PI]).into(),
            TORUS.point([0.3 + angle, PI]).into(),
        );
        assert!(
            (inner.unwrap().length - 0.6 * angle).abs() < 1e-13,
            "inner equator {angle}"
        );
        // The outer equator is shortest up to its conjugate point, π √(r (R + r)) along it: an
        // angle of 1.68.
        let outer = shortest(
            &TORUS,
            TORUS.point([0.3, 0.0]).into(),
            TORUS.point([0.3 + angle, 0.0]).into(),
        );
        assert!(
            (outer.unwrap().length - 1.4 * angle).abs() < 1e-13,
            "outer equator {angle}"
        );
    }
}

#[test]
fn outer_equator_beyond_its_conjugate_point_is_listed_as_unstable() {
    let angle = 2.5;
    let found = geodesics(
        &TORUS,
        [1.4, 0.0, 0.0],
        TORUS.point([angle, 0.0]).into(),
        3.6,
    );
    let lengths: Vec<f64> = found.iter().map(|g| g.length).collect();
    // Two mirror images over and under, shorter than the equator itself.
    assert!(
        found.len() >= 3 && (lengths[0] - lengths[1]).abs() < 1e-12 && found[0].stable,
        "{lengths:?}"
    );
    let equator = found
        .iter()
        .find(|g| (g.length - 1.4 * angle).abs() < 1e-12)
        .unwrap();
    assert!(!equator.stable && equator.length > lengths[0] + 1e-3);
}

#[test]
fn geodesics_longer_than_the_shortest_are_found_from_both_ends() {
    let points = generate::torus(20, &TORUS, 5).points;
    let complete = random_pairs(&points).par_iter().all(|&(p, q)| {
        let there: Vec<f64> = geodesics(&TORUS, p, q, 5.0)
            .iter()
            .map(|g| g.length)
            .collect();
        let back: Vec<f64> = geodesics(&TORUS, q, p, 5.0)
            .iter()
            .map(|g| g.length)
            .collect();
        assert!(there.len() >= 3, "{there:?}");
        there.len() == back.len() && there.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-10)
    });
    assert!(complete);
}

#[test]
fn shot_points_are_found_again() {
    let points = generate::ellipsoid(20, TRIAXIAL.semi_axes, 6);
    for pair in points.chunks_exact(2) {
        let end = shoot(&TRIAXIAL, pair[0], pair[1], 1.0);
        let found = geodesics(&TRIAXIAL, pair[0], end, 1.2);
        assert!(
            found.iter().any(|g| (g.length - 1.0).abs() < 1e-13),
            "{found:?}"
        );
    }
}
