//! Surfaces fitted to clouds: how near they pass, their sides, and what a file keeps of them.

use std::f64::consts::TAU;

use taut_core::Vector;
use taut_core::cloud::Cloud;
use taut_core::correction::Settings;
use taut_core::error::Error;
use taut_core::field::{self, Fields, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::Node;
use taut_core::surface::atlas::{Atlas, Fit, FitSettings, Model};

/// Uniform deviates from a fixed linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn sphere(count: usize, radius: f64) -> Vec<[f64; 3]> {
    let mut random = Random(3);
    let mut point = || {
        let (z, angle) = (2.0 * random.next() - 1.0, TAU * random.next());
        let across = (1.0 - z * z).sqrt();
        [across * angle.cos(), across * angle.sin(), z].map(|v| radius * v)
    };
    (0..count).map(|_| point()).collect()
}

/// Even on a torus of radii 1 and 0.4.
fn torus(count: usize) -> Vec<[f64; 3]> {
    let mut random = Random(4);
    let mut points = Vec::new();
    while points.len() < count {
        let (u, v) = (TAU * random.next(), TAU * random.next());
        let across = 1.0 + 0.4 * v.cos();
        if 1.4 * random.next() < across {
            points.push([across * u.cos(), across * u.sin(), 0.4 * v.sin()]);
        }
    }
    points
}

fn fit(points: &[[f64; 3]], settings: &FitSettings<'_>) -> (Atlas<3>, Fit) {
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
    Atlas::fit(cloud, 2, settings).expect("a surface")
}

fn within(accuracy: f64) -> FitSettings<'static> {
    FitSettings {
        accuracy: Some(accuracy),
        ..FitSettings::default()
    }
}

fn value(atlas: &Atlas<3>, x: [f64; 3]) -> f64 {
    atlas.level(&Vector::from(x)).expect("one normal").value
}

#[test]
fn points_lie_within_the_accuracy_and_fewer_charts_serve_a_larger_one() {
    let points = torus(10_000);
    let mut charts = Vec::new();
    for accuracy in [1e-4, 1e-3, 1e-2] {
        let (atlas, fit) = fit(&points, &within(accuracy));
        assert_eq!((fit.beyond, fit.contradictions), (0, 0));
        assert!(fit.residual <= fit.largest_residual && fit.largest_residual <= accuracy);
        charts.push(atlas.report().charts);
    }
    assert!(charts.is_sorted_by(|a, b| a > b), "{charts:?}");
    assert!(charts[2] * 3 < charts[0], "{charts:?}");
}

#[test]
fn the_function_has_one_sign_on_each_side() {
    let (atlas, _) = fit(&torus(10_000), &within(1e-3));
    let mut random = Random(8);
    let mut coordinate = |most: f64| most * (2.0 * random.next() - 1.0);
    let mut inside = 0;
    for _ in 0..20_000 {
        let x = [coordinate(2.0), coordinate(2.0), coordinate(1.0)];
        let distance = (x[0].hypot(x[1]) - 1.0).hypot(x[2]) - 0.4;
        if distance.abs() > 1e-3 {
            inside += usize::from(distance < 0.0);
            assert!(value(&atlas, x) * distance > 0.0, "{x:?} at {distance}");
        }
    }
    assert!(inside > 1000);
}

#[test]
fn derivatives_are_those_of_the_function() {
    let (atlas, _) = fit(&torus(10_000), &within(1e-3));
    let step = 1e-6;
    let mut random = Random(9);
    for _ in 0..200 {
        let (u, v) = (TAU * random.next(), TAU * random.next());
        let r = 0.4 + 0.02 * (random.next() - 0.5);
        let across = 1.0 + r * v.cos();
        let x = Vector::<3>::from([across * u.cos(), across * u.sin(), r * v.sin()]);
        let level = atlas.level(&x).expect("one normal");
        assert!(level.charted && !level.beyond_rim);
        for axis in 0..3 {
            let mut shifted = [x, x];
            shifted[0][axis] -= step;
            shifted[1][axis] += step;
            let [before, after] = shifted.map(|x| atlas.level(&x).expect("one normal"));
            let slope = (after.value - before.value) / (2.0 * step);
            assert!((slope - level.gradient[axis]).abs() < 1e-6);
            let slopes = (after.gradient - before.gradient) / (2.0 * step);
            assert!((slopes - level.hessian.column(axis)).amax() < 1e-4);
        }
        let steepness = level.gradient.norm();
        assert!((steepness - 1.0).abs() < 0.1, "{steepness} at {x:?}");
    }
}

