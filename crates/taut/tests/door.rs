//! What the front door answers, against closed forms.

use std::f64::consts::{FRAC_PI_2, PI};

use taut::{CloudOptions, End, Error, FieldOptions, PathOptions, Status, Surface};

type Outcome = Result<(), Error>;

/// Points of the unit sphere of R^3 on a spiral, moved by `offset` along every axis.
fn sphere(count: usize, offset: f64) -> Vec<f64> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .flat_map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / count as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            [radius * cos, radius * sin, z].map(|v| v + offset)
        })
        .collect()
}

fn row(rows: &[f64], i: usize) -> [f64; 3] {
    [rows[3 * i], rows[3 * i + 1], rows[3 * i + 2]]
}

/// The angle between two points of a sphere about `offset`.
fn angle(a: [f64; 3], b: [f64; 3], offset: f64) -> f64 {
    let [u, v] = [a, b].map(|point| point.map(|c| c - offset));
    let chord = (0..3).map(|i| (u[i] - v[i]).powi(2)).sum::<f64>().sqrt();
    2.0 * (0.5 * chord).min(1.0).asin()
}

#[test]
fn paths_are_given_in_the_coordinates_of_the_input() -> Outcome {
    let offset = 1e3;
    let rows = sphere(3000, offset);
    let surface = Surface::from_points(&rows, 3)?;
    let (from, to) = (row(&rows, 17), row(&rows, 2100));
    let by_rows = surface.path(17, 2100, &PathOptions::default())?;
    let by_points = surface.path(from, to, &PathOptions::default())?;
    let truth = angle(from, to, offset);
    for path in [by_rows, by_points] {
        assert!(path.converged());
        assert!((path.length - truth).abs() <= path.length_error + path.surface_error + 1e-9);
        assert!((path.length - truth).abs() < 1e-6 * truth);
        let (first, last) = (&path.points[..3], &path.points[path.points.len() - 3..]);
        for axis in 0..3 {
            assert!((first[axis] - from[axis]).abs() < 1e-6);
            assert!((last[axis] - to[axis]).abs() < 1e-6);
        }
        assert_eq!(path.points.len(), 3 * path.arc_length.len());
        assert!(path.moved.iter().all(|moved| *moved < 1e-6));
    }
    Ok(())
}

#[test]
fn distances_keep_to_their_errors_and_agree_anywhere() -> Outcome {
    let rows = sphere(5000, -7.0);
    let surface = Surface::from_points(&rows, 3)?;
    let sources = [400_usize, 4100];
    let field = surface.field(&sources, &FieldOptions::default())?;
    let found = field.at_rows()?;
    let points: Vec<[f64; 3]> = (0..5000).step_by(97).map(|i| row(&rows, i)).collect();
    let anywhere = field.at(&points);
    assert_eq!(found.distance.len(), 5000);
    let mut covered = 0;
    for i in 0..5000 {
        let from = sources.map(|source| angle(row(&rows, source), row(&rows, i), -7.0));
        let truth = from[0].min(from[1]);
        let error = (found.distance[i] - truth).abs();
        covered += usize::from(error <= found.error[i] + 1e-12);
        assert!(error < 1e-4, "{i}: {error:e}");
        if (from[0] - from[1]).abs() > 1e-3 {
            assert_eq!(found.source[i], Some(u32::from(from[1] < from[0])));
        }
    }
    assert!(covered >= 4900, "{covered} of 5000");
    for (k, i) in (0..5000).step_by(97).enumerate() {
        assert!((anywhere.distance[k] - found.distance[i]).abs() < 1e-6);
    }
    let straight = surface.distances(&sources, &FieldOptions::default())?;
    assert_eq!(straight, found);
    Ok(())
}

