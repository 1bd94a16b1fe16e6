//! A surface of any kind, and how each kind knows the points that a user names.

use taut_core::Vector;
use taut_core::cloud::Cloud;
use taut_core::error::Error;
use taut_core::field::{Cost, Field, Fields, Logarithm, Value};
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_core::guess::sampling::Sampled;
use taut_core::surface::atlas::report::Report;
use taut_core::surface::atlas::{Atlas, ChartIndex};
use taut_core::surface::mls::MovingLeastSquares;
use taut_core::surface::{Geometry, Node, Surface};

use crate::End;
use crate::equations::System;
use crate::size::padded;

/// A surface of any kind. The solvers are compiled for this type alone, once for each size of
/// vectors.
pub enum Kind<const D: usize> {
    /// Charts through the points of a cloud, or those of a model.
    Atlas(Atlas<D>),
    /// The moving least squares surface of a cloud.
    MovingLeastSquares(MovingLeastSquares<D>),
    /// The zeros of equations.
    Equations(Sampled<D, System>),
}

/// A place on a surface of any kind, which reads the part that means something to it.
#[derive(Clone, Copy, Debug)]
pub struct Place<const D: usize> {
    /// On the surface of a cloud, the nearest chart.
    chart: ChartIndex,
    /// On the surface of equations, the point where the node was last.
    last: Vector<D>,
}

/// A node of a surface and how far a point was moved there.
pub type Located<const D: usize> = (Node<D, Place<D>>, f64);

impl<const D: usize> From<ChartIndex> for Place<D> {
    fn from(chart: ChartIndex) -> Self {
        Self {
            chart,
            last: Vector::zeros(),
        }
    }
}

impl<const D: usize> From<Vector<D>> for Place<D> {
    fn from(last: Vector<D>) -> Self {
        Self { chart: 0, last }
    }
}

impl<const D: usize> From<Place<D>> for ChartIndex {
    fn from(place: Place<D>) -> Self {
        place.chart
    }
}

impl<const D: usize> From<Place<D>> for Vector<D> {
    fn from(place: Place<D>) -> Self {
        place.last
    }
}

impl<const D: usize> AsMut<ChartIndex> for Place<D> {
    fn as_mut(&mut self) -> &mut ChartIndex {
        &mut self.chart
    }
}

impl<const D: usize> AsMut<Vector<D>> for Place<D> {
    fn as_mut(&mut self) -> &mut Vector<D> {
        &mut self.last
    }
}

impl<const D: usize> From<Atlas<D>> for Kind<D> {
    fn from(atlas: Atlas<D>) -> Self {
        Self::Atlas(atlas)
    }
}

impl<const D: usize> From<MovingLeastSquares<D>> for Kind<D> {
    fn from(surface: MovingLeastSquares<D>) -> Self {
        Self::MovingLeastSquares(surface)
    }
}

impl<const D: usize> From<Sampled<D, System>> for Kind<D> {
    fn from(surface: Sampled<D, System>) -> Self {
        Self::Equations(surface)
    }
}

/// Asks a surface of any kind what all kinds can be asked. Methods that have a default need it too:
/// the default is not what the surface itself answers.
macro_rules! ask {
    ($kind:expr, $surface:ident => $answer:expr) => {
        match $kind {
            Kind::Atlas($surface) => $answer,
            Kind::MovingLeastSquares($surface) => $answer,
            Kind::Equations($surface) => $answer,
        }
    };
}

impl<const D: usize> Surface<D> for Kind<D> {
    type Place = Place<D>;

    fn intrinsic_dimension(&self) -> usize {
        ask!(self, surface => surface.intrinsic_dimension())
    }

