//! Fields of distances on clouds and equations against known truth.

use std::f64::consts::PI;

use taut_compare::cases::Case;
use taut_compare::outline::Outline;
use taut_compare::shooting::Fan;
use taut_compare::surface::Torus;
use taut_compare::{closed_form, generate};
use taut_core::cloud::Cloud;
use taut_core::correction;
use taut_core::field::{Field, Fields, Settings, Source, Value};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;
use taut_core::surface::implicit::{Equation, ImplicitSurface};
use taut_core::{Matrix, Vector};

fn geodesics(points: &[[f64; 3]]) -> Geodesics<3, Atlas<3>> {
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
    Geodesics::of_atlas(Atlas::new(cloud, 2).expect("a surface"))
}

/// The field from some rows with their start values, at all points.
fn field(
    geodesics: &Geodesics<3, Atlas<3>>,
    rows: &[(usize, f64)],
    settings: &Settings,
) -> (Field<3>, Vec<Value<3>>) {
    let sources: Vec<_> = rows
        .iter()
        .map(|(row, start)| Source {
            node: geodesics.surface().node_of_row(*row).expect("a foot"),
            start: *start,
        })
        .collect();
    let fields = Fields::of_cloud(geodesics).expect("fields");
    let field = fields.from(&sources, settings).expect("a field");
    let values = fields.at_points(&field);
    (field, values)
}

/// Mean and largest relative error, and the share of errors within their estimates, of rows farther
/// than `near`.
fn judged(values: &[Value<3>], truth: &[(usize, f64)], near: f64) -> [f64; 3] {
    let (mut sum, mut most, mut covered, mut count) = (0.0, 0.0_f64, 0.0, 0.0);
    for (row, truth) in truth.iter().filter(|(_, truth)| *truth >= near) {
        let error = (values[*row].distance - truth).abs();
        sum += error / truth;
        most = most.max(error / truth);
        covered += f64::from(u8::from(error <= values[*row].error));
        count += 1.0;
    }
    [sum / count, most, covered / count]
}

#[test]
fn sphere() {
    let points = generate::sphere::<3>(10_000, 1.0, 1);
    let (field, values) = field(&geodesics(&points), &[(0, 0.0)], &Settings::default());
    let truth: Vec<_> = (1..points.len())
        .map(|i| (i, closed_form::sphere(1.0, &points[0], &points[i])))
        .collect();
    let [mean, most, covered] = judged(&values, &truth, 0.18);
    assert!(mean < 1e-6 && most < 3e-4, "{mean:e} {most:e}");
    assert!(covered > 0.98, "{covered}");
    assert_eq!((field.unreached_nodes(), field.carried_nodes()), (0, 0));
    let mut turned = 0.0;
    for (row, distance) in truth.iter().filter(|t| t.1 > 0.2 && t.1 < 3.0) {
        let [from, to] = [
            Vector::<3>::from(points[0]),
            Vector::<3>::from(points[*row]),
        ];
        let direction = (to * distance.cos() - from) / distance.sin();
        turned += (values[*row].direction - direction).norm() / points.len() as f64;
    }
    assert!(turned < 1e-3, "{turned:e}");
}

#[test]
fn torus() {
    let shape = Torus {
        major: 1.0,
        minor: 0.4,
    };
    let points = generate::torus(10_000, &shape, 1).points;
    let (_, values) = field(&geodesics(&points), &[(0, 0.0)], &Settings::default());
    let fan = Fan::new(&shape, points[0], 5.0);
    let truth: Vec<_> = (1..points.len())
        .step_by(20)
        .filter_map(|i| Some((i, fan.geodesics(points[i], 5.0).first()?.length)))
        .collect();
    assert!(truth.len() > 480);
    let [mean, most, covered] = judged(&values, &truth, 0.2);
    assert!(mean < 1e-5 && most < 1e-3, "{mean:e} {most:e}");
    assert!(covered > 0.98, "{covered}");
}