#[test]
fn equations_and_shapes_need_no_points() -> Outcome {
    let sphere = Surface::from_equation("x^2 + y^2 + z^2 = 4")?;
    let options = PathOptions::to(1e-10);
    let path = sphere.path([2.0, 0.0, 0.0], [0.0, 0.0, 2.0], &options)?;
    assert!((path.length - PI).abs() < 1e-9 && path.converged());
    assert!(matches!(
        sphere.distances(&[[2.0, 0.0, 0.0]], &FieldOptions::default()),
        Err(Error::NoRows)
    ));
    let field = sphere.field(&[[2.0, 0.0, 0.0]], &FieldOptions::default())?;
    let there = field.at(&[[0.0, 2.0, 0.0], [0.0, -1.2, 1.6]]);
    assert!(there.distance.iter().all(|d| (d - PI).abs() < 1e-5));

    let ring = Surface::from_shape("torus:1,0.4")?;
    let path = ring.path([1.4, 0.0, 0.0], [0.6, 0.0, 0.0], &options)?;
    assert!((path.length - 0.4 * PI).abs() < 1e-10);
    let ways = ring.alternatives([1.4, 0.0, 0.0], [-1.4, 0.0, 0.0], &options, 3)?;
    assert!(ways.len() >= 2 && ways[0].length <= ways[1].length);

    // Far from the origin only a box says where the surface is.
    let far = ["(x - 5000)^2 + y^2 + z^2 = 1"];
    let [low, high] = [[4998.0, -2.0, -2.0], [5002.0, 2.0, 2.0]];
    let surface = Surface::from_equations(&far, 3, Some([&low, &high]))?;
    let path = surface.path([5001.0, 0.0, 0.0], [5000.0, 1.0, 0.0], &options)?;
    assert!((path.length - FRAC_PI_2).abs() < 1e-9);
    Ok(())
}

#[test]
fn any_dimension_by_the_same_calls() -> Outcome {
    // The Clifford torus in R^4, on which lengths are those of a plane.
    let count = 60;
    let step = 2.0 * PI / f64::from(count);
    let rows: Vec<f64> = (0..count * count)
        .flat_map(|i| {
            let (u, v) = (step * f64::from(i / count), step * f64::from(i % count));
            [u.cos(), u.sin(), v.cos(), v.sin()]
        })
        .collect();
    assert!(matches!(
        Surface::from_points(&rows, 4),
        Err(Error::Dimension { found: None, .. })
    ));
    let options = CloudOptions { dimension: Some(2) };
    let surface = Surface::from_cloud(&rows, 4, &options)?;
    let path = surface.path(0, 10 * 60 + 15, &PathOptions::default())?;
    assert!((path.length - step * 10.0_f64.hypot(15.0)).abs() < 1e-4);
    assert_eq!(
        (surface.coordinates(), surface.intrinsic_dimension()),
        (4, 2)
    );
    let circle: Vec<f64> = (0..200)
        .flat_map(|i| <[f64; 2]>::from((0.01 * PI * f64::from(i)).sin_cos()))
        .collect();
    let options = CloudOptions { dimension: Some(1) };
    let curve = Surface::from_cloud(&circle, 2, &options)?;
    let path = curve.path(0, 50, &PathOptions::default())?;
    assert!((path.length - FRAC_PI_2).abs() < 1e-5);
    Ok(())
}

#[test]
fn logarithms_lead_back_by_the_exponential() -> Outcome {
    let rows = sphere(4000, 0.0);
    let surface = Surface::from_points(&rows, 3)?;
    let found = surface.log(&[2000_usize], &FieldOptions::default())?;
    for i in (0..4000).step_by(311) {
        let [a, b] = found.vectors[i];
        let truth = angle(row(&rows, 2000), row(&rows, i), 0.0);
        assert!((a.hypot(b) - truth).abs() < 1e-4);
        let [u, v] = &found.tangents[0];
        let vector: Vec<f64> = (0..3).map(|axis| a * u[axis] + b * v[axis]).collect();
        let shot = surface.exp(2000, &vector, &FieldOptions::default())?;
        assert!(shot.complete || a.hypot(b) < 1e-9);
        let miss = (0..3).map(|axis| (shot.end()[axis] - rows[3 * i + axis]).powi(2));
        let miss = miss.sum::<f64>().sqrt();
        assert!(miss <= found.error[i] + shot.error, "{i}");
        assert!(miss < 1e-3, "{i}: {miss:e}");
    }
    Ok(())
}

