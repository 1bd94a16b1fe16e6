//! What a source looks like from near by: a point, or a straight piece of a curve.

use crate::Vector;
use crate::field::frame::{Frame, ON_SURFACE};
use crate::field::jet::{Heading, Jet, bent, norm};

/// A point, or a piece of a geodesic that is short as the surface bends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const D: usize> {
    /// At its middle; of a piece of a curve the first tangent is along it.
    pub frame: Frame<D>,
    /// Half its length, 0 of a point.
    pub half: f64,
    /// The distance there.
    pub start: f64,
    /// The source that it is of.
    pub source: u32,
}

/// The way from a piece to a point.
pub(crate) struct Way {
    pub length: f64,
    /// To the point from the middle, and from the piece's nearest point, in the frame's tangent coordinates.
    from_middle: [f64; 2],
    step: [f64; 2],
}

impl<const D: usize> Piece<D> {
    pub fn is_point(&self) -> bool {
        self.half == 0.0
    }

    /// In normal coordinates about the middle two points a and b are |a - b|^2 - K (a x b)^2 / 3 apart, squared.
    pub fn way(&self, x: &Vector<D>, share: f64) -> Way {
        let [along, off] = self.frame.log(x, share);
        let nearest = along.clamp(-self.half, self.half);
        let bent = 1.0 - self.frame.gauss * nearest * nearest / 3.0;
        let step = [along - nearest, off * bent.max(0.0).sqrt()];
        Way {
            length: norm(step),
            from_middle: [along, off],
            step,
        }
    }

    /// Estimated error of a way's length.
    pub fn error(&self, way: &Way) -> f64 {
        self.frame.log_error(norm(way.from_middle))
    }

    /// The direction in which a way arrives, zero where it has no length.
    pub fn direction(&self, way: &Way) -> Vector<D> {
        bent(&self.frame, way.step, way.from_middle)
    }

    /// Rays say that its source is so far from somewhere near them: less than its start value they say of the other
    /// side of a curve that they have left.
    pub fn admits(&self, distance: f64) -> bool {
        self.is_point() || distance >= self.start
    }

    /// A lower bound of the distance of `x` from the source that the first of its pieces belongs to.
    pub fn least(&self, x: &Vector<D>) -> f64 {
        if self.is_point() {
            self.start + (self.frame.point - x).norm()
        } else {
            self.start
        }
    }

    /// The jet of the distance at a place near by, in the frame there.
    pub fn jet(&self, to: &Frame<D>) -> Jet {
        let way = self.way(&to.point, ON_SURFACE);
        let known = if self.is_point() {
            Jet::of_point(&self.frame, self.start, to)
        } else {
            self.jet_of_curve(&way, to)
        };
        known.unwrap_or(Jet::new(
            self.start + way.length,
            [1.0, 0.0],
            0.0,
            Heading::default(),
        ))
    }

    /// The fronts of a geodesic bend with the surface, those of its ends are circles.
    fn jet_of_curve(&self, way: &Way, to: &Frame<D>) -> Option<Jet> {
        let gradient = to.coordinates(&self.direction(way));
        let inverse = norm(gradient).recip();
        let is_beside = way.step[0] == 0.0;
        let curvature = if is_beside {
            -self.frame.gauss * way.length
        } else {
            way.length.recip()
        };
        inverse.is_finite().then(|| {
            let gradient = gradient.map(|g| g * inverse);
            Jet::new(
                self.start + way.length,
                gradient,
                curvature,
                Heading::default(),
            )
        })
    }
}