/// Surfaces whose rays draw together unevenly, to caustics: where those are, jets must not be
/// carried past them.
#[test]
fn beside_caustics_fields_neither_jump_nor_fall_short() {
    for (name, seed) in [("ellipsoid", 5), ("wavy", 6), ("peanut", 5)] {
        let case = Case::new(name, 5000, seed).expect("a case");
        let source = 17 * seed as usize;
        let geodesics = geodesics(&case.points);
        let (_, values) = field(&geodesics, &[(source, 0.0)], &Settings::default());
        let distances: Vec<f64> = values.iter().map(|value| value.distance).collect();
        let torn = case.jumps(&distances, 0.1);
        let truth = case.distances(source);
        let truth = (0..case.rows)
            .step_by(11)
            .filter_map(|row| Some((row, truth(row)?)));
        let [mean, most, covered] = judged(&values, &truth.collect::<Vec<_>>(), case.near());
        assert!(
            torn == 0 && mean < 1e-4 && most < 2e-3 && covered > 0.96,
            "{name} {torn} {mean:e} {most:e} {covered}"
        );
    }
}

/// In the shadow of edges, on outliers and on detail of few points, what is not known well is said.
#[test]
fn fields_err_by_what_they_claim() {
    let names = ["hole", "frustum", "outliers1", "outliers3", "torus"];
    for (name, seed) in names.into_iter().zip(31..) {
        let case = Case::new(name, 5000, seed).expect("a case");
        let geodesics = geodesics(&case.points);
        let source = 13 * seed as usize;
        let (_, values) = field(&geodesics, &[(source, 0.0)], &Settings::default());
        let truth = case.distances(source);
        let step = if name == "torus" { 17 } else { 3 };
        let rows = (0..case.rows).step_by(step);
        let known: Vec<_> = rows.filter_map(|row| Some((row, truth(row)?))).collect();
        let far = known.iter().filter(|(_, truth)| *truth >= case.near());
        let over = far.map(|(row, truth)| {
            let value = &values[*row];
            (value.distance - truth).abs() / value.error
        });
        let over = over.fold(0.0, f64::max);
        let [mean, _, covered] = judged(&values, &known, case.near());
        let most = if name == "hole" { 5e-3 } else { 1e-3 };
        assert!(
            mean < most && covered > 0.99 && over < 10.0,
            "{name} {mean:e} {covered} {over}"
        );
    }
}

/// Where a cloud ends is known to a spacing: paths that pass a rough rim say what the way round its
/// dents may add.
#[test]
fn paths_past_a_hole_err_by_what_they_claim() {
    let case = Case::new("hole", 20_000, 41).expect("a case");
    let geodesics = geodesics(&case.points);
    let source = 977;
    let truth = case.distances(source);
    let surface = geodesics.surface();
    let from = surface.node_of_row(source).expect("a foot");
    let (mut converged, mut past) = (0, 0);
    for row in (0..case.rows).step_by(97) {
        let to = surface.node_of_row(row).expect("a foot");
        let path = geodesics.path(&from, &to, &correction::Settings::default());
        let truth = truth(row).expect("a distance");
        let claim = path.length_error + path.surface_error;
        if path.converged() && truth >= case.near() {
            assert!(
                (path.length - truth).abs() <= claim + 1e-12,
                "{row} {claim:e}"
            );
            converged += 1;
            past += usize::from(claim > 1e-6);
        }
    }
    assert!(converged > 180 && past > 20, "{converged} {past}");
}

#[test]
fn roll_with_near_layers_is_not_joined() {
    let spacing = (4.0 / 10_000.0_f64).sqrt();
    let shape = generate::Roll {
        inner_radius: 15.0 * spacing,
        gap: 2.0 * spacing,
        turns: 1.9,
    };
    let sample = shape.random(10_000, 1);
    let (field, values) = field(
        &geodesics(&sample.points),
        &[(0, 0.0)],
        &Settings::default(),
    );
    let truth: Vec<_> = (1..sample.points.len())
        .map(|i| {
            (
                i,
                closed_form::sheet(&sample.parameters[0], &sample.parameters[i]),
            )
        })
        .collect();
    let [mean, most, covered] = judged(&values, &truth, 5.0 * spacing);
    assert!(mean < 1e-5 && most < 2e-2, "{mean:e} {most:e}");
    assert!(covered > 0.98, "{covered}");
    assert_eq!(field.unreached_nodes(), 0);
}