#[test]
fn matrices_hold_the_lengths_of_paths() -> Outcome {
    let rows = sphere(2000, 3.0);
    let surface = Surface::from_points(&rows, 3)?;
    let (sources, targets) = ([3_usize, 700], [1999_usize, 3, 1200]);
    let options = PathOptions::default();
    let matrix = surface.matrix(&sources, &targets, &options)?;
    assert_eq!((matrix.rows, matrix.columns), (2, 3));
    let pairs: Vec<[usize; 2]> = sources
        .iter()
        .flat_map(|from| targets.iter().map(move |to| [*from, *to]))
        .collect();
    let paths = surface.paths(&pairs, &options);
    for (i, path) in paths.into_iter().enumerate() {
        let path = path?;
        assert!((path.length - matrix.lengths[i]).abs() <= 1e-6 * path.length);
        assert_eq!(matrix.status[i], Status::Converged);
        assert!(matrix.errors[i] <= 1e-4);
    }
    let gave_up = surface.matrix_with(&sources, &targets, &options, &|_, _| false);
    assert!(matches!(gave_up, Err(Error::Cancelled)));
    Ok(())
}

#[test]
fn models_keep_within_their_accuracy() -> Outcome {
    let rows = sphere(3000, 0.0);
    let model = Surface::fit(&rows, 3, &CloudOptions::default(), None)?;
    let path = model.path(row(&rows, 5), row(&rows, 2500), &PathOptions::default())?;
    assert!((path.length - angle(row(&rows, 5), row(&rows, 2500), 0.0)).abs() < 1e-2);
    let named = model.path(5, 2500, &PathOptions::default())?;
    assert!((named.length - path.length).abs() < 1e-2);
    Ok(())
}

#[test]
fn parts_are_told_apart() -> Outcome {
    let mut two = sphere(1000, 0.0);
    two.extend(sphere(1000, 10.0));
    let surface = Surface::from_points(&two, 3)?;
    let path = surface.path(0, 1500, &PathOptions::default())?;
    assert_eq!((path.status, path.length), (Status::NoPath, f64::INFINITY));
    assert!(path.points.is_empty());
    let field = surface.distances(&[0_usize], &FieldOptions::default())?;
    assert!(field.distance[1500].is_infinite() && field.source[1500].is_none());
    assert_eq!(surface.check().parts.len(), 2);
    Ok(())
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let rows = sphere(500, 0.0);
    let surface = Surface::from_points(&rows, 3).expect("a sphere");
    let options = PathOptions::default();
    let ragged = Surface::from_points(&rows[..100], 3);
    assert!(matches!(ragged, Err(Error::RaggedRows { values: 100, .. })));
    for found in [0, 17] {
        let refused = Surface::from_points(&[0.0; 34], found);
        assert!(matches!(refused, Err(Error::Coordinates { found: f }) if f == found));
    }
    assert!(matches!(
        surface.path(500, 3, &options),
        Err(Error::NoPlace {
            end: End::Row(500),
            ..
        })
    ));
    let flat = surface.path([1.0, 0.0], 3, &options);
    assert!(matches!(flat, Err(Error::NoPlace { .. })));
    assert!(matches!(
        Surface::from_equation("x^2 + "),
        Err(Error::Formula(_))
    ));
    assert!(matches!(
        Surface::from_equation("x^2 + y^2 + z^2 = -1"),
        Err(Error::NotFound { .. })
    ));
    assert!(matches!(
        Surface::from_shape("cube:1"),
        Err(Error::Shape(_))
    ));
    assert!(matches!(
        Surface::from_points(&rows[..3], 3),
        Err(Error::Engine(_))
    ));
}

#[test]
fn surfaces_and_fields_are_shared_between_threads() -> Outcome {
    fn is_shared<T: Clone + Send + Sync + 'static>(_: &T) {}
    let surface = Surface::from_shape("sphere:1")?;
    let field = surface.field(&[[0.0, 0.0, 1.0]], &FieldOptions::default())?;
    is_shared(&surface);
    is_shared(&field);
    let ends = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
    let lengths = std::thread::scope(|scope| {
        let asked = ends.map(|end| {
            let (surface, field) = (surface.clone(), field.clone());
            scope.spawn(move || {
                let path = surface.path([0.0, 0.0, 1.0], end, &PathOptions::default());
                (path.map(|path| path.length), field.at(&[end]).distance[0])
            })
        });
        asked.map(|thread| thread.join().expect("no panic"))
    });
    for ((length, distance), truth) in lengths.into_iter().zip([FRAC_PI_2, FRAC_PI_2, PI]) {
        assert!((length? - truth).abs() < 1e-5 && (distance - truth).abs() < 1e-5);
    }
    Ok(())
}
