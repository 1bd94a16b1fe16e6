//! The logarithmic map at a source, and parallel transport along the shortest geodesics. Both come
//! from the same jets as the distances, which know the direction in which the arriving ray left the
//! source.

use crate::Vector;
use crate::correction;
use crate::error::Error;
use crate::field::evaluate::{Taken, Value};
use crate::field::plane::{norm, turned_by};
use crate::field::rays::branches::{Branch, SAME_DIRECTION};
use crate::field::rays::frame::{Frame, ON_SURFACE};
use crate::field::rays::jet::{Heading, Jet};
use crate::field::rays::piece::Piece;
use crate::field::{Field, Fields, frame};
use crate::guess::Guide;
use crate::parallel;
use crate::surface::atlas::ChartIndex;
use crate::surface::{Geometry, Node};

/// Error of an angle, in radians, above which paths are pulled taut where rays draw together.
const DOUBTFUL_ANGLE: f64 = 1e-2;

/// Largest share of a distance, beyond its error, by which a path's length may differ from it for
/// both to be the same way.
const SAME_WAY: f64 = 1e-4;

/// Largest error of a direction, as the chord between unit vectors: that of opposite directions.
const OPPOSITE_DIRECTIONS: f64 = 2.0;

/// The logarithm of a point: the tangent vector at a source whose geodesic leads to the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Logarithm<const D: usize> {
    /// The vector in the coordinates of [`Fields::source_tangents`]; it is as long as the geodesic.
    pub vector: [f64; 2],
    /// Estimated error of the vector's end, in the input's units.
    pub error: f64,
    /// The index of the nearest source.
    pub source: u32,
    /// The source's two tangents, carried in parallel along the geodesic to the point. `None` where
    /// the way is diffracted round a hole or where the direction is not known; the error then says
    /// so.
    pub transported: Option<[Vector<D>; 2]>,
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The two orthonormal tangents at a source in which its logarithms are given.
    #[must_use]
    pub fn source_tangents(&self, field: &Field<D>, source: u32) -> Option<[Vector<D>; 2]> {
        field.pieces.get(source as usize).map(|s| s.frame.tangents)
    }

    /// The logarithm of a node of the surface at its nearest source; `None` where the node is
    /// unreached.
    ///
    /// # Errors
    /// [`Error::NoDirections`] on surfaces of other dimensions than 2, with costs, on rough clouds,
    /// and for distances from curves.
    pub fn logarithm(
        &self,
        field: &Field<D>,
        node: &Node<D, S::Place>,
    ) -> Result<Option<Logarithm<D>>, Error> {
        if field.other.is_some() || field.is_of_curve() {
            return Err(Error::NoDirections);
        }
        let mut geometry = Geometry::new(D - 2);
        Ok(self.logarithm_at(field, node, &mut geometry))
    }

    /// The logarithm of a node, on fields found by rays from points.
    fn logarithm_at(
        &self,
        field: &Field<D>,
        node: &Node<D, S::Place>,
        geometry: &mut Geometry<D>,
    ) -> Option<Logarithm<D>> {
        let near = self.nearest_node(node)?;
        let taken = self.taken(field, near, &node.point, ON_SURFACE)?;
        let branch = field.branches(taken.node)[taken.branch];
        let piece = &field.pieces[branch.source as usize];
        let (source, length) = (&piece.frame, taken.value.distance - piece.start);
        if length <= 0.0 {
            return Some(Logarithm {
                vector: [0.0; 2],
                error: taken.value.error,
                source: branch.source,
                transported: Some(source.tangents),
            });
        }
        let here = frame(self.geodesics.surface(), node, geometry);
        let known = here.and_then(|here| self.arrival(field, &taken, &branch, node, &here));
        let (angle, error, transported) =
            known.unwrap_or((branch.jet.heading.angle, OPPOSITE_DIRECTIONS, None));
        let (sin, cos) = angle.sin_cos();
        Some(Logarithm {
            vector: [length * cos, length * sin],
            error: taken
                .value
                .error
                .hypot(length * error.min(OPPOSITE_DIRECTIONS)),
            source: branch.source,
            transported,
        })
    }

    /// The angle at the source of the ray that arrives at a node, its estimated error, and the
    /// source's tangents carried in parallel to the node.
    fn arrival(
        &self,
        field: &Field<D>,
        taken: &Taken<D>,
        branch: &Branch,
        node: &Node<D, S::Place>,
        here: &Frame<D>,
    ) -> Option<(f64, f64, Option<[Vector<D>; 2]>)> {
        let jet = self.jet_at(field, taken.node, branch, here);
        let known = jet.map(|jet| {
            let next = self.angle_error(field, taken.node, branch, here, &jet);
            (jet, branch.angle_error + next)
        });
        let doubtful = known.is_none_or(|(_, error)| error > DOUBTFUL_ANGLE);
        let focused = branch.is_focused(self.ground.spacing[taken.node as usize]);
        let polished = (doubtful && focused).then(|| {
            let from = self.ground.frames[taken.node as usize].as_ref()?;
            let hand = from.handedness(here) * branch.jet.heading.turn;
            self.polished(field, &taken.value, node, here, hand)
        });
        let (jet, error) = polished.flatten().or(known)?;
        let transported = (!jet.heading.is_diffracted()).then(|| transported(here, &jet));
        Some((jet.heading.angle, error, transported))
    }

    /// The jet at a node by the path pulled taut, with the error of its directions. It serves where
    /// rays draw together; `None` where the path is not the shortest.
    fn polished(
        &self,
        field: &Field<D>,
        value: &Value<D>,
        node: &Node<D, S::Place>,
        here: &Frame<D>,
        hand: f64,
    ) -> Option<(Jet, f64)> {
        let index = value.source as usize;
        let surface = self.geodesics.surface();
        let near = field.piece_nodes[index]?;
        let Piece {
            frame: source,
            start: before,
            ..
        } = &field.pieces[index];
        let mut start = self.geodesics.graph().nodes[near as usize];
        start.point = source.point;
        if !surface.find_place(&start.point, &mut start.place, &mut Geometry::new(D - 2)) {
            return None;
        }
        let settings = correction::Settings::default();
        let path = self.geodesics.path(&start, node, &settings);
        let length = value.distance - before;
        let most = value.error + SAME_WAY * length;
        if !path.converged() || (path.length - length).abs() > most {
            return None;
        }
        // The first and the last segment of the path give its directions, as straight steps seen
        // from its ends.
        let ahead = source.log(path.points.get(1)?, ON_SURFACE);
        let back = here.log(path.points.iter().nth_back(1)?, ON_SURFACE);
        let arrival = norm(back);
        let steps = [
            source.log_error(norm(ahead)) / norm(ahead),
            here.log_error(arrival) / arrival,
        ];
        let heading = Heading {
            angle: ahead[1].atan2(ahead[0]),
            turn: hand,
            ..Heading::default()
        };
        let jet = Jet::new(path.length, back.map(|b| -b / arrival), 0.0, heading);
        Some((jet, steps[0].max(steps[1]) + settings.tolerance))
    }

    /// The jet of a branch at a frame near the branch's node.
    fn jet_at(&self, field: &Field<D>, node: u32, branch: &Branch, here: &Frame<D>) -> Option<Jet> {
        if let Some(piece) = branch.piece {
            return Jet::of_point(&field.pieces[piece as usize].frame, 0.0, here);
        }
        let from = self.ground.frames[node as usize].as_ref()?;
        branch.jet.carried(from, here)
    }

    /// The mean difference between the angle at the source of a jet and the angles that the
    /// adjacent nodes, which are farther off, say.
    fn angle_error(
        &self,
        field: &Field<D>,
        node: u32,
        branch: &Branch,
        here: &Frame<D>,
        jet: &Jet,
    ) -> f64 {
        let differences = self.adjacent(node).filter_map(|edge| {
            let same = field.branches(edge.to).iter().filter_map(|other| {
                let there = self.jet_at(field, edge.to, other, here)?;
                let along =
                    there.gradient[0] * jet.gradient[0] + there.gradient[1] * jet.gradient[1];
                let same = other.source == branch.source && along >= SAME_DIRECTION;
                same.then(|| turned_by(jet.heading.angle, there.heading.angle).abs())
            });
            same.reduce(f64::min)
        });
        let (sum, count) = differences.fold((0.0, 0.0), |(sum, count), d| (sum + d, count + 1.0));
        if count > 0.0 {
            sum / count
        } else {
            f64::INFINITY
        }
    }
}

