use super::*;
use crate::cloud::Cloud;
use crate::correction::Settings;

/// A spiral of equal areas on the unit sphere.
fn sphere(count: usize) -> Atlas<3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let coordinates: Vec<f64> = (0..count)
        .flat_map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / count as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let r = (1.0 - z * z).sqrt();
            [r * cos, r * sin, z]
        })
        .collect();
    Atlas::new(Cloud::new(&coordinates, 3).expect("points"), 2).expect("sphere")
}

#[test]
fn sphere_shrinks_by_half_h_squared() {
    // By (16) on a sphere, the mean height of the points within theta is kappa h^2 / 2.
    for h in [0.08, 0.16] {
        let surface = MovingLeastSquares::new(sphere(10_000), Some(h)).expect("surface");
        let mut scratch = Geometry::new(1);
        for row in (0..10_000).step_by(531) {
            let node = surface.node_of_row(row).expect("node");
            let centred = node.point + surface.atlas.cloud.centre;
            let shrunk = 1.0 - centred.norm();
            assert!(
                (shrunk / (0.5 * h * h) - 1.0).abs() < 0.03,
                "{h} {row} {shrunk}"
            );
            assert!(surface.geometry(&node.point, node.place, &mut scratch));
            let tilt = scratch.normal(0).cross(&centred.normalize()).norm();
            assert!(tilt < 2e-3, "{h} {row} {tilt}");
            let expected = scratch.normal_curvature(&scratch.tangent(0));
            assert!(
                (expected.norm() * centred.norm() - 1.0).abs() < 0.01,
                "{h} {row} {}",
                expected.norm()
            );
        }
    }
}

#[test]
fn gradient_is_normal_to_the_feet() {
    let surface = MovingLeastSquares::new(sphere(2_000), Some(0.1)).expect("surface");
    let mut scratch = Geometry::new(1);
    for row in (0..2_000).step_by(97) {
        let node = surface.node_of_row(row).expect("node");
        assert!(surface.geometry(&node.point, node.place, &mut scratch));
        let normal = scratch.normal(0);
        for j in 0..2 {
            let t = scratch.tangent(j);
            let step = 1e-4;
            let foot = |s: f64| {
                let mut place = node.place;
                surface
                    .foot(&(node.point + t * s), &mut place, &mut Geometry::new(1))
                    .expect("foot")
            };
            let secant = (foot(step) - foot(-step)) / (2.0 * step);
            assert!(
                secant.norm() > 0.5 && secant.dot(&normal).abs() < 1e-5,
                "{row} {}",
                secant.dot(&normal)
            );
        }
    }
}

#[test]
fn lengths_err_by_h_squared() {
    let mut errors = Vec::new();
    for h in [0.08, 0.16] {
        let geodesics = Geodesics::of_mls(sphere(10_000), Some(h)).expect("surface");
        let surface = geodesics.surface();
        let rows = [17, 4_321];
        let [a, b] = rows.map(|row| surface.node_of_row(row).expect("node"));
        let path = geodesics.path(&a, &b, &Settings::default());
        assert!(path.converged(), "{:?}", path.status);
        assert!(path.max_off_surface < 1e-14);
        let [p, q] = [a, b].map(|node| (node.point + surface.atlas.cloud.centre).normalize());
        errors.push(1.0 - path.length / p.dot(&q).acos());
    }
    assert!(
        (errors[0] / (0.5 * 0.08 * 0.08) - 1.0).abs() < 0.05,
        "{errors:?}"
    );
    assert!((errors[1] / errors[0] - 4.0).abs() < 0.2, "{errors:?}");
}

#[test]
fn padded_with_a_coordinate_nothing_changes() {
    let plain = MovingLeastSquares::new(sphere(2_000), None).expect("surface");
    let cloud = &plain.atlas.cloud.points;
    let coordinates: Vec<f64> = cloud.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
    let padded = Atlas::new(Cloud::<4>::new(&coordinates, 3).expect("points"), 2);
    let padded = MovingLeastSquares::new(padded.expect("sphere"), Some(plain.h())).expect("h");
    let (mut scratch, mut wider) = (Geometry::new(1), Geometry::new(2));
    for row in (0..2_000).step_by(97) {
        let node = plain.node_of_row(row).expect("node");
        let other = padded.node_of_row(row).expect("node");
        let gap = (node.point - other.point.fixed_rows::<3>(0)).norm() + other.point[3].abs();
        assert!(gap < 1e-9, "{row} {gap:e}");
        assert!(plain.geometry(&node.point, node.place, &mut scratch));
        assert!(padded.geometry(&other.point, other.place, &mut wider));
        let t = scratch.tangent(0);
        let expected = wider.normal_curvature(&Vector::<4>::new(t[0], t[1], t[2], 0.0));
        let off =
            (scratch.normal_curvature(&t) - expected.fixed_rows::<3>(0)).norm() + expected[3].abs();
        // Both normal curvature vectors are differences of gradients at feet that agree to 1e-9.
        assert!(off < 1e-6, "{row} {off:e}");
    }
}

#[test]
fn refuses_bad_spacings() {
    for h in [0.0, -1.0, 5.0, f64::NAN, f64::INFINITY] {
        let error = MovingLeastSquares::new(sphere(500), Some(h)).err();
        assert!(error.is_some(), "{h}");
    }
}

/// Rows of a roll with layers three spacings apart, at equal arc lengths, and their unrolled
/// coordinates.
fn roll() -> (Vec<f64>, Vec<[f64; 2]>) {
    let (inner, growth, step) = (0.3, 0.06 / std::f64::consts::TAU, 0.02);
    let (mut rows, mut unrolled) = (Vec::new(), Vec::new());
    let (mut angle, mut along) = (0.0_f64, 0.0);
    while angle < 14.0 {
        let radius = inner + growth * angle;
        for j in 0..20 {
            let z = step * f64::from(j);
            rows.extend([radius * angle.cos(), radius * angle.sin(), z]);
            unrolled.push([along, z]);
        }
        // The midpoint rule for d angle / d along gives the angle.
        let half = angle + 0.5 * step / radius.hypot(growth);
        angle += step / (inner + growth * half).hypot(growth);
        along += step;
    }
    (rows, unrolled)
}

#[test]
fn layers_stay_apart() {
    let (rows, unrolled) = roll();
    let cloud = Cloud::<3>::new(&rows, 3).expect("points");
    let atlas = Atlas::new(cloud, 2).expect("roll");
    let geodesics = Geodesics::of_mls(atlas, None).expect("surface");
    let surface = geodesics.surface();
    assert!(CUTOFF_WEIGHTS * surface.h() > 2.0 * 0.06);
    for row in (0..unrolled.len()).step_by(61) {
        let node = surface.node_of_row(row).expect("node");
        let moved = (node.point - surface.atlas.cloud.points[row]).norm();
        assert!(moved < 0.004, "{row} {moved}");
    }
    for (from, to) in [(48, 3_771), (2_010, 4_505), (1_205, 3_311)] {
        let [a, b] = [from, to].map(|row| surface.node_of_row(row).expect("node"));
        let path = geodesics.path(&a, &b, &Settings::default());
        let [p, q] = [unrolled[from], unrolled[to]];
        let truth = (p[0] - q[0]).hypot(p[1] - q[1]);
        let error = (path.length / truth - 1.0).abs();
        assert!(path.converged() && error < 5e-3, "{from} {to} {error:e}");
    }
}