#[test]
fn paths_on_the_model_are_true_to_the_surface() {
    let points = sphere(10_000, 1.0);
    let (atlas, fit) = fit(&points, &within(1e-4));
    let geodesics = Geodesics::of_atlas(atlas);
    assert_eq!(geodesics.component_sizes().len(), 1);
    for i in 0..40 {
        let [a, b] = [points[31 * i], points[9_999 - 17 * i]].map(Vector::<3>::from);
        let truth = a.angle(&b);
        let ends = [a, b].map(|x| geodesics.surface().node_near(&x).expect("a foot"));
        let path = geodesics.path(&ends[0], &ends[1], &Settings::default());
        let error = (path.length - truth).abs();
        assert!(path.converged(), "pair {i}");
        // A height of h over the whole way changes an arc of radius 1 by h times its angle.
        assert!(error <= (2.0 + truth) * fit.accuracy, "pair {i}: {error}");
    }
}

#[test]
fn normals_say_which_side_is_which_and_are_counted_where_they_do_not_agree() {
    let points = sphere(3_000, 1.0);
    let mut normals: Vec<f64> = points.iter().flatten().map(|v| -2.0 * v).collect();
    for row in 0..7 {
        normals[3 * row..3 * row + 3].copy_from_slice(&points[row]);
    }
    normals[300..303].fill(f64::NAN);
    let inwards = FitSettings {
        normals: Some(&normals),
        ..within(1e-3)
    };
    let (atlas, fit) = fit(&points, &inwards);
    assert_eq!((fit.normals_against, fit.contradictions), (7, 0));
    assert!(value(&atlas, [0.0, 0.0, 1.5]) < 0.0 && value(&atlas, [0.0, 0.0, 0.5]) > 0.0);
    let (atlas, fit) = self::fit(&points, &within(1e-3));
    assert_eq!(fit.normals_against, 0);
    assert!(value(&atlas, [0.0, 0.0, 1.5]) > 0.0 && value(&atlas, [0.0, 0.0, 0.5]) < 0.0);
}

#[test]
fn a_moebius_strip_has_no_two_sides() {
    let mut random = Random(5);
    let points: Vec<[f64; 3]> = (0..8_000)
        .map(|_| {
            let (angle, width) = (TAU * random.next(), 0.3 * (2.0 * random.next() - 1.0));
            let across = 1.0 + width * (0.5 * angle).cos();
            let height = width * (0.5 * angle).sin();
            [across * angle.cos(), across * angle.sin(), height]
        })
        .collect();
    let (_, fit) = fit(&points, &within(1e-3));
    assert!(fit.contradictions > 0);
}

#[test]
fn an_open_surface_says_where_it_ends() {
    let points: Vec<_> = sphere(12_000, 1.0)
        .into_iter()
        .filter(|x| x[2] > 0.0)
        .collect();
    let (atlas, _) = fit(&points, &within(1e-3));
    let rim = atlas.report().rim_length;
    assert!((0.8..1.5).contains(&(rim / TAU)), "rim {rim}");
    let level = |x: [f64; 3]| atlas.level(&Vector::from(x)).expect("one normal");
    assert!(!level([0.6, 0.0, 0.8]).beyond_rim);
    let tilt: f64 = -0.08;
    assert!(level([tilt.cos(), 0.0, tilt.sin()]).beyond_rim);
}

#[test]
fn a_scaled_cloud_has_the_scaled_surface() {
    let (atlas, one) = fit(&sphere(3_000, 1.0), &FitSettings::default());
    let (scaled, other) = fit(&sphere(3_000, 1024.0), &FitSettings::default());
    assert_eq!(atlas.report().charts, scaled.report().charts);
    assert!((other.residual / one.residual / 1024.0 - 1.0).abs() < 1e-9);
    let x = [0.7, -0.5, 0.6];
    let ratio = value(&scaled, x.map(|v| 1024.0 * v)) / value(&atlas, x);
    assert!((ratio / 1024.0 - 1.0).abs() < 1e-9);
}

