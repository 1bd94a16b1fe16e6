//! Fields of least cost: a cost per length that differs from point to point or depends on the
//! slope, and places that nothing passes.
//!
//! Rays do not serve for costs that jump. Costs are marched over the points of the cloud
//! themselves, which know more of the costs than the charts do. Each point takes the least way
//! through the segments between its neighbours (ordered upwind methods: J. A. Sethian, A.
//! Vladimirsky, SIAM Journal on Numerical Analysis 41, 2003). The cost on a segment is cubic, by
//! its values and gradients at both ends (jet marching: S. F. Potter, M. K. Cameron, SIAM Journal
//! on Scientific Computing 43, 2021).

mod barrier;
mod evaluate;
mod march;
mod net;
mod update;

pub(crate) use march::{Limits, Marched, SourcePlace, find};
pub(crate) use net::Net;

use crate::Vector;
use crate::error::Error;
use crate::field::sources::nearest_entrance;
use crate::field::{Field, Fields, Other, Settings, Source, Sources, frame};
use crate::guess::Guide;
use crate::surface::Geometry;

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The field of least cost, which ends where `enough` points are passed.
    pub(crate) fn by_cost(
        &self,
        net: &Net<D>,
        sources: Sources<'_, D, S::Place>,
        enough: usize,
        settings: &Settings,
    ) -> Result<Field<D>, Error> {
        let surface = self.geodesics.surface();
        let is_surface = surface.intrinsic_dimension() == 2;
        let origin = |source: u32, at: &Source<D, S::Place>, gap: f64| {
            let entrances = self.geodesics.entrances(&at.node);
            SourcePlace {
                point: at.node.point,
                near: nearest_entrance(&entrances).map(|nearest| nearest.0),
                start: at.start,
                source,
                gap,
                frame: is_surface
                    .then(|| frame(surface, &at.node, &mut Geometry::new(D - 2)))
                    .flatten(),
            }
        };
        let origins: Vec<SourcePlace<D>> = match sources {
            Sources::Points([]) => return Err(Error::NoSources),
            Sources::Points(points) => {
                let points = (0..).zip(points);
                points.map(|(i, at)| origin(i, at, 0.0)).collect()
            }
            Sources::Curve(curve) => {
                let spacing = |x: &Vector<D>, near: u32| net.spacing_at(x, near);
                let places = self.places_on(curve, spacing);
                places.iter().map(|(at, gap)| origin(0, at, *gap)).collect()
            }
        };
        let limits = Limits {
            longest: settings.max_distance,
            enough,
        };
        let coordinates = self.geodesics.surface().origin();
        let found = find(net, origins, limits, &coordinates)?;
        Ok(Field::of_other(Other::Cost(found), settings.max_distance))
    }
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The indices of the [`barriers`](Cost::barriers) that change nothing, because no point lies
    /// within them and none of their edges lies between a point and its neighbours.
    #[must_use]
    pub fn idle_barriers(&self) -> Vec<usize> {
        self.ground
            .net
            .as_ref()
            .map_or_else(Vec::new, Net::idle_barriers)
    }
}

/// What a way costs: the integral of the cost per length.
#[derive(Clone, Debug, Default)]
pub struct Cost {
    /// Cost per length at each input row: positive, and infinite where nothing passes. If empty,
    /// the cost is 1 everywhere. Values at dropped rows are ignored, and of repeated rows the first
    /// counts.
    pub at_rows: Vec<f64>,
    /// How the slope multiplies the cost.
    pub slope: Slope,
    /// Polygons that nothing passes through, however thin they are. Each is given by the first two
    /// coordinates of its corners, in the input's units, as it is seen along the third axis. Points
    /// within it are not reached.
    pub barriers: Vec<Vec<[f64; 2]>>,
}

/// By how much going up or down multiplies the cost per length. The third coordinate points up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Slope {
    /// The slope does not change the cost.
    #[default]
    Level,
    /// The time of walking by W. Tobler, "Three presentations on geographical analysis and
    /// modeling", 1993, relative to level ground: exp(3.5 |g + 0.05|) / exp(3.5 * 0.05), where g is
    /// the rise over the horizontal run. It is least downhill, at g = -0.05.
    Hiking,
    /// The cost is multiplied by 1 + `up` g uphill and by 1 + `down` |g| downhill, where g is the
    /// rise over the horizontal run.
    Factors {
        /// Factor of the grade uphill; it is not negative.
        up: f64,
        /// Factor of the grade downhill; it is not negative.
        down: f64,
    },
}

/// Decay of the walking speed by grade, in Tobler's function.
const SPEED_DECAY: f64 = 3.5;
/// Downhill grade at which walking is fastest, in Tobler's function.
const EASIEST: f64 = 0.05;
/// Index of the coordinate that points up.
const UP: usize = 2;

impl Slope {
    /// The factor by which a grade multiplies the cost, and the derivative of the factor by the
    /// grade.
    fn factor(self, grade: f64) -> (f64, f64) {
        match self {
            Self::Level => (1.0, 0.0),
            Self::Hiking => {
                let off = grade + EASIEST;
                let factor = (SPEED_DECAY * (off.abs() - EASIEST)).exp();
                (factor, SPEED_DECAY * factor * off.signum())
            }
            Self::Factors { up, down } => {
                if grade > 0.0 {
                    (1.0 + up * grade, up)
                } else {
                    (1.0 - down * grade, -down)
                }
            }
        }
    }

    /// The cost of a straight step where the cost per level length is 1, and its gradient by the
    /// step.
    fn step<const D: usize>(self, step: &Vector<D>) -> (f64, Vector<D>) {
        let length = step.norm();
        if self == Self::Level || D <= UP || length == 0.0 {
            return (length, step / length.max(f64::MIN_POSITIVE));
        }
        let run = (length * length - step[UP] * step[UP]).max(0.0).sqrt();
        let grade = step[UP] / run;
        let (factor, change) = self.factor(grade);
        // The grade grows with the rise and falls along the horizontal part of the step.
        let mut gradient = step * (factor / length - length * change * grade / (run * run));
        gradient[UP] = factor * step[UP] / length + length * change / run;
        (length * factor, gradient)
    }

    /// Refuses factors that are negative or not finite.
    fn check(self) -> Result<(), Error> {
        let Self::Factors { up, down } = self else {
            return Ok(());
        };
        let wrong = [up, down]
            .into_iter()
            .find(|factor| !(*factor >= 0.0 && factor.is_finite()));
        wrong.map_or(Ok(()), |found| Err(Error::BadSlope { found }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_of_steps_are_their_derivatives() {
        let laws = [
            Slope::Level,
            Slope::Hiking,
            Slope::Factors { up: 3.0, down: 0.5 },
        ];
        for law in laws {
            for step in [[0.3, 0.4, 0.1], [-0.2, 0.5, -0.3], [0.1, -0.7, 0.0001]] {
                let step = Vector::<3>::from(step);
                let (cost, gradient) = law.step(&step);
                assert!((gradient.dot(&step) - cost).abs() < 1e-12, "{law:?}");
                for i in 0..3 {
                    let mut there = step;
                    there[i] += 1e-7;
                    let slope = (law.step(&there).0 - cost) / 1e-7;
                    assert!((slope - gradient[i]).abs() < 1e-5, "{law:?} {step} {i}");
                }
            }
        }
    }
}
