//! Logarithms, parallel transport and geodesics shot along a vector, against known geodesics.

use std::f64::consts::TAU;

use nalgebra::{SVector, Vector3};
use taut_compare::direction::{Geodesic, errors};
use taut_compare::generate;
use taut_compare::shooting::{Fan, shoot};
use taut_compare::surface::{Surface, Torus};
use taut_core::cloud::Cloud;
use taut_core::error::Error;
use taut_core::field::{Cost, Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

const TORUS: Torus = Torus {
    major: 1.0,
    minor: 0.4,
};

fn geodesics<const D: usize>(points: &[[f64; D]], dimension: usize) -> Geodesics<D, Atlas<D>> {
    let cloud = Cloud::<D>::new(points.as_flattened(), D).expect("a cloud");
    Geodesics::of_atlas(Atlas::new(cloud, dimension).expect("a surface"))
}

/// Means of the errors of position and transport, and the share of positions within their
/// estimates.
fn judged(points: &[[f64; 3]], truth: &[(usize, Geodesic)]) -> [f64; 3] {
    let geodesics = geodesics(points, 2);
    let fields = Fields::of_cloud(&geodesics).expect("fields");
    let node = geodesics.surface().node_of_row(0).expect("a foot");
    let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default());
    let field = field.expect("a field");
    let found = fields.logarithms(&field).expect("directions");
    let source = fields.source_tangents(&field, 0).expect("the source");
    let (mut sums, mut covered) = ([0.0; 2], 0.0);
    for (row, geodesic) in truth {
        let found = found[*row].expect("reached");
        let (position, transport) = errors(&found, &source, geodesic);
        sums[0] += position;
        sums[1] += transport.expect("no hole is in the way");
        covered += f64::from(u8::from(position * geodesic.length <= found.error));
    }
    let count = truth.len() as f64;
    [sums[0] / count, sums[1] / count, covered / count]
}

#[test]
fn logarithms_on_the_sphere() {
    let points = generate::sphere::<3>(5000, 1.0, 1);
    let truth: Vec<_> = (1..points.len())
        .map(|i| (i, Geodesic::of_sphere(&points[0], &points[i])))
        .filter(|truth| truth.1.length > 0.25)
        .collect();
    let [position, transport, covered] = judged(&points, &truth);
    assert!(
        position < 1e-4 && transport < 1e-4,
        "{position:e} {transport:e}"
    );
    assert!(covered > 0.98, "{covered}");
}

#[test]
fn logarithms_on_the_torus() {
    let points = generate::torus(10_000, &TORUS, 1).points;
    let fan = Fan::new(&TORUS, points[0], 5.0);
    let truth: Vec<_> = (1..points.len())
        .step_by(20)
        .filter_map(|i| {
            let shortest = *fan.geodesics(points[i], 5.0).first()?;
            let geodesic = Geodesic {
                length: shortest.length,
                tangents: [shortest.direction, shortest.arrival].map(Into::into),
                normals: [points[0], points[i]].map(|x| TORUS.normal(&x.into())),
            };
            (geodesic.length > 0.2).then_some((i, geodesic))
        })
        .collect();
    assert!(truth.len() > 480);
    let [position, transport, covered] = judged(&points, &truth);
    assert!(
        position < 1e-4 && transport < 2e-4,
        "{position:e} {transport:e}"
    );
    assert!(covered > 0.95, "{covered}");
}

/// The geodesic from row 0 along a vector: its end, the vector's tangential part, and that carried
/// to the end.
fn shot<const D: usize>(
    points: &[[f64; D]],
    dimension: usize,
    vector: [f64; D],
) -> [SVector<f64, D>; 3] {
    let geodesics = geodesics(points, dimension);
    let fields = Fields::new(&geodesics);
    let atlas = geodesics.surface();
    let node = atlas.node_of_row(0).expect("a foot");
    let settings = Settings {
        tolerance: 1e-8,
        ..Settings::default()
    };
    let found = fields.exponential(&node, &vector.into(), &settings);
    let found = found.expect("a geodesic");
    assert!(found.complete);
    let end = found.points.last().expect("an end") + atlas.cloud().centre;
    let length = found.arc_length.last().expect("a length");
    let ahead = |tangents: &SVector<f64, D>| tangents * *length;
    [
        end,
        ahead(&found.tangents.column(0).into_owned()),
        ahead(&found.transported.column(0).into_owned()),
    ]
}

/// Once and a half round, past both conjugate points.
#[test]
fn geodesics_go_on_round_spheres() {
    let points = generate::sphere::<3>(5000, 1.0, 1);
    let start = Vector3::from(points[0]);
    let aside = start.cross(&Vector3::new(0.3, -0.5, 0.8)).normalize();
    let [end, ahead, carried] = shot(&points, 2, (aside * (1.3 * TAU)).into());
    let (sin, cos) = (1.3 * TAU).sin_cos();
    assert!((end - (start * cos + aside * sin)).norm() < 1e-4);
    assert!((ahead - aside * (1.3 * TAU)).norm() < 1e-4);
    assert!((carried / (1.3 * TAU) - (aside * cos - start * sin)).norm() < 1e-4);
    let points = generate::sphere::<4>(20_000, 1.0, 1);
    let start = SVector::from(points[0]);
    let aside = SVector::from([-start[1], start[0], -start[3], start[2]]);
    let [end, ..] = shot(&points, 3, (aside * 4.0).into());
    let (sin, cos) = 4.0_f64.sin_cos();
    assert!((end - (start * cos + aside * sin)).norm() < 1e-3);
}

#[test]
fn geodesics_on_the_torus_end_where_clairaut_says() {
    let points = generate::torus(10_000, &TORUS, 1).points;
    let [normal, first] = [
        TORUS.normal(&points[0].into()),
        Vector3::new(0.6, 0.2, -0.7),
    ];
    let along = (first - normal * first.dot(&normal)).normalize();
    let [end, ..] = shot(&points, 2, (along * 3.0).into());
    let truth = Vector3::from(shoot(&TORUS, points[0], along.into(), 3.0));
    assert!((end - truth).norm() < 1e-3, "{:e}", (end - truth).norm());
}

#[test]
fn what_has_no_direction_is_refused() {
    let points = generate::sphere::<3>(1000, 1.0, 1);
    let geodesics = geodesics(&points, 2);
    let node = geodesics.surface().node_of_row(0).expect("a foot");
    let fields = Fields::new(&geodesics);
    let away = Vector3::from(points[0]);
    for vector in [Vector3::zeros(), Vector3::new(f64::NAN, 0.0, 0.0)] {
        let found = fields.exponential(&node, &vector, &Settings::default());
        assert!(matches!(found, Err(Error::NoFoot { .. })), "{vector}");
    }
    let costs = Fields::with_cost(&geodesics, &Cost::default()).expect("costs");
    let found = costs.exponential(&node, &away, &Settings::default());
    assert!(matches!(found, Err(Error::NoDirections)));
    let source = Source { node, start: 0.0 };
    let field = costs
        .from(&[source], &Settings::default())
        .expect("a field");
    assert!(matches!(costs.logarithms(&field), Err(Error::NoDirections)));
}
