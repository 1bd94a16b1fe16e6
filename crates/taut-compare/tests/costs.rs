//! Fields of least cost and fields in other dimensions than 2 against known truth.

use taut_compare::cost::{Norm, linear_speed, refraction, wall_with_gap};
use taut_compare::{closed_form, generate};
use taut_core::cloud::Cloud;
use taut_core::error::Error;
use taut_core::field::{Cost, Fields, Settings, Slope, Source, Value};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

const POINTS: usize = 5_000;

fn values<const D: usize>(
    points: &[[f64; D]],
    dimension: usize,
    cost: Option<&Cost>,
) -> Vec<Value<D>> {
    let cloud = Cloud::<D>::new(points.as_flattened(), D).expect("a cloud");
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, dimension).expect("a surface"));
    let fields = match cost {
        Some(cost) => Fields::with_cost(&geodesics, cost).expect("costs"),
        None => Fields::new(&geodesics),
    };
    let node = geodesics.surface().node_of_row(0).expect("a foot");
    let source = Source { node, start: 0.0 };
    let field = fields.from(&[source], &Settings::default());
    fields.at_points(&field.expect("a field"))
}

/// Random points of the square [-1, 1]^2, the first at `source`, and lifted to z = tilt x.
fn square(source: [f64; 2], tilt: f64) -> (Vec<[f64; 2]>, Vec<[f64; 3]>) {
    let mut places = generate::plane_with_hole(POINTS, 1.0, 0.0, 1).parameters;
    places[0] = source;
    let points = places.iter().map(|[x, y]| [*x, *y, tilt * x]).collect();
    (places, points)
}

/// Mean relative error and the share covered by their estimates, of points at least `near` away.
fn judged<const D: usize>(
    values: &[Value<D>],
    near: f64,
    truth: impl Fn(usize) -> f64,
) -> [f64; 2] {
    let (mut sum, mut covered, mut count) = (0.0, 0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let truth = truth(i);
        assert_eq!(truth.is_finite(), value.distance.is_finite(), "{i}");
        if truth.is_finite() && truth >= near {
            let error = (value.distance - truth).abs();
            sum += error / truth;
            covered += f64::from(u8::from(error <= value.error));
            count += 1.0;
        }
    }
    [sum / count, covered / count]
}

fn at_rows(places: &[[f64; 2]], rate: impl Fn([f64; 2]) -> f64) -> Cost {
    Cost {
        at_rows: places.iter().map(|place| rate(*place)).collect(),
        ..Cost::default()
    }
}

#[test]
fn three_sphere() {
    let points = generate::sphere::<4>(POINTS, 1.0, 1);
    let values = values(&points, 3, None);
    let truth = |i: usize| closed_form::sphere(1.0, &points[0], &points[i]);
    let [mean, covered] = judged(&values, 0.8, truth);
    assert!(mean < 1e-4, "{mean:e}");
    assert!(covered > 0.95, "{covered}");
}

#[test]
fn circle() {
    let points: Vec<[f64; 3]> = (0..400)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 400.0).sin_cos();
            [2.0 * cos, 2.0 * sin, 0.0]
        })
        .collect();
    let values = values(&points, 1, None);
    let truth = |i: usize| closed_form::sphere(2.0, &points[0], &points[i]);
    let [mean, covered] = judged(&values, 0.1, truth);
    assert!(mean < 1e-6, "{mean:e}");
    assert!(covered > 0.95, "{covered}");
}

#[test]
fn constant_cost_is_a_multiple_of_the_distance() {
    let points = generate::sphere::<3>(POINTS, 1.0, 1);
    let cost = Cost {
        at_rows: vec![3.0; POINTS],
        ..Cost::default()
    };
    let values = values(&points, 2, Some(&cost));
    let truth = |i: usize| 3.0 * closed_form::sphere(1.0, &points[0], &points[i]);
    let [mean, covered] = judged(&values, 0.75, truth);
    assert!(mean < 2e-3, "{mean:e}");
    assert!(covered > 0.8, "{covered}");
}

