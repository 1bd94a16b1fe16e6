//! The exponential map: where the geodesic that leaves a point along a tangent vector ends.

use crate::error::Error;
use crate::field::manifold;
use crate::field::manifold::ray::{Knot, follow};
use crate::field::rays::ray::Limits;
use crate::field::{Fields, Settings};
use crate::guess::Guide;
use crate::surface::{Geometry, Node, named};
use crate::{Matrix, Vector};

/// Share of a vector below which its part along the surface is rounding and has no direction.
const LOST: f64 = 1e-8;

/// A geodesic shot from a point.
#[derive(Clone, Debug)]
pub struct Shot<const D: usize> {
    /// Points on the geodesic, from the source on, in the surface's coordinates, which are centred
    /// for a cloud; the integration's step sizes decide where they lie.
    pub points: Vec<Vector<D>>,
    /// Length of the geodesic from the source to each point, in the input's units.
    pub arc_length: Vec<f64>,
    /// Whether the geodesic was followed to its full length. If not, the surface ended, or is not
    /// known well enough to go on.
    pub complete: bool,
    /// Estimated error of the end, in the input's units, by the tolerance and the surface's own
    /// error, where neighbouring rays spread no faster than on a plane.
    pub error: f64,
    /// The k orthonormal tangents at the source, in columns, the first along the vector; the other
    /// columns are 0.
    pub tangents: Matrix<D>,
    /// The tangents at the source carried in parallel along the geodesic to its end, in the same
    /// columns.
    pub transported: Matrix<D>,
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// Follows the geodesic that leaves a node of the surface along the tangential part of a
    /// vector, as long as that part is. It works in any dimension, and goes on past conjugate
    /// points and past where it is the shortest way.
    ///
    /// # Errors
    /// [`Error::NoFoot`] where the surface has no tangent space or the vector no tangential part,
    /// [`Error::NoDirections`] for fields with costs.
    pub fn exponential(
        &self,
        source: &Node<D, S::Place>,
        vector: &Vector<D>,
        settings: &Settings,
    ) -> Result<Shot<D>, Error> {
        let (start, length) = self.departure(source, vector)?;
        Ok(self.shot(start, length, settings))
    }

    /// The same as [`exponential`](Self::exponential), to a length in the input's units instead of
    /// the vector's own.
    ///
    /// A caller that scales the vector itself would measure it on its own tangent space. That of a
    /// cloud is known only to the error of its charts, which a vector with a large normal part
    /// magnifies.
    ///
    /// # Errors
    /// The same errors as [`exponential`](Self::exponential).
    pub fn exponential_to(
        &self,
        source: &Node<D, S::Place>,
        direction: &Vector<D>,
        length: f64,
        settings: &Settings,
    ) -> Result<Shot<D>, Error> {
        let (start, _) = self.departure(source, direction)?;
        Ok(self.shot(start, length, settings))
    }

    /// The first knot of the geodesic along the tangential part of a vector, and the length of that
    /// part.
    fn departure(
        &self,
        source: &Node<D, S::Place>,
        vector: &Vector<D>,
    ) -> Result<(Knot<D, S::Place>, f64), Error> {
        if self.ground.net.is_some() {
            return Err(Error::NoDirections);
        }
        let surface = self.geodesics.surface();
        let refused = |reason| Error::NoFoot {
            point: named(surface, &source.point),
            reason,
        };
        let mut geometry = Geometry::new(D - surface.intrinsic_dimension());
        let frame = manifold::frame(surface, source, &mut geometry)
            .ok_or_else(|| refused("it has no tangent space there"))?;
        let along = frame.coordinates(vector);
        let length = along.norm();
        let direction = along
            .try_normalize(0.0)
            .filter(|_| length.is_finite() && length > LOST * vector.norm())
            .ok_or_else(|| refused("the direction has no part along the surface"))?;
        let near = self
            .nearest_node(source)
            .ok_or_else(|| refused("no node of the surface is near"))?;
        Ok((Knot::first(&frame, &direction, source.place, near), length))
    }

    /// The geodesic from its first knot to a length.
    fn shot(&self, first: Knot<D, S::Place>, length: f64, settings: &Settings) -> Shot<D> {
        let surface = self.geodesics.surface();
        // The geodesic is wanted as it is, also where it is no longer the shortest way.
        let limits = Limits {
            past_conjugate: true,
            ..self.unbounded(length, settings)
        };
        let tangents = first.frame.tangents;
        let knots = follow(surface, first, &limits, length);
        let last = knots.last();
        let height = last.map_or(0.0, |last| surface.height_error(last.place));
        let error = last.map_or(0.0, |last| last.heights.length_error());
        Shot {
            complete: last.is_some_and(|last| last.length >= length),
            error: limits.tolerance * length + error.hypot(height),
            transported: last.map_or(tangents, |last| last.frame.tangents),
            tangents,
            arc_length: knots.iter().map(|knot| knot.length).collect(),
            points: knots.iter().map(|knot| knot.frame.point).collect(),
        }
    }
}
