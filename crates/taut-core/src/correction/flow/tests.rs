use super::*;
use crate::correction::{straighten, tighten};
use crate::surface::implicit::ImplicitSurface;
use crate::surface::shapes::Shape;

type Implicit = ImplicitSurface<3, Shape>;

fn surface(text: &str) -> Implicit {
    let shape = Shape::parse(text).expect("known");
    let size = shape.size();
    ImplicitSurface::new(shape, size)
}

/// A guess through points of a curve, pushed sideways to and fro.
fn guess(surface: &Implicit, curve: impl Fn(f64) -> [f64; 3]) -> Vec<Node<3, ()>> {
    let mut solver = Solver::<3, ()>::new(1);
    (0..=12)
        .map(|i| {
            let zigzag = if i % 12 == 0 {
                0.0
            } else {
                0.05 + 0.04 * f64::from(i % 3)
            };
            let point = Vector::<3>::from(curve(f64::from(i) / 12.0));
            let pushed = point + Vector::<3>::new(0.3, -0.5, 0.8) * zigzag;
            let point = surface
                .foot(&pushed, &mut (), &mut solver.scratch)
                .expect("foot");
            Node { point, place: () }
        })
        .collect()
}

/// A surface, a curve over [0, 1] that is a shortest path on it, and the curve's length, for
/// several known cases.
fn closed_forms() -> Vec<(Implicit, Vec<Node<3, ()>>, f64)> {
    let circle = |text: &str, radius: f64, angle: f64| {
        let surface = surface(text);
        let nodes = guess(&surface, |t| {
            let (sin, cos) = (angle * t).sin_cos();
            [radius * cos, radius * sin, 0.0]
        });
        (surface, nodes, radius * angle)
    };
    let meridian = {
        let surface = surface("torus:1,0.4");
        let nodes = guess(&surface, |t| {
            let (sin, cos) = (1.5 * t).sin_cos();
            [1.0 + 0.4 * cos, 0.0, 0.4 * sin]
        });
        (surface, nodes, 0.6)
    };
    vec![
        circle("sphere:1", 1.0, 0.5),
        circle("sphere:2.5", 2.5, 2.2),
        circle("torus:1,0.4", 1.4, 1.0),
        circle("torus:1,0.4", 0.6, 2.5),
        circle("cylinder:0.5", 0.5, 3.0),
        meridian,
    ]
}

#[test]
fn circles_of_known_length() {
    let mut solver = Solver::new(1);
    for (i, (surface, guess, truth)) in closed_forms().iter().enumerate() {
        for tolerance in [1e-2, 1e-4, 1e-6] {
            let settings = Settings {
                tolerance,
                ..Settings::default()
            };
            let path = flow(surface, guess, &settings, &mut solver);
            let error = (path.length - truth).abs();
            assert!(
                path.converged() && path.stable,
                "{i} {tolerance:e} {}",
                path.status
            );
            assert!(
                error <= tolerance * truth && error <= path.length_error,
                "{i} {error:e}"
            );
            assert!(path.length_error <= tolerance * path.length && path.max_off_surface < 1e-14);
            let end = path.arc_length[path.arc_length.len() - 1];
            assert!((end - path.length).abs() < 1e-13);
        }
    }
}

/// A guess of a path without symmetry.
fn generic() -> (Implicit, Vec<Node<3, ()>>) {
    let surface = surface("torus:1,0.4");
    let nodes = guess(&surface, |t| {
        let (u, v) = (0.3 + 1.4 * t, 0.4 + 1.1 * t);
        let width = 1.0 + 0.4 * v.cos();
        [width * u.cos(), width * u.sin(), 0.4 * v.sin()]
    });
    (surface, nodes)
}

#[test]
fn same_limit_as_newton() {
    let (surface, guess) = generic();
    let mut solver = Solver::new(1);
    let settings = |tolerance| Settings {
        tolerance,
        ..Settings::default()
    };
    let coarse = straighten(&surface, &guess, &mut solver).expect("followed");
    let newton = tighten(&surface, coarse, &settings(1e-12), &mut solver);
    assert!(newton.converged());
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        let path = flow(&surface, &guess, &settings(tolerance), &mut solver);
        let error = (path.length - newton.length).abs();
        assert!(
            path.converged() && error <= path.length_error,
            "{tolerance:e} {error:e}"
        );
        assert!(error <= tolerance * newton.length);
    }
    let path = flow(&surface, &guess, &settings(1e-10), &mut solver);
    assert_eq!(path.status, Status::NotResolved);
    assert!((path.length - newton.length).abs() <= path.length_error);
    assert!(path.points.len() <= Settings::default().most_nodes);
}

#[test]
fn chords_converge_at_second_order_and_arcs_at_fourth() {
    let (surface, guess) = generic();
    let mut solver = Solver::new(1);
    let settings = Settings {
        tolerance: 1e-13,
        ..Settings::default()
    };
    let coarse = straighten(&surface, &guess, &mut solver).expect("followed");
    let truth = tighten(&surface, coarse, &settings, &mut solver).length;
    let mut flow = Flow {
        surface: &surface,
        solver: &mut solver,
        nodes: guess,
        normals: Vec::new(),
        band: Band::default(),
        steps: 0,
    };
    let mut errors = Vec::new();
    for _ in 0..5 {
        assert!(matches!(flow.level(1e-14), Outcome::Taut(_)));
        let sum = |parts: Vec<f64>| parts.iter().sum::<f64>();
        errors.push([truth - sum(flow.chords()), (truth - sum(flow.arcs())).abs()]);
        flow.insert(&vec![true; flow.nodes.len() - 1]);
    }
    for pair in errors.windows(2).skip(1) {
        let ratio = pair[0][0] / pair[1][0];
        assert!((3.7..4.3).contains(&ratio), "{errors:?}");
    }
    assert!(errors[1][1] / errors[4][1] > 1000.0, "{errors:?}");
}

#[test]
fn no_way_to_go() {
    let (surface, guess) = generic();
    let mut solver = Solver::new(1);
    let path = flow(
        &surface,
        &[guess[0], guess[0]],
        &Settings::default(),
        &mut solver,
    );
    assert!(path.converged());
    assert_eq!((path.length, path.length_error), (0.0, 0.0));
}
