//! Paths on F = 0 against closed forms, at every tolerance and in several dimensions.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use taut_core::Vector;
use taut_core::correction::Settings;
use taut_core::geodesics::Geodesics;
use taut_core::result::{Path, Status};
use taut_core::surface::implicit::ImplicitSurface;
use taut_core::surface::shapes::Shape;

fn path<const D: usize>(shape: &str, from: [f64; D], to: [f64; D], tolerance: f64) -> Path<D> {
    let shape = Shape::parse(shape).expect("a shape");
    let (from, to) = (Vector::from(from), Vector::from(to));
    let surface = ImplicitSurface::new(shape.clone(), shape.size());
    let geodesics = Geodesics::of_implicit(surface, &[from, to], None).expect("a surface");
    let node = |x: &Vector<D>| geodesics.surface().node_near(x).expect("a foot").0;
    let settings = Settings {
        tolerance,
        ..Settings::default()
    };
    geodesics.path(&node(&from), &node(&to), &settings)
}

fn expect<const D: usize>(shape: &str, from: [f64; D], to: [f64; D], truth: f64) {
    for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
        let path = path(shape, from, to, tolerance);
        let error = (path.length - truth).abs();
        assert_eq!(path.status, Status::Converged, "{shape} {tolerance:e}");
        assert!(path.stable, "{shape} {tolerance:e}");
        assert!(
            error <= tolerance * truth,
            "{shape} {tolerance:e}: {error:e}"
        );
        assert!(
            error <= path.length_error,
            "{shape} {tolerance:e}: {error:e}"
        );
        assert!((path.arc_length[path.arc_length.len() - 1] - path.length).abs() < 1e-9);
    }
}

#[test]
fn spheres_of_several_dimensions() {
    expect(
        "sphere:1",
        [1.0, 0.0, 0.0],
        [-0.6, 0.8, 0.0],
        (-0.6_f64).acos(),
    );
    expect("sphere:2,2", [2.0, 0.0], [0.0, 2.0], PI);
    expect(
        "sphere:1,4",
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.6, 0.0, 0.8],
        PI / 2.0,
    );
    // Spare coordinates are zero: the same circle in a larger space.
    expect("sphere:2,2", [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], PI);
}

#[test]
fn torus_equators_and_meridians() {
    let turn = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin(), 0.0];
    // The inner equator is the shortest of its class; the outer only up to its conjugate point.
    expect("torus:1,0.4", turn(0.6, 0.0), turn(0.6, 2.0), 1.2);
    expect("torus:1,0.4", turn(1.4, 0.0), turn(1.4, 1.0), 1.4);
    let meridian = |angle: f64| [1.0 + 0.4 * angle.cos(), 0.0, 0.4 * angle.sin()];
    expect("torus:1,0.4", meridian(0.3), meridian(1.9), 0.64);
}

#[test]
fn cylinder_unrolls() {
    let point = |angle: f64, z: f64| [0.5 * angle.cos(), 0.5 * angle.sin(), z];
    expect(
        "cylinder:0.5",
        point(0.0, 0.0),
        point(2.5, 1.0),
        1.25_f64.hypot(1.0),
    );
}

#[test]
fn clifford_torus_is_flat() {
    let point = |a: f64, b: f64| [a.cos(), a.sin(), b.cos(), b.sin()].map(|x| x * FRAC_1_SQRT_2);
    let truth = FRAC_1_SQRT_2 * 2.0_f64.hypot(1.5);
    let shape = format!("flat-torus:{FRAC_1_SQRT_2},{FRAC_1_SQRT_2}");
    expect(&shape, point(0.0, 0.0), point(2.0, -1.5), truth);
}

#[test]
fn the_two_ways_round_a_cylinder_are_both_found() {
    let shape = Shape::parse("cylinder:1").expect("a shape");
    let point = |angle: f64| Vector::<3>::new(angle.cos(), angle.sin(), 0.5 * angle);
    let (from, to) = (point(0.0), point(2.8));
    let surface = ImplicitSurface::new(shape.clone(), shape.size());
    let geodesics = Geodesics::of_implicit(surface, &[from, to], None).expect("a surface");
    let node = |x: &Vector<3>| geodesics.surface().node_near(x).expect("a foot").0;
    let paths = geodesics.alternatives(&node(&from), &node(&to), &Settings::default(), 2);
    let truths = [2.8_f64.hypot(1.4), (2.0 * PI - 2.8).hypot(1.4)];
    assert_eq!(paths.len(), 2);
    for (path, truth) in paths.iter().zip(truths) {
        assert!(
            (path.length / truth - 1.0).abs() < 1e-6,
            "{} {truth}",
            path.length
        );
    }
}

#[test]
fn a_tolerance_below_rounding_is_refused_not_claimed() {
    let path = path("sphere:1", [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 1e-17);
    assert_eq!(path.status, Status::NotResolved);
    assert!((path.length - PI / 2.0).abs() <= path.length_error);
}
