//! How a user names a point of a surface.

use std::fmt;
use std::str::FromStr;

/// A point of a surface: a row of the points that it was put through, or coordinates.
///
/// Functions take anything that becomes an `End`: a row as a `usize`, coordinates as an array, a
/// slice or a vector.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// A row of the points given, counted from 0.
    Row(usize),
    /// Coordinates in the input's units. They are moved to the nearest point of the surface.
    Point(Vec<f64>),
}

impl FromStr for End {
    type Err = String;

    /// Reads a row, or coordinates with commas between them.
    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains(',') {
            return text.trim().parse().map(Self::Row).map_err(|_| {
                format!(
                    "found {text:?}, expected a row of the file (the first is 0) or coordinates with commas between them"
                )
            });
        }
        text.split(',')
            .map(coordinate)
            .collect::<Result<_, _>>()
            .map(Self::Point)
    }
}

/// Reads a finite number.
///
/// # Errors
/// What was found instead.
pub fn coordinate(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("found {text:?}, expected a finite number")),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_rows_or_coordinates() {
        assert_eq!("12".parse(), Ok(End::Row(12)));
        assert_eq!("-1, 2e-3,0".parse(), Ok(End::Point(vec![-1.0, 2e-3, 0.0])));
        for wrong in ["", "-1", "1.5", "1,,2", "1,nan", "1,inf", "one"] {
            assert!(wrong.parse::<End>().is_err(), "{wrong:?}");
        }
    }
}