impl<const D: usize, S: Guide<D, Place: From<ChartIndex>>> Fields<'_, D, S> {
    /// The logarithms of the points of the cloud, in the order of
    /// [`Cloud::points`](crate::cloud::Cloud::points); `None` where a point is unreached or has no
    /// foot. A surface that is no atlas has no points.
    ///
    /// O(n), in parallel.
    ///
    /// # Errors
    /// The same errors as [`logarithm`](Self::logarithm).
    pub fn logarithms(&self, field: &Field<D>) -> Result<Vec<Option<Logarithm<D>>>, Error> {
        if field.other.is_some() || field.is_of_curve() {
            return Err(Error::NoDirections);
        }
        let Some(atlas) = self.geodesics.surface().atlas() else {
            return Ok(Vec::new());
        };
        let scratch = || Geometry::new(D - 2);
        let of_point = |geometry: &mut _, point: usize| {
            let node = atlas.node_of_point(point).ok()?;
            self.logarithm_at(field, &node.into_kind(), geometry)
        };
        let count = atlas.cloud().points.len();
        Ok(parallel::map_with(count, scratch, of_point))
    }
}

/// The source's tangents at the end of the geodesic that a jet arrives by. Parallel transport keeps
/// their angle to the geodesic.
fn transported<const D: usize>(here: &Frame<D>, jet: &Jet) -> [Vector<D>; 2] {
    let [a, b] = jet.gradient.map(|g| g / norm(jet.gradient));
    let hand = 1_f64.copysign(jet.heading.turn);
    let (ahead, left) = (here.vector([a, b]), here.vector([-b * hand, a * hand]));
    let (sin, cos) = jet.heading.angle.sin_cos();
    [ahead * cos - left * sin, ahead * sin + left * cos]
}
