//! Jets of a distance in any dimension: its value, its gradient and the shape operator of its
//! front, carried over a step.
//!
//! A step goes x along the gradient and y to the side. The front's shape operator S follows the
//! equation of Riccati, S' = -S^2 - R, where R is the curvature along the ray. In the plane of the
//! step S acts as that of a front in the surface of constant curvature K = <R u, u>, u = y / |y|,
//! where the step is exact ([`grow`]). Errors are of fourth order in the step, except that the
//! change of S along the front makes one of third order.

use crate::field::manifold::frame::Frame;
use crate::field::rays::frame::ON_SURFACE;
use crate::field::rays::jet::FOCUS;
use crate::field::rays::jet::{Growth, grow};
use crate::{Matrix, Vector};

/// The Taylor expansion of a distance near a point with a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet<const D: usize> {
    /// The distance at the point, in the input's units.
    pub distance: f64,
    /// The unit gradient, in the frame's tangent coordinates.
    pub gradient: Vector<D>,
    /// The second derivatives of the distance, which are the shape operator of the front; 0 along
    /// the gradient.
    pub shape: Matrix<D>,
}

/// Least distance, as a share of the distance before the step, that rays which draw together must
/// keep in a step that carries a jet, which depends more on them.
const JET_FOCUS: f64 = 0.25;

/// A step of the distance in the plane of the gradient and the step.
struct Step<const D: usize> {
    growth: Growth,
    /// Length of the step along the gradient.
    x: f64,
    /// Length of the step to the side.
    y: f64,
    /// The unit vector to the side.
    side: Vector<D>,
    /// Curvature of the front to the side, with which the step is exact under constant curvature.
    front: f64,
    /// Curvature of the surface in the plane of the step.
    gauss: f64,
    /// Slope of the distance out of the plane.
    across: Vector<D>,
    /// The factor by which rays to the side draw together along the gradient.
    drawn: f64,
    tidal: Matrix<D>,
}

impl<const D: usize> Jet<D> {
    /// The jet, in the frame of `to`, of the distance from a source at the point of `from`, where
    /// the distance is `start`.
    pub fn of_point(from: &Frame<D>, start: f64, to: &Frame<D>) -> Option<Self> {
        let length = from.log(&to.point, ON_SURFACE).norm();
        let gradient = -to.log(&from.point, ON_SURFACE).try_normalize(0.0)?;
        let mut across = -gradient * gradient.transpose();
        for i in 0..to.dimension() {
            across[(i, i)] += 1.0;
        }
        let shape = across / length - to.tidal(&gradient) * (length / 3.0);
        (length > 0.0).then_some(Self {
            distance: start + length,
            gradient,
            shape,
        })
    }

    /// Whether the least curvature of the front is above a bound, so that no rays beside draw
    /// together faster.
    pub fn spreads_faster(&self, bound: f64) -> bool {
        (self.shape - Matrix::identity() * bound)
            .cholesky()
            .is_some()
    }

    /// The distance at tangent coordinates `v`; `None` beyond where rays meet.
    pub fn distance_at(&self, frame: &Frame<D>, v: &Vector<D>) -> Option<f64> {
        Some(self.distance + self.step(frame, v)?.growth.delta)
    }

    /// The jet carried from its frame to another frame; `None` beyond where rays meet, and where
    /// the gradient would be turned round.
    pub fn carried(&self, from: &Frame<D>, to: &Frame<D>) -> Option<Self> {
        let v = from.log(&to.point, ON_SURFACE);
        let step = self.step(from, &v)?;
        if step.drawn * JET_FOCUS > 1.0 {
            return None;
        }
        let gradient = step.gradient(from, to, &v, self)?;
        let delta = step.growth.delta;
        let shape = self.shape_after(&step.tidal, delta)?;
        let shape = from.transported_matrix(to, &v, &shape);
        let before = from.transported(to, &v, &self.gradient);
        let turn = rotation(&before.try_normalize(0.0)?, &gradient)?;
        let shape = turn * shape * turn.transpose();
        Some(Self {
            distance: self.distance + delta,
            gradient,
            shape,
        })
    }

