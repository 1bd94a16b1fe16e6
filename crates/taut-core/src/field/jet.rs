//! Jets of a distance: value, gradient, curvature of the front and its change, carried over a step.
//!
//! A step is made in the surface of constant curvature K, the mean of both ends: with sn, cs and md its
//! sine, cosine and (1 - cs) / K, the distance grows by delta where
//! sn(delta) + kappa md(delta) = sn(s) cos(theta) + kappa md(s), s the length of the step and theta its
//! angle to the gradient; kappa' = -kappa^2 - K (Riccati) along rays.

use std::f64::consts::{PI, TAU};

use crate::Vector;
use crate::field::frame::{Frame, ON_SURFACE};

/// A distance near a point with a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet {
    pub distance: f64,
    /// Unit gradient in the frame's tangent coordinates.
    pub gradient: [f64; 2],
    /// Geodesic curvature of the front, positive where rays spread.
    pub curvature: f64,
    /// Its derivative along the front, to the left of the gradient in the frame.
    pub change: f64,
    /// Estimated error of that.
    pub change_error: f64,
    /// How far along the front the jet may be used, to the right and to the left of the gradient in the frame.
    pub width: [f64; 2],
    /// Estimated error of the distance by the step that carried the jet here.
    pub step_error: f64,
    pub heading: Heading,
}

/// The direction at the source of the ray that arrives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Heading {
    /// In the tangent coordinates of the source's frame.
    pub angle: f64,
    /// Its derivative along the front, to the left of the gradient: 1 / J, negative where left at the source
    /// is right here, and 0 where the ray came round a rim.
    pub turn: f64,
    /// Its second derivative along the front.
    pub bow: f64,
    /// Between which angles there are rays of the kind, where not all round. Of rays that leave a curve square to it
    /// the angle is their place on it instead.
    pub range: Option<[f64; 2]>,
}

impl Heading {
    /// All rays that come round a point of a rim left the source in the same direction.
    pub fn same(angle: f64) -> Self {
        Self {
            angle,
            ..Self::default()
        }
    }

    /// The ray came round a rim.
    pub fn is_bent(&self) -> bool {
        self.turn == 0.0
    }

    /// The angle from this to another of the same kind.
    pub fn turned_to(&self, other: &Self) -> f64 {
        if self.range.is_some() {
            other.angle - self.angle
        } else {
            turned_by(self.angle, other.angle)
        }
    }

    /// How far along the front it is back to where there are rays of the kind.
    pub fn beyond(&self) -> f64 {
        let off = |[from, to]: [f64; 2]| (from - self.angle).max(self.angle - to).max(0.0);
        self.range.map_or(0.0, |range| off(range) / self.turn.abs())
    }

    /// How far along the front rays spread alike.
    pub fn even(&self, spacing: f64) -> f64 {
        if self.range.is_some() || self.is_bent() {
            return f64::INFINITY;
        }
        (WIDE * spacing).min(EVEN * (self.turn / self.bow).abs())
    }

    /// How wide the rays of the kind are here.
    pub fn width(&self) -> f64 {
        self.range
            .map_or(f64::INFINITY, |[from, to]| (to - from) / self.turn.abs())
    }

    /// The angle this far along the front.
    fn at(&self, arc: f64) -> f64 {
        self.angle + arc * (self.turn + 0.5 * arc * self.bow)
    }
}

/// A jet may be used so many spacings of the graph's nodes along its front, ...
pub(crate) const WIDE: f64 = 2.0;
/// ... and as far as the rays' spread changes by no more than this share.
const EVEN: f64 = 0.5;
/// Most curvature of the surface, times the square of the step: more is noise, and the series end.
const MOST_BENT: f64 = 0.3;
/// A front is a circle about the source where its curvature and 1 / J differ by less than this share.
const CIRCLE: f64 = 0.1;
/// Rays drawing together must not come nearer than this share of their distance in one step.
const FOCUS: f64 = 0.1;

/// Square of how much longer than the step the growth may come out.
const LONGER: f64 = 1.01;

