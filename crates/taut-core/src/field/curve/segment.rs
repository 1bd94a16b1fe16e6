//! One segment of a curve: the shortest geodesic between two of its vertices, shot from one to the
//! other.
//!
//! The length of a path pulled taut differs from that of the geodesic only by the square of the
//! distance between the two. Distances measured from the path are wrong by that distance itself. So
//! the path's ends and its first direction serve as a first guess for shooting.

use crate::Vector;
use crate::correction;
use crate::error::Error;
use crate::field::plane::norm;
use crate::field::rays::frame::ON_SURFACE;
use crate::field::rays::knot::{Knot, between};
use crate::field::rays::ray::{self, Limits};
use crate::field::{Fields, Settings, frame};
use crate::guess::Guide;
use crate::guess::dijkstra::Distances;
use crate::surface::{Geometry, Node, Surface};

/// Most shots until one hits.
const MOST_SEGMENT_SHOTS: usize = 8;
/// Largest miss of a shot that hits, as a multiple of the rays' tolerance.
const HIT: f64 = 0.1;
/// Largest miss, as a share of the shot's length, beyond which shooting is given up.
const SHOT_ASTRAY: f64 = 0.3;
/// Tolerance of a shot, as a share of the tolerance of distances: an error of the segment to the
/// side is an error of the distances from the segment.
const FINER: f64 = 0.01;

/// Least step along a segment, as a share of its length.
const LEAST_STEP: f64 = 1e-5;

/// A geodesic, given by places on it with their lengths from its start. The first tangent of each
/// place is along the geodesic.
#[derive(Clone, Debug)]
pub(super) struct Segment<const D: usize, P> {
    knots: Vec<Knot<D, P>>,
}

impl<const D: usize, P: Copy> Segment<D, P> {
    /// The length of the geodesic, in the input's units.
    pub fn length(&self) -> f64 {
        self.knots.last().map_or(0.0, |last| last.length)
    }

    /// The first and the last place.
    pub fn ends(&self) -> [&Knot<D, P>; 2] {
        [&self.knots[0], &self.knots[self.knots.len() - 1]]
    }

    /// The place at a length from the start, with the frame of the surface there.
    pub fn at<S: Surface<D, Place = P>>(
        &self,
        surface: &S,
        nearest: &impl Fn(&Vector<D>, u32) -> u32,
        length: f64,
    ) -> Knot<D, P> {
        let after = self.knots.partition_point(|knot| knot.length < length);
        let i = after.clamp(1, self.knots.len() - 1);
        let pair = [&self.knots[i - 1], &self.knots[i]];
        let length = length.clamp(pair[0].length, pair[1].length);
        let known = between(pair, length).unwrap_or(*pair[0]);
        let mut knot = ray::onto(surface, &known).unwrap_or(known);
        knot.near = nearest(&knot.frame.point, knot.near);
        knot
    }

    /// Lengths from 0 to the whole length, spaced as evenly as steps of `step` are, and no farther
    /// apart.
    pub fn cut(&self, step: impl Fn(&Vector<D>, u32) -> f64) -> Vec<f64> {
        let all = self.length();
        let mut cuts = vec![0.0];
        let mut length = 0.0;
        let mut knot = 0;
        while length < all {
            while knot + 2 < self.knots.len() && self.knots[knot + 1].length <= length {
                knot += 1;
            }
            let pair = [&self.knots[knot], &self.knots[knot + 1]];
            let known = between(pair, length).unwrap_or(*pair[0]);
            length += step(&known.frame.point, known.near).max(LEAST_STEP * all);
            cuts.push(length);
        }
        cuts.iter().map(|cut| cut * (all / length)).collect()
    }
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The segment between two vertices, the `index`-th segment of its curve.
    pub(super) fn segment(
        &self,
        [from, to]: [&Node<D, S::Place>; 2],
        index: usize,
        spacing: &[f64],
    ) -> Result<Segment<D, S::Place>, Error> {
        let graph = self.geodesics.graph();
        let path = self
            .geodesics
            .path(from, to, &correction::Settings::default());
        let refused = |reason| Error::NoEdge {
            edge: index,
            reason,
        };
        if !path.converged() {
            return Err(refused(path.status.word()));
        }
        let unbounded = Distances::new(graph);
        let limits = Limits {
            spacing,
            ..self.limits(&unbounded, 0.0, &Settings::default())
        };
        let near = self.nearest_node(from).ok_or_else(|| refused("no-path"))?;
        let mut geometry = Geometry::new(D - 2);
        let surface = self.geodesics.surface();
        let first = frame(surface, from, &mut geometry);
        let first = first.ok_or_else(|| refused("off-surface"))?;
        let mut shooter = Shooter {
            surface,
            limits,
            geometry,
            knots: vec![Knot {
                length: 0.0,
                frame: first,
                jacobi: [0.0, 1.0],
                place: from.place,
                near,
                heights: Default::default(),
            }],
        };
        let reached = shooter.reach(&path.points, &path.arc_length);
        reached.ok_or_else(|| refused("off-surface"))?;
        Ok(Segment {
            knots: shooter.knots,
        })
    }
}

