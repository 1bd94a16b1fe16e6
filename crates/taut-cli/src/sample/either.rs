//! A surface of either kind, so that what spreads over all of them is compiled once for each
//! dimension.

use taut::equations::System;
use taut_core::Vector;
use taut_core::surface::atlas::{Atlas, ChartIndex};
use taut_core::surface::implicit::ImplicitSurface;
use taut_core::surface::{Geometry, Surface};

/// A surface of charts or of equations; on the latter places mean nothing.
pub enum Either<'a, const D: usize> {
    Charts(&'a Atlas<D>),
    Equations(&'a ImplicitSurface<D, System>),
}

impl<const D: usize> Surface<D> for Either<'_, D> {
    type Place = ChartIndex;

    fn intrinsic_dimension(&self) -> usize {
        match self {
            Self::Charts(atlas) => atlas.intrinsic_dimension(),
            Self::Equations(surface) => surface.intrinsic_dimension(),
        }
    }

    fn origin(&self) -> Vector<D> {
        match self {
            Self::Charts(atlas) => atlas.origin(),
            Self::Equations(surface) => surface.origin(),
        }
    }

    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut ChartIndex,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        match self {
            Self::Charts(atlas) => atlas.foot(x, place, scratch),
            Self::Equations(surface) => surface.foot(x, &mut (), scratch),
        }
    }

    fn geometry(&self, x: &Vector<D>, place: ChartIndex, out: &mut Geometry<D>) -> bool {
        match self {
            Self::Charts(atlas) => atlas.geometry(x, place, out),
            Self::Equations(surface) => surface.geometry(x, (), out),
        }
    }

    fn beyond_rim(&self, x: &Vector<D>, place: ChartIndex) -> Option<(f64, Vector<D>)> {
        match self {
            Self::Charts(atlas) => atlas.beyond_rim(x, place),
            Self::Equations(surface) => surface.beyond_rim(x, ()),
        }
    }
}
