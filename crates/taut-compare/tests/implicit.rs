//! Surfaces given by equations: layers near each other, extents, many dimensions, and what stays
//! unknown.

use taut_compare::generate::{self, Roll};
use taut_compare::{closed_form, generate::Sample};
use taut_core::Vector;
use taut_core::correction::Settings;
use taut_core::field::{Fields, Source};
use taut_core::geodesics::Geodesics;
use taut_core::guess::sampling::{Extent, Sampled};
use taut_core::result::{Path, Status};
use taut_core::surface::implicit::{Equations, ImplicitSurface};
use taut_core::surface::shapes::Shape;
use taut_formula::Formula;

type Ready<const D: usize, E> = Geodesics<D, Sampled<D, E>>;

fn path<const D: usize, E: Equations<D>>(
    geodesics: &Ready<D, E>,
    from: [f64; D],
    to: [f64; D],
) -> Path<D> {
    let [from, to] = [from, to].map(|x| {
        let node = geodesics.surface().node_near(&Vector::from(x));
        node.expect("a foot").0
    });
    geodesics.path(&from, &to, &Settings::default())
}

fn of_formula(
    equation: &str,
    seeds: &[[f64; 3]],
    bounds: Option<[[f64; 3]; 2]>,
) -> Ready<3, Formula> {
    let formula = Formula::parse(&[equation], Some(3)).expect("an equation");
    let seeds: Vec<Vector<3>> = seeds.iter().map(|seed| Vector::from(*seed)).collect();
    let bounds = bounds.map(|[low, high]| (Vector::from(low), Vector::from(high)));
    let surface = ImplicitSurface::new(formula, 1.0);
    Geodesics::of_implicit(surface, &seeds, bounds).expect("a surface")
}

fn expect(path: &Path<3>, truth: f64) {
    assert_eq!(path.status, Status::Converged, "truth {truth}");
    let error = (path.length - truth).abs();
    assert!(error <= 1e-6 * truth, "{} for {truth}", path.length);
    // The truth is rounded too.
    assert!(error <= path.length_error + 1e-13, "{error:e}");
}

/// The roll of an equation, sampled from two of its points; with random points and where they lie
/// on its sheet.
fn roll(gap: f64, points: usize, seed: u64) -> (Ready<3, Shape>, Sample<3>) {
    let roll = Roll {
        inner_radius: 0.3,
        gap,
        turns: 7.0,
    };
    let sample = roll.random(points, seed);
    let shape = Shape::parse(&format!("roll:0.3,{gap},7")).expect("a shape");
    let (low, high) = shape.region();
    let slack = 0.01 * shape.size();
    let low = Vector::from_fn(|i, _| low[i] - slack);
    let high = Vector::from_fn(|i, _| high[i] + slack);
    let seeds = [0, 1].map(|i| Vector::from(sample.points[i]));
    let surface = ImplicitSurface::new(shape.clone(), shape.size());
    let geodesics = Geodesics::of_implicit(surface, &seeds, Some((low, high)));
    (geodesics.expect("a surface"), sample)
}

fn on_sheet(sample: &Sample<3>, i: usize, j: usize) -> f64 {
    closed_form::sheet(&sample.parameters[i], &sample.parameters[j])
}

#[test]
fn paths_on_a_roll_stay_on_their_layer() {
    for (gap, seed) in [(0.1, 41), (0.03, 42)] {
        let (geodesics, sample) = roll(gap, 80, seed);
        for i in (0..80).step_by(2) {
            let found = path(&geodesics, sample.points[i], sample.points[i + 1]);
            expect(&found, on_sheet(&sample, i, i + 1));
        }
    }
}

