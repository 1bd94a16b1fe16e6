//! Surfaces fitted to clouds: how near they pass, their sides, and what a file keeps of them.

use std::f64::consts::TAU;

use taut::Vector;
use taut::cloud::Cloud;
use taut::correction::Settings;
use taut::error::Error;
use taut::geodesics::Geodesics;
use taut::surface::atlas::{Atlas, Fit, FitSettings};

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
        assert!((level.gradient.norm() - 1.0).abs() < 0.1);
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
    let refused = |spoil: &dyn Fn(&mut taut::surface::atlas::Model)| {
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
