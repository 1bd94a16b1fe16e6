//! How a user names a point of a surface.

use std::fmt;

/// A point of a surface: a row of the points that it was put through, or coordinates.
///
/// Functions take anything that becomes an `End`: a row as a `usize`, coordinates as an array, a slice or a vector.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// A row of the points given, counted from 0.
    Row(usize),
    /// Coordinates in the input's units. They are moved to the nearest point of the surface.
    Point(Vec<f64>),
}

impl fmt::Display for End {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Row(row) => write!(formatter, "{row}"),
            Self::Point(point) => {
                let point: Vec<String> = point.iter().map(f64::to_string).collect();
                formatter.write_str(&point.join(","))
            }
        }
    }
}

impl From<usize> for End {
    fn from(row: usize) -> Self {
        Self::Row(row)
    }
}

impl<const N: usize> From<[f64; N]> for End {
    fn from(point: [f64; N]) -> Self {
        Self::Point(point.to_vec())
    }
}

impl From<&[f64]> for End {
    fn from(point: &[f64]) -> Self {
        Self::Point(point.to_vec())
    }
}

impl From<Vec<f64>> for End {
    fn from(point: Vec<f64>) -> Self {
        Self::Point(point)
    }
}

impl From<&End> for End {
    fn from(end: &End) -> Self {
        end.clone()
    }
}
