//! Jets of a distance: its value, its gradient, the curvature of its front and the derivative of
//! that, carried over a step.
//!
//! A step is made in the surface of constant curvature K, the mean of the curvatures at both ends.
//! With sn and cs its sine and cosine and md = (1 - cs) / K, the distance grows by delta where
//! sn(delta) + kappa md(delta) = sn(s) cos(theta) + kappa md(s). Here kappa is the curvature of the
//! front, s the length of the step and theta its angle to the gradient. Along rays
//! kappa' = -kappa^2 - K (Riccati).

use std::f64::consts::PI;

use crate::Vector;
use crate::field::plane::{norm, turned_by};
use crate::field::rays::frame::{Frame, ON_SURFACE};

/// The Taylor expansion of a distance near a point with a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet {
    /// The distance at the point, in the input's units.
    pub distance: f64,
    /// The unit gradient, in the frame's tangent coordinates.
    pub gradient: [f64; 2],
    /// The geodesic curvature of the front, in inverse units of length; positive where rays spread.
    pub curvature: f64,
    /// The derivative of the front curvature along the front, to the left of the gradient in the
    /// frame.
    pub curvature_rate: f64,
    /// Estimated error of the derivative of the front curvature.
    pub curvature_rate_error: f64,
    /// How far along the front the jet may be used, to the right and to the left of the gradient in
    /// the frame, in the input's units.
    pub width: [f64; 2],
    /// Estimated error of the distance because of the step that carried the jet here.
    pub step_error: f64,
    pub heading: Heading,
}

/// The direction at the source of the ray that arrives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Heading {
    /// The angle of the direction in the tangent coordinates of the source's frame, in radians. For
    /// a ray that leaves a curve at right angles it is the ray's place on the curve instead.
    pub angle: f64,
    /// The derivative of the angle along the front, to the left of the gradient. It is 1 / J,
    /// negative where left at the source is right here, and 0 where the ray came round a rim (the
    /// boundary of the surface).
    pub turn: f64,
    /// The second derivative of the angle along the front.
    pub turn_rate: f64,
    /// The interval of angles in which there are rays of the same kind; `None` where they leave all
    /// round. For rays that leave a curve at right angles it is an interval of places on the curve.
    pub range: Option<[f64; 2]>,
}

impl Heading {
    /// The heading of a ray diffracted at a point of a rim: all rays that come round that point
    /// left the source in the same direction.
    pub fn same(angle: f64) -> Self {
        Self {
            angle,
            ..Self::default()
        }
    }

    /// Whether the ray came round a rim.
    pub fn is_diffracted(&self) -> bool {
        self.turn == 0.0
    }

    /// The angle from this heading to another of the same kind.
    pub fn turned_to(&self, other: &Self) -> f64 {
        if self.range.is_some() {
            other.angle - self.angle
        } else {
            turned_by(self.angle, other.angle)
        }
    }

    /// How far along the front it is back to where there are rays of the same kind; 0 where there
    /// are some here.
    pub fn beyond(&self) -> f64 {
        let off = |[from, to]: [f64; 2]| (from - self.angle).max(self.angle - to).max(0.0);
        self.range.map_or(0.0, |range| off(range) / self.turn.abs())
    }

    /// How far along the front rays spread nearly evenly.
    pub fn even(&self, spacing: f64) -> f64 {
        if self.range.is_some() || self.is_diffracted() {
            return f64::INFINITY;
        }
        (WIDE * spacing).min(EVEN * (self.turn / self.turn_rate).abs())
    }

    /// The width, along the front, of the strip that rays of this kind fill here.
    pub fn width(&self) -> f64 {
        self.range
            .map_or(f64::INFINITY, |[from, to]| (to - from) / self.turn.abs())
    }

    /// The angle at a distance `arc` along the front.
    fn at(&self, arc: f64) -> f64 {
        self.angle + arc * (self.turn + 0.5 * arc * self.turn_rate)
    }
}

/// How far a jet may be used along its front, in spacings of the graph's nodes.
pub(crate) const WIDE: f64 = 2.0;
/// Most by which the spread of rays may change along the part of a front on which a jet is used, as
/// a share of the spread.
const EVEN: f64 = 0.5;
/// Largest Gauss curvature times the square of the step: more is taken for noise, and the series
/// end there.
const MOST_GAUSS: f64 = 0.3;
/// Largest difference, as a share, between the front curvature and 1 / J where a front counts as a
/// circle about the source.
const CIRCLE: f64 = 0.1;
/// Least distance, as a share of the distance before the step, that rays which draw together must
/// keep in one step.
pub(crate) const FOCUS: f64 = 0.1;