/// A segment that is being made.
struct Shooter<'a, const D: usize, S: Surface<D>> {
    surface: &'a S,
    limits: Limits<'a, D, S::Place>,
    geometry: Geometry<D>,
    knots: Vec<Knot<D, S::Place>>,
}

impl<const D: usize, S: Guide<D>> Shooter<'_, D, S> {
    /// Continues from the last knot, which is the first of some points of a path, to the last of
    /// these points: in one shot, or in two parts by way of a point between. `None` where the
    /// surface ends.
    fn reach(&mut self, points: &[Vector<D>], lengths: &[f64]) -> Option<()> {
        let count = points.len();
        if let Some(shot) = self.hit(points, lengths[count - 1] - lengths[0]) {
            self.knots.pop();
            self.knots.extend(shot);
            return Some(());
        }
        if count > 2 {
            let middle = count / 2;
            self.reach(&points[..=middle], &lengths[..=middle])?;
            return self.reach(&points[middle..], &lengths[middle..]);
        }
        let step = self.straight(&points[1])?;
        self.knots.pop();
        self.knots.extend(step);
        Some(())
    }

    /// The geodesic from the last knot to the last of some points, by Newton's method from the
    /// direction of the second point; `None` where no shot hits.
    fn hit(&self, points: &[Vector<D>], length: f64) -> Option<Vec<Knot<D, S::Place>>> {
        let from = self.knots.last()?;
        let to = points.last()?;
        let [x, y] = from.frame.log(&points[1], ON_SURFACE);
        let (mut angle, mut length) = (y.atan2(x), length);
        let limits = |longest| Limits {
            longest,
            tolerance: FINER * self.limits.tolerance,
            ..self.limits
        };
        for _ in 0..MOST_SEGMENT_SHOTS {
            let start = Knot {
                length: 0.0,
                frame: from.frame.turned([angle.cos(), angle.sin()]),
                jacobi: [0.0, 1.0],
                ..*from
            };
            let mut knots = ray::shoot(self.surface, start, &limits(length)).knots;
            let after = knots.partition_point(|knot| knot.length < length);
            let next = knots.get(after)?;
            let last = between([knots.get(after.checked_sub(1)?)?, next], length)?;
            let last = ray::onto(self.surface, &last)?;
            let [ahead, left] = last.frame.log(to, ON_SURFACE);
            let miss = norm([ahead, left]);
            if miss <= HIT * self.limits.tolerance * length {
                knots.truncate(after);
                knots.push(last);
                for knot in &mut knots {
                    knot.length += from.length;
                }
                return Some(knots);
            }
            if miss.is_nan() || miss > SHOT_ASTRAY * length || last.jacobi[0] <= 0.0 {
                return None;
            }
            angle += left / last.jacobi[0];
            length += ahead;
        }
        None
    }

    /// A straight step from the last knot to a point near by, as two knots whose tangents point
    /// along the step.
    fn straight(&mut self, to: &Vector<D>) -> Option<[Knot<D, S::Place>; 2]> {
        let from = *self.knots.last()?;
        let ahead = from.frame.log(to, ON_SURFACE);
        let length = norm(ahead);
        let mut place = from.place;
        if !self.surface.find_place(to, &mut place, &mut self.geometry) {
            return None;
        }
        let node = Node { point: *to, place };
        let there = frame(self.surface, &node, &mut self.geometry)?;
        let back = there.vector(there.log(&from.frame.point, ON_SURFACE));
        let start = from.frame.vector(ahead);
        let side = from.frame.tangents[1];
        Some([
            Knot {
                frame: from.frame.facing(&start, &side)?,
                ..from
            },
            Knot {
                length: from.length + length,
                frame: there.facing(&-back, &side)?,
                place,
                near: ray::nearest(self.limits.graph, to, from.near),
                ..from
            },
        ])
    }
}
