//! Isolines against known truth.

use std::f64::consts::{PI, TAU};

use taut_compare::surface::Torus;
use taut_compare::{closed_form, generate};
use taut_core::Vector;
use taut_core::cloud::Cloud;
use taut_core::error::Error;
use taut_core::field::{Cost, Fields, Isoline, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

fn geodesics(points: &[[f64; 3]]) -> Geodesics<3, Atlas<3>> {
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
    Geodesics::of_atlas(Atlas::new(cloud, 2).expect("a surface"))
}

/// Isolines about rows of a cloud, in its coordinates.
fn isolines(
    points: &[[f64; 3]],
    rows: &[usize],
    levels: &[f64],
    cost: Option<&Cost>,
) -> Vec<Isoline<3>> {
    let geodesics = geodesics(points);
    let surface = geodesics.surface();
    let fields = match cost {
        Some(cost) => Fields::with_cost(&geodesics, cost),
        None => Fields::of_cloud(&geodesics),
    };
    let fields = fields.expect("fields");
    let source = |row: &usize| Source {
        node: surface.node_of_row(*row).expect("a foot"),
        start: 0.0,
    };
    let sources: Vec<_> = rows.iter().map(source).collect();
    let field = fields
        .from(&sources, &Settings::default())
        .expect("a field");
    let mut lines = fields.isolines(&field, levels).expect("isolines");
    for point in lines.iter_mut().flat_map(|line| &mut line.points) {
        *point += surface.cloud().centre;
    }
    lines
}

fn length(line: &Isoline<3>) -> f64 {
    line.points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// The largest difference between the true distance of a vertex and its line's level.
fn worst(lines: &[Isoline<3>], truth: impl Fn(&[f64; 3]) -> f64) -> f64 {
    let off = |line: &Isoline<3>| {
        let off = |p: &Vector<3>| (truth(&[p.x, p.y, p.z]) - line.level).abs();
        line.points.iter().map(off).fold(0.0, f64::max)
    };
    lines.iter().map(off).fold(0.0, f64::max)
}

/// Two circles that grow into each other: kinks on the bisector, where their fronts meet, and one
/// line from then on.
#[test]
fn lines_of_two_sources_meet_on_the_bisector() {
    let mut points = generate::sphere::<3>(10_000, 1.0, 1);
    points[0] = [0.0, 0.0, 1.0];
    points[1] = [0.6, 0.0, 0.8];
    let levels = [0.02, 0.1, 0.3, 0.4, 0.7, 2.0];
    let lines = isolines(&points, &[0, 1], &levels, None);
    let distance = |p: &[f64; 3]| {
        let to = |i: usize| closed_form::sphere(1.0, &points[i], p);
        to(0).min(to(1))
    };
    assert!(worst(&lines, distance) < 1e-4);
    assert!(lines.iter().all(|line| line.closed));
    let count = |level| lines.iter().filter(|line| line.level == level).count();
    assert_eq!(levels.map(count), [2, 2, 2, 1, 1, 1]);
    // From a source the other's arc is hidden behind the bisector, at half the angle between them.
    let half = 0.5 * 0.6_f64.asin();
    for line in lines
        .iter()
        .filter(|line| line.level > 0.3 && line.level < 1.0)
    {
        let d = line.level;
        let hidden = (half.tan() / d.tan()).acos();
        let truth = 2.0 * (TAU - 2.0 * hidden) * d.sin();
        assert!((length(line) / truth - 1.0).abs() < 2e-3, "{d} {truth}");
    }
}

/// Circles of the unrolled plane.
#[test]
fn lines_on_a_cylinder_end_at_its_rims() {
    let points = generate::cylinder(10_000, 1.0, 4.0, 3).points;
    let unrolled = |p: &[f64; 3]| {
        let turn = |p: &[f64; 3]| p[1].atan2(p[0]);
        let around = (turn(p) - turn(&points[0])).rem_euclid(TAU);
        around.min(TAU - around).hypot(p[2] - points[0][2])
    };
    let edge = points.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let top = points
        .iter()
        .map(|p| p[2])
        .fold(f64::NEG_INFINITY, f64::max);
    let height = (points[0][2] - edge).min(top - points[0][2]);
    let levels = [0.9 * height, height + 0.3];
    let lines = isolines(&points, &[0], &levels, None);
    assert!(worst(&lines, unrolled) < 1e-4);
    let (inner, rest) = lines.split_first().expect("lines");
    assert!(inner.closed);
    assert!((length(inner) / (TAU * levels[0]) - 1.0).abs() < 2e-3);
    assert!(!rest.is_empty());
    for line in rest {
        assert!(!line.closed);
        for end in [line.points.first(), line.points.last()] {
            let z = end.expect("a vertex").z;
            assert!((z - edge).min(top - z) < 0.1, "{z}");
        }
    }
}

/// A disc, then a band round the tube with two edges.
#[test]
fn lines_on_a_torus_are_as_many_as_the_edges_of_what_they_enclose() {
    let shape = Torus {
        major: 1.0,
        minor: 0.4,
    };
    let mut points = generate::torus(20_000, &shape, 1).points;
    points[0] = [1.4, 0.0, 0.0];
    let tube = 0.4 * PI;
    let lines = isolines(&points, &[0], &[0.6 * tube, 0.95 * tube, 1.3 * tube], None);
    let levels: Vec<f64> = lines.iter().map(|line| line.level / tube).collect();
    assert_eq!(levels.len(), 4, "{levels:?}");
    assert!(lines.iter().all(|line| line.closed && line.miss < 1e-3));
    assert!((length(&lines[2]) / length(&lines[3]) - 1.0).abs() < 1e-3);
}

#[test]
fn lines_of_costs_are_circles_of_the_cost() {
    let mut points = generate::sphere::<3>(10_000, 1.0, 1);
    points[0] = [0.0, 0.0, 1.0];
    let cost = Cost {
        at_rows: vec![2.0; points.len()],
        ..Cost::default()
    };
    let lines = isolines(&points, &[0], &[1.0, 3.0, 5.0], Some(&cost));
    assert_eq!(lines.len(), 3);
    let distance = |p: &[f64; 3]| 2.0 * closed_form::sphere(1.0, &points[0], p);
    assert!(worst(&lines, distance) < 0.015);
    assert!(lines.iter().all(|line| line.closed));
}

#[test]
fn surfaces_of_other_dimensions_have_no_isolines() {
    let points = generate::sphere::<4>(500, 1.0, 1);
    let cloud = Cloud::<4>::new(points.as_flattened(), 4).expect("a cloud");
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 3).expect("a surface"));
    let fields = Fields::new(&geodesics);
    let node = geodesics.surface().node_of_row(0).expect("a foot");
    let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default());
    let found = fields.isolines(&field.expect("a field"), &[0.5]);
    assert!(matches!(found, Err(Error::NoIsolines { dimension: 3 })));
}
