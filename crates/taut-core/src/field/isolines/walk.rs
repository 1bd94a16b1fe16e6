//! Following an isoline from one of its places.

use crate::Vector;
use crate::field::isolines::GRADIENTS_ALIKE;
use crate::field::isolines::spot::{Follower, Spot};
use crate::field::plane::norm;
use crate::guess::Guide;

/// Longest step, in mean edges of the graph.
const LONGEST_LINE_STEP: f64 = 0.25;
/// Shortest step, in mean edges of the graph; it is also how well kinks are known.
const SHORTEST_LINE_STEP: f64 = LONGEST_LINE_STEP / 64.0;
/// Least cosine of the turn in a step, except in a kink.
const LEAST_STEP_COSINE: f64 = 0.98;
/// Cosine of the turn in a step above which the next step may be longer.
const STRAIGHT_STEP: f64 = 0.995;
/// Factor by which the next step may be longer after a straight one.
const STEP_GROWTH: f64 = 1.6;
/// Least distance that a step must lead onwards, as a share of its length.
const ONWARD: f64 = 0.2;
/// Distances, in shortest steps, at which the line is looked for behind a sharp corner.
const CORNER_LOOKS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
/// Length without a new seed, in mean edges of the graph, after which a line is taken to run where
/// it ran before.
const LOST_LENGTH: f64 = 10.0;
/// Distance from the start, as a share of a step, within which a passing line closes.
const CLOSING: f64 = 0.3;

/// The distance of a point from the straight step between two places.
pub(super) fn off<const D: usize, P>(x: &Vector<D>, from: &Spot<D, P>, to: &Spot<D, P>) -> f64 {
    let step = to.point - from.point;
    let along = (x - from.point).dot(&step) / step.norm_squared();
    (x - from.point - step * along.clamp(0.0, 1.0)).norm()
}

/// A place with the direction in which the line goes on from there, with the nearer side to one
/// hand.
struct Way<const D: usize, P> {
    spot: Spot<D, P>,
    /// The side on which the nearer points lie, 1 or -1, by the orientation of the spot's frame.
    hand: f64,
    /// The unit direction in which the line goes on.
    onward: Vector<D>,
}

impl<const D: usize, P: Copy> Way<D, P> {
    fn new(spot: Spot<D, P>, hand: f64) -> Self {
        Self {
            onward: tangent(&spot, hand),
            spot,
            hand,
        }
    }

    /// The way at another place beside this one, with the nearer side to the same hand.
    fn at(&self, spot: Spot<D, P>) -> Self {
        let hand = self.hand * self.spot.frame.handedness(&spot.frame);
        Self::new(spot, hand)
    }
}

impl<const D: usize, S: Guide<D>> Follower<'_, D, S> {
    /// Follows the line from a place on, and tells whether it comes back. The nearer side stays on
    /// one hand: `hand` is 1 or -1 for the two directions. `pass` is told each step and says
    /// whether it leads past a new seed.
    pub fn walk(
        &mut self,
        start: &Spot<D, S::Place>,
        hand: f64,
        pass: &mut impl FnMut(&Spot<D, S::Place>, &Spot<D, S::Place>) -> bool,
    ) -> (Vec<Spot<D, S::Place>>, bool) {
        let mut line = vec![*start];
        let mut way = Way::new(*start, hand);
        let mut mean = self.fields.mean_edge(start.near);
        let mut length = LONGEST_LINE_STEP * mean;
        let (mut astray, mut fresh) = (0.0, line.len());
        loop {
            // A line that passes no new seed runs where it ran before, and is cut back to the last
            // one.
            if astray > LOST_LENGTH * mean {
                line.truncate(fresh);
                break;
            }
            let here = way.spot;
            let shortest = SHORTEST_LINE_STEP * mean;
            let x = here.point + way.onward * length;
            let next = self.on_level(&x, (here.place, here.near), length);
            let next = next.map(|next| way.at(next));
            let cosine = |next: &Way<D, S::Place>| next.onward.dot(&way.onward);
            let step = |next: &Way<D, S::Place>| (next.spot.point - here.point).norm();
            let ahead = next.filter(|next| step(next) > ONWARD * length);
            let straight = ahead.as_ref().map_or(-1.0, cosine);
            // A step is halved until it turns little; what still turns at the shortest step is a
            // kink.
            if straight < LEAST_STEP_COSINE && length > shortest {
                length = (0.5 * length).max(shortest);
                continue;
            }
            let next = match ahead {
                Some(next) => next,
                None => match self.round_corner(&way, shortest) {
                    Some(next) => next,
                    None => break,
                },
            };
            let step = step(&next);
            if line.len() > 2 && comes_back(start, &here, &next.spot, step) {
                pass(&here, start);
                line.push(*start);
                return (line, true);
            }
            line.push(next.spot);
            astray += step;
            if pass(&here, &next.spot) {
                (astray, fresh) = (0.0, line.len());
            }
            mean = self.fields.mean_edge(next.spot.near);
            way = next;
            if straight > STRAIGHT_STEP {
                length = (STEP_GROWTH * length).min(LONGEST_LINE_STEP * mean);
            }
        }
        (line, false)
    }

    /// Goes on from a place where a front from elsewhere ends the line's own front, along that
    /// front's line.
    fn round_corner(&mut self, way: &Way<D, S::Place>, shortest: f64) -> Option<Way<D, S::Place>> {
        let here = &way.spot;
        for far in CORNER_LOOKS {
            let x = here.point + way.onward * (far * shortest);
            let other = way.at(self.spot(&x, (here.place, here.near))?);
            if other.spot.ahead.dot(&here.ahead) >= LEAST_STEP_COSINE {
                continue;
            }
            for far in CORNER_LOOKS {
                let x = here.point + other.onward * (far * shortest);
                let place = (other.spot.place, other.spot.near);
                let next = self.on_level(&x, place, far * shortest);
                let is_onward = |next: &Spot<D, S::Place>| {
                    let step = (next.point - here.point).norm();
                    step > ONWARD * shortest
                        && next.ahead.dot(&other.spot.ahead) >= LEAST_STEP_COSINE
                };
                if let Some(next) = next.filter(is_onward) {
                    return Some(other.at(next));
                }
            }
        }
        None
    }
}

/// The unit vector at right angles to the gradient, to one hand.
fn tangent<const D: usize, P>(spot: &Spot<D, P>, hand: f64) -> Vector<D> {
    let [a, b] = spot.frame.coordinates(&spot.ahead);
    let inverse = hand / norm([a, b]);
    spot.frame.vector([-b * inverse, a * inverse])
}

/// Whether a step passes the line's start.
fn comes_back<const D: usize, P>(
    start: &Spot<D, P>,
    from: &Spot<D, P>,
    to: &Spot<D, P>,
    step: f64,
) -> bool {
    let alike = |spot: &Spot<D, P>| spot.ahead.dot(&start.ahead) >= GRADIENTS_ALIKE;
    off(&start.point, from, to) <= CLOSING * step && (alike(from) || alike(to))
}
