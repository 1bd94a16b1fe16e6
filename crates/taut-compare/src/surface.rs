//! The surfaces that geodesics are shot on, each with its own form of the geodesic equation.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use num_dual::{Dual2SVec64, DualNum};

use crate::gragg::State;

/// Component of a state that holds the Jacobi field J with J(0) = 0, J'(0) = 1; J' is the next one.
pub(crate) const JACOBI: usize = 6;

/// A closed surface in space with the equation of its unit-speed geodesics. Sizes should be near 1:
/// tolerances are absolute.
pub trait Surface: Sync {
    /// State at the point of the surface nearest to `point`, heading along the tangential part of
    /// `direction`.
    fn start(&self, point: &Vector3<f64>, direction: &Vector3<f64>) -> State;
    /// Derivative of the state by arc length, the scalar Jacobi equation J'' + K J = 0 included.
    fn derivative(&self, state: &State) -> State;
    /// Point of a state.
    fn position(&self, state: &State) -> Vector3<f64>;
    /// Unit tangent of a state.
    fn velocity(&self, state: &State) -> Vector3<f64>;
    /// Unit outward normal at a point of the surface.
    fn normal(&self, point: &Vector3<f64>) -> Vector3<f64>;
    /// Radius of the largest ball that rolls on both sides: no curvature exceeds its inverse.
    fn reach(&self) -> f64;
    /// Length of some curve of the surface from `p` to `q`.
    fn length_bound(&self, p: &Vector3<f64>, q: &Vector3<f64>) -> f64;
}

/// Torus round the z axis: tube of radius `minor` about a circle of radius `major` > `minor`.
///
/// State: u, v, v', the constant of Clairaut, two unused, J, J'; the point is
/// ((R + r cos v) cos u, (R + r cos v) sin u, r sin v).
#[derive(Clone, Copy, Debug)]
pub struct Torus {
    /// R
    pub major: f64,
    /// r
    pub minor: f64,
}

impl Torus {
    /// Angles u round the axis and v round the tube, in radians, of a point near the torus.
    pub fn angles(&self, point: &Vector3<f64>) -> [f64; 2] {
        let axial = point.x.hypot(point.y);
        [point.y.atan2(point.x), point.z.atan2(axial - self.major)]
    }

    /// Point of the angles u and v.
    pub fn point(&self, [u, v]: [f64; 2]) -> Vector3<f64> {
        let width = self.major + self.minor * v.cos();
        Vector3::new(width * u.cos(), width * u.sin(), self.minor * v.sin())
    }
}

impl Surface for Torus {
    fn start(&self, point: &Vector3<f64>, direction: &Vector3<f64>) -> State {
        let [u, v] = self.angles(point);
        let east = direction.dot(&Vector3::new(-u.sin(), u.cos(), 0.0));
        let north = direction.dot(&Vector3::new(
            -v.sin() * u.cos(),
            -v.sin() * u.sin(),
            v.cos(),
        ));
        let speed = east.hypot(north);
        let clairaut = (self.major + self.minor * v.cos()) * east / speed;
        State::from([
            u,
            v,
            north / speed / self.minor,
            clairaut,
            0.0,
            0.0,
            0.0,
            1.0,
        ])
    }

    fn derivative(&self, y: &State) -> State {
        let (sin, cos) = y[1].sin_cos();
        let width = self.major + self.minor * cos;
        let turning = y[3] / (width * width);
        let curvature = cos / (self.minor * width);
        let bend = -sin * width * turning * turning / self.minor;
        State::from([turning, y[2], bend, 0.0, 0.0, 0.0, y[7], -curvature * y[6]])
    }

    fn position(&self, y: &State) -> Vector3<f64> {
        self.point([y[0], y[1]])
    }

    fn velocity(&self, y: &State) -> Vector3<f64> {
        let (sin_u, cos_u) = y[0].sin_cos();
        let (sin_v, cos_v) = y[1].sin_cos();
        let east = y[3] / (self.major + self.minor * cos_v);
        let north = self.minor * y[2];
        Vector3::new(-sin_u, cos_u, 0.0) * east
            + Vector3::new(-sin_v * cos_u, -sin_v * sin_u, cos_v) * north
    }

    fn normal(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let [u, v] = self.angles(point);
        Vector3::new(v.cos() * u.cos(), v.cos() * u.sin(), v.sin())
    }

    fn reach(&self) -> f64 {
        self.minor.min(self.major - self.minor)
    }