    fn origin(&self) -> Vector<D> {
        ask!(self, surface => surface.origin())
    }

    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut Place<D>,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        ask!(self, surface => surface.foot(x, place.as_mut(), scratch))
    }

    fn geometry(&self, x: &Vector<D>, place: Place<D>, out: &mut Geometry<D>) -> bool {
        ask!(self, surface => surface.geometry(x, place.into(), out))
    }

    fn find_place(&self, x: &Vector<D>, place: &mut Place<D>, scratch: &mut Geometry<D>) -> bool {
        ask!(self, surface => surface.find_place(x, place.as_mut(), scratch))
    }

    fn cheap_geometry(&self, x: &Vector<D>, place: Place<D>, out: &mut Geometry<D>) -> bool {
        ask!(self, surface => surface.cheap_geometry(x, place.into(), out))
    }

    fn cheap_foot(
        &self,
        x: &Vector<D>,
        place: &mut Place<D>,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        ask!(self, surface => surface.cheap_foot(x, place.as_mut(), scratch))
    }

    fn has_cheap_view(&self) -> bool {
        ask!(self, surface => surface.has_cheap_view())
    }

    fn beyond_rim(&self, x: &Vector<D>, place: Place<D>) -> Option<(f64, Vector<D>)> {
        ask!(self, surface => surface.beyond_rim(x, place.into()))
    }

    fn has_rims(&self) -> bool {
        ask!(self, surface => surface.has_rims())
    }

    fn rim(&self) -> Vec<(Node<D, Place<D>>, Vector<D>, f64)> {
        ask!(self, surface => {
            let rim = surface.rim().into_iter();
            rim.map(|(node, outward, spacing)| (node.into_kind(), outward, spacing)).collect()
        })
    }

    fn detail(&self) -> f64 {
        ask!(self, surface => surface.detail())
    }

    fn height_error(&self, place: Place<D>) -> f64 {
        ask!(self, surface => surface.height_error(place.into()))
    }

    fn height_error_along(&self, nodes: [&Node<D, Place<D>>; 3]) -> f64 {
        ask!(self, surface => {
            let [a, b, c] = nodes.map(|node| node.into_kind());
            surface.height_error_along([&a, &b, &c])
        })
    }

    fn rippled(&self, place: Place<D>) -> f64 {
        ask!(self, surface => surface.rippled(place.into()))
    }

    fn resolution(&self, place: Place<D>) -> f64 {
        ask!(self, surface => surface.resolution(place.into()))
    }
}

impl<const D: usize> Guide<D> for Kind<D> {
    fn entrances(&self, node: &Node<D, Place<D>>, visit: &mut dyn FnMut(u32)) {
        ask!(self, surface => surface.entrances(&node.into_kind(), visit));
    }

    fn ways(
        &self,
        from: &Node<D, Place<D>>,
        to: &Node<D, Place<D>>,
        is_joined: bool,
    ) -> Vec<Vec<Node<D, Place<D>>>> {
        ask!(self, surface => {
            let ways = surface.ways(&from.into_kind(), &to.into_kind(), is_joined).into_iter();
            ways.map(|way| way.into_iter().map(Node::into_kind).collect()).collect()
        })
    }

    fn passes_tip(&self, way: &[Node<D, Place<D>>]) -> bool {
        ask!(self, surface => {
            let way: Vec<_> = way.iter().map(|node| node.into_kind()).collect();
            surface.passes_tip(&way)
        })
    }

    fn apart(&self, from: Option<u32>, to: Option<u32>) -> bool {
        ask!(self, surface => surface.apart(from, to))
    }

    fn atlas(&self) -> Option<&Atlas<D>> {
        match self {
            Self::Atlas(atlas) => Some(atlas),
            Self::MovingLeastSquares(_) | Self::Equations(_) => None,
        }
    }
}

impl<const D: usize> Kind<D> {
    /// The node of an end, and how far the point was moved onto the surface.
    ///
    /// # Errors
    /// The engine's, where the end has no place on the surface.
    pub fn locate(&self, end: &End) -> Result<Located<D>, Error> {
        match self {
            Self::Atlas(atlas) => {
                let node = match end {
                    End::Row(row) if !atlas.has_points() => {
                        return Err(Error::NoSuchPoint {
                            row: *row,
                            reason: "a model keeps no rows; give coordinates",
                        });
                    }
                    End::Row(row) => atlas.node_of_row(*row)?,
                    End::Point(point) => atlas.node_near(&padded(point))?,
                };
                Ok((node.into_kind(), moved(atlas.cloud(), end, &node.point)))
            }
            Self::MovingLeastSquares(surface) => {
                let node = match end {
                    End::Row(row) => surface.node_of_row(*row)?,
                    End::Point(point) => surface.node_near(&padded(point))?,
                };
                let cloud = surface.atlas().cloud();
                Ok((node.into_kind(), moved(cloud, end, &node.point)))
            }
            Self::Equations(surface) => match end {
                End::Point(point) => {
                    let (node, moved) = surface.node_near(&padded(point))?;
                    Ok((node.into_kind(), moved))
                }
                End::Row(row) => Err(Error::NoSuchPoint {
                    row: *row,
                    reason: "a surface given by equations has no rows; give coordinates",
                }),
            },
        }
    }

