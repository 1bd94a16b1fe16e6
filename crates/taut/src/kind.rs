//! The kinds of surfaces, and how each knows the points that a user names.

use taut_core::Vector;
use taut_core::cloud::Cloud;
use taut_core::error::Error;
use taut_core::field::{self, Cost, Field, Fields, Logarithm, Sources, Value};
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_core::guess::sampling::Sampled;
use taut_core::surface::Node;
use taut_core::surface::atlas::Atlas;
use taut_core::surface::atlas::report::Report;
use taut_core::surface::mls::MovingLeastSquares;

use crate::End;
use crate::equations::System;
use crate::size::padded;

/// A surface that knows the user's way of naming its points.
pub trait Kind<const D: usize>: Guide<D> {
    /// The node of an end, and how far the point was moved onto the surface.
    ///
    /// # Errors
    /// The engine's, where the end has no place on the surface.
    fn locate(&self, end: &End) -> Result<(Node<D, Self::Place>, f64), Error>;

    /// How far at most the points lie from the surface near a node that it was fitted to, where that is known of points
    /// that are not kept.
    fn farthest_point(&self, _node: &Node<D, Self::Place>) -> Option<f64> {
        None
    }

    /// What was subtracted from the input's coordinates.
    fn centre(&self) -> Vector<D>;

    /// What speaks against all answers, in sentences.
    fn doubts(&self) -> Vec<String> {
        Vec::new()
    }

    /// How many spacings of the points an end lies off the surface that was moved by so much onto it, where that is
    /// more than points usually do.
    fn spacings_off(&self, _node: &Node<D, Self::Place>, _moved: f64) -> Option<f64> {
        None
    }

    /// Facts about the points that it was put through, if it was.
    fn report(&self) -> Option<Report> {
        None
    }

    /// Whether the `surface_error` of paths is an estimate, or unknown.
    fn estimates_its_error(&self) -> bool {
        true
    }

    /// Makes the surface ready for fields of distances, or of costs, which only clouds have.
    ///
    /// # Errors
    /// The engine's, where the costs do not suit the surface.
    fn fields<'a>(
        geodesics: &'a Geodesics<D, Self>,
        _cost: Option<&Cost>,
    ) -> Result<Fields<'a, D, Self>, Error>
    where
        Self: Sized,
    {
        Ok(Fields::new(geodesics))
    }

    /// The field at the rows that the surface was put through, if it keeps any; `None` for rows without a place on it.
    fn at_rows(
        &self,
        _fields: &Fields<'_, D, Self>,
        _field: &Field<D>,
    ) -> Option<Vec<Option<Value<D>>>>
    where
        Self: Sized,
    {
        None
    }

    /// The logarithms of the same rows; within, `None` for unreached ones.
    ///
    /// # Errors
    /// The engine's, where directions at the source are not known.
    fn logarithms_of_rows(
        &self,
        _fields: &Fields<'_, D, Self>,
        _field: &Field<D>,
    ) -> Result<Option<Vec<Option<Option<Logarithm<D>>>>>, Error>
    where
        Self: Sized,
    {
        Ok(None)
    }

    /// The field as far as the `count` nearest of the surface's own points, if it has any.
    ///
    /// # Errors
    /// The engine's, where a source has no tangent plane.
    fn nearest(
        fields: &Fields<'_, D, Self>,
        sources: Sources<'_, D, Self::Place>,
        _count: usize,
        settings: &field::Settings,
    ) -> Result<Field<D>, Error>
    where
        Self: Sized,
    {
        fields.from(sources, settings)
    }
}

impl<const D: usize> Kind<D> for Atlas<D> {
    fn locate(&self, end: &End) -> Result<(Node<D, Self::Place>, f64), Error> {
        let node = match end {
            End::Row(row) if !self.has_points() => {
                return Err(Error::NoSuchPoint {
                    row: *row,
                    reason: "a model keeps no rows; give coordinates",
                });
            }
            End::Row(row) => self.node_of_row(*row)?,
            End::Point(point) => self.node_near(&padded(point))?,
        };
        Ok((node, moved(self.cloud(), end, &node.point)))
    }

    fn farthest_point(&self, node: &Node<D, Self::Place>) -> Option<f64> {
        (!self.has_points()).then(|| self.farthest_point(node.place))
    }

    fn centre(&self) -> Vector<D> {
        self.cloud().centre
    }

    fn doubts(&self) -> Vec<String> {
        Atlas::doubts(self)
            .iter()
            .map(ToString::to_string)
            .collect()
    }

    fn spacings_off(&self, node: &Node<D, Self::Place>, moved: f64) -> Option<f64> {
        Atlas::spacings_off(self, node, moved)
    }

    fn report(&self) -> Option<Report> {
        Some(Atlas::report(self))
    }

    fn fields<'a>(
        geodesics: &'a Geodesics<D, Self>,
        cost: Option<&Cost>,
    ) -> Result<Fields<'a, D, Self>, Error> {
        match cost {
            Some(cost) => Fields::with_cost(geodesics, cost),
            None => Fields::of_cloud(geodesics),
        }
    }

    fn at_rows(
        &self,
        fields: &Fields<'_, D, Self>,
        field: &Field<D>,
    ) -> Option<Vec<Option<Value<D>>>> {
        self.has_points()
            .then(|| of_rows(self.cloud(), &fields.at_points(field)))
    }

    fn logarithms_of_rows(
        &self,
        fields: &Fields<'_, D, Self>,
        field: &Field<D>,
    ) -> Result<Option<Vec<Option<Option<Logarithm<D>>>>>, Error> {
        if !self.has_points() {
            return Ok(None);
        }
        let found = fields.logarithms(field)?;
        Ok(Some(of_rows(self.cloud(), &found)))
    }

    fn nearest(
        fields: &Fields<'_, D, Self>,
        sources: Sources<'_, D, Self::Place>,
        count: usize,
        settings: &field::Settings,
    ) -> Result<Field<D>, Error> {
        fields.nearest(sources, count, settings)
    }
}

impl<const D: usize> Kind<D> for MovingLeastSquares<D> {
    fn locate(&self, end: &End) -> Result<(Node<D, Self::Place>, f64), Error> {
        let node = match end {
            End::Row(row) => self.node_of_row(*row)?,
            End::Point(point) => self.node_near(&padded(point))?,
        };
        Ok((node, moved(self.atlas().cloud(), end, &node.point)))
    }

    fn centre(&self) -> Vector<D> {
        self.atlas().cloud().centre
    }

    fn doubts(&self) -> Vec<String> {
        Kind::doubts(self.atlas())
    }

    fn estimates_its_error(&self) -> bool {
        false
    }
}

impl<const D: usize> Kind<D> for Sampled<D, System> {
    fn locate(&self, end: &End) -> Result<(Node<D, Vector<D>>, f64), Error> {
        match end {
            End::Point(point) => self.node_near(&padded(point)),
            End::Row(row) => Err(Error::NoSuchPoint {
                row: *row,
                reason: "a surface given by equations has no rows; give coordinates",
            }),
        }
    }

    fn centre(&self) -> Vector<D> {
        Vector::zeros()
    }
}

/// As [`Kind::locate`] on a surface whose points have `dimension` coordinates.
///
/// # Errors
/// What is wrong with the end, in words.
pub fn locate<const D: usize, S: Kind<D>>(
    surface: &S,
    dimension: usize,
    end: &End,
) -> Result<(Node<D, S::Place>, f64), String> {
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