/// A step of the distance.
pub(crate) struct Growth {
    /// By how much the distance grows.
    pub delta: f64,
    /// By how much the front spreads on the way.
    pub spread: f64,
    /// Sine and cosine of delta.
    sn: f64,
    cs: f64,
}

impl Jet {
    /// A jet of rays that spread as from a point, or along a circle.
    pub fn new(distance: f64, gradient: [f64; 2], curvature: f64, heading: Heading) -> Self {
        Self {
            distance,
            gradient,
            curvature,
            change: 0.0,
            change_error: 0.0,
            width: [f64::INFINITY; 2],
            step_error: 0.0,
            heading,
        }
    }

    /// A source at the frame's own point sees `to` at a distance; the jet there, in the frame of `to`.
    pub fn of_point<const D: usize>(from: &Frame<D>, start: f64, to: &Frame<D>) -> Option<Self> {
        let v = from.log(&to.point, ON_SURFACE);
        let length = norm(v);
        let back = to.log(&from.point, ON_SURFACE);
        let inverse = norm(back).recip();
        inverse.is_finite().then(|| {
            let bent = length * length * 0.5 * (from.gauss + to.gauss);
            let heading = Heading {
                angle: v[1].atan2(v[0]),
                turn: from.handedness(to) * (1.0 + bent / 6.0) / length,
                ..Heading::default()
            };
            let gradient = [-back[0] * inverse, -back[1] * inverse];
            let curvature = (1.0 - bent / 3.0) / length;
            Self::new(start + length, gradient, curvature, heading)
        })
    }

    /// The distance at tangent coordinates `v`, and the estimated error of the step; `None` beyond where rays meet.
    pub fn distance_at(&self, v: [f64; 2], gauss: f64) -> Option<(f64, f64)> {
        let [x, y] = self.split(v);
        let growth = grow(self.curvature, x, y, gauss)?;
        let front = y / growth.spread;
        let cube = front * front * front / 6.0;
        self.covers(x, front).then(|| {
            let distance = self.distance + growth.delta + self.change * cube;
            (distance, self.change_error * cube.abs())
        })
    }

    /// The jet carried from its frame to another one.
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
            let slope = 0.5 * self.change * front * front / growth.spread;
            let (cosine, sine) = (cosine - sine * slope, hand * (sine + cosine * slope));
            let scale = cosine.hypot(sine).recip();
            let (cosine, sine) = (cosine * scale, sine * scale);
            [cosine * t[0] - sine * t[1], cosine * t[1] + sine * t[0]]
        } else {
            let g = to.coordinates(&from.vector(self.gradient));
            [g[0] / norm(g), g[1] / norm(g)]
        };
        let curvature = self.curvature + self.change * front;
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
            distance: self.distance + delta + self.change * front * front * front / 6.0,
            gradient,
            curvature: (curvature * cs - gauss * sn) / (cs + curvature * sn),
            change: hand * self.change / (spread * spread * spread),
            change_error: self.change_error / (spread * spread * spread),
            width: if hand > 0.0 {
                [right, left]
            } else {
                [left, right]
            },
            step_error: self.change_error * front.abs().powi(3) / 6.0,
            heading,
        })
    }

    /// The angle at the source of the ray through tangent coordinates `v`; of the jet's own where none is known.
    pub fn angle_at(&self, v: [f64; 2], gauss: f64) -> f64 {
        let [x, y] = self.split(v);
        let growth = grow(self.curvature, x, y, gauss);
        growth.map_or(self.heading.angle, |growth| {
            let front = y / growth.spread;
            self.heading_after(x, front, growth.spread, gauss).angle
        })
    }

    /// Whether the jet may be carried so far ahead, and so far along the front to the left. Rays that left a point all round are
    /// not followed past where they meet: that may be a caustic.
    fn covers(&self, ahead: f64, front: f64) -> bool {
        let is_round = self.heading.range.is_none() && !self.heading.is_bent();
        // Behind a front that is a circle about the source there is the source itself, and no caustic.
        let about_source = (self.curvature / self.heading.turn.abs() - 1.0).abs() < CIRCLE;
        let meet = is_round && !about_source && 1.0 + self.curvature * ahead < FOCUS;
        !meet && -self.width[0] <= front && front <= self.width[1]
    }

    /// How far along the front it is back from tangent coordinates `v` to where there are rays of the kind.
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

    /// The heading of the ray that leads to a place `ahead` along the gradient, which meets the front so far to the left
    /// and then spreads.
    fn heading_after(&self, ahead: f64, front: f64, spread: f64, gauss: f64) -> Heading {
        // Along the front itself: it is a circle in the surface of constant curvature.
        let circle = self.curvature * self.curvature + gauss;
        let arc = if 1.0 + self.curvature * ahead < 0.0 && circle > 0.0 {
            // Beyond its centre rays come from the far half of it.
            let sine = (front * circle.sqrt()).abs().min(1.0);
            (PI - sine.asin()).copysign(front) / circle.sqrt()
        } else {
            front * (1.0 + circle * front * front / 6.0)
        };
        Heading {
            angle: self.heading.at(arc),
            turn: (self.heading.turn + arc * self.heading.bow) / spread,
            bow: self.heading.bow / (spread * spread),
            range: self.heading.range,
        }
    }

    /// How far tangent coordinates `v` lie ahead along the gradient.
    pub fn ahead(&self, v: [f64; 2]) -> f64 {
        self.split(v)[0]
    }

    /// Along the gradient and to the left of it.
    fn split(&self, v: [f64; 2]) -> [f64; 2] {
        let g = self.gradient;
        [g[0] * v[0] + g[1] * v[1], g[0] * v[1] - g[1] * v[0]]
    }
}

