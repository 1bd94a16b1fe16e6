//! Particles on surfaces: where they settle, what joins them, and paths along their trajectories
//! against closed forms.

use std::f64::consts::{PI, TAU};

use taut_core::correction;
use taut_core::error::Error;
use taut_core::geodesics::Geodesics;
use taut_core::guess::particles::{Network, Region, Sampling, Settings, Spread, sample};
use taut_core::result::Status;
use taut_core::surface::implicit::{Equation, ImplicitSurface};
use taut_core::surface::shapes::Shape;
use taut_core::surface::{Geometry, Node, Surface};
use taut_core::{Matrix, Vector};

fn surface(shape: &str) -> ImplicitSurface<3, Shape> {
    let shape = Shape::parse(shape).expect("a shape");
    let size = shape.size();
    ImplicitSurface::new(shape, size)
}

fn nodes<const D: usize>(points: &[[f64; D]]) -> Vec<Node<D, ()>> {
    let node = |point: &[f64; D]| Node {
        point: Vector::from(*point),
        place: (),
    };
    points.iter().map(node).collect()
}

fn spread(shape: &str, source: [f64; 3], count: usize, spread: Spread) -> Sampling<3, ()> {
    let surface = surface(shape);
    let settings = Settings {
        spread,
        ..Settings::new(surface.size())
    };
    sample(&surface, &nodes(&[source]), true, count, &settings).expect("a sampling")
}

fn within(threads: usize, work: impl FnOnce() + Send) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads").install(work);
}

#[test]
fn particles_settle_on_the_surface_denser_where_it_bends() {
    let ellipsoid = surface("ellipsoid:3,2,1");
    let mut scratch = Geometry::new(1);
    for (kind, [least, most]) in [(Spread::Curvature, [0.9, 1.0]), (Spread::Even, [-0.3, 0.3])] {
        let sampling = spread("ellipsoid:3,2,1", [3.0, 0.0, 0.0], 800, kind);
        assert_eq!(sampling.nodes.len(), 800);
        assert_eq!(sampling.nodes[0].point, Vector::<3>::new(3.0, 0.0, 0.0));
        for node in &sampling.nodes {
            let foot = ellipsoid.foot(&node.point, &mut (), &mut scratch);
            assert!((foot.expect("a foot") - node.point).norm() < 1e-9);
        }
        let quality = sampling.quality;
        let follows = quality.density_follows_curvature;
        assert!((least..=most).contains(&follows), "{kind:?}: {quality:?}");
        assert!(quality.spread < 0.3, "{kind:?}: {quality:?}");
    }
    // Each of 800 points of a lattice of triangles has 2 / sqrt(3) of its distance squared to itself.
    let even = spread("sphere:1", [1.0, 0.0, 0.0], 800, Spread::Even).quality;
    let lattice = (4.0 * PI / 800.0 * 2.0 / 3.0_f64.sqrt()).sqrt();
    assert!(even.nearest > 0.85 * lattice && even.nearest < lattice && even.spread < 0.1);
}

#[test]
fn few_particles_are_enough() {
    for count in [1, 2, 7] {
        let sampling = spread("torus:1,0.4", [1.4, 0.0, 0.0], count, Spread::Curvature);
        assert_eq!(sampling.nodes.len(), count);
        assert!(sampling.quality.spread.is_finite());
    }
}

#[test]
fn threads_change_no_bit_and_scale_nothing() {
    let points = |shape: &str, source: f64| -> Vec<Vector<3>> {
        let sampling = spread(shape, [source, 0.0, 0.0], 300, Spread::Curvature);
        sampling.nodes.iter().map(|node| node.point).collect()
    };
    let mut found = [Vec::new(), Vec::new()];
    for (threads, found) in [1, 3].into_iter().zip(&mut found) {
        within(threads, || *found = points("torus:1,0.4", 1.4));
    }
    assert_eq!(found[0], found[1]);
    let large = points("torus:1024,409.6", 1433.6);
    for (small, large) in found[0].iter().zip(&large) {
        assert!((small - large / 1024.0).norm() < 1e-9);
    }
}

