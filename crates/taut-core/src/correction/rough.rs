//! The cheap view of a surface: it costs less to evaluate, and agrees with the surface to the
//! surface's own estimated error.

use crate::Vector;
use crate::surface::{Geometry, Surface};

/// The cheap view of a surface, which is good for all but the last steps of a path.
pub(crate) struct Rough<'a, S>(pub &'a S);

impl<const D: usize, S: Surface<D>> Surface<D> for Rough<'_, S> {
    type Place = S::Place;

    fn intrinsic_dimension(&self) -> usize {
        self.0.intrinsic_dimension()
    }

    fn origin(&self) -> Vector<D> {
        self.0.origin()
    }

    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut S::Place,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        self.0.cheap_foot(x, place, scratch)
    }

    fn geometry(&self, x: &Vector<D>, place: S::Place, out: &mut Geometry<D>) -> bool {
        self.0.cheap_geometry(x, place, out)
    }

    fn beyond_rim(&self, x: &Vector<D>, place: S::Place) -> Option<(f64, Vector<D>)> {
        self.0.beyond_rim(x, place)
    }

    fn resolution(&self, place: S::Place) -> f64 {
        self.0.resolution(place)
    }
}
