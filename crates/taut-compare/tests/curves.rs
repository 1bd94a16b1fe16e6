//! Distances from curves against known truth.

use std::f64::consts::{PI, TAU};

use taut_compare::outline::Outline;
use taut_compare::{closed_form, generate};
use taut_core::cloud::Cloud;
use taut_core::error::Error;
use taut_core::field::{Cost, Curve, Fields, Settings, Value, least};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::{Atlas, ChartIndex};
use taut_core::surface::implicit::{Equation, ImplicitSurface};
use taut_core::{Matrix, Vector};

fn geodesics(points: &[[f64; 3]]) -> Geodesics<3, Atlas<3>> {
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
    Geodesics::of_atlas(Atlas::new(cloud, 2).expect("a surface"))
}

/// The curve through the feet of some points.
fn curve(
    fields: &Fields<'_, 3, Atlas<3>>,
    geodesics: &Geodesics<3, Atlas<3>>,
    vertices: &[[f64; 3]],
) -> Curve<3, ChartIndex> {
    let node = |x: &[f64; 3]| {
        geodesics
            .surface()
            .node_near(&Vector::from(*x))
            .expect("a foot")
    };
    let nodes: Vec<_> = vertices.iter().map(node).collect();
    fields.curve(&nodes).expect("a curve")
}

/// The distances of all points of a cloud from a curve.
fn values(points: &[[f64; 3]], vertices: &[[f64; 3]]) -> Vec<Value<3>> {
    let geodesics = geodesics(points);
    let fields = Fields::of_cloud(&geodesics).expect("fields");
    let curve = curve(&fields, &geodesics, vertices);
    let field = fields.from(&curve, &Settings::default()).expect("a field");
    fields.at_points(&field)
}

struct Judged {
    /// Mean relative error of what is at least five spacings away.
    mean: f64,
    /// Largest error of all.
    most: f64,
    /// Share of errors within their estimates.
    covered: f64,
}

/// None is negative, none that should not be is 0, all are of the one source.
fn judged(values: &[Value<3>], spacing: f64, truth: impl Fn(usize) -> f64) -> Judged {
    let (mut sum, mut count, mut most, mut covered) = (0.0, 0.0, 0.0_f64, 0.0);
    for (i, value) in values.iter().enumerate() {
        let truth = truth(i);
        assert!(
            value.distance > 0.0 || truth < 1e-6,
            "{i}: {value:?} {truth}"
        );
        assert_eq!(value.source, 0, "{i}");
        let error = (value.distance - truth).abs();
        most = most.max(error);
        covered += f64::from(u8::from(error <= value.error + 1e-12)) / values.len() as f64;
        if truth >= 5.0 * spacing {
            sum += error / truth;
            count += 1.0;
        }
    }
    let mean = sum / count;
    println!("mean {mean:.2e}, most {most:.2e}, covered {covered:.3}");
    Judged {
        mean,
        most,
        covered,
    }
}

/// Distance of points in the plane from a polyline.
fn off_polyline(vertices: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let edge = |ends: &[[f64; 2]]| {
        let [[ax, ay], [bx, by]] = [ends[0], ends[1]];
        let (dx, dy) = (bx - ax, by - ay);
        let share = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy);
        let share = share.clamp(0.0, 1.0);
        (x - ax - share * dx).hypot(y - ay - share * dy)
    };
    vertices.windows(2).map(edge).fold(f64::INFINITY, f64::min)
}

/// A point of the unit sphere.
fn on_sphere(latitude: f64, longitude: f64) -> [f64; 3] {
    let ((sin, cos), (y, x)) = (latitude.sin_cos(), longitude.sin_cos());
    [cos * x, cos * y, sin]
}

/// Some vertices of the equator, from longitude 0 on.
fn equator(count: usize, to: f64) -> Vec<[f64; 3]> {
    let longitude = |i: usize| to * i as f64 / (count - 1) as f64;
    (0..count).map(|i| on_sphere(0.0, longitude(i))).collect()
}

const SPACING: f64 = 0.035;