    /// Along the tube first or last, and round the axis on the shorter of the two parallels.
    fn length_bound(&self, p: &Vector3<f64>, q: &Vector3<f64>) -> f64 {
        let difference = |a: f64, b: f64| (a - b + PI).rem_euclid(2.0 * PI) - PI;
        let ([u0, v0], [u1, v1]) = (self.angles(p), self.angles(q));
        let width = self.major + self.minor * v0.cos().min(v1.cos());
        width * difference(u1, u0).abs() + self.minor * difference(v1, v0).abs()
    }
}

/// Ellipsoid x²/a² + y²/b² + z²/c² = 1 with any semi-axes, in space: x'' = -(x' H x' / |g|²) g with
/// g = H x, so no coordinate is singular. State: x, x', J, J'.
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoid {
    /// a, b, c
    pub semi_axes: [f64; 3],
}

impl Ellipsoid {
    fn weights(&self) -> Vector3<f64> {
        Vector3::from(self.semi_axes).map(|a| 1.0 / (a * a))
    }

    /// The point of the surface where Newton steps along the gradient end.
    fn foot(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let weights = self.weights();
        (0..8).fold(*point, |x, _| {
            let gradient = x.component_mul(&weights);
            x - gradient * (0.5 * (x.dot(&gradient) - 1.0) / gradient.norm_squared())
        })
    }
}

impl Surface for Ellipsoid {
    fn start(&self, point: &Vector3<f64>, direction: &Vector3<f64>) -> State {
        let x = self.foot(point);
        let normal = self.normal(&x);
        let t = (direction - normal * normal.dot(direction)).normalize();
        State::from([x.x, x.y, x.z, t.x, t.y, t.z, 0.0, 1.0])
    }

    fn derivative(&self, y: &State) -> State {
        let weights = self.weights();
        let (x, t) = (self.position(y), Vector3::new(y[3], y[4], y[5]));
        let gradient = x.component_mul(&weights);
        let steepness = gradient.norm_squared();
        let bend = gradient * (-t.dot(&t.component_mul(&weights)) / steepness);
        let curvature = weights.product() / (steepness * steepness);
        State::from([
            t.x,
            t.y,
            t.z,
            bend.x,
            bend.y,
            bend.z,
            y[7],
            -curvature * y[6],
        ])
    }

    fn position(&self, y: &State) -> Vector3<f64> {
        Vector3::new(y[0], y[1], y[2])
    }

    fn velocity(&self, y: &State) -> Vector3<f64> {
        Vector3::new(y[3], y[4], y[5])
    }

    fn normal(&self, point: &Vector3<f64>) -> Vector3<f64> {
        point.component_mul(&self.weights()).normalize()
    }

    fn reach(&self) -> f64 {
        let (least, most) = self
            .semi_axes
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(l, m), &a| (l.min(a), m.max(a)));
        least * least / most
    }

    /// The image of a great circle under the scaling that makes the ellipsoid of the unit sphere.
    fn length_bound(&self, p: &Vector3<f64>, q: &Vector3<f64>) -> f64 {
        const CHORDS: usize = 128;
        let axes = Vector3::from(self.semi_axes);
        let from = p.component_div(&axes).normalize();
        let to = q.component_div(&axes).normalize();
        let angle = 2.0 * (from - to).norm().atan2((from + to).norm());
        let aside = to - from * from.dot(&to);
        let aside = if aside.norm() > 1e-9 {
            aside
        } else {
            from.cross(&Vector3::ith(from.iamin(), 1.0))
        }
        .normalize();
        let at = |i: usize| {
            let (sin, cos) = (angle * i as f64 / CHORDS as f64).sin_cos();
            (from * cos + aside * sin).component_mul(&axes)
        };
        // 0.1 % more than the chords: an arc of π in 128 parts is at most 2.6e-5 longer, times the
        // axis ratio.
        1.001 * (0..CHORDS).map(|i| (at(i + 1) - at(i)).norm()).sum::<f64>()
    }
}

/// A number with its first and second derivatives by the coordinates of space.
pub type Dual = Dual2SVec64<3>;

/// A surface round the origin that every ray from there meets once, in space: |x| = radius(x /
/// |x|). Derivatives are those of dual numbers. State: x, x', J, J'.
#[derive(Clone, Copy, Debug)]
pub struct StarShaped {
    /// The distance from the origin in a direction of unit length.
    pub radius: fn(&[Dual; 3]) -> Dual,
    /// What no curvature exceeds the inverse of.
    pub reach: f64,
}

impl StarShaped {
    /// The point in a direction.
    pub fn point(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let unit = direction.normalize();
        let radius = (self.radius)(&[unit.x, unit.y, unit.z].map(Dual::from_re));
        unit * radius.re
    }

