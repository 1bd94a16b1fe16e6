//! The logarithmic map of a source and parallel transport along the shortest geodesics, from the same jets as the
//! distances: they know the direction in which the ray that arrives left the source.

use rayon::prelude::*;

use crate::Vector;
use crate::error::Error;
use crate::field::branches::{Branch, SAME_DIRECTION};
use crate::field::frame::{Frame, ON_SURFACE};
use crate::field::jet::{Jet, norm, turned_by};
use crate::field::{Field, Fields, frame};
use crate::guess::Guide;
use crate::surface::atlas::Atlas;
use crate::surface::{Geometry, Node};

/// The tangent vector at a source whose geodesic leads to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Logarithm<const D: usize> {
    /// In the coordinates of [`Fields::source_tangents`]; as long as the geodesic.
    pub vector: [f64; 2],
    /// Estimated error of its end.
    pub error: f64,
    /// The nearest source.
    pub source: u32,
    /// The source's two tangents, carried along the geodesic in parallel. `None` where the way bends round a hole
    /// and at points that have no tangent plane.
    pub transported: Option<[Vector<D>; 2]>,
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The orthonormal tangents at a source that its logarithms are given in.
    #[must_use]
    pub fn source_tangents(&self, field: &Field<D>, source: u32) -> Option<[Vector<D>; 2]> {
        field.sources.get(source as usize).map(|s| s.tangents)
    }

    /// The logarithm of a node of the surface at its nearest source; `None` where unreached.
    ///
    /// # Errors
    /// [`Error::NoDirections`] on surfaces of other dimensions than 2, with costs and on rough clouds.
    pub fn logarithm(
        &self,
        field: &Field<D>,
        node: &Node<D, S::Place>,
    ) -> Result<Option<Logarithm<D>>, Error> {
        if field.other.is_some() {
            return Err(Error::NoDirections);
        }
        let mut geometry = Geometry::new(D - 2);
        Ok(self.logarithm_at(field, node, &mut geometry))
    }

    fn logarithm_at(
        &self,
        field: &Field<D>,
        node: &Node<D, S::Place>,
        geometry: &mut Geometry<D>,
    ) -> Option<Logarithm<D>> {
        let near = self.nearest_node(node)?;
        let taken = self.taken(field, near, &node.point, ON_SURFACE)?;
        let branch = field.branches(taken.node)[taken.branch];
        let length = taken.value.distance - field.source_starts[branch.source as usize];
        let polar = |angle: f64| [length * angle.cos(), length * angle.sin()];
        let Some(here) = frame(self.geodesics.surface(), node, geometry) else {
            let angle = branch.jet.heading.angle;
            return Some(Logarithm {
                vector: polar(angle),
                error: f64::INFINITY,
                source: branch.source,
                transported: None,
            });
        };
        let jet = self.jet_at(field, taken.node, &branch, &here)?;
        let error = branch.angle_error + self.angle_error(field, &taken.node, &branch, &here, &jet);
        let transported = (!branch.carried).then(|| transported(&here, &jet));
        Some(Logarithm {
            vector: polar(jet.heading.angle),
            error: taken.value.error.hypot(length * error),
            source: branch.source,
            transported,
        })
    }

    /// The jet of a branch at a frame near its node.
    fn jet_at(&self, field: &Field<D>, node: u32, branch: &Branch, here: &Frame<D>) -> Option<Jet> {
        if branch.at_source {
            let source = &field.sources[branch.source as usize];
            return Jet::of_point(source, 0.0, here);
        }
        let from = self.frames[node as usize].as_ref()?;
        branch.jet.carried(from, here)
    }

    /// By how much the angle at the source differs from that which the next node would say.
    fn angle_error(
        &self,
        field: &Field<D>,
        node: &u32,
        branch: &Branch,
        here: &Frame<D>,
        jet: &Jet,
    ) -> f64 {
        let off = |n: u32| {
            let point = &self.geodesics.graph().nodes[n as usize].point;
            (point - here.point).norm()
        };
        let next = self.adjacent(*node).filter_map(|edge| {
            let same = field.branches(edge.to).iter().filter_map(|other| {
                let there = self.jet_at(field, edge.to, other, here)?;
                let along =
                    there.gradient[0] * jet.gradient[0] + there.gradient[1] * jet.gradient[1];
                let same = other.source == branch.source && along >= SAME_DIRECTION;
                same.then(|| turned_by(jet.heading.angle, there.heading.angle).abs())
            });
            Some((off(edge.to), same.reduce(f64::min)?))
        });
        let next = next.min_by(|a, b| a.0.total_cmp(&b.0));
        next.map_or(0.0, |next| next.1)
    }
}

impl<const D: usize> Fields<'_, D, Atlas<D>> {
    /// The logarithms of the points of the cloud, in the order of [`Cloud::points`](crate::cloud::Cloud::points);
    /// `None` where unreached or where a point has no foot.
    ///
    /// O(n), in parallel.
    ///
    /// # Errors
    /// As [`logarithm`](Self::logarithm).
    pub fn logarithms(&self, field: &Field<D>) -> Result<Vec<Option<Logarithm<D>>>, Error> {
        if field.other.is_some() {
            return Err(Error::NoDirections);
        }
        let atlas = self.geodesics.surface();
        let points = 0..atlas.cloud().points.len();
        let found = points.into_par_iter().map_init(
            || Geometry::new(D - 2),
            |geometry, point| {
                let node = atlas.node_of_point(point).ok()?;
                self.logarithm_at(field, &node, geometry)
            },
        );
        Ok(found.collect())
    }
}

/// The source's tangents at the end of the geodesic that a jet arrives by, where they keep their angle to it.
fn transported<const D: usize>(here: &Frame<D>, jet: &Jet) -> [Vector<D>; 2] {
    let [a, b] = jet.gradient.map(|g| g / norm(jet.gradient));
    let hand = 1_f64.copysign(jet.heading.turn);
    let (ahead, left) = (here.vector([a, b]), here.vector([-b * hand, a * hand]));
    let (sin, cos) = jet.heading.angle.sin_cos();
    [ahead * cos - left * sin, ahead * sin + left * cos]
}