/// Square of the largest ratio of the growth of the distance to the length of the step, above which
/// a step is refused.
const JET_GROWTH: f64 = 1.01;

/// The growth of a distance over a step.
pub(crate) struct Growth {
    /// By how much the distance grows, in the input's units.
    pub delta: f64,
    /// The factor by which the front spreads on the way.
    pub spread: f64,
    /// The generalised sine of delta.
    sn: f64,
    /// The generalised cosine of delta.
    cs: f64,
}

impl Jet {
    /// A jet of rays that spread as from a point, or along a circle, so that the front curvature is
    /// constant along the front.
    pub fn new(distance: f64, gradient: [f64; 2], curvature: f64, heading: Heading) -> Self {
        Self {
            distance,
            gradient,
            curvature,
            curvature_rate: 0.0,
            curvature_rate_error: 0.0,
            width: [f64::INFINITY; 2],
            step_error: 0.0,
            heading,
        }
    }

    /// The jet, in the frame of `to`, of the distance from a source at the point of `from`, where
    /// the distance is `start`.
    pub fn of_point<const D: usize>(from: &Frame<D>, start: f64, to: &Frame<D>) -> Option<Self> {
        let v = from.log(&to.point, ON_SURFACE);
        let length = norm(v);
        let back = to.log(&from.point, ON_SURFACE);
        let inverse = norm(back).recip();
        inverse.is_finite().then(|| {
            let curved = length * length * 0.5 * (from.gauss + to.gauss);
            let heading = Heading {
                angle: v[1].atan2(v[0]),
                turn: from.handedness(to) * (1.0 + curved / 6.0) / length,
                ..Heading::default()
            };
            let gradient = [-back[0] * inverse, -back[1] * inverse];
            let curvature = (1.0 - curved / 3.0) / length;
            Self::new(start + length, gradient, curvature, heading)
        })
    }

    /// The distance at tangent coordinates `v`, and the estimated error of the step; `None` where
    /// the jet does not count, as beyond where rays meet.
    pub fn distance_at(&self, v: [f64; 2], gauss: f64) -> Option<(f64, f64)> {
        let [x, y] = self.split(v);
        let growth = grow(self.curvature, x, y, gauss)?;
        let front = y / growth.spread;
        let cube = front * front * front / 6.0;
        self.covers(x, front).then(|| {
            let distance = self.distance + growth.delta + self.curvature_rate * cube;
            (distance, self.curvature_rate_error * cube.abs())
        })
    }

    /// The jet carried from its frame to another frame; `None` where the jet does not count there.
    pub fn carried<const D: usize>(&self, from: &Frame<D>, to: &Frame<D>) -> Option<Self> {
        let v = from.log(&to.point, ON_SURFACE);
        let back = to.log(&from.point, ON_SURFACE);
        let [x, y] = self.split(v);
        let gauss = 0.5 * (from.gauss + to.gauss);
        let growth = grow(self.curvature, x, y, gauss)?;
        let front = y / growth.spread;
        if !self.covers(x, front) {
            return None;
        }
        // The direction at the end follows from the step in the surface of constant curvature, seen
        // from the arriving step.
        let hand = from.handedness(to);
        let arrival = norm(back);
        let length = norm(v);
        let gradient = if arrival > 0.0 && length > 0.0 {
            let t = [-back[0] / arrival, -back[1] / arrival];
            let turn = gauss * length * length;
            let cosine = ((1.0 - 0.5 * turn) * x / length
                + self.curvature * length * (1.0 - turn / 6.0))
                / growth.spread;
            let sine = -y / (length * growth.spread);
            let slope = 0.5 * self.curvature_rate * front * front / growth.spread;
            let (cosine, sine) = (cosine - sine * slope, hand * (sine + cosine * slope));
            let scale = cosine.hypot(sine).recip();
            let (cosine, sine) = (cosine * scale, sine * scale);
            [cosine * t[0] - sine * t[1], cosine * t[1] + sine * t[0]]
        } else {
            let g = to.coordinates(&from.vector(self.gradient));
            [g[0] / norm(g), g[1] / norm(g)]
        };
        let curvature = self.curvature + self.curvature_rate * front;
        let mut heading = self.heading_after(x, front, growth.spread, gauss);
        heading.turn *= hand;
        let [right, left] = self.width;
        let Growth {
            delta,
            spread,
            sn,
            cs,
        } = growth;
        Some(Self {
            distance: self.distance + delta + self.curvature_rate * front * front * front / 6.0,
            gradient,
            curvature: (curvature * cs - gauss * sn) / (cs + curvature * sn),
            curvature_rate: hand * self.curvature_rate / (spread * spread * spread),
            curvature_rate_error: self.curvature_rate_error / (spread * spread * spread),
            width: if hand > 0.0 {
                [right, left]
            } else {
                [left, right]
            },
            step_error: self.curvature_rate_error * front.abs().powi(3) / 6.0,
            heading,
        })
    }

