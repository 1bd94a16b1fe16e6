//! What a surface must answer: the foot of a point, the frame there, and the second fundamental
//! form.
//!
//! Everything downstream (first guesses, correction) reaches a surface only through [`Surface`], so
//! equations F(x) = 0 and point clouds are served by the same code in every dimension. A rim is a
//! part of the boundary of the surface: the end of a point cloud's data, or the edge of a hole.

pub mod atlas;
pub(crate) mod crease;
pub mod frame;
pub mod implicit;
pub mod level_set;
pub mod mls;
pub mod shapes;

pub use frame::Geometry;

use crate::Vector;

/// A smooth surface of dimension k in R^D, as the correction sees it.
///
/// A *place* is what a node remembers between calls so that no search is needed: nothing for
/// equations, the nearest chart for a point cloud.
pub trait Surface<const D: usize>: Sync {
    /// What a node remembers between calls.
    type Place: Copy + Send + Sync + std::fmt::Debug;

    /// The intrinsic dimension k of the surface.
    fn intrinsic_dimension(&self) -> usize;

    /// The vector that must be added to a point of the surface to get its coordinates as they were
    /// given: clouds are centred.
    fn origin(&self) -> Vector<D> {
        Vector::zeros()
    }

    /// The point of the surface near `x`, found from `place`, which is brought up to date;
    /// `scratch` is overwritten.
    ///
    /// `None` where the iteration does not arrive: `x` is too far from the surface, or near a
    /// singular point.
    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut Self::Place,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>>;

    /// Computes the tangent and normal frame and the second fundamental form at a point `x` of the
    /// surface.
    ///
    /// Returns `false`, leaving `out` unspecified, where the surface has no tangent space.
    fn geometry(&self, x: &Vector<D>, place: Self::Place, out: &mut Geometry<D>) -> bool;

    /// Brings `place` up to date for a point `x` near the surface; `false` where the surface knows
    /// nothing of `x`. `scratch` is overwritten.
    fn find_place(
        &self,
        x: &Vector<D>,
        place: &mut Self::Place,
        scratch: &mut Geometry<D>,
    ) -> bool {
        self.foot(x, place, scratch).is_some()
    }

    /// A cheaper [`geometry`](Self::geometry), of something that agrees with the surface to its
    /// estimated error: one chart of a clean cloud.
    fn cheap_geometry(&self, x: &Vector<D>, place: Self::Place, out: &mut Geometry<D>) -> bool {
        self.geometry(x, place, out)
    }

    /// A cheaper [`foot`](Self::foot), on one chart of a clean cloud, accurate to a millionth of
    /// the chart's radius.
    fn cheap_foot(
        &self,
        x: &Vector<D>,
        place: &mut Self::Place,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        self.foot(x, place, scratch)
    }

    /// Whether [`cheap_geometry`](Self::cheap_geometry) and [`cheap_foot`](Self::cheap_foot) do
    /// cost less.
    fn has_cheap_view(&self) -> bool {
        false
    }

    /// How far `x` lies beyond the known extent of the surface (in a hole or past a rim of a point
    /// cloud), and the gradient of that depth; `None` inside, and everywhere on a surface without
    /// rims.
    fn beyond_rim(&self, _x: &Vector<D>, _place: Self::Place) -> Option<(f64, Vector<D>)> {
        None
    }

    /// Whether the surface has rims that are known.
    fn has_rims(&self) -> bool {
        false
    }

    /// The points at the surface's rims, each with the unit direction outwards and the spacing of
    /// the points there; none on a surface without rims.
    fn rim(&self) -> Vec<(Node<D, Self::Place>, Vector<D>, f64)> {
        Vec::new()
    }

    /// The wavelength of the surface's finest detail, where it is known beforehand: a path needs an
    /// element for each. It is 0 for equations and clean clouds, whose paths are smooth.
    fn detail(&self) -> f64 {
        0.0
    }

    /// Estimated standard error of the surface's height at a place; 0 for equations.
    fn height_error(&self, _place: Self::Place) -> f64 {
        0.0
    }

    /// The [`height_error`](Self::height_error) along the way from the first of three nodes past
    /// the second to the third.
    fn height_error_along(&self, nodes: [&Node<D, Self::Place>; 3]) -> f64 {
        self.height_error(nodes[1].place)
    }

    /// How far the surface may be followed in one step at a place where it has ripples that its
    /// surroundings do not have, as beside an outlier; infinite where it has none.
    fn rippled(&self, _place: Self::Place) -> f64 {
        f64::INFINITY
    }

    /// The radius of the chart at a place of a cloud; 0 for equations.
    fn resolution(&self, _place: Self::Place) -> f64 {
        0.0
    }
}

/// A point as messages name it: in the coordinates that were given.
pub(crate) fn named<const D: usize>(surface: &impl Surface<D>, x: &Vector<D>) -> String {
    format!("{:?}", (x + surface.origin()).as_slice())
}

/// A point of a surface, with what the surface needs to find it again.
#[derive(Clone, Copy, Debug)]
pub struct Node<const D: usize, P> {
    /// The point, in the surface's coordinates.
    pub point: Vector<D>,
    /// Where on the surface the point lies.
    pub place: P,
}

impl<const D: usize, P> Node<D, P> {
    /// The same node of a surface whose places are of another type.
    #[must_use]
    pub fn into_kind<Q: From<P>>(self) -> Node<D, Q> {
        Node {
            point: self.point,
            place: self.place.into(),
        }
    }
}
