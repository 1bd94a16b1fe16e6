//! The geodesic from a source through a point, by shooting: Newton's method with the Jacobi field,
//! from a direction that is nearly right. This is how a doubtful claim of a jet is proven.

use crate::Vector;
use crate::field::rays::frame::ON_SURFACE;
use crate::field::rays::jet::{Heading, Jet};
use crate::field::rays::knot::{Knot, between};
use crate::field::rays::piece::Piece;
use crate::field::rays::ray;
use crate::field::rays::sides::{self, Side};
use crate::field::{Fields, Settings};
use crate::guess::Guide;
use crate::surface::Geometry;

/// Most shots at one point.
const SHOTS: usize = 6;
/// Distance from the point, in spacings of the graph's nodes, within which a shot hits, if carrying
/// its jet the rest of the way is accurate enough.
const HIT_DISTANCE: f64 = 0.3;
/// Most that a miss counts for, in spacings of the graph's nodes, when the next shot is turned and
/// lengthened.
const MOST_MISS: f64 = 3.0;
/// Most that the next shot is turned by, in radians.
const MOST_TURN: f64 = 0.3;
/// Spread of the rays, in spacings of the graph's nodes a radian, below which the next shot is
/// turned by less than Newton's method says.
const LEAST_SPREAD: f64 = 0.1;
/// Spread of rays, as a share of what it would be on a plane, below which rays count as having
/// nearly come together again.
const RAYS_TOGETHER: f64 = 0.1;
/// How far to both sides the rays lie from which the derivative of the front curvature is found, in
/// spacings of the graph's nodes.
const ASIDE: f64 = 0.7;

/// A source to shoot geodesics from.
pub(in crate::field) struct Gun<'a, const D: usize, S: Guide<D>> {
    fields: &'a Fields<'a, D, S>,
    piece: &'a Piece<D>,
    place: S::Place,
    near: u32,
    settings: Settings,
}

/// A geodesic that passes a point.
pub(in crate::field) struct Hit<const D: usize, P> {
    /// The knot where the geodesic is nearest to the point.
    pub knot: Knot<D, P>,
    /// The jet there, in the knot's frame.
    pub jet: Jet,
    /// Estimated error of the distance because of the surface's own error, in the input's units.
    pub surface_error: f64,
}

impl<const D: usize, P> Hit<D, P> {
    /// Whether the rays beside the geodesic have nearly come together again.
    pub fn is_focused(&self) -> bool {
        self.knot.jacobi[0] < RAYS_TOGETHER * self.knot.length
    }
}

impl<'a, const D: usize, S: Guide<D>> Gun<'a, D, S> {
    /// The gun at a source near a node of the graph; `None` where the surface has no place for it.
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

    /// The geodesic to a point of the surface, searched for from an angle and a length that are
    /// nearly right, where the graph's nodes lie `spacing` apart. `None` where there is none
    /// without a conjugate point on the way.
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
            let most = HIT_DISTANCE * spacing;
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
            let most = MOST_MISS * spacing;
            let least = LEAST_SPREAD * spacing;
            let turn = left.clamp(-most, most) * spread / (spread * spread + least * least);
            angle += turn.clamp(-MOST_TURN, MOST_TURN);
            length += ahead.clamp(-most, most);
        }
        None
    }

    /// Adds to a hit's jet what changes along the front, from two more shots to the sides.
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

    /// The knot at a length of the geodesic that leaves at an angle; `None` where the geodesic does
    /// not get there.
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
