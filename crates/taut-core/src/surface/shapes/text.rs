//! Shapes as texts, and as boxes.

use std::fmt;

use thiserror::Error;

use crate::surface::shapes::{KNOWN, Shape};

/// Why a text names no shape.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ShapeError {
    /// There is no shape of this name.
    #[error("no shape is called `{name}`; write one of {}", known())]
    Unknown {
        /// The name given.
        name: String,
    },
    /// A parameter is not a number.
    #[error("parameter {position} of `{usage}` is `{found}`, expected a number like 0.4")]
    NotANumber {
        /// How the shape is written.
        usage: String,
        /// The position of the parameter, counted from 1.
        position: usize,
        /// The text of the parameter.
        found: String,
    },
    /// There are too many or too few parameters.
    #[error("`{usage}` was given {found} parameters")]
    WrongCount {
        /// How the shape is written.
        usage: String,
        /// The number of parameters given.
        found: usize,
    },
    /// A parameter is outside its range.
    #[error("parameter {position} of `{usage}` is {found}, expected {expected}")]
    OutOfRange {
        /// How the shape is written.
        usage: String,
        /// The position of the parameter, counted from 1.
        position: usize,
        /// The value of the parameter.
        found: f64,
        /// The values allowed.
        expected: &'static str,
    },
}

fn known() -> String {
    let all: Vec<String> = KNOWN
        .iter()
        .map(|known| usage(known.name, known.parameters))
        .collect();
    all.join(", ")
}

fn usage(name: &str, parameters: &str) -> String {
    match parameters {
        "" => name.to_owned(),
        _ => format!("{name}:{parameters}"),
    }
}

pub(super) const POSITIVE: &str = "a finite number above 0";

impl Shape {
    /// The shape that is written as a name and its parameters, such as `torus:1,0.4`; [`KNOWN`]
    /// lists them.
    ///
    /// # Errors
    /// [`ShapeError`] for unknown names, parameters that are not numbers, too many or too few of
    /// them, or parameters out of range.
    pub fn parse(text: &str) -> Result<Self, ShapeError> {
        let (name, list) = text.split_once(':').unwrap_or((text, ""));
        let name = name.trim();
        let Some(known) = KNOWN.iter().find(|known| known.name == name) else {
            return Err(ShapeError::Unknown {
                name: name.to_owned(),
            });
        };
        let usage = usage(name, known.parameters);
        let values = numbers(list, &usage)?;
        let Some(shape) = Self::with_parameters(name, &values) else {
            return Err(ShapeError::WrongCount {
                usage,
                found: values.len(),
            });
        };
        let is_wrong = |value: &f64| !(*value > 0.0 && value.is_finite());
        let wrong = values.iter().position(is_wrong);
        let wrong = wrong.map(|i| (i, POSITIVE));
        match wrong.or_else(|| shape.unfit(&values)) {
            None => Ok(shape),
            Some((i, expected)) => Err(ShapeError::OutOfRange {
                usage,
                position: i + 1,
                found: values[i],
                expected,
            }),
        }
    }

    /// The dimension d of the space that the shape lives in.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.dimensions()[0]
    }

    /// The dimension k of the surface itself.
    #[must_use]
    pub fn intrinsic_dimension(&self) -> usize {
        let [dimension, equations] = self.dimensions();
        dimension - equations
    }

    /// A length of the order of the shape's extent: half the longest side of its region.
    #[must_use]
    pub fn size(&self) -> f64 {
        let (low, high) = self.region();
        let sides = low.iter().zip(&high).map(|(low, high)| high - low);
        0.5 * sides.fold(0.0, f64::max)
    }

    /// The corners of the smallest box about the shape; `None` for a shape without end.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        (!self.is_endless()).then(|| self.region())
    }
}

fn numbers(list: &str, usage: &str) -> Result<Vec<f64>, ShapeError> {
    if list.trim().is_empty() {
        return Ok(Vec::new());
    }
    let number = |(i, text): (usize, &str)| {
        text.trim().parse().map_err(|_| ShapeError::NotANumber {
            usage: usage.to_owned(),
            position: i + 1,
            found: text.trim().to_owned(),
        })
    };
    list.split(',').enumerate().map(number).collect()
}

impl fmt::Display for Shape {
    /// Writes the shape as [`Shape::parse`] reads it.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, parameters) = self.parts();
        formatter.write_str(name)?;
        for (i, value) in parameters.iter().enumerate() {
            let before = if i == 0 { ':' } else { ',' };
            write!(formatter, "{before}{value}")?;
        }
        Ok(())
    }
}