    /// Gradient and Hessian of |x| - radius(x / |x|).
    fn derivatives(&self, x: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let level = |x: Vector3<Dual>| {
            let length = (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt();
            length - (self.radius)(&[x[0] / length, x[1] / length, x[2] / length])
        };
        let (_, gradient, hessian) = num_dual::hessian(level, x);
        (gradient, hessian)
    }
}

impl Surface for StarShaped {
    fn start(&self, point: &Vector3<f64>, direction: &Vector3<f64>) -> State {
        let x = self.point(point);
        let normal = self.normal(&x);
        let t = (direction - normal * normal.dot(direction)).normalize();
        State::from([x.x, x.y, x.z, t.x, t.y, t.z, 0.0, 1.0])
    }

    fn derivative(&self, y: &State) -> State {
        let (x, t) = (self.position(y), self.velocity(y));
        let (gradient, hessian) = self.derivatives(&x);
        let steepness = gradient.norm_squared();
        let bend = gradient * (-t.dot(&(hessian * t)) / steepness);
        // Gauss curvature of a level set: the gradient's quadratic form of the adjugate of the
        // Hessian.
        let column = |i: usize| Vector3::from(hessian.column(i));
        let (a, b, c) = (column(0), column(1), column(2));
        let adjugate = Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
        let curvature = gradient.dot(&(adjugate * gradient)) / (steepness * steepness);
        State::from([
            t.x,
            t.y,
            t.z,
            bend.x,
            bend.y,
            bend.z,
            y[7],
            -curvature * y[6],
        ])
    }

    fn position(&self, y: &State) -> Vector3<f64> {
        Vector3::new(y[0], y[1], y[2])
    }

    fn velocity(&self, y: &State) -> Vector3<f64> {
        Vector3::new(y[3], y[4], y[5])
    }

    fn normal(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.derivatives(point).0.normalize()
    }

    fn reach(&self) -> f64 {
        self.reach
    }

    /// Over the great circle of directions.
    fn length_bound(&self, p: &Vector3<f64>, q: &Vector3<f64>) -> f64 {
        const CHORDS: usize = 256;
        let (from, to) = (p.normalize(), q.normalize());
        let at = |i: usize| {
            let share = i as f64 / CHORDS as f64;
            self.point(&(from * (1.0 - share) + to * share))
        };
        1.01 * (0..CHORDS).map(|i| (at(i + 1) - at(i)).norm()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gragg::integrate;

    #[test]
    fn invariants_hold_along_long_geodesics_of_a_flat_spheroid() {
        let surface = Ellipsoid {
            semi_axes: [1.0, 1.0, 0.4],
        };
        for tilt in [0.3_f64, 1.0, 1.5] {
            let start = surface.start(&Vector3::x(), &Vector3::new(0.0, tilt.cos(), tilt.sin()));
            for length in [1.0, 5.0, 10.0] {
                let end = integrate(|y| surface.derivative(y), start, length, 0.1);
                let (x, t) = (surface.position(&end), surface.velocity(&end));
                let off = x.component_div(&Vector3::from(surface.semi_axes)).norm() - 1.0;
                let clairaut = x.x * t.y - x.y * t.x - tilt.cos();
                let worst = [clairaut, t.norm() - 1.0, off]
                    .iter()
                    .fold(0.0_f64, |worst, x| worst.max(x.abs()));
                assert!(worst < 1e-13, "length {length}: {worst:e}");
            }
        }
    }

    #[test]
    fn torus_geodesic_has_unit_speed_and_obeys_the_equation_in_space() {
        let torus = Torus {
            major: 1.0,
            minor: 0.4,
        };
        let start = torus.start(&torus.point([0.2, 1.1]), &Vector3::new(0.5, -0.3, 0.8));
        let at = |length: f64| integrate(|y| torus.derivative(y), start, length, 0.1);
        let (before, here, after) = (at(2.0 - 1e-4), at(2.0), at(2.0 + 1e-4));
        assert!((torus.velocity(&here).norm() - 1.0).abs() < 1e-13);
        let secant = (torus.position(&after) - torus.position(&before)) / 2e-4;
        assert!((secant - torus.velocity(&here)).norm() < 1e-7);
        let bend = (torus.velocity(&after) - torus.velocity(&before)) / 2e-4;
        assert!(
            bend.norm() > 0.5 && bend.cross(&torus.normal(&torus.position(&here))).norm() < 1e-6
        );
    }
}
