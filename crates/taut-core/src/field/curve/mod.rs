//! Curves that distances are measured from: polylines whose segments are shortest geodesics.
//!
//! Rays leave the segments to both sides, at right angles to them, and leave the corners and ends
//! in all directions between. The point of the curve nearest to a place is either the foot of a
//! geodesic at right angles to a segment or a vertex (Huygens).

mod segment;

use std::f64::consts::FRAC_PI_2;

use crate::Vector;
use crate::correction::length::HeightErrors;
use crate::error::Error;
use crate::field::plane::turned_by;
use crate::field::rays::fan::Bundle;
use crate::field::rays::knot::Knot;
use crate::field::rays::piece::Piece;
use crate::field::rays::ray;
use crate::field::sources::RayOrigin;
use crate::field::{Fields, Source, spacing};
use crate::guess::Guide;
use crate::parallel;
use crate::surface::Node;
use segment::Segment;

/// A polyline on a surface whose segments are shortest geodesics, made ready to measure distances
/// from.
#[derive(Clone, Debug)]
pub struct Curve<const D: usize, P> {
    /// The segments in their order; a curve that is a single point has none.
    segments: Vec<Segment<D, P>>,
    /// The first vertex.
    first: Source<D, P>,
    is_closed: bool,
}

/// Longest piece of a curve that is measured from as a straight one, in spacings of the graph's
/// nodes.
const PIECE: f64 = 0.5;
/// Distance between the first rays along a segment, in spacings of the graph's nodes.
const FIRST_RAYS_APART: f64 = 1.5;
/// Distance between the places on a curve that costs are measured from, in spacings of the points.
const DENSE: f64 = 0.1;
/// Least turn of a corner, in radians; from a smaller one the fan of rays would nowhere be seen
/// between the others.
const STRAIGHT_CORNER: f64 = 1e-9;

impl<const D: usize, P> Curve<D, P> {
    /// The length of the curve, in the input's units; 0 for a single point.
    #[must_use]
    pub fn length(&self) -> f64
    where
        P: Copy,
    {
        self.segments.iter().map(Segment::length).sum()
    }

