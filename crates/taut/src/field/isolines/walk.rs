//! Following an isoline from one of its places.

use crate::Vector;
use crate::field::isolines::ALIKE;
use crate::field::isolines::spot::{Follower, Spot};
use crate::field::jet::norm;
use crate::guess::Guide;

/// Longest and shortest step, in mean edges of the graph: kinks are known to the latter.
const LONGEST: f64 = 0.25;
const SHORTEST: f64 = LONGEST / 64.0;
/// Cosine of the turn in a step, but in a kink.
const TURN: f64 = 0.98;
/// Where it is more than this, the next step may be longer by this factor.
const STRAIGHT: f64 = 0.995;
const LONGER: f64 = 1.6;
/// A step leads at least so far, in its length.
const ONWARD: f64 = 0.2;
/// Behind a sharp corner the line is looked for so many shortest steps away.
const CORNER: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
/// A line that passes none of the seeds on so many mean edges runs where it ran before.
const ASTRAY: f64 = 10.0;
/// A line closes if it passes its start at this share of a step.
const CLOSE: f64 = 0.3;

/// The distance of a point from the straight step between two places.
pub(super) fn off<const D: usize, P>(x: &Vector<D>, from: &Spot<D, P>, to: &Spot<D, P>) -> f64 {
    let step = to.point - from.point;
    let along = (x - from.point).dot(&step) / step.norm_squared();
    (x - from.point - step * along.clamp(0.0, 1.0)).norm()
}

impl<const D: usize, S: Guide<D>> Follower<'_, D, S> {
    /// The line from a place on, the nearer side on one hand throughout: `hand` is 1 or -1 for the two ways. And
    /// whether it comes back. `pass` hears of each step and says whether it leads past something new.
    pub fn walk(
        &mut self,
        start: &Spot<D, S::Place>,
        hand: f64,
        pass: &mut impl FnMut(&Spot<D, S::Place>, &Spot<D, S::Place>) -> bool,
    ) -> (Vec<Spot<D, S::Place>>, bool) {
        let mut line = vec![*start];
        let (mut here, mut hand) = (*start, hand);
        let mut onward = tangent(start, hand);
        let mut mean = self.fields.mean_edge(here.near);
        let mut length = LONGEST * mean;
        let (mut astray, mut fresh) = (0.0, line.len());
        loop {
            if astray > ASTRAY * mean {
                line.truncate(fresh);
                break;
            }
            let x = here.point + onward * length;
            let next = self.on_level(&x, (here.place, here.near), length);
            let shortest = SHORTEST * mean;
            let turned = next.as_ref().map(|next| {
                let hand = hand * here.frame.handedness(&next.frame);
                (hand, tangent(next, hand))
            });
            let cosine = turned.map_or(-1.0, |(_, ahead)| ahead.dot(&onward));
            let step = next.map_or(0.0, |next| (next.point - here.point).norm());
            let is_clear = cosine >= TURN && step >= ONWARD * length;
            if !is_clear && length > shortest {
                length = (0.5 * length).max(shortest);
                continue;
            }
            let found = if step >= ONWARD * length {
                next.zip(turned)
            } else {
                self.round_corner(&here, hand, &onward, shortest)
            };
            let Some((next, turned)) = found else { break };
            let step = (next.point - here.point).norm();
            if line.len() > 2 && comes_back(start, &here, &next, step) {
                pass(&here, start);
                line.push(*start);
                return (line, true);
            }
            line.push(next);
            astray += step;
            if pass(&here, &next) {
                (astray, fresh) = (0.0, line.len());
            }
            (here, hand, onward) = (next, turned.0, turned.1);
            mean = self.fields.mean_edge(here.near);
            if cosine > STRAIGHT {
                length = (LONGER * length).min(LONGEST * mean);
            }
        }
        (line, false)
    }

    /// On from a place where a front from elsewhere ends the line's own, along that: the place and its way on.
    fn round_corner(
        &mut self,
        here: &Spot<D, S::Place>,
        hand: f64,
        onward: &Vector<D>,
        shortest: f64,
    ) -> Option<(Spot<D, S::Place>, (f64, Vector<D>))> {
        for far in CORNER {
            let x = here.point + onward * (far * shortest);
            let other = self.spot(&x, (here.place, here.near))?;
            if other.ahead.dot(&here.ahead) >= TURN {
                continue;
            }
            let hand = hand * here.frame.handedness(&other.frame);
            let along = tangent(&other, hand);
            for far in CORNER {
                let x = here.point + along * (far * shortest);
                let next = self.on_level(&x, (other.place, other.near), far * shortest);
                if let Some(next) = next.filter(|next| next.ahead.dot(&other.ahead) >= TURN) {
                    let hand = hand * other.frame.handedness(&next.frame);
                    return Some((next, (hand, tangent(&next, hand))));
                }
            }
        }
        None
    }
}

/// Across the gradient, to one hand.
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
    let alike = |spot: &Spot<D, P>| spot.ahead.dot(&start.ahead) >= ALIKE;
    off(&start.point, from, to) <= CLOSE * step && (alike(from) || alike(to))
}