    /// How neighbouring rays spread over a length along the gradient, as a matrix that is the
    /// identity at first, and its derivative by the length.
    fn spread(&self, tidal: &Matrix<D>, length: f64) -> (Matrix<D>, Matrix<D>) {
        let (s, r) = (&self.shape, tidal);
        let rs = r * s;
        let rr = r * r;
        let l = length;
        let spread = Matrix::identity() + s * l - r * (l * l / 2.0) - rs * (l * l * l / 6.0)
            + rr * (l.powi(4) / 24.0);
        let slope = s - r * l - rs * (l * l / 2.0) + rr * (l * l * l / 6.0);
        (spread, slope)
    }

    /// The shape operator of the front after a length along the gradient.
    fn shape_after(&self, tidal: &Matrix<D>, length: f64) -> Option<Matrix<D>> {
        let (spread, slope) = self.spread(tidal, length);
        let shape = slope * spread.try_inverse()?;
        Some((shape + shape.transpose()) * 0.5)
    }

    /// The step of the distance to tangent coordinates `v`; `None` beyond where rays meet.
    fn step(&self, frame: &Frame<D>, v: &Vector<D>) -> Option<Step<D>> {
        let tidal = frame.tidal(&self.gradient);
        let x = self.gradient.dot(v);
        let beside = v - self.gradient * x;
        let y = beside.norm();
        let side = if y > 0.0 { beside / y } else { beside };
        let gauss = (tidal * side).dot(&side);
        let (spread, slope) = self.spread(&tidal, x);
        let left = spread.try_inverse()? * side;
        if left.dot(&side) < 0.0 {
            return None;
        }
        let turned = slope * left;
        let after = turned.dot(&side);
        let across = (turned - side * after) * y;
        // This is the curvature of the front before the step that becomes `after` under constant
        // curvature.
        let z = gauss * x * x;
        let (cs, sn) = (
            1.0 - z / 2.0 * (1.0 - z / 12.0),
            x * (1.0 - z / 6.0 * (1.0 - z / 20.0)),
        );
        let share = cs - after * sn;
        if share <= FOCUS {
            return None;
        }
        let front = (after * cs + gauss * sn) / share;
        Some(Step {
            growth: grow(front, x, y, gauss)?,
            x,
            y,
            side,
            front,
            gauss,
            across,
            drawn: left.norm(),
            tidal,
        })
    }

    /// The gradient as a vector at the point that `v` leads to: carried along and turned with the
    /// surface, to second order.
    pub fn direction_at(&self, frame: &Frame<D>, v: &Vector<D>) -> Vector<D> {
        transported(frame, &(self.gradient + self.shape * v), v)
    }
}

impl<const D: usize> Step<D> {
    /// The unit gradient at the end of the step, in the frame there.
    fn gradient(
        &self,
        from: &Frame<D>,
        to: &Frame<D>,
        v: &Vector<D>,
        jet: &Jet<D>,
    ) -> Option<Vector<D>> {
        let length = v.norm();
        if length == 0.0 {
            let carried = from.transported(to, v, &jet.gradient);
            return carried.try_normalize(0.0);
        }
        let arrival = -to.log(&from.point, ON_SURFACE).try_normalize(0.0)?;
        let turn = self.gauss * length * length;
        let cosine = ((1.0 - 0.5 * turn) * self.x / length
            + self.front * length * (1.0 - turn / 6.0))
            / self.growth.spread;
        let sine = self.y / (length * self.growth.spread);
        // This direction lies in the plane, at a right angle to the step, on the side where the
        // gradient is.
        let beside = (jet.gradient * self.y - self.side * self.x) / length;
        let beside = from.transported(to, v, &beside);
        let beside = (beside - arrival * arrival.dot(&beside)).try_normalize(0.0);
        let in_plane = arrival * cosine + beside.unwrap_or_else(Vector::zeros) * sine;
        let across = from.transported(to, v, &self.across);
        (in_plane + across).try_normalize(0.0)
    }
}