    /// Whether the last vertex of the curve is its first one.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.is_closed
    }

    /// The one vertex of a curve that is a single point; `None` for other curves.
    pub(crate) fn as_point(&self) -> Option<&Source<D, P>> {
        self.segments.is_empty().then_some(&self.first)
    }
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The curve through vertices in their order, each joined to the next by the shortest geodesic.
    /// It is closed where the last vertex is the first one; vertices that repeat the one before are
    /// left out.
    ///
    /// A curve that is not straight is known only as well as by its vertices; as many vertices as
    /// there are graph nodes along it are enough.
    ///
    /// # Errors
    /// [`Error::NoSources`] without vertices, [`Error::NoCurves`] on surfaces of other dimensions
    /// than 2, [`Error::NoEdge`] where two vertices are not joined by a geodesic.
    ///
    /// One path query for each segment, in parallel.
    pub fn curve(&self, vertices: &[Node<D, S::Place>]) -> Result<Curve<D, S::Place>, Error> {
        let dimension = self.geodesics.surface().intrinsic_dimension();
        if dimension != 2 {
            return Err(Error::NoCurves { dimension });
        }
        let first = vertices.first().ok_or(Error::NoSources)?;
        let is_new = |i: &usize| vertices[*i].point != vertices[i + 1].point;
        let joined: Vec<usize> = (0..vertices.len() - 1).filter(is_new).collect();
        let spacing = spacing(self.geodesics.graph());
        let segments = parallel::map(joined.len(), |i| {
            let segment = joined[i];
            self.segment(
                [&vertices[segment], &vertices[segment + 1]],
                segment,
                &spacing,
            )
        });
        let segments = segments.into_iter().collect::<Result<Vec<_>, _>>()?;
        let last = vertices.last().map(|last| last.point);
        Ok(Curve {
            is_closed: !segments.is_empty() && last == Some(first.point),
            segments,
            first: Source {
                node: *first,
                start: 0.0,
            },
        })
    }

    /// The straight pieces of a curve, and their middles as sources.
    pub(crate) fn pieces(
        &self,
        curve: &Curve<D, S::Place>,
    ) -> (Vec<Source<D, S::Place>>, Vec<Piece<D>>) {
        let of_segment = |i: usize| {
            let segment = &curve.segments[i];
            let cuts = segment.cut(|_, near| PIECE * self.ground.spacing[near as usize]);
            let piece = |ends: &[f64]| {
                let middle = self.place_on(segment, 0.5 * (ends[0] + ends[1]));
                let piece = Piece {
                    frame: middle.frame,
                    half: 0.5 * (ends[1] - ends[0]),
                    start: 0.0,
                    source: 0,
                };
                (source_at(&middle), piece)
            };
            cuts.windows(2).map(piece).collect::<Vec<_>>()
        };
        let pieces = parallel::map(curve.segments.len(), of_segment);
        pieces.into_iter().flatten().unzip()
    }

    /// Places close together all along a curve, from its first to its last vertex, each with the
    /// largest distance between successive places of its segment. `spacing` is the spacing of the
    /// points near a place and its nearest node.
    pub(crate) fn places_on(
        &self,
        curve: &Curve<D, S::Place>,
        spacing: impl Fn(&Vector<D>, u32) -> f64 + Sync,
    ) -> Vec<(Source<D, S::Place>, f64)> {
        let of_segment = |i: usize| {
            let segment = &curve.segments[i];
            let cuts = segment.cut(|x, near| DENSE * spacing(x, near));
            let gaps = cuts.windows(2).map(|ends| ends[1] - ends[0]);
            let gap = gaps.fold(0.0, f64::max);
            let places = cuts.iter().map(|cut| self.place_on(segment, *cut));
            places
                .map(|place| (source_at(&place), gap))
                .collect::<Vec<_>>()
        };
        parallel::map(curve.segments.len(), of_segment).concat()
    }

    /// The place at a length on a segment.
    fn place_on(&self, segment: &Segment<D, S::Place>, length: f64) -> Knot<D, S::Place> {
        let graph = self.geodesics.graph();
        let nearest = |x: &Vector<D>, near: u32| ray::nearest(graph, x, near);
        segment.at(self.geodesics.surface(), &nearest, length)
    }

    /// The rays that leave a curve: to both sides of each segment, and from each corner and end.
    pub(crate) fn bundles<'b>(
        &'b self,
        curve: &'b Curve<D, S::Place>,
    ) -> Vec<Bundle<'b, D, S::Place>> {
        let sides = |segment: &'b Segment<D, S::Place>| {
            let cuts = segment.cut(|_, near| FIRST_RAYS_APART * self.ground.spacing[near as usize]);
            [1.0, -1.0].map(|side| self.square(segment, &cuts, side))
        };
        let mut bundles: Vec<Bundle<'b, D, S::Place>> =
            curve.segments.iter().flat_map(sides).collect();
        let corners = curve.segments.windows(2);
        bundles.extend(corners.filter_map(|pair| corner(&pair[0], &pair[1])));
        if let [first, .., last] | [first @ last] = &curve.segments[..] {
            if curve.is_closed {
                bundles.extend(corner(last, first));
            } else {
                bundles.push(sector(first.ends()[0], [FRAC_PI_2, 3.0 * FRAC_PI_2]));
                bundles.push(sector(last.ends()[1], [-FRAC_PI_2, FRAC_PI_2]));
            }
        }
        bundles
    }

    /// The rays that leave one side of a segment at right angles. `side` is 1 for the right side,
    /// where places along the segment grow to the left as seen along the rays, and -1 for the left
    /// side.
    fn square<'b>(
        &'b self,
        segment: &'b Segment<D, S::Place>,
        cuts: &[f64],
        side: f64,
    ) -> Bundle<'b, D, S::Place> {
        let mut first: Vec<f64> = cuts.iter().map(|cut| side * cut).collect();
        first.sort_by(f64::total_cmp);
        Bundle {
            start: 0.0,
            first,
            is_round: false,
            knot: Box::new(move |place| {
                let along = self.place_on(segment, side * place);
                Knot {
                    length: 0.0,
                    frame: along.frame.turned([0.0, -side]),
                    jacobi: [1.0, 0.0],
                    heights: HeightErrors::default(),
                    ..along
                }
            }),
        }
    }
}

/// A place on a curve as a point source.
fn source_at<const D: usize, P: Copy>(knot: &Knot<D, P>) -> Source<D, P> {
    let node = Node {
        point: knot.frame.point,
        place: knot.place,
    };
    Source { node, start: 0.0 }
}

/// The rays that leave the corner between two segments to its outer side, if the corner turns.
fn corner<'b, const D: usize, P: Copy + Sync>(
    before: &'b Segment<D, P>,
    after: &Segment<D, P>,
) -> Option<Bundle<'b, D, P>> {
    let vertex = before.ends()[1];
    let [x, y] = vertex.frame.coordinates(&after.ends()[0].frame.tangents[0]);
    let turn = turned_by(0.0, y.atan2(x));
    let square = if turn > 0.0 { -FRAC_PI_2 } else { FRAC_PI_2 };
    let angles = [square + turn.min(0.0), square + turn.max(0.0)];
    (turn.abs() > STRAIGHT_CORNER).then(|| sector(vertex, angles))
}

/// The rays that leave a vertex between two angles to the direction of a segment there.
fn sector<const D: usize, P: Copy + Sync>(
    vertex: &Knot<D, P>,
    angles: [f64; 2],
) -> Bundle<'_, D, P> {
    Bundle::of_point(
        &RayOrigin {
            node: &source_at(vertex).node,
            frame: &vertex.frame,
            near: vertex.near,
            start: 0.0,
        },
        Some(angles),
    )
}