#[test]
fn speed_growing_linearly() {
    let (places, points) = square([-0.6, -0.5], 0.0);
    let cost = at_rows(&places, |[x, _]| 1.0 / (1.0 + 0.5 * x));
    let values = values(&points, 2, Some(&cost));
    let [mean, covered] = judged(&values, 0.15, |i| linear_speed(0.5, places[0], places[i]));
    assert!(mean < 5e-4, "{mean:e}");
    assert!(covered > 0.95, "{covered}");
}

#[test]
fn refraction_by_the_law_of_snell() {
    let (places, points) = square([-0.4, -0.5], 0.0);
    let cost = at_rows(&places, |[_, y]| if y < 0.0 { 1.0 } else { 2.0 });
    let values = values(&points, 2, Some(&cost));
    let truth = |i: usize| refraction([1.0, 2.0], places[0], places[i]);
    let [mean, covered] = judged(&values, 0.15, truth);
    assert!(mean < 1.5e-2, "{mean:e}");
    assert!(covered > 0.9, "{covered}");
}

#[test]
fn slopes_cost_more_uphill_and_zigzags_less() {
    let tilt = 0.5;
    let (places, points) = square([-0.1, 0.2], tilt);
    let cost = Cost {
        slope: Slope::Factors { up: 4.0, down: 1.0 },
        ..Cost::default()
    };
    let values = values(&points, 2, Some(&cost));
    let norm = Norm::new(|[x, y]| {
        let (run, rise) = (x.hypot(y), tilt * x);
        let grade = rise / run;
        run.hypot(rise) * (1.0 + 4.0 * grade.max(0.0) + (-grade).max(0.0))
    });
    let off = |i: usize| [0, 1].map(|a| places[i][a] - places[0][a]);
    let [mean, covered] = judged(&values, 0.15, |i| norm.cost(off(i)));
    assert!(mean < 1e-2, "{mean:e}");
    assert!(covered > 0.75, "{covered}");
}

#[test]
fn nothing_passes_a_wall_but_by_its_gap() {
    let (half, gap) = (0.1, [0.2, 0.5]);
    let (places, points) = square([-0.3, -0.6], 0.0);
    let inside = |[x, y]: [f64; 2]| y.abs() <= half && !(x >= gap[0] && x <= gap[1]);
    let cost = at_rows(&places, |p| if inside(p) { f64::INFINITY } else { 1.0 });
    let values = values(&points, 2, Some(&cost));
    let truth = |i: usize| {
        if inside(places[i]) {
            f64::INFINITY
        } else {
            wall_with_gap(half, gap, places[0], places[i])
        }
    };
    let [mean, covered] = judged(&values, 0.15, truth);
    assert!(mean < 1.5e-2, "{mean:e}");
    assert!(covered > 0.9, "{covered}");
}

#[test]
fn costs_that_are_none_are_refused() {
    let points = generate::sphere::<3>(500, 1.0, 1);
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2).expect("a surface"));
    let error = |at_rows: Vec<f64>, slope| {
        let cost = Cost {
            at_rows,
            slope,
            ..Cost::default()
        };
        Fields::with_cost(&geodesics, &cost).err()
    };
    let mut negative = vec![1.0; 500];
    negative[7] = -2.0;
    let (row, found) = (7, -2.0);
    let refused = error(negative, Slope::Level);
    assert_eq!(refused, Some(Error::BadCost { row, found }));
    let (found, expected) = (3, 500);
    let refused = error(vec![1.0; 3], Slope::Level);
    assert_eq!(refused, Some(Error::WrongCosts { found, expected }));
    let (up, down) = (-1.0, 0.0);
    let refused = error(Vec::new(), Slope::Factors { up, down });
    assert_eq!(refused, Some(Error::BadSlope { found: up }));
}