#[test]
fn several_sources_with_start_values() {
    let points = generate::sphere::<3>(10_000, 1.0, 1);
    let starts = [(0, 0.0), (17, 0.4), (4711, 0.1)];
    let (_, values) = field(&geodesics(&points), &starts, &Settings::default());
    for (i, value) in values.iter().enumerate() {
        let ways =
            starts.map(|(row, start)| start + closed_form::sphere(1.0, &points[row], &points[i]));
        let least = ways.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(
            (value.distance - least).abs() < 1e-4,
            "{i}: {value:?} {least}"
        );
        assert!(ways[value.source as usize] < least + 1e-4, "{i}: {value:?}");
    }
}

#[test]
fn what_is_not_connected_is_infinitely_far() {
    let mut points = generate::sphere::<3>(3_000, 1.0, 1);
    let other = generate::sphere::<3>(2_000, 0.5, 2);
    points.extend(other.iter().map(|[x, y, z]| [x + 5.0, *y, *z]));
    let (field, values) = field(&geodesics(&points), &[(0, 0.0)], &Settings::default());
    let unreached = values
        .iter()
        .filter(|value| value.distance == f64::INFINITY);
    assert_eq!(unreached.count(), 2_000);
    assert!(values[3_000..].iter().all(|value| value.source == u32::MAX));
    assert!(field.unreached_nodes() > 0);
}

#[test]
fn largest_distance_ends_the_field() {
    let points = generate::sphere::<3>(10_000, 1.0, 1);
    let geodesics = geodesics(&points);
    let settings = Settings {
        max_distance: 0.7,
        ..Settings::default()
    };
    let (_, values) = field(&geodesics, &[(5, 0.0)], &settings);
    for (i, value) in values.iter().enumerate() {
        let truth = closed_form::sphere(1.0, &points[5], &points[i]);
        if truth < 0.6999 {
            assert!(
                (value.distance - truth).abs() < 1e-4,
                "{i}: {value:?} {truth}"
            );
        } else if truth > 0.7001 {
            assert_eq!(value.distance, f64::INFINITY, "{i}: {truth}");
        }
    }
}

#[test]
fn same_bits_on_one_and_two_threads() {
    let points = generate::sphere::<3>(3_000, 1.0, 1);
    let geodesics = geodesics(&points);
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        pool.install(|| field(&geodesics, &[(0, 0.0), (9, 0.3)], &Settings::default()).1)
    });
    assert!(one == two);
}

/// Behind a hole rays bend round it: distances are as good as the points know where it is, and say
/// so.
#[test]
fn rays_bend_round_a_hole() {
    let sample = generate::plane_with_hole(10_000, 1.0, 0.4, 1);
    let (field, values) = field(
        &geodesics(&sample.points),
        &[(0, 0.0)],
        &Settings::default(),
    );
    assert_eq!((field.carried_nodes(), field.unreached_nodes()), (0, 0));
    let truth: Vec<_> = (1..sample.points.len())
        .map(|i| {
            let ends = (&sample.parameters[0], &sample.parameters[i]);
            (i, closed_form::plane_with_hole(0.4, ends.0, ends.1))
        })
        .collect();
    let [mean, most, covered] = judged(&values, &truth, 0.1);
    assert!(mean < 1e-3 && most < 0.05, "{mean:e} {most:e}");
    assert!(covered > 0.95, "{covered}");
}

/// Round sharp corners, which points leave uncertain by two or three spacings; nothing crosses a
/// notch.
#[test]
fn fields_go_round_notches() {
    let outline = Outline::notches();
    let sample = generate::plane(10_000, &outline, 1.0, 1);
    let (field, values) = field(
        &geodesics(&sample.points),
        &[(0, 0.0)],
        &Settings::default(),
    );
    assert_eq!(field.unreached_nodes(), 0);
    let places = &sample.parameters;
    let truth: Vec<_> = (1..places.len())
        .zip(outline.distances(places[0], &places[1..]))
        .collect();
    let [mean, most, covered] = judged(&values, &truth, 0.1);
    assert!(mean < 6e-3 && most < 0.06, "{mean:e} {most:e}");
    assert!(covered > 0.9, "{covered}");
}