    /// How far at most the points lie from the surface near a node that it was fitted to, where
    /// that is known of points that are not kept.
    #[must_use]
    pub fn farthest_point(&self, node: &Node<D, Place<D>>) -> Option<f64> {
        let model = self.atlas().filter(|atlas| !atlas.has_points())?;
        Some(model.farthest_point(node.place.chart))
    }

    /// What speaks against all answers, in sentences.
    #[must_use]
    pub fn doubts(&self) -> Vec<String> {
        let atlas = match self {
            Self::Atlas(atlas) => atlas,
            Self::MovingLeastSquares(surface) => surface.atlas(),
            Self::Equations(_) => return Vec::new(),
        };
        atlas.doubts().iter().map(ToString::to_string).collect()
    }

    /// How many spacings of the points an end lies off the surface that was moved by so much onto
    /// it, where that is more than points usually do.
    #[must_use]
    pub fn spacings_off(&self, node: &Node<D, Place<D>>, moved: f64) -> Option<f64> {
        self.atlas()?.spacings_off(&node.into_kind(), moved)
    }

    /// Facts about the points that it was put through, if it was.
    #[must_use]
    pub fn report(&self) -> Option<Report> {
        self.atlas().map(Atlas::report)
    }

    /// Whether the `surface_error` of paths is an estimate, or unknown.
    #[must_use]
    pub fn estimates_its_error(&self) -> bool {
        !matches!(self, Self::MovingLeastSquares(_))
    }

    /// The atlas, if it keeps the points of a cloud.
    fn atlas_with_points(&self) -> Option<&Atlas<D>> {
        self.atlas().filter(|atlas| atlas.has_points())
    }

    /// Makes the surface ready for fields of distances, or of costs, which only clouds have.
    ///
    /// # Errors
    /// The engine's, where the costs do not suit the surface.
    pub fn fields<'a>(
        geodesics: &'a Geodesics<D, Self>,
        cost: Option<&Cost>,
    ) -> Result<Fields<'a, D, Self>, Error> {
        match cost {
            Some(cost) => Fields::with_cost(geodesics, cost),
            None => Fields::of_cloud(geodesics),
        }
    }

    /// The field at the rows that the surface was put through, if it keeps any; `None` for rows
    /// without a place on it.
    #[must_use]
    pub fn at_rows(
        &self,
        fields: &Fields<'_, D, Self>,
        field: &Field<D>,
    ) -> Option<Vec<Option<Value<D>>>> {
        let atlas = self.atlas_with_points()?;
        Some(of_rows(atlas.cloud(), &fields.at_points(field)))
    }

    /// The logarithms of the same rows; within, `None` for unreached ones.
    ///
    /// # Errors
    /// The engine's, where directions at the source are not known.
    pub fn logarithms_of_rows(
        &self,
        fields: &Fields<'_, D, Self>,
        field: &Field<D>,
    ) -> Result<Option<Vec<Option<Option<Logarithm<D>>>>>, Error> {
        let Some(atlas) = self.atlas_with_points() else {
            return Ok(None);
        };
        let found = fields.logarithms(field)?;
        Ok(Some(of_rows(atlas.cloud(), &found)))
    }
}

/// As [`Kind::locate`] on a surface whose points have `dimension` coordinates.
///
/// # Errors
/// What is wrong with the end, in words.
pub fn locate<const D: usize>(
    surface: &Kind<D>,
    dimension: usize,
    end: &End,
) -> Result<Located<D>, String> {
    if let End::Point(point) = end
        && point.len() != dimension
    {
        return Err(format!(
            "found {} coordinates, expected {dimension}, as many as the points of the surface have",
            point.len()
        ));
    }
    surface.locate(end).map_err(|error| error.to_string())
}

/// What is known of the points of a cloud, for each row that was read.
fn of_rows<const D: usize, T: Copy>(cloud: &Cloud<D>, values: &[T]) -> Vec<Option<T>> {
    let rows = cloud.point_of_row.iter();
    rows.map(|point| point.map(|point| values[point as usize]))
        .collect()
}

/// How far an end was moved onto the surface of a cloud.
fn moved<const D: usize>(cloud: &Cloud<D>, end: &End, point: &Vector<D>) -> f64 {
    let given = match end {
        End::Row(row) => match cloud.point_of_row.get(*row) {
            Some(Some(index)) => cloud.points[*index as usize],
            _ => *point,
        },
        End::Point(given) => padded::<D>(given) - cloud.centre,
    };
    (point - given).norm()
}
