//! Sources as they are measured from near by: a point, or a straight piece of a curve.

use crate::Vector;
use crate::field::plane::norm;
use crate::field::rays::frame::{Frame, ON_SURFACE};
use crate::field::rays::jet::{Heading, Jet, transported};

/// A point source, or a piece of a geodesic that is short compared with the surface's radius of
/// curvature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const D: usize> {
    /// The frame at the middle of the piece; on a piece of a curve the first tangent is along the
    /// curve.
    pub frame: Frame<D>,
    /// Half the length of the piece, in the input's units; 0 for a point.
    pub half: f64,
    /// The distance at the piece itself, in the input's units.
    pub start: f64,
    /// The index of the source that the piece belongs to.
    pub source: u32,
}

/// The shortest way from a piece to a point.
pub(crate) struct Way {
    pub length: f64,
    /// The step from the piece's middle to the point, in the frame's tangent coordinates.
    from_middle: [f64; 2],
    /// The step from the piece's nearest point to the point, in the frame's tangent coordinates.
    step: [f64; 2],
}

impl<const D: usize> Piece<D> {
    pub fn is_point(&self) -> bool {
        self.half == 0.0
    }

    /// The shortest way from the piece to `x`. In normal coordinates about the middle, the square
    /// of the distance between two points a and b is |a - b|^2 - K (a x b)^2 / 3.
    pub fn way(&self, x: &Vector<D>, share: f64) -> Way {
        let [along, off] = self.frame.log(x, share);
        let nearest = along.clamp(-self.half, self.half);
        let narrowing = 1.0 - self.frame.gauss * nearest * nearest / 3.0;
        let step = [along - nearest, off * narrowing.max(0.0).sqrt()];
        Way {
            length: norm(step),
            from_middle: [along, off],
            step,
        }
    }

    /// Estimated error of the length of a way.
    pub fn error(&self, way: &Way) -> f64 {
        self.frame.log_error(norm(way.from_middle))
    }

    /// The direction in which a way arrives; zero where the way has no length.
    pub fn direction(&self, way: &Way) -> Vector<D> {
        transported(&self.frame, way.step, way.from_middle)
    }

    /// Whether a distance that rays say somewhere near them may be one from this piece's source.
    /// Rays of a curve that say less than the start value speak of the other side of the curve,
    /// which they have left.
    pub fn admits(&self, distance: f64) -> bool {
        self.is_point() || distance >= self.start
    }

    /// A lower bound of the distance of `x` from the source, of which this is the first piece.
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

    /// The jet of the distance from a piece of a curve. The fronts of a geodesic curve with the
    /// surface, and those of its ends are circles.
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
