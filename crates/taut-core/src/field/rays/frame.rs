//! Tangent frames with the second fundamental form, and the straight steps on the surface that they
//! determine.

use crate::Vector;
use crate::field::plane::norm;
use crate::surface::Geometry;
use crate::surface::crease::is_unexplained;

/// A point of a two-dimensional surface with its tangent plane and its second fundamental form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<const D: usize> {
    pub point: Vector<D>,
    /// Two orthonormal tangent vectors e1 and e2.
    pub tangents: [Vector<D>; 2],
    /// The second fundamental form: II(e1, e1), II(e1, e2), II(e2, e2).
    pub second: [Vector<D>; 3],
    /// The Gauss curvature.
    pub gauss: f64,
}

/// Factor of a point's height over the surface's quadric in a straight step, for points on the
/// surface. The height is taken for the surface's own third order, and the fourth order of a
/// straight step needs 3/4 of it.
pub(crate) const ON_SURFACE: f64 = 0.75;
/// Factor of a point's height over the surface's quadric in a straight step, for points that lie
/// off the surface, whose height is their own.
pub(crate) const OFF_SURFACE: f64 = 1.0;

impl<const D: usize> Frame<D> {
    /// Makes the frame from the geometry at a point of the surface.
    pub fn new(point: Vector<D>, geometry: &Geometry<D>) -> Self {
        let (e, f) = (geometry.tangent(0), geometry.tangent(1));
        let (first, last) = (geometry.normal_curvature(&e), geometry.normal_curvature(&f));
        let both = geometry.normal_curvature(&((e + f) * std::f64::consts::FRAC_1_SQRT_2));
        Self::of_forms(point, [e, f], [first, both - (first + last) * 0.5, last])
    }

    /// Makes the frame from two orthonormal tangents and the second fundamental form in them.
    pub fn of_forms(point: Vector<D>, tangents: [Vector<D>; 2], second: [Vector<D>; 3]) -> Self {
        let gauss = second[0].dot(&second[2]) - second[1].norm_squared();
        Self {
            point,
            tangents,
            second,
            gauss,
        }
    }

    /// A bound of the normal curvatures: the Frobenius norm of the second fundamental form.
    pub fn curvature(&self) -> f64 {
        let [first, both, last] = self.second.map(|form| form.norm_squared());
        (first + 2.0 * both + last).sqrt()
    }

    /// The tangent coordinates of a vector.
    pub fn coordinates(&self, v: &Vector<D>) -> [f64; 2] {
        [v.dot(&self.tangents[0]), v.dot(&self.tangents[1])]
    }

    /// The vector that has these tangent coordinates.
    pub fn vector(&self, [a, b]: [f64; 2]) -> Vector<D> {
        self.tangents[0] * a + self.tangents[1] * b
    }

    /// The vectors II(v, e1) and II(v, e2).
    fn second_form_along(&self, [a, b]: [f64; 2]) -> [Vector<D>; 2] {
        let [first, both, last] = &self.second;
        [first * a + both * b, both * a + last * b]
    }

    /// The second fundamental form II(u, v).
    pub fn second_form(&self, u: [f64; 2], v: [f64; 2]) -> Vector<D> {
        let [first, last] = self.second_form_along(u);
        first * v[0] + last * v[1]
    }

    /// The frame with another pair of tangents, the first of which is given in tangent coordinates.
    pub fn turned(&self, first: [f64; 2]) -> Self {
        let [c, s] = first;
        let last = [-s, c];
        Self {
            tangents: [self.vector(first), self.vector(last)],
            second: [
                self.second_form(first, first),
                self.second_form(first, last),
                self.second_form(last, last),
            ],
            ..*self
        }
    }

    /// The frame turned so that its first tangent points along a vector and its second to the side
    /// given.
    pub fn facing(&self, ahead: &Vector<D>, side: &Vector<D>) -> Option<Self> {
        let ahead = self.coordinates(ahead);
        let inverse = norm(ahead).recip();
        let mut frame = inverse
            .is_finite()
            .then(|| self.turned(ahead.map(|a| a * inverse)))?;
        if frame.tangents[1].dot(side) < 0.0 {
            frame.tangents[1].neg_mut();
            frame.second[1].neg_mut();
        }
        Some(frame)
    }

    /// The initial velocity of the geodesic that reaches the foot of `x` at time 1, in tangent
    /// coordinates. It is v = w + <(1/6 - |II(w, .)|^2 / 40) II(w, w) + share z, II(w, .)>, where w
    /// is the tangential part of the chord and z the height over the quadric. In a step along a
    /// plane curve the error of the length is of fifth order.
    pub fn log(&self, x: &Vector<D>, share: f64) -> [f64; 2] {
        let chord = x - self.point;
        let w = self.coordinates(&chord);
        let forms = self.second_form_along(w);
        let curved = forms[0] * w[0] + forms[1] * w[1];
        let height = chord - self.vector(w) - curved * 0.5;
        let steep = forms[0].norm_squared() + forms[1].norm_squared();
        let pull = curved * (1.0 / 6.0 - steep / 40.0) + height * share;
        [w[0] + pull.dot(&forms[0]), w[1] + pull.dot(&forms[1])]
    }

    /// Whether a crease lies on the way to another frame.
    pub fn is_creased(&self, other: &Self) -> bool {
        let way = (other.point - self.point).norm();
        let turning = (self.curvature() + other.curvature()) * way;
        let off = |tangent: &Vector<D>| (tangent - self.vector(self.coordinates(tangent))).norm();
        let mut tangents = other.tangents.iter();
        tangents.any(|tangent| is_unexplained(off(tangent), turning))
    }

    /// Estimated error of the length of a straight step.
    pub fn log_error(&self, length: f64) -> f64 {
        length * (length * self.curvature()).powi(4) / 24.0
    }

    /// By how much the lengths of the straight step to another frame, seen from its two ends,
    /// differ, with the estimated error of the step.
    pub fn disagreement(&self, other: &Self) -> f64 {
        let [there, back] = [
            self.log(&other.point, ON_SURFACE),
            other.log(&self.point, ON_SURFACE),
        ];
        (norm(there) - norm(back)).abs() + self.log_error(norm(there))
    }

    /// The relative orientation of another frame nearby: 1 if it turns the same way, -1 if not.
    pub fn handedness(&self, other: &Self) -> f64 {
        let [a, b] = other.coordinates(&self.tangents[0]);
        let [c, d] = other.coordinates(&self.tangents[1]);
        1_f64.copysign(a * d - b * c)
    }
}