    /// The angle at the source of the ray through tangent coordinates `v`; the angle of the jet's
    /// own ray where none is known there.
    pub fn angle_at(&self, v: [f64; 2], gauss: f64) -> f64 {
        let [x, y] = self.split(v);
        let growth = grow(self.curvature, x, y, gauss);
        growth.map_or(self.heading.angle, |growth| {
            let front = y / growth.spread;
            self.heading_after(x, front, growth.spread, gauss).angle
        })
    }

    /// Whether the jet may be carried by `ahead` along the gradient and `front` along the front to
    /// the left. Rays that left a point in all directions are not followed past where they meet,
    /// which may be a caustic.
    fn covers(&self, ahead: f64, front: f64) -> bool {
        let is_round = self.heading.range.is_none() && !self.heading.is_diffracted();
        // Behind a front that is a circle about the source lies the source itself, and no caustic.
        let about_source = (self.curvature / self.heading.turn.abs() - 1.0).abs() < CIRCLE;
        let meet = is_round && !about_source && 1.0 + self.curvature * ahead < FOCUS;
        !meet && -self.width[0] <= front && front <= self.width[1]
    }

    /// How far along the front it is from tangent coordinates `v` back to where there are rays of
    /// the same kind.
    pub fn beyond_at(&self, v: [f64; 2], gauss: f64) -> f64 {
        let [x, y] = self.split(v);
        let growth = self
            .heading
            .range
            .and_then(|_| grow(self.curvature, x, y, gauss));
        growth.map_or(0.0, |growth| {
            let front = y / growth.spread;
            self.heading_after(x, front, growth.spread, gauss).beyond()
        })
    }

    /// The heading of the ray that leads to a place `ahead` along the gradient. That ray meets the
    /// front by `front` to the left of the jet, and then spreads by the factor `spread`.
    fn heading_after(&self, ahead: f64, front: f64, spread: f64, gauss: f64) -> Heading {
        // The arc along the front itself, which is a circle in the surface of constant curvature.
        let circle = self.curvature * self.curvature + gauss;
        let arc = if 1.0 + self.curvature * ahead < 0.0 && circle > 0.0 {
            // Beyond the circle's centre, rays come from its far half.
            let sine = (front * circle.sqrt()).abs().min(1.0);
            (PI - sine.asin()).copysign(front) / circle.sqrt()
        } else {
            front * (1.0 + circle * front * front / 6.0)
        };
        Heading {
            angle: self.heading.at(arc),
            turn: (self.heading.turn + arc * self.heading.turn_rate) / spread,
            turn_rate: self.heading.turn_rate / (spread * spread),
            range: self.heading.range,
        }
    }

    /// How far tangent coordinates `v` lie ahead along the gradient.
    pub fn ahead(&self, v: [f64; 2]) -> f64 {
        self.split(v)[0]
    }

    /// The components of `v` along the gradient and to the left of it.
    fn split(&self, v: [f64; 2]) -> [f64; 2] {
        let g = self.gradient;
        [g[0] * v[0] + g[1] * v[1], g[0] * v[1] - g[1] * v[0]]
    }
}

/// The growth of the distance over a step x along the gradient and y to the side, on a front of
/// curvature `kappa` in a surface of Gauss curvature `gauss`; `None` where rays meet.
pub(crate) fn grow(kappa: f64, x: f64, y: f64, gauss: f64) -> Option<Growth> {
    let squared = x * x + y * y;
    let curved = (gauss * squared).clamp(-MOST_GAUSS, MOST_GAUSS);
    let gauss = if squared > 0.0 {
        curved / squared
    } else {
        gauss
    };
    // This is the right-hand side of the equation for delta, with sn and md by their series.
    let sine = 1.0 - curved / 6.0 * (1.0 - curved / 20.0 * (1.0 - curved / 42.0));
    let versine = 0.5 - curved / 24.0 * (1.0 - curved / 30.0 * (1.0 - curved / 56.0));
    let reached = x * sine + kappa * squared * versine;
    let discriminant = 1.0 + reached * (2.0 * kappa - gauss * reached);
    // In t = tn(delta / 2) the equation for delta is quadratic; `t` is its root.
    let least = if kappa < 0.0 { FOCUS * FOCUS } else { 0.0 };
    if discriminant <= least || discriminant.is_nan() {
        return None;
    }
    let spread = discriminant.sqrt();
    let t = reached / (1.0 + spread);
    let z = gauss * t * t;
    let inverse = (1.0 + z).recip();
    let delta = 2.0 * t * (1.0 - z * (1.0 / 3.0 - z * (0.2 - z * (1.0 / 7.0 - z / 9.0))));
    // No distance changes by more than the step.
    (delta * delta <= JET_GROWTH * squared).then_some(Growth {
        delta,
        spread,
        sn: 2.0 * t * inverse,
        cs: (1.0 - z) * inverse,
    })
}

