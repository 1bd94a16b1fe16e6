//! Ends that share a place, or lie within rounding of each other: lengths of 0 and of next to
//! nothing.

use taut_core::cloud::Cloud;
use taut_core::correction::{Scheme, Settings};
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_core::surface::atlas::Atlas;
use taut_core::surface::implicit::{Equation, ImplicitSurface};
use taut_core::surface::{Geometry, Node};
use taut_core::{Matrix, Vector};

/// Points of the unit sphere on a spiral, moved by `far`; the last repeats the first.
fn sphere(count: usize, far: f64) -> Geodesics<3, Atlas<3>> {
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (2.399_963 * i as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos + far, radius * sin + far, z + far]
    };
    let rows: Vec<f64> = (0..count).chain([0]).flat_map(point).collect();
    let cloud = Cloud::<3>::new(&rows, 3).expect("a cloud");
    Geodesics::of_atlas(Atlas::new(cloud, 2).expect("a surface"))
}

/// Paths of all kinds between a node and those a step off, on a unit sphere.
fn near_ends<S: Guide<3>>(geodesics: &Geodesics<3, S>, from: Node<3, S::Place>) {
    let surface = geodesics.surface();
    let mut scratch = Geometry::new(1);
    assert!(surface.geometry(&from.point, from.place, &mut scratch));
    let tangent = scratch.tangent(0);
    let flow = Settings {
        scheme: Scheme::Flow,
        ..Settings::default()
    };
    for step in [0.0, 1e-15, 1e-14, 1e-13, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3] {
        let mut to = from;
        if step > 0.0 {
            let moved = surface.foot(&(from.point + tangent * step), &mut to.place, &mut scratch);
            to.point = moved.expect("a foot");
        }
        let chord = (to.point - from.point).norm();
        let truth = 2.0 * (0.5 * chord).asin();
        let origins = [geodesics.origin(&from), geodesics.origin(&to)];
        for settings in [Settings::default(), flow] {
            let paths = [
                geodesics.path(&from, &to, &settings),
                geodesics.path_between(&origins[0], &origins[1], &settings),
                geodesics
                    .all_pairs(&[from, to], &settings, |_, path| path)
                    .remove(0),
                geodesics.alternatives(&from, &to, &settings, 3).remove(0),
            ];
            for path in paths {
                let error = path.length_error + path.surface_error;
                assert!(
                    path.converged() && path.points.len() > 1,
                    "{step:e} {}",
                    path.status
                );
                assert!(
                    (path.length - truth).abs() <= error + 1e-16 && error <= 4e-14 + 0.05 * truth,
                    "{step:e} {:e} {truth:e} {error:e}",
                    path.length
                );
                if step == 0.0 {
                    assert_eq!((path.length, error), (0.0, 0.0));
                }
            }
        }
    }
}

#[test]
fn on_clouds() {
    for far in [0.0, 1e5] {
        let geodesics = sphere(2000, far);
        let node = |row| geodesics.surface().node_of_row(row).expect("a foot");
        near_ends(&geodesics, node(700));
        let path = geodesics.path(&node(0), &node(2000), &Settings::default());
        assert_eq!((path.length, path.converged()), (0.0, true));
    }
}

#[test]
fn on_equations() {
    let sphere = |x: &Vector<3>| (x.dot(x) - 1.0, x * 2.0, Matrix::<3>::identity() * 2.0);
    let surface = ImplicitSurface::new(Equation(sphere), 1.0);
    let from = Vector::<3>::new(0.6, 0.48, 0.64);
    let geodesics = Geodesics::of_implicit(surface, &[from], None).expect("samples");
    let (from, _) = geodesics.surface().node_near(&from).expect("a foot");
    near_ends(&geodesics, from);
}