#[test]
fn a_field_on_a_roll_follows_the_sheet() {
    let (geodesics, sample) = roll(0.065, 300, 43);
    let fields = Fields::new(&geodesics);
    let node = |i: usize| {
        let point = Vector::from(sample.points[i]);
        geodesics.surface().node_near(&point).expect("a foot").0
    };
    let source = Source {
        node: node(0),
        start: 0.0,
    };
    let field = fields.from(&[source], &Default::default());
    let field = field.expect("a field");
    let (mut sum, mut covered) = (0.0, 0);
    for i in 1..300 {
        let value = fields.at(&field, &node(i));
        let truth = on_sheet(&sample, 0, i);
        let error = (value.distance - truth).abs();
        assert!(error < 1e-2 * truth, "{} for {truth}", value.distance);
        sum += error / truth;
        covered += usize::from(error <= value.error);
    }
    assert!(sum / 299.0 < 1e-5, "{:e}", sum / 299.0);
    assert!(covered >= 297, "{covered}");
}

#[test]
fn thin_shells_are_kept_apart() {
    for radius in [1.02, 1.001] {
        let equation = format!("(x^2+y^2+z^2-1)*(x^2+y^2+z^2-{})", radius * radius);
        let points = generate::sphere::<3>(60, 1.0, 44);
        let outer = |i: usize| points[i].map(|x| radius * x);
        let geodesics = of_formula(&equation, &[points[0], outer(1)], None);
        assert_eq!(geodesics.surface().extent(), Extent::Whole);
        assert_eq!(geodesics.component_sizes().len(), 2);
        for i in (0..60).step_by(2) {
            let truth = closed_form::sphere(1.0, &points[i], &points[i + 1]);
            expect(&path(&geodesics, points[i], points[i + 1]), truth);
            expect(&path(&geodesics, outer(i), outer(i + 1)), radius * truth);
            let across = path(&geodesics, points[i], outer(i + 1));
            assert_eq!(across.status, Status::NoPath);
        }
    }
}

#[test]
fn extents_are_found() {
    // The seed says nothing of how large the sphere is.
    for radius in [1.0, 40.0] {
        let points = generate::sphere::<3>(400, radius, 45);
        let equation = format!("x^2+y^2+z^2={}", radius * radius);
        let geodesics = of_formula(&equation, &points[..1], None);
        assert_eq!(geodesics.surface().extent(), Extent::Whole);
        let fields = Fields::new(&geodesics);
        let node = |i: usize| {
            let point = Vector::from(points[i]);
            geodesics.surface().node_near(&point).expect("a foot").0
        };
        let source = Source {
            node: node(0),
            start: 0.0,
        };
        let field = fields.from(&[source], &Default::default());
        let field = field.expect("a field");
        for i in 1..400 {
            let value = fields.at(&field, &node(i));
            let truth = closed_form::sphere(radius, &points[0], &points[i]);
            let error = (value.distance - truth).abs();
            assert!(error < 1e-3 * truth, "{} for {truth}", value.distance);
        }
    }
}