/// The gradient as a vector at the point that `v` leads to, where the front has turned: the
/// gradient is carried along and turned with the surface. Its error is of second order in `v`.
pub(crate) fn direction_at<const D: usize>(frame: &Frame<D>, jet: &Jet, v: [f64; 2]) -> Vector<D> {
    let [x, y] = jet.split(v);
    let (ahead, left) = (1.0 + jet.curvature * x, jet.curvature * y);
    let g = jet.gradient;
    let turned = [ahead * g[0] - left * g[1], ahead * g[1] + left * g[0]];
    transported(frame, turned, v)
}

/// A tangent vector carried along `v` and turned with the surface, of unit length; zero for the
/// zero vector.
pub(crate) fn transported<const D: usize>(
    frame: &Frame<D>,
    tangent: [f64; 2],
    v: [f64; 2],
) -> Vector<D> {
    let vector = frame.vector(tangent) + frame.second_form(v, tangent);
    vector.try_normalize(0.0).unwrap_or_else(Vector::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::surface::implicit::{Equation, ImplicitSurface};
    use crate::surface::{Geometry, Surface};

    fn frame(x: [f64; 3]) -> Frame<3> {
        let sphere = ImplicitSurface::new(
            Equation(|x: &Vector<3>| (x.dot(x) - 1.0, x * 2.0, Matrix::<3>::identity() * 2.0)),
            1.0,
        );
        let x = Vector::<3>::from(x).normalize();
        let mut geometry = Geometry::new(1);
        assert!(sphere.geometry(&x, (), &mut geometry));
        Frame::new(x, &geometry)
    }

    /// Steps between points of the unit sphere, whose distance from a pole is known, in all
    /// directions: the error is of fifth order in the length of the step.
    #[test]
    fn steps_on_the_sphere_are_of_fifth_order() {
        let pole = frame([0.0, 0.0, 1.0]);
        let angle = |x: &Vector<3>| 2.0 * (0.5 * (x - pole.point).norm()).asin();
        let near = frame([0.1, 0.05, 1.0]);
        let first = Jet::of_point(&pole, 0.0, &near).expect("a distance");
        assert!((first.distance - angle(&near.point)).abs() < 1e-6);
        let mut worst = [0.0_f64; 2];
        for (size, worst) in [0.1, 0.05].into_iter().zip(&mut worst) {
            for base in [[1.0, 0.3, 0.2], [0.2, -0.5, -0.4], [0.4, 0.1, 0.7]] {
                let from = frame(base);
                let distance = angle(&from.point);
                let away = from.coordinates(&-pole.point);
                let gradient = away.map(|a| a / norm(away));
                let curvature = distance.cos() / distance.sin();
                let jet = Jet::new(distance, gradient, curvature, Heading::default());
                for turn in 0..16 {
                    let (sin, cos) = (f64::from(turn) * 0.4).sin_cos();
                    let there = from.point + from.vector([size * cos, size * sin]);
                    let to = frame([there.x, there.y, there.z]);
                    let carried = jet.carried(&from, &to).expect("no focus between");
                    let truth = angle(&to.point);
                    *worst = worst.max((carried.distance - truth).abs());
                    let direct = jet.distance_at(from.log(&to.point, ON_SURFACE), 1.0);
                    assert_eq!(direct, Some((carried.distance, 0.0)));
                    let slope = to.coordinates(&-pole.point).map(|a| a / truth.sin());
                    let off = [
                        slope[0] - carried.gradient[0],
                        slope[1] - carried.gradient[1],
                    ];
                    assert!(
                        norm(off) < 1e-4 && (carried.curvature * truth.tan() - 1.0).abs() < 1e-3
                    );
                }
            }
        }
        assert!(worst[0] < 1e-6 && worst[1] < worst[0] / 16.0, "{worst:?}");
    }
}