/// The least rotation that takes one unit vector to another; `None` where they are opposite, so
/// that there is no least one.
fn rotation<const D: usize>(from: &Vector<D>, to: &Vector<D>) -> Option<Matrix<D>> {
    let turn = to * from.transpose() - from * to.transpose();
    let share = 1.0 + from.dot(to);
    (share > 0.0).then(|| Matrix::identity() + turn + turn * turn / share)
}

/// A tangent vector carried along `v` and turned with the surface, of unit length; zero for the
/// zero vector.
pub(crate) fn transported<const D: usize>(
    frame: &Frame<D>,
    tangent: &Vector<D>,
    v: &Vector<D>,
) -> Vector<D> {
    let vector = frame.vector(tangent) + frame.second_form_along(v) * tangent;
    vector.try_normalize(0.0).unwrap_or_else(Vector::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::implicit::{Equation, ImplicitSurface};
    use crate::surface::{Geometry, Surface};

    fn frame(x: [f64; 4]) -> Frame<4> {
        let sphere = ImplicitSurface::new(
            Equation(|x: &Vector<4>| (x.dot(x) - 1.0, x * 2.0, Matrix::<4>::identity() * 2.0)),
            1.0,
        );
        let x = Vector::<4>::from(x).normalize();
        let mut geometry = Geometry::new(1);
        assert!(sphere.geometry(&x, (), &mut geometry));
        Frame::new(x, &geometry)
    }

    /// Steps between points of the unit sphere of R^4, whose distance from a pole is known: the
    /// error is of fifth order.
    #[test]
    fn steps_on_the_three_sphere_are_of_fifth_order() {
        let pole = frame([0.0, 0.0, 0.0, 1.0]);
        let angle = |x: &Vector<4>| 2.0 * (0.5 * (x - pole.point).norm()).asin();
        let mut worst = [0.0_f64; 2];
        for (size, worst) in [0.1, 0.05].into_iter().zip(&mut worst) {
            for base in [
                [1.0, 0.3, 0.2, 0.4],
                [0.2, -0.5, -0.4, -0.2],
                [0.4, 0.1, 0.7, 0.5],
                [0.2, 0.1, -0.1, -0.8],
            ] {
                let from = frame(base);
                let distance = angle(&from.point);
                let away = from.coordinates(&-pole.point).normalize();
                let mut across = -away * away.transpose();
                for i in 0..3 {
                    across[(i, i)] += 1.0;
                }
                let jet = Jet {
                    distance,
                    gradient: away,
                    shape: across * (distance.cos() / distance.sin()),
                };
                for turn in 0..32 {
                    let (sin, cos) = (f64::from(turn) * 0.4).sin_cos();
                    let (rise, flat) = (f64::from(turn) * 1.3).sin_cos();
                    let v = Vector::<4>::new(flat * cos, flat * sin, rise, 0.0) * size;
                    let to = frame((from.point + from.vector(&v)).into());
                    let carried = jet.carried(&from, &to).expect("no focus between");
                    let truth = angle(&to.point);
                    *worst = worst.max((carried.distance - truth).abs());
                    let slope = to.coordinates(&-pole.point) / truth.sin();
                    assert!((slope - carried.gradient).norm() < 1e-3);
                    let mut across = -slope * slope.transpose();
                    for i in 0..3 {
                        across[(i, i)] += 1.0;
                    }
                    let shape = across * (truth.cos() / truth.sin());
                    assert!(
                        (shape - carried.shape).norm() < 0.02 * (1.0 + shape.norm()),
                        "{shape} {}",
                        carried.shape
                    );
                }
            }
        }
        assert!(worst[0] < 1e-6 && worst[1] < worst[0] / 16.0, "{worst:?}");
    }
}