#[test]
fn equator_of_a_sphere() {
    let points = generate::sphere::<3>(10_000, 1.0, 1);
    let mut vertices = equator(9, TAU);
    vertices[8] = vertices[0];
    let values = values(&points, &vertices);
    let found = judged(&values, SPACING, |i| points[i][2].asin().abs());
    assert!(found.mean < 1e-5 && found.most < 1e-3);
    assert!(found.covered > 0.95);
    for (value, point) in values.iter().zip(&points) {
        let away = value.direction.z * point[2].signum();
        assert!(point[2].abs() > 0.95 || away > 0.0, "{value:?} {point:?}");
    }
}

/// Distance of a point of the unit sphere from the equator's part from longitude 0 to `to`.
fn off_arc(to: f64, [x, y, z]: [f64; 3]) -> f64 {
    let longitude = y.atan2(x).rem_euclid(TAU);
    if longitude <= to {
        return z.asin().abs();
    }
    let end = |at: f64| (x * at.cos() + y * at.sin()).clamp(-1.0, 1.0).acos();
    end(0.0).min(end(to))
}

#[test]
fn open_arc_on_a_sphere() {
    let points = generate::sphere::<3>(10_000, 1.0, 1);
    let values = values(&points, &equator(2, 0.5 * PI));
    let found = judged(&values, SPACING, |i| off_arc(0.5 * PI, points[i]));
    assert!(found.mean < 1e-4 && found.most < 2e-3);
    assert!(found.covered > 0.95);
}

/// A polyline that turns by a right angle, the other way by an obtuse one, and back.
const POLYLINE: [[f64; 2]; 5] = [
    [-0.5, -0.4],
    [0.1, -0.4],
    [0.1, 0.3],
    [0.5, 0.6],
    [0.45, 0.1],
];

/// A flat square of side 2 with that in it: points by their places and in space.
fn flat() -> (Vec<[f64; 2]>, Vec<[f64; 3]>) {
    let rings = vec![Outline::rectangle([-1.0; 2], [1.0; 2])];
    let outline = Outline { rings };
    let sample = generate::plane(10_000, &outline, 1.0, 1);
    (sample.parameters, sample.points)
}

#[test]
fn polyline_in_the_plane() {
    let (places, points) = flat();
    let lifted: Vec<_> = POLYLINE.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
    let values = values(&points, &lifted);
    let found = judged(&values, 0.02, |i| off_polyline(&POLYLINE, places[i]));
    assert!(found.mean < 1e-4 && found.most < 5e-3);
    assert!(found.covered > 0.95);
    for (i, value) in values.iter().enumerate() {
        let truth = off_polyline(&POLYLINE, places[i]);
        let near = truth < 0.02;
        assert!(
            !near || (value.distance - truth).abs() < 1e-8,
            "{i}: {value:?} {truth}"
        );
    }
}

#[test]
fn ring_round_a_cylinder() {
    let sample = generate::cylinder(10_000, 1.0, 2.0, 1);
    let middle = 0.5 * sample.points.iter().map(|p| p[2]).fold(0.0, f64::max);
    let ring = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / 6.0).sin_cos();
        [cos, sin, middle]
    };
    let mut vertices: Vec<_> = (0..7).map(ring).collect();
    vertices[6] = vertices[0];
    let values = values(&sample.points, &vertices);
    let found = judged(&values, 0.035, |i| (sample.points[i][2] - middle).abs());
    assert!(found.mean < 1e-5 && found.most < 1e-3);
    assert!(found.covered > 0.95);
}

#[test]
fn curves_on_an_equation() {
    let sphere = ImplicitSurface::new(
        Equation(|x: &Vector<3>| (x.dot(x) - 1.0, x * 2.0, Matrix::<3>::identity() * 2.0)),
        1.0,
    );
    let corner = Vector::<3>::repeat(1.5);
    let pole = Vector::<3>::new(0.0, 0.0, 1.0);
    let geodesics = Geodesics::of_implicit(sphere, &[pole], Some((-corner, corner)));
    let geodesics = geodesics.expect("a sampling");
    let node = |x: &[f64; 3]| {
        let x = Vector::from(*x);
        geodesics.surface().node_near(&x).expect("a foot").0
    };
    let fields = Fields::new(&geodesics);
    let vertices: Vec<_> = equator(3, 2.0).iter().map(node).collect();
    let curve = fields.curve(&vertices).expect("a curve");
    assert!((curve.length() - 2.0).abs() < 1e-6 && !curve.is_closed());
    let field = fields.from(&curve, &Settings::default()).expect("a field");
    let points = generate::sphere::<3>(1000, 1.0, 3);
    let values: Vec<_> = points.iter().map(|x| fields.at(&field, &node(x))).collect();
    let found = judged(&values, 0.05, |i| off_arc(2.0, points[i]));
    assert!(found.mean < 2e-4 && found.most < 5e-3);
    assert!(found.covered > 0.95);
    assert_eq!(
        fields.logarithm(&field, &vertices[0]),
        Err(Error::NoDirections)
    );
}

