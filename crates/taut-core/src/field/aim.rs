//! The geodesic from a source through a point, by shooting: from a direction that is nearly right, by Newton's method with
//! the Jacobi field. A claim of a jet that is doubtful is put to the proof in this way.

use crate::Vector;
use crate::field::frame::ON_SURFACE;
use crate::field::jet::{Heading, Jet};
use crate::field::knot::{Knot, between};
use crate::field::piece::Piece;
use crate::field::ray;
use crate::field::sides::{self, Side};
use crate::field::{Fields, Settings};
use crate::guess::Guide;
use crate::surface::Geometry;

/// Shots at most.
const SHOTS: usize = 6;
/// A shot that passes so near, in spacings of the graph's nodes, hits, if carrying its jet the rest of the way is accurate enough.
const NEAR: f64 = 0.3;
/// A miss counts for at most so many spacings when the next shot is turned and lengthened.
const FARTHEST: f64 = 3.0;
/// The next shot is turned by at most this angle, in radians.
const MOST_TURN: f64 = 0.3;
/// Where rays lie nearer together than this, in spacings a radian, the next shot is turned with care.
const LEAST_SPREAD: f64 = 0.1;
/// Rays have nearly come together again that are no farther apart than this share of what they would be on a plane.
const TOGETHER: f64 = 0.1;
/// The front's curvature changes as it does between rays so many spacings to both sides.
const ASIDE: f64 = 0.7;

/// A source to shoot from.
pub(super) struct Gun<'a, const D: usize, S: Guide<D>> {
    fields: &'a Fields<'a, D, S>,
    piece: &'a Piece<D>,
    place: S::Place,
    near: u32,
    settings: Settings,
}

/// A geodesic that passes a point.
pub(super) struct Hit<const D: usize, P> {
    /// Where it is nearest to the point.
    pub knot: Knot<D, P>,
    /// There, in the knot's frame.
    pub jet: Jet,
    /// Estimated error of the distance by that of the surface.
    pub surface_error: f64,
}

impl<const D: usize, P> Hit<D, P> {
    /// Rays beside it have nearly come together again.
    pub fn is_focused(&self) -> bool {
        self.knot.jacobi[0] < TOGETHER * self.knot.length
    }
}

impl<'a, const D: usize, S: Guide<D>> Gun<'a, D, S> {
    /// At a source near a node of the graph; `None` where the surface has no place for it.
    pub fn new(
        fields: &'a Fields<'a, D, S>,
        piece: &'a Piece<D>,
        near: u32,
        tolerance: f64,
    ) -> Option<Self> {
        let surface = fields.geodesics.surface();
        let mut place = fields.geodesics.graph().nodes[near as usize].place;
        let found = surface.find_place(&piece.frame.point, &mut place, &mut Geometry::new(D - 2));
        found.then(|| Self {
            fields,
            piece,
            place,
            near,
            settings: Settings {
                tolerance,
                ..Settings::default()
            },
        })
    }

    /// The geodesic to a point of the surface from nearly an angle and a length, where the graph's nodes lie `spacing` apart;
    /// `None` where there is none without a conjugate point on the way.
    pub fn hit(
        &self,
        (mut angle, mut length): (f64, f64),
        x: &Vector<D>,
        spacing: f64,
    ) -> Option<Hit<D, S::Place>> {
        for _ in 0..SHOTS {
            let knot = self.shot(angle, length)?;
            let [spread, slope] = knot.jacobi;
            if spread <= 0.0 {
                return None;
            }
            let [ahead, left] = knot.frame.log(x, ON_SURFACE);
            let curvature = slope / spread;
            let error = curvature.abs() * left.abs().powi(3) / (6.0 * spacing);
            let most = NEAR * spacing;
            if ahead.abs() <= most
                && left.abs() <= most
                && error <= self.settings.tolerance * length
            {
                let heading = Heading {
                    angle,
                    turn: spread.recip(),
                    ..Heading::default()
                };
                let distance = self.piece.start + length;
                return Some(Hit {
                    jet: Jet::new(distance, [1.0, 0.0], curvature, heading),
                    surface_error: knot.heights.length_error(),
                    knot,
                });
            }
            let most = FARTHEST * spacing;
            let least = LEAST_SPREAD * spacing;
            let turn = left.clamp(-most, most) * spread / (spread * spread + least * least);
            angle += turn.clamp(-MOST_TURN, MOST_TURN);
            length += ahead.clamp(-most, most);
        }
        None
    }

    /// Adds to a hit's jet what changes to the sides, from two more shots.
    pub fn look_aside(&self, hit: &mut Hit<D, S::Place>, spacing: f64) {
        let Knot { length, jacobi, .. } = hit.knot;
        let angle = hit.jet.heading.angle;
        let apart = (ASIDE * spacing / jacobi[0]).min(MOST_TURN);
        let sides = [-apart, apart].map(|turn| {
            let jacobi = self.shot(angle + turn, length)?.jacobi;
            (jacobi[0] > 0.0).then_some(Side {
                angle: turn,
                jacobi,
            })
        });
        hit.jet = sides::jet(hit.jet.distance, jacobi, sides, (angle, None), spacing);
    }

    /// The knot of the geodesic of an angle at a length; `None` where it does not get there.
    fn shot(&self, angle: f64, length: f64) -> Option<Knot<D, S::Place>> {
        let limits = self.fields.unbounded(length, &self.settings);
        let first = Knot::leaving(&self.piece.frame, angle, self.place, self.near);
        let knots = ray::shoot(self.fields.geodesics.surface(), first, &limits).knots;
        let after = knots.partition_point(|knot| knot.length < length);
        let (before, after) = (knots.get(after.checked_sub(1)?)?, knots.get(after)?);
        let heights = after.heights;
        between([before, after], length).map(|knot| Knot { heights, ..knot })
    }
}