#[test]
fn surfaces_without_end_are_said_to_be() {
    let geodesics = of_formula("x^2+y^2=1", &[[1.0, 0.0, 0.0], [0.0, 1.0, 5.0]], None);
    assert_eq!(geodesics.surface().extent(), Extent::Endless);
    let truth = (0.25 * std::f64::consts::TAU).hypot(5.0);
    expect(&path(&geodesics, [1.0, 0.0, 0.0], [0.0, 1.0, 5.0]), truth);
    // The other of two sheets without end may be joined to the first anywhere beyond.
    let geodesics = of_formula("x^2-y^2-z^2=1", &[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], None);
    let across = path(&geodesics, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    assert_eq!(across.status, Status::Unknown);
    assert!(across.length.is_nan());
    // A field on the one sheet is none the coarser for it; the meridian is a hyperbola, its length
    // by the midpoint rule.
    let fields = Fields::new(&geodesics);
    let node = |x: f64, y: f64| {
        let point = Vector::from([x, y, 0.0]);
        geodesics.surface().node_near(&point).expect("a foot").0
    };
    let source = Source {
        node: node(1.0, 0.0),
        start: 0.0,
    };
    let settings = taut_core::field::Settings {
        max_distance: 2.0,
        ..Default::default()
    };
    let field = fields.from(&[source], &settings);
    let field = field.expect("a field");
    let step = 0.75_f64.asinh() / 1000.0;
    let speed = |i: u32| {
        let t = step * (f64::from(i) + 0.5);
        step * t.sinh().hypot(t.cosh())
    };
    let truth: f64 = (0..1000).map(speed).sum();
    let value = fields.at(&field, &node(1.25, 0.75));
    let error = (value.distance - truth).abs();
    assert!(error < 1e-3 && error <= value.error, "{}", value.distance);
    assert!(fields.at(&field, &node(-1.25, 0.75)).distance.is_nan());
}

/// A way over a place without a tangent plane is not sure, and no reason to say that there is none.
fn expect_doubt(path: &Path<3>, truth: f64) {
    match path.status {
        Status::NotResolved | Status::NotTaut => {
            let error = (path.length - truth).abs();
            assert!(error <= 1e-3 * truth, "{} for {truth}", path.length);
            assert!(error <= 20.0 * path.length_error, "{error:e}");
        }
        status => assert_eq!(status, Status::Unknown),
    }
}

#[test]
fn ways_over_points_without_a_tangent_plane_are_not_denied() {
    // From one nappe to the other the only way leads through the apex.
    let geodesics = of_formula(
        "x^2+y^2=z^2",
        &[[0.6, 0.0, 0.6], [0.0, 0.5, -0.5]],
        Some([[-1.0; 3], [1.0; 3]]),
    );
    let through = path(&geodesics, [0.6, 0.0, 0.6], [0.0, 0.5, -0.5]);
    expect_doubt(&through, 1.1 * 2.0_f64.sqrt());
    let around = path(&geodesics, [0.6, 0.0, 0.6], [0.0, 0.6, 0.6]);
    let slant = 0.6 * 2.0_f64.sqrt();
    let turn = 0.25 * std::f64::consts::TAU * 0.5_f64.sqrt();
    expect(&around, 2.0 * slant * (0.5 * turn).sin());
    // Over an edge of an octahedron: by symmetry through its point that is nearest to both ends.
    let [from, to] = [[0.3, 0.3, 0.4], [-0.3, 0.3, 0.4]];
    let geodesics = of_formula("abs(x)+abs(y)+abs(z)=1", &[from, to], None);
    let over = path(&geodesics, from, to);
    expect_doubt(&over, 2.0 * (0.09_f64 + 0.15 * 0.15 * 2.0).sqrt());
}

#[test]
fn nothing_that_crosses_a_crease_claims_an_error() {
    let points: Vec<[f64; 3]> = generate::sphere::<3>(80, 1.0, 61)
        .into_iter()
        .map(|x| x.map(|v| v / x.iter().map(|v| v.abs()).sum::<f64>()))
        .collect();
    let is_one_face = |a: &[f64; 3], b: &[f64; 3]| (0..3).all(|i| a[i] * b[i] > 0.0);
    let chord = |a: &[f64; 3], b: &[f64; 3]| (Vector::from(*a) - Vector::from(*b)).norm();
    let geodesics = of_formula("abs(x)+abs(y)+abs(z)=1", &points, None);
    let mut over = 0;
    for pair in points.chunks(2) {
        let found = path(&geodesics, pair[0], pair[1]);
        if is_one_face(&pair[0], &pair[1]) {
            expect(&found, chord(&pair[0], &pair[1]));
        } else {
            over += 1;
            assert_ne!(found.status, Status::Converged, "{pair:?}");
            assert!(found.length_error == f64::INFINITY, "{pair:?}");
        }
    }
    assert!(over > 20);
    let fields = Fields::new(&geodesics);
    let node = |x: &[f64; 3]| {
        let node = geodesics.surface().node_near(&Vector::from(*x));
        node.expect("a foot").0
    };
    let source = Source {
        node: node(&points[0]),
        start: 0.0,
    };
    let field = fields.from(&[source], &Default::default());
    let field = field.expect("a field");
    for point in &points[1..] {
        let value = fields.at(&field, &node(point));
        if is_one_face(&points[0], point) {
            let error = (value.distance - chord(&points[0], point)).abs();
            assert!(error <= value.error + 1e-13, "{point:?} {error:e}");
            assert!(value.error < 1e-3, "{point:?} {:e}", value.error);
        } else {
            assert!(value.distance.is_nan() || value.error == f64::INFINITY);
        }
    }
}

/// The point of a cone of the given half angle at an angle about its axis and a slant length.
fn on_cone(half: f64, angle: f64, slant: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    [cos * half.sin(), sin * half.sin(), half.cos()].map(|v| v * slant)
}

#[test]
fn the_shorter_way_past_a_tip_is_found_and_its_error_is_claimed() {
    for (half, seed) in [(0.5, 62), (1.0, 63), (1.4, 64)] {
        let shape = Shape::parse(&format!("cone:{half}")).expect("a shape");
        let seeds: Vec<Vector<3>> = shape
            .seeds()
            .iter()
            .map(|seed| Vector::from_column_slice(seed))
            .collect();
        let region = shape.region();
        let [low, high] = [region.0, region.1].map(|x| Vector::<3>::from_column_slice(&x));
        let surface = ImplicitSurface::new(shape.clone(), shape.size());
        let slack = Vector::repeat(0.01 * shape.size());
        let geodesics = Geodesics::of_implicit(surface, &seeds, Some((low - slack, high + slack)));
        let geodesics = geodesics.expect("a surface");
        let ends = generate::cone(60, half, 1.0, seed).parameters;
        let turns = generate::cone(30, half, 1.0, seed + 10).parameters;
        let mut covered = 0;
        for (pair, turn) in ends.chunks(2).zip(&turns) {
            // Nearly opposite: both ways round the tip are nearly as long.
            let around = 0.9 * std::f64::consts::PI + 0.1 * turn[0];
            let slants = [pair[0][1], pair[1][1]].map(|slant| 0.2 + 0.7 * slant);
            let from = on_cone(half, pair[0][0], slants[0]);
            let to = on_cone(half, pair[0][0] + around, slants[1]);
            let found = path(&geodesics, from, to);
            let truth = closed_form::cone(half, &from, &to);
            let error = (found.length - truth).abs();
            assert_eq!(found.status, Status::Converged, "{half} {truth}");
            assert!(error <= 1e-6 * truth, "{half} {} for {truth}", found.length);
            covered += usize::from(error <= found.length_error + 1e-13);
        }
        assert!(covered >= 29, "{half}: {covered} of 30");
    }
}

/// Pairs of random points of an ellipsoid in R^N, in vectors of size D.
fn ellipsoid_pairs<const N: usize, const D: usize>(semi_axes: [f64; N], pairs: usize, seed: u64) {
    let list = semi_axes.map(|axis| axis.to_string()).join(",");
    let shape = Shape::parse(&format!("ellipsoid:{list}")).expect("a shape");
    let points: Vec<Vector<D>> = generate::sphere::<N>(2 * pairs, 1.0, seed)
        .iter()
        .map(|u| Vector::from_fn(|i, _| u.get(i).map_or(0.0, |u| u * semi_axes[i])))
        .collect();
    let surface = ImplicitSurface::new(shape.clone(), shape.size());
    let geodesics = Geodesics::of_implicit(surface, &points[..2], None).expect("a surface");
    let is_round = semi_axes.iter().all(|axis| *axis == semi_axes[0]);
    for pair in points.chunks(2) {
        let [there, back] = [[0, 1], [1, 0]].map(|[i, j]| {
            let found = path(&geodesics, pair[i].into(), pair[j].into());
            assert_eq!(found.status, Status::Converged, "{list} {:?}", pair[i]);
            found.length
        });
        let truth = if is_round {
            closed_form::sphere(semi_axes[0], pair[0].as_slice(), pair[1].as_slice())
        } else {
            back
        };
        assert!((there - truth).abs() <= 2e-6 * truth, "{there} {truth}");
    }
}

#[test]
fn many_dimensions_are_walked() {
    ellipsoid_pairs::<5, 9>([3.0, 2.0, 1.0, 1.0, 1.0], 8, 46);
    ellipsoid_pairs::<8, 9>([1.3; 8], 8, 47);
    ellipsoid_pairs::<9, 9>([1.0, 1.2, 3.0, 2.5, 1.7, 2.2, 1.1, 2.9, 1.4], 8, 48);
}