/// The growth of the distance over a step x along the gradient and y to the side, on a front of curvature
/// `kappa` in a surface of curvature `gauss`.
pub(crate) fn grow(kappa: f64, x: f64, y: f64, gauss: f64) -> Option<Growth> {
    let squared = x * x + y * y;
    let bent = (gauss * squared).clamp(-MOST_BENT, MOST_BENT);
    let gauss = if squared > 0.0 { bent / squared } else { gauss };
    // The right-hand side, sn and md by their series.
    let sine = 1.0 - bent / 6.0 * (1.0 - bent / 20.0 * (1.0 - bent / 42.0));
    let versine = 0.5 - bent / 24.0 * (1.0 - bent / 30.0 * (1.0 - bent / 56.0));
    let reached = x * sine + kappa * squared * versine;
    let discriminant = 1.0 + reached * (2.0 * kappa - gauss * reached);
    // In t = tn(delta / 2) the left-hand side makes it a quadratic equation, whose root this is.
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
    (delta * delta <= LONGER * squared).then_some(Growth {
        delta,
        spread,
        sn: 2.0 * t * inverse,
        cs: (1.0 - z) * inverse,
    })
}

/// The angle from one direction to another, between -pi and pi.
pub(crate) fn turned_by(from: f64, to: f64) -> f64 {
    (to - from + PI).rem_euclid(TAU) - PI
}

/// Length of tangent coordinates.
pub(crate) fn norm([a, b]: [f64; 2]) -> f64 {
    (a * a + b * b).sqrt()
}

/// The gradient as a vector at the point that `v` leads to, where the front has turned: carried along and
/// bent with the surface. Its error is of second order in `v`.
pub(crate) fn direction_at<const D: usize>(frame: &Frame<D>, jet: &Jet, v: [f64; 2]) -> Vector<D> {
    let [x, y] = jet.split(v);
    let (ahead, left) = (1.0 + jet.curvature * x, jet.curvature * y);
    let g = jet.gradient;
    let turned = [ahead * g[0] - left * g[1], ahead * g[1] + left * g[0]];
    bent(frame, turned, v)
}

/// A tangent vector carried along `v` and bent with the surface, of unit length; zero for the zero vector.
pub(crate) fn bent<const D: usize>(frame: &Frame<D>, tangent: [f64; 2], v: [f64; 2]) -> Vector<D> {
    let vector = frame.vector(tangent) + frame.bend(v, tangent);
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

    /// Steps between points of the unit sphere, whose distance from a pole is known, in all directions: of
    /// fifth order in the length of the step.
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