/// Points of the unit sphere on a spiral.
fn spiral(count: u32) -> Vec<[f64; 3]> {
    let point = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = (2.399963 * f64::from(i)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [r * cos, r * sin, z]
    };
    (0..count).map(point).collect()
}

#[test]
fn guesses_along_trajectories_are_near_the_truth_and_never_below() {
    let sources = nodes(&spiral(12));
    let settings = Settings::new(1.0);
    let geodesics =
        Geodesics::of_particles(surface("sphere:1"), &sources, 1000, &settings).expect("a network");
    let network = geodesics.surface();
    assert!(network.classes().iter().all(|class| *class == 0));
    for (i, trajectory) in network.trajectories().iter().enumerate().skip(12) {
        let mut before = network.trajectories()[..i].iter().flatten();
        assert!(before.any(|node| node.point == trajectory[0].point));
    }
    let mut excess = Vec::new();
    for (i, from) in sources.iter().enumerate() {
        for to in &sources[..i] {
            let truth = from.point.angle(&to.point);
            let guess = geodesics.guess(from, to).expect("a guess");
            excess.push(guess.length / truth - 1.0);
        }
    }
    excess.sort_by(f64::total_cmp);
    assert!(excess[0] > -1e-10 && excess[33] < 0.1, "{excess:?}");
    let correct = correction::Settings::default();
    let wrong = geodesics.all_pairs(&sources, &correct, |[i, j], path| {
        let truth = sources[i].point.angle(&sources[j].point);
        !path.converged() || (path.length / truth - 1.0).abs() > 1e-6
    });
    assert_eq!(wrong.len(), 66);
    assert!(!wrong.contains(&true));
    let lengths = geodesics.from_one(&sources[0], &sources[1..], &correct, |_, path| path.length);
    for (length, to) in lengths.iter().zip(&sources[1..]) {
        let truth = sources[0].point.angle(&to.point);
        assert!((length / truth - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_network_has_the_same_bits_on_any_number_of_threads() {
    let sources = nodes(&spiral(6));
    let mut found = [Vec::new(), Vec::new()];
    for (threads, found) in [1, 3].into_iter().zip(&mut found) {
        within(threads, || {
            let sphere = surface("sphere:1");
            let geodesics = Geodesics::of_particles(sphere, &sources, 500, &Settings::new(1.0));
            *found = geodesics
                .expect("a network")
                .surface()
                .particles()
                .collect();
        });
    }
    assert_eq!(found[0], found[1]);
}

/// Two unit spheres, 4 apart.
fn two_spheres(x: &Vector<3>) -> (f64, Vector<3>, Matrix<3>) {
    let [a, b] = [-2.0, 2.0].map(|centre| x - Vector::<3>::new(centre, 0.0, 0.0));
    let (f, g) = (a.dot(&a) - 1.0, b.dot(&b) - 1.0);
    let gradient = a * (2.0 * g) + b * (2.0 * f);
    let cross = a * b.transpose() * 4.0;
    let hessian = Matrix::<3>::identity() * (2.0 * (f + g)) + cross + cross.transpose();
    (f * g, gradient, hessian)
}

#[test]
fn sources_that_cannot_meet_are_told() {
    let spheres = ImplicitSurface::new(Equation(two_spheres), 3.0);
    let sources = nodes(&[
        [-3.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [-2.0, 0.0, 1.0],
        [2.0, 0.0, -1.0],
    ]);
    let geodesics =
        Geodesics::of_particles(spheres, &sources, 400, &Settings::new(3.0)).expect("a network");
    assert_eq!(geodesics.surface().classes(), [0, 1, 0, 1]);
    let correct = correction::Settings::default();
    let path = |i: usize, j: usize| geodesics.path(&sources[i], &sources[j], &correct);
    assert_eq!(path(0, 1).status, Status::NoPath);
    for (i, j) in [(0, 2), (1, 3)] {
        assert!((path(i, j).length - PI / 2.0).abs() < 1e-6);
    }
    assert!(geodesics.guess(&sources[0], &sources[1]).is_none());
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let plane = surface("plane");
    let source = nodes(&[[0.0; 3]]);
    let endless = sample(&plane, &source, true, 1000, &Settings::new(1.0));
    assert!(matches!(endless, Err(Error::Endless { .. })));
    let endless = Geodesics::of_particles(surface("plane"), &source, 1000, &Settings::new(1.0));
    assert!(matches!(endless, Err(Error::Endless { .. })));
    let region = Region {
        low: Vector::<3>::new(-1.0, -0.5, -1.0),
        high: Vector::<3>::new(1.0, 0.5, 1.0),
    };
    let settings = Settings {
        region: Some(region),
        ..Settings::new(1.0)
    };
    let sampling = sample(&plane, &source, true, 300, &settings).expect("a sampling");
    assert!(sampling.nodes.iter().all(|node| region.holds(&node.point)));
    let right = sampling.nodes.iter().filter(|n| n.point.x > 0.5).count();
    assert!((50..=110).contains(&right), "{right} of 300 in a quarter");
    let nowhere = sample(&plane, &[], true, 300, &settings);
    assert_eq!(nowhere.err(), Some(Error::NoSources));
    let apex = sample(&surface("cone:0.4"), &source, true, 300, &settings);
    assert!(matches!(apex, Err(Error::NoFoot { .. })));
}

fn bounded(
    shape: &str,
    sources: &[[f64; 3]],
    count: usize,
) -> Geodesics<3, Network<3, ImplicitSurface<3, Shape>>> {
    let surface = surface(shape);
    let (low, high) = surface.equations().region();
    let region = Region {
        low: Vector::from_column_slice(&low),
        high: Vector::from_column_slice(&high),
    };
    let settings = Settings {
        region: Some(region),
        ..Settings::new(surface.size())
    };
    Geodesics::of_particles(surface, &nodes(sources), count, &settings).expect("a network")
}

#[test]
fn paths_on_a_roll_are_those_of_the_plane() {
    // Radius 0.3 + gap theta / (2 pi); arc length from where the radius would be 0.
    let growth: f64 = 0.1 / TAU;
    let arc = |r: f64| 0.5 * (r * r.hypot(growth) / growth + growth * (r / growth).asinh());
    let place = |[theta, z]: [f64; 2]| {
        let radius = 0.3 + growth * theta;
        let point = [radius * theta.cos(), radius * theta.sin(), z];
        (point, Vector::<2>::new(arc(radius), z))
    };
    let places = [[0.3, 0.2], [5.0, 0.8], [9.0, 0.4], [13.0, 0.9], [18.0, 0.1]].map(place);
    let geodesics = bounded("roll:0.3,0.1,3", &places.map(|p| p.0), 2000);
    assert!(geodesics.surface().classes().iter().all(|c| *c == 0));
    let sources = geodesics.surface().sources();
    let errors = geodesics.all_pairs(sources, &correction::Settings::default(), |[i, j], path| {
        (path.length / (places[i].1 - places[j].1).norm() - 1.0).abs()
    });
    assert!(
        errors.len() == 10 && errors.iter().all(|e| *e <= 1e-6),
        "{errors:?}"
    );
}

#[test]
fn both_ways_round_a_cylinder_are_found() {
    let angles = [[0.0, -1.0], [2.0, 0.5], [4.5, 1.2]];
    let geodesics = bounded(
        "cylinder:1",
        &angles.map(|[u, z]: [f64; 2]| [u.cos(), u.sin(), z]),
        800,
    );
    let sources = geodesics.surface().sources();
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let correct = correction::Settings::default();
        let found = geodesics.alternatives(&sources[i], &sources[j], &correct, 2);
        let turn = (angles[i][0] - angles[j][0]).abs();
        let height = angles[i][1] - angles[j][1];
        for turn in [turn, TAU - turn] {
            let truth = turn.hypot(height);
            let lengths = found.iter().map(|path| path.length);
            let errors: Vec<f64> = lengths.map(|l| (l / truth - 1.0).abs()).collect();
            assert!(errors.iter().any(|e| *e <= 1e-6), "{i} {j}: {errors:?}");
        }
    }
}