#[test]
fn a_model_is_the_same_surface_to_the_last_bit() {
    let points: Vec<_> = torus(6_000).into_iter().filter(|x| x[0] > -1.2).collect();
    let (atlas, _) = fit(&points, &within(1e-3));
    let model = atlas.to_model();
    let kept = Atlas::<3>::from_model(&model).expect("a model");
    assert_eq!(kept.to_model(), model);
    assert!(atlas.has_points() && !kept.has_points());
    let ends = [[1.4, 0.0, 0.0], [-0.5, 0.5, 0.3]].map(Vector::<3>::from);
    let path = |atlas: Atlas<3>| {
        let nodes = ends.map(|x| atlas.node_near(&x).expect("a foot"));
        Geodesics::of_atlas(atlas).path(&nodes[0], &nodes[1], &Settings::default())
    };
    let (one, other) = (path(atlas), path(kept));
    assert!(one.converged());
    assert_eq!(
        (one.length.to_bits(), one.points),
        (other.length.to_bits(), other.points)
    );
}

#[test]
fn models_that_contradict_themselves_are_refused() {
    let (atlas, _) = fit(&sphere(2_000, 1.0), &within(1e-2));
    let good = atlas.to_model();
    let refused = |spoil: &dyn Fn(&mut taut_core::surface::atlas::Model)| {
        let mut model = good.clone();
        spoil(&mut model);
        match Atlas::<3>::from_model(&model).err() {
            Some(Error::BadModel { chart, .. }) => chart,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(&|m| m.header.ambient_dimension = 4), None);
    assert_eq!(refused(&|m| m.header.intrinsic_dimension = 3), None);
    assert_eq!(refused(&|m| m.header.centre[0] = f64::NAN), None);
    assert_eq!(refused(&|m| m.charts.clear()), None);
    assert_eq!(refused(&|m| m.charts[1].origin[2] = f64::INFINITY), Some(1));
    assert_eq!(refused(&|m| m.charts[2].frame[0][0] += 1e-3), Some(2));
    assert_eq!(refused(&|m| m.charts[2].frame.truncate(2)), Some(2));
    assert_eq!(refused(&|m| m.charts[0].radius = 0.0), Some(0));
    assert_eq!(refused(&|m| m.charts[0].degree = 5), Some(0));
    assert_eq!(
        refused(&|m| m.charts[3].coefficients[0].truncate(1)),
        Some(3)
    );
    assert_eq!(refused(&|m| m.charts[0].neighbours[1] = 1_000_000), Some(0));
    assert_eq!(
        refused(&|m| m.charts[0].neighbours.resize(9_999, 0)),
        Some(0)
    );
    assert_eq!(refused(&|m| m.charts[4].sides[0] = i8::MIN), Some(4));
    // What made fields on files of 8 KB take gigabytes: charts at one place, heights magnified,
    // supports without end.
    assert_eq!(
        refused(&|m| m.charts.iter_mut().for_each(|c| c.origin.fill(1e-42))),
        Some(0)
    );
    assert_eq!(refused(&|m| m.charts[1].scale *= 0.01), Some(1));
    assert_eq!(refused(&|m| m.charts[2].radius = f64::MAX), Some(2));
    assert_eq!(refused(&|m| m.charts[2].spacing = 1e6), Some(2));
    assert_eq!(refused(&|m| m.charts[3].coefficients[0][0] = 0.1), Some(3));
    assert_eq!(refused(&|m| m.charts[3].coefficients[0][5] = 1e9), Some(3));
    assert_eq!(refused(&|m| m.charts[0].neighbours.swap(1, 3)), Some(0));
    assert_eq!(refused(&|m| m.header.detail = 1e-30), None);
}

#[test]
fn an_accuracy_that_is_no_length_is_refused() {
    let points = sphere(500, 1.0);
    for found in [0.0, -1.0, f64::INFINITY] {
        let cloud = Cloud::<3>::new(points.as_flattened(), 3).expect("a cloud");
        let refused = Atlas::fit(cloud, 2, &within(found)).err();
        assert_eq!(refused, Some(Error::BadAccuracy { found }));
    }
}

/// The model of a fit, as a file keeps it.
fn model(points: &[[f64; 3]], accuracy: f64) -> Geodesics<3, Atlas<3>> {
    let (atlas, _) = fit(points, &within(accuracy));
    let kept = Atlas::<3>::from_model(&atlas.to_model()).expect("a model");
    Geodesics::of_atlas(kept)
}

/// Distances from a point of a model to others: what the field says, its error, and the truth.
fn distances(
    geodesics: &Geodesics<3, Atlas<3>>,
    points: &[[f64; 3]],
    from: usize,
    step: usize,
    truth: impl Fn(usize, &Node<3, u32>, &Node<3, u32>) -> f64,
) -> Vec<[f64; 3]> {
    let node = |i: usize| {
        let point = Vector::from(points[i]);
        geodesics.surface().node_near(&point).expect("a foot")
    };
    let source = node(from);
    let fields = Fields::of_cloud(geodesics).expect("a surface");
    let start = Source {
        node: source,
        start: 0.0,
    };
    let field = fields
        .from(&[start], &field::Settings::default())
        .expect("a field");
    let others = (0..points.len()).step_by(step).filter(|i| *i != from);
    others
        .map(|i| {
            let value = fields.at(&field, &node(i));
            [value.distance, value.error, truth(i, &source, &node(i))]
        })
        .collect()
}

/// Mean relative error, the share covered by the estimates (and `known`), and the worst error over
/// its claim.
fn judged(found: &[[f64; 3]], known: f64) -> [f64; 3] {
    let count = found.len() as f64;
    let off = |[distance, _, truth]: &[f64; 3]| (distance - truth).abs();
    let mean = found.iter().map(|f| off(f) / f[2]).sum::<f64>() / count;
    let ratios = found.iter().map(|f| off(f) / (f[1] + known));
    let covered = ratios.clone().filter(|ratio| *ratio <= 1.0).count() as f64 / count;
    [mean, covered, ratios.fold(0.0, f64::max)]
}

/// r = 1 + 0.1 sin 4x sin(3y + 1) sin 4z over the unit sphere.
fn wavy(count: usize) -> Vec<[f64; 3]> {
    let sphere = sphere(count, 1.0).into_iter();
    let moved = sphere.map(|p| {
        let wave = (4.0 * p[0]).sin() * (3.0 * p[1] + 1.0).sin() * (4.0 * p[2]).sin();
        p.map(|v| v * (1.0 + 0.1 * wave))
    });
    moved.collect()
}

#[test]
fn fields_on_models_agree_with_paths_on_them() {
    // Charts of half a radius of curvature, on which rays erred by up to 29 %.
    for (points, accuracy) in [
        (wavy(8_000), 3e-3),
        (torus(8_000), 3e-3),
        (torus(8_000), 3e-5),
    ] {
        let geodesics = model(&points, accuracy);
        for from in [17, 4_001] {
            let truth = |_: usize, a: &Node<3, u32>, b: &Node<3, u32>| {
                let path = geodesics.path(a, b, &Settings::default());
                assert!(path.converged());
                path.length
            };
            let found = distances(&geodesics, &points, from, 97, truth);
            let [mean, covered, worst] = judged(&found, 1e-6);
            assert!(mean < 2e-4, "mean {mean}");
            assert!(covered >= 0.95 && worst <= 20.0, "{covered} {worst}");
        }
    }
}

#[test]
fn fields_on_models_are_true_to_the_surface() {
    let points = sphere(6_000, 1.0);
    for accuracy in [1e-2, 1e-3, 1e-5] {
        let geodesics = model(&points, accuracy);
        for from in [5, 2_222] {
            let truth = |i: usize, _: &Node<3, u32>, _: &Node<3, u32>| {
                Vector::<3>::from(points[from]).angle(&Vector::from(points[i]))
            };
            let found = distances(&geodesics, &points, from, 11, truth);
            // The model itself lies off the sphere by the accuracy at most.
            let [mean, covered, worst] = judged(&found, 3.0 * accuracy);
            assert!(mean < 1e-4 + accuracy, "{accuracy}: mean {mean}");
            assert!(covered >= 0.98 && worst <= 2.0, "{covered} {worst}");
        }
    }
}

/// A sheet of width 0.5 rolled up along r = b angle, layers 0.065 apart, on a jittered grid, with
/// the place of each point on it.
fn roll() -> (Vec<[f64; 3]>, Vec<[f64; 2]>) {
    let b = 0.065 / TAU;
    let arc = |angle: f64| 0.5 * b * (angle * angle.hypot(1.0) + angle.asinh());
    let mut random = Random(6);
    let (mut points, mut places) = (Vec::new(), Vec::new());
    let mut angle = 5.0 * TAU;
    while angle < 9.0 * TAU {
        let step = 0.02 / (b * angle);
        for row in 0..25 {
            let along = angle + step * random.next();
            let z = 0.02 * (f64::from(row) + random.next());
            points.push([b * along * along.cos(), b * along * along.sin(), z]);
            places.push([arc(along), z]);
        }
        angle += step;
    }
    (points, places)
}

#[test]
fn points_of_a_rolled_model_stay_on_their_layer() {
    let (points, places) = roll();
    // Charts are up to ten times as wide as layers are apart.
    for accuracy in [1e-3, 8e-3] {
        let geodesics = model(&points, accuracy);
        let atlas = geodesics.surface();
        let nodes: Vec<_> = points
            .iter()
            .map(|x| atlas.node_near(&Vector::from(*x)).expect("a foot"))
            .collect();
        for (i, (node, x)) in nodes.iter().zip(&points).enumerate() {
            let moved = (node.point + atlas.cloud().centre - Vector::from(*x)).norm();
            assert!(moved <= 2.0 * accuracy, "point {i} moved by {moved}");
            assert!(moved <= atlas.farthest_point(node.place), "point {i}");
        }
        for i in 0..40 {
            let [a, b] = [
                (i * 7_919) % points.len(),
                (i * 104_729 + 13) % points.len(),
            ];
            let truth = (places[a][0] - places[b][0]).hypot(places[a][1] - places[b][1]);
            let path = geodesics.path(&nodes[a], &nodes[b], &Settings::default());
            let error = (path.length - truth).abs();
            assert!(
                path.converged() && error <= 3.0 * accuracy,
                "pair {i}: {error}"
            );
        }
    }
    // A point between two layers is farther off than the model's points are.
    let geodesics = model(&points, 1e-3);
    let between = Vector::<3>::from([6.5 * 0.065, 0.0, 0.25]);
    let node = geodesics.surface().node_near(&between).expect("a foot");
    let moved = (node.point + geodesics.surface().cloud().centre - between).norm();
    assert!((moved - 0.0325).abs() < 3e-3, "{moved}");
    assert!(moved > geodesics.surface().farthest_point(node.place));
}

/// All the numbers of a model.
fn numbers(model: &mut Model) -> Vec<&mut f64> {
    let mut numbers = vec![&mut model.header.detail];
    for chart in &mut model.charts {
        numbers.extend(&mut chart.origin);
        numbers.extend(chart.frame.iter_mut().flatten());
        numbers.extend(chart.coefficients.iter_mut().flatten());
        numbers.extend([&mut chart.radius, &mut chart.scale, &mut chart.spacing]);
        numbers.extend([&mut chart.residual, &mut chart.height_error]);
        for disc in &mut chart.rim {
            numbers.extend(disc.centre.iter_mut().chain(&mut disc.outward));
            numbers.extend([&mut disc.radius, &mut disc.share]);
        }
    }
    numbers
}

#[test]
fn damaged_models_are_refused_or_cost_no_more_than_others() {
    let points: Vec<_> = sphere(900, 1.0)
        .into_iter()
        .filter(|x| x[2] > 0.3)
        .collect();
    let (atlas, _) = fit(&points, &within(1e-2));
    let good = atlas.to_model();
    let count = numbers(&mut good.clone()).len();
    let (mut refused, mut served) = (0, 0);
    for (i, factor) in (0..count).step_by(5).zip(
        [0.0, 1e-200, 1e-2, 0.7, -1.0, 30.0, 1e9, 1e300]
            .iter()
            .cycle(),
    ) {
        let mut model = good.clone();
        *numbers(&mut model)[i] *= factor;
        let Ok(atlas) = Atlas::<3>::from_model(&model) else {
            refused += 1;
            continue;
        };
        served += 1;
        let geodesics = Geodesics::of_atlas(atlas);
        let fields = Fields::of_cloud(&geodesics).expect("a surface");
        let node = geodesics.surface().nodes()[0];
        let Ok(field) = fields.from(&[Source { node, start: 0.0 }], &field::Settings::default())
        else {
            continue;
        };
        for value in fields.at_points(&field) {
            assert!(value.distance >= 0.0 && value.error >= 0.0, "{i} {factor}");
        }
    }
    assert!(refused > 10 && served > 10, "{refused} {served}");
}