/// By a march over the points: noise makes the cloud rough.
#[test]
fn noise_and_costs() {
    let clean = generate::sphere::<3>(10_000, 1.0, 1);
    let noisy = generate::radial_noise(&clean, 2e-3, 2);
    let noisy_values = values(&noisy, &equator(2, 0.5 * PI));
    let found = judged(&noisy_values, SPACING, |i| off_arc(0.5 * PI, clean[i]));
    assert!(found.mean < 1e-2);

    let (places, points) = flat();
    let geodesics = geodesics(&points);
    let cost = Cost {
        at_rows: vec![2.0; points.len()],
        ..Cost::default()
    };
    let fields = Fields::with_cost(&geodesics, &cost).expect("costs");
    let lifted: Vec<_> = POLYLINE.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
    let curve = curve(&fields, &geodesics, &lifted);
    let field = fields.from(&curve, &Settings::default()).expect("a field");
    let values = fields.at_points(&field);
    let found = judged(&values, 0.02, |i| 2.0 * off_polyline(&POLYLINE, places[i]));
    assert!(found.mean < 1e-2);
}

#[test]
fn curves_that_are_none_are_refused() {
    let mut points = generate::sphere::<3>(3_000, 1.0, 1);
    let other = generate::sphere::<3>(2_000, 0.5, 2);
    points.extend(other.iter().map(|[x, y, z]| [x + 5.0, *y, *z]));
    let geodesics = geodesics(&points);
    let fields = Fields::of_cloud(&geodesics).expect("fields");
    let nodes = [0, 7, 4000].map(|row| geodesics.surface().node_of_row(row).expect("a foot"));
    let reason = "no-path";
    let refused = Error::NoEdge { edge: 1, reason };
    assert_eq!(fields.curve(&nodes).err(), Some(refused));
    assert_eq!(fields.curve(&[]).err(), Some(Error::NoSources));
    // A vertex alone is a point, also where it is repeated.
    let point = fields.curve(&[nodes[1]; 3]).expect("a point");
    assert!(point.length() == 0.0 && !point.is_closed());
    let field = fields.from(&point, &Settings::default()).expect("a field");
    assert!(fields.at(&field, &nodes[1]).distance < 1e-9);

    let solid = generate::sphere::<4>(2_000, 1.0, 1);
    let cloud = Cloud::<4>::new(solid.as_flattened(), 4).expect("a cloud");
    let solid = Geodesics::of_atlas(Atlas::new(cloud, 3).expect("a surface"));
    let node = solid.surface().node_of_row(0).expect("a foot");
    let refused = Fields::new(&solid).curve(&[node]).err();
    assert_eq!(refused, Some(Error::NoCurves { dimension: 3 }));
}

#[test]
fn same_bits_on_one_and_two_threads() {
    let points = generate::sphere::<3>(3_000, 1.0, 1);
    let vertices = [
        on_sphere(0.0, 0.0),
        on_sphere(0.8, 1.0),
        on_sphere(-0.3, 2.0),
    ];
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        pool.install(|| values(&points, &vertices))
    });
    assert!(one == two);
}

/// Behind a hole: truth by the nearest of many points of the curve.
#[test]
fn ways_from_curves_bend_round_a_hole() {
    let sample = generate::plane_with_hole(10_000, 1.0, 0.4, 1);
    let values = values(&sample.points, &[[-0.7, -0.5, 0.0], [-0.7, 0.2, 0.0]]);
    let from = |p: &[f64; 2]| {
        let places = (0..=700).map(|i| [-0.7, -0.5 + 1e-3 * f64::from(i)]);
        let ways = places.map(|q| closed_form::plane_with_hole(0.4, &q, p));
        ways.fold(f64::INFINITY, f64::min)
    };
    let found = judged(&values, 0.02, |i| from(&sample.parameters[i]));
    assert!(found.mean < 1e-3 && found.most < 0.03);
    assert!(found.covered > 0.9);
}