/// The round hole lies between polygons within and round it.
#[test]
fn ways_round_polygons_enclose_those_round_a_circle() {
    let (corners, radius) = (24, 0.4);
    let around = |radius: f64| {
        let corner = |i: usize| {
            let (sin, cos) = (2.0 * PI * i as f64 / corners as f64).sin_cos();
            [radius * cos, radius * sin]
        };
        let hole = (0..corners).map(corner).collect();
        let square = Outline::rectangle([-1.0; 2], [1.0; 2]);
        Outline {
            rings: vec![square, hole],
        }
    };
    let outer = radius / (PI / corners as f64).cos();
    let sample = generate::plane_with_hole(300, 1.0, outer, 1);
    let places = &sample.parameters;
    let [less, more] =
        [radius, outer].map(|radius| around(radius).distances(places[0], &places[1..]));
    for ((less, more), place) in less.iter().zip(&more).zip(&places[1..]) {
        let truth = closed_form::plane_with_hole(radius, &places[0], place);
        let held = less - 1e-12 <= truth && truth <= more + 1e-12 && more - less < 0.02;
        assert!(held, "{less} {truth} {more}");
    }
}

#[test]
fn outliers_and_uneven_density() {
    let clean = generate::sphere::<3>(10_000, 1.0, 1);
    let mut strewn = clean.clone();
    strewn.extend(generate::outliers(&clean, 100, 5));
    let uneven = generate::uneven_sphere(10_000, 1.0, 20.0, 1);
    for (points, known, bar) in [(&strewn, &clean, 5e-3), (&uneven, &uneven, 1e-4)] {
        let (_, values) = field(&geodesics(points), &[(0, 0.0)], &Settings::default());
        let truth: Vec<_> = (1..known.len())
            .map(|i| (i, closed_form::sphere(1.0, &known[0], &known[i])))
            .collect();
        let [mean, _, covered] = judged(&values, &truth, 0.18);
        assert!(mean < bar && covered > 0.95, "{mean:e} {covered}");
    }
}

/// An outlier has the distance of its foot, and says how far it lies off. A value that stands for
/// missing data is such a point too.
#[test]
fn outliers_themselves_say_how_far_off_they_lie() {
    for seed in [31, 32] {
        let clean = generate::sphere::<3>(5_000, 1.0, seed);
        let mut strewn = clean.clone();
        strewn.extend(generate::outliers(&clean, 150, seed + 10));
        strewn.push([0.4, -0.2, -9999.0]);
        let (_, values) = field(&geodesics(&strewn), &[(0, 0.0)], &Settings::default());
        let (mut covered, mut nowhere, mut followed) = (0, 0, 0);
        let strays = clean.len()..strewn.len();
        for i in strays.clone() {
            let radius = strewn[i].iter().map(|x| x * x).sum::<f64>().sqrt();
            let foot = strewn[i].map(|x| x / radius);
            let truth = closed_form::sphere(1.0, &clean[0], &foot);
            let value = &values[i];
            nowhere += usize::from(value.distance.is_nan());
            covered += usize::from((value.distance - truth).abs() <= value.error + 1e-9);
            let off = (radius - 1.0).abs();
            // Charts may follow some outliers that lie together.
            followed += usize::from(off > 0.1 && value.error < 0.05);
        }
        assert!(
            covered + nowhere >= 146,
            "{covered} covered, {nowhere} nowhere"
        );
        assert!(followed <= 5, "{followed} followed");
        assert!(covered >= 100, "{covered}");
        let sentinel = &values[strewn.len() - 1];
        assert!(sentinel.distance.is_nan() || sentinel.error > 9_000.0);
    }
}

#[test]
fn equations_have_fields_too() {
    let sphere = ImplicitSurface::new(
        Equation(|x: &Vector<3>| (x.dot(x) - 1.0, x * 2.0, Matrix::<3>::identity() * 2.0)),
        1.0,
    );
    let pole = Vector::<3>::new(0.0, 0.0, 1.0);
    let corner = Vector::<3>::repeat(1.5);
    let bounds = Some((-corner, corner));
    let geodesics = Geodesics::of_implicit(sphere, &[pole], bounds).expect("a sampling");
    let node = |x: &Vector<3>| geodesics.surface().node_near(x).expect("a foot").0;
    let fields = Fields::new(&geodesics);
    let source = Source {
        node: node(&pole),
        start: 0.0,
    };
    let field = fields
        .from(&[source], &Settings::default())
        .expect("a field");
    for point in generate::sphere::<3>(500, 1.0, 3) {
        let value = fields.at(&field, &node(&point.into()));
        let truth = closed_form::sphere(1.0, &[0.0, 0.0, 1.0], &point);
        assert!(
            (value.distance - truth).abs() < 2e-4 * PI,
            "{value:?} {truth}"
        );
    }
}
