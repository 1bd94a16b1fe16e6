//! What can be wrong with what was asked.

use taut_core::surface::shapes::ShapeError;
use taut_formula::FormulaError;

use crate::End;

/// Why a surface cannot be made or a question cannot be answered.
///
/// That no path exists, or that one did not converge, is no error: the [`Status`](crate::Status) of
/// the path says it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The engine refuses the surface or the question.
    #[error(transparent)]
    Engine(#[from] taut_core::error::Error),
    /// The text of an equation cannot be read.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// The name or the numbers of a shape cannot be read.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The number of values is not a multiple of the number of coordinates.
    #[error(
        "found {values} values, expected a multiple of {dimension}, the coordinates of a point"
    )]
    RaggedRows {
        /// The number of values given.
        values: usize,
        /// The number of coordinates of a point.
        dimension: usize,
    },
    /// Points of no coordinates, or of more than the engine takes.
    #[error("found {found} coordinates a point, expected 1 to 16; project the points first")]
    Coordinates {
        /// The number of coordinates.
        found: usize,
    },
    /// A dimension that no surface in this space has, or none where one must be named.
    #[error(
        "found {} as the dimension of the surface, expected 1 to {most} for points of {coordinates} coordinates",
        found.map_or("nothing".to_owned(), |found| found.to_string())
    )]
    Dimension {
        /// The dimension given.
        found: Option<usize>,
        /// The largest that is possible.
        most: usize,
        /// The number of coordinates of a point.
        coordinates: usize,
    },
    /// A point that has no place on the surface.
    #[error("the point {end}: {reason}")]
    NoPlace {
        /// The point as it was named.
        end: End,
        /// What is wrong with it.
        reason: String,
    },
    /// No point of an equation's surface was found.
    #[error(
        "no point of the surface was found between {low:?} and {high:?}; say in which box it lies"
    )]
    NotFound {
        /// The lowest coordinates of the box that was searched.
        low: Vec<f64>,
        /// The highest coordinates.
        high: Vec<f64>,
    },
    /// The surface has no points of its own to ask at.
    #[error("the surface was not put through points and has no rows; name the points to ask at")]
    NoRows,
    /// The caller gave up.
    #[error("given up by the caller")]
    Cancelled,
}