/// The lines about a straight edge are stadiums, also where they lie between it and the points
/// beside it.
#[test]
fn isolines_about_an_edge() {
    let (_, points) = flat();
    let geodesics = geodesics(&points);
    let fields = Fields::of_cloud(&geodesics).expect("fields");
    let edge = curve(&fields, &geodesics, &[[-0.3, 0.0, 0.0], [0.3, 0.1, 0.0]]);
    let field = fields.from(&edge, &Settings::default()).expect("a field");
    for level in [0.003, 0.03, 0.2] {
        let lines = fields.isolines(&field, &[level]).expect("lines");
        assert_eq!(lines.len(), 1, "{level}");
        let steps = lines[0].points.windows(2);
        let length: f64 = steps.map(|ends| (ends[1] - ends[0]).norm()).sum();
        let truth = 2.0 * edge.length() + TAU * level;
        assert!(lines[0].closed, "{level}");
        assert!(
            (length / truth - 1.0).abs() < 2e-3,
            "{level} {length} {truth}"
        );
    }
}

/// The nearest points have the values of the whole field, and lengths scale with the input.
#[test]
fn nearest_and_large() {
    let points = generate::sphere::<3>(5_000, 1.0, 1);
    let large: Vec<_> = points.iter().map(|x| x.map(|x| 1e6 * x)).collect();
    let vertices = [
        on_sphere(0.1, 0.0),
        on_sphere(0.8, 1.0),
        on_sphere(-0.3, 2.0),
    ];
    let far = vertices.map(|x| x.map(|x| 1e6 * x));
    let whole = values(&points, &vertices);
    for (value, large) in whole.iter().zip(&values(&large, &far)) {
        let off = (large.distance - 1e6 * value.distance).abs();
        assert!(off < 1e-3 * (1.0 + large.distance), "{value:?} {large:?}");
    }
    let geodesics = geodesics(&points);
    let fields = Fields::of_cloud(&geodesics).expect("fields");
    let curve = curve(&fields, &geodesics, &vertices);
    let near = fields
        .nearest(&curve, 300, &Settings::default())
        .expect("a field");
    let near = fields.at_points(&near);
    let distances: Vec<f64> = whole.iter().map(|value| value.distance).collect();
    assert!(near.iter().any(|value| value.distance.is_infinite()));
    for i in least(&distances, 300) {
        let off = (near[i].distance - distances[i]).abs();
        assert!(
            off <= 1e-3 * near[i].error,
            "{i}: {:?} {:?}",
            near[i],
            whole[i]
        );
    }
}

/// Distance of a point of the unit sphere from a polyline of arcs of great circles.
fn off_arcs(vertices: &[[f64; 3]], point: &[f64; 3]) -> f64 {
    let x = Vector::<3>::from(*point);
    let edge = |ends: &[[f64; 3]]| {
        let [a, b] = [Vector::<3>::from(ends[0]), Vector::<3>::from(ends[1])];
        let normal = a.cross(&b).normalize();
        if normal.cross(&a).dot(&x) >= 0.0 && b.cross(&normal).dot(&x) >= 0.0 {
            return normal.dot(&x).abs().asin();
        }
        let end = |end: Vector<3>| 2.0 * (0.5 * (end - x).norm()).asin();
        end(a).min(end(b))
    };
    vertices.windows(2).map(edge).fold(f64::INFINITY, f64::min)
}

/// Circles of latitude by more vertices than there are points beside them, and by fewer.
#[test]
fn dense_vertices_of_a_round_curve() {
    let points = generate::sphere::<3>(10_000, 1.0, 1);
    for (latitude, count) in [(0.5, 600), (0.0, 100), (0.5, 70), (0.5, 30)] {
        let vertex = |i: usize| on_sphere(latitude, TAU * i as f64 / count as f64);
        let mut vertices: Vec<_> = (0..=count).map(vertex).collect();
        vertices[count] = vertices[0];
        let values = values(&points, &vertices);
        let found = judged(&values, SPACING, |i| off_arcs(&vertices, &points[i]));
        // Beside the focus ways from everywhere meet.
        assert!(found.mean < 1e-3 && found.most < 0.1);
        assert!(found.covered > 0.95);
    }
}
