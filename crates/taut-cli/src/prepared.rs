//! Surfaces with ends located on them, their dimension forgotten.

use taut::size::coordinates;
use taut_core::result::Path;
use taut_core::surface::Surface;

use crate::answer::{Answer, FoundPath, LocatedEnd, Outcome, Place};
use crate::exit::Failure;
use crate::located::{Located, Request};
use crate::matrix::fill::{self, Keep, Work};
use crate::surface::{FlatSamples, Samples, flat_samples};

/// A surface with ends located on it, its dimension forgotten.
pub trait Prepared: Sync {
    /// Coordinates of a point.
    fn dimension(&self) -> usize;

    /// Finds the paths between two of the ends.
    fn answer(&self, pair: [usize; 2], request: &Request) -> Answer;

    /// Refuses an end that has no place on the surface.
    fn check_ends(&self) -> Result<(), Failure>;

    /// Finds the paths of a table's blocks, and hands over each block when it is done.
    fn fill(&self, work: &Work<'_>, keep: Keep<'_>) -> Result<(), Failure>;

    /// Points of the surface for a picture.
    fn samples(&self) -> FlatSamples;
}

impl<const D: usize> Prepared for Located<D> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn answer(&self, pair: [usize; 2], request: &Request) -> Answer {
        let centre = self.geodesics.surface().origin();
        let ends = pair.map(|end| &self.ends[end]);
        let mut paths = match ends.map(|end| &end.located) {
            [Ok((from, _)), Ok((to, _))] => self.paths(from, to, request),
            _ => vec![FoundPath {
                outcome: Outcome::UnusableEnd,
                ..FoundPath::new(&Path::none(), &centre, self.dimension)
            }],
        };
        Answer {
            path: paths.remove(0),
            alternatives: paths,
            ends: ends.map(|end| LocatedEnd {
                named: end.named.clone(),
                place: end.located.clone().map(|(node, moved)| Place {
                    point: coordinates(&(node.point + centre), self.dimension),
                    moved,
                    farthest: self.geodesics.surface().farthest_point(&node),
                    off: self.geodesics.surface().spacings_off(&node, moved),
                }),
            }),
            doubts: self.doubts.clone(),
        }
    }

    fn check_ends(&self) -> Result<(), Failure> {
        self.nodes().map(|_| ())
    }

    fn fill(&self, work: &Work<'_>, keep: Keep<'_>) -> Result<(), Failure> {
        fill::fill(self, work, keep)
    }

    fn samples(&self) -> FlatSamples {
        let surface = self.geodesics.surface();
        flat_samples(&Samples::of(surface), &surface.origin(), self.dimension)
    }
}
