//! Distances that a formula gives. Points need not lie on the shape exactly: angles are what
//! counts.

use nalgebra::{Matrix3, Vector2, Vector3};

/// Angle between two vectors of equal length, accurate for small angles and near π (Kahan 2006,
/// "How futile are mindless assessments of roundoff", section 12).
fn angle(p: &[f64], q: &[f64]) -> f64 {
    let norm = |sign: f64| {
        p.iter()
            .zip(q)
            .map(|(a, b)| (a + sign * b).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    2.0 * norm(-1.0).atan2(norm(1.0))
}

/// Sphere of any dimension about the origin.
pub fn sphere(radius: f64, p: &[f64], q: &[f64]) -> f64 {
    radius * angle(p, q)
}

/// Torus of two circles in R^4, (r0 cos a, r0 sin a, r1 cos b, r1 sin b): flat. The Clifford torus
/// of the unit sphere has radii 1/√2.
pub fn flat_torus(radii: [f64; 2], p: &[f64; 4], q: &[f64; 4]) -> f64 {
    (radii[0] * angle(&p[..2], &q[..2])).hypot(radii[1] * angle(&p[2..], &q[2..]))
}

/// Rotation matrices (row-major) as a surface in R^9: √2 times the angle of the relative rotation.
pub fn rotations(p: &[f64; 9], q: &[f64; 9]) -> f64 {
    let (p, q) = (Matrix3::from_row_slice(p), Matrix3::from_row_slice(q));
    // |P - Q| = 2√2 sin(angle/2): exact for small angles; sine and cosine of the whole angle near π.
    let half_sine = (p - q).norm() / 8_f64.sqrt();
    let angle = if half_sine < 0.5 {
        2.0 * half_sine.asin()
    } else {
        let relative = p.transpose() * q;
        let skew = relative - relative.transpose();
        let axis = Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]);
        axis.norm().atan2(relative.trace() - 1.0)
    };
    2_f64.sqrt() * angle
}

/// Cylinder round the z axis.
pub fn cylinder(radius: f64, p: &[f64; 3], q: &[f64; 3]) -> f64 {
    (radius * angle(&p[..2], &q[..2])).hypot(p[2] - q[2])
}

/// Cone with its apex at the origin, opening along +z by `half_angle` radians from the axis: the
/// unrolled sector, whose angle is below π for every pair of points, so that a geodesic meets the
/// apex only where it begins or ends.
pub fn cone(half_angle: f64, p: &[f64; 3], q: &[f64; 3]) -> f64 {
    let slant = |x: &[f64; 3]| Vector3::from(*x).norm();
    let (a, b) = (slant(p), slant(q));
    if a == 0.0 || b == 0.0 {
        return a.max(b);
    }
    let unit = |x: &[f64; 3]| Vector2::new(x[0], x[1]).normalize();
    let turn = angle(unit(p).as_slice(), unit(q).as_slice()) * half_angle.sin();
    (a - b).hypot(2.0 * (a * b).sqrt() * (0.5 * turn).sin())
}

/// Developable sheet (a roll) by its sheet coordinates: the plane.
pub fn sheet(p: &[f64; 2], q: &[f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// Plane less the open disc of `radius` about the origin: straight, or tangent, arc, tangent. No
/// point inside the disc.
pub fn plane_with_hole(radius: f64, p: &[f64; 2], q: &[f64; 2]) -> f64 {
    let (a, b) = (Vector2::from(*p), Vector2::from(*q));
    let chord = b - a;
    let nearest = a + chord * (-a.dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
    if chord.norm() == 0.0 || nearest.norm() >= radius {
        return chord.norm();
    }
    let tangent = |x: &Vector2<f64>| (x.norm_squared() - radius * radius).max(0.0).sqrt();
    let seen = a.perp(&b).abs().atan2(a.dot(&b));
    let arc = seen - tangent(&a).atan2(radius) - tangent(&b).atan2(radius);
    tangent(&a) + tangent(&b) + radius * arc.max(0.0)
}
