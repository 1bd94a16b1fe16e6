//! What can go wrong when drawing.

/// Why a picture could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// There is nothing to draw.
    #[error(
        "nothing to draw: of {points} points none has finite coordinates; expected at least one"
    )]
    Empty {
        /// Points given, finite or not.
        points: usize,
    },
    /// An attribute of the points has the wrong length.
    #[error(
        "{found} {attribute} for {expected} points; give one for each point, in the same order"
    )]
    Count {
        /// Which attribute: "normals", "colours" or "radii".
        attribute: &'static str,
        /// Values given.
        found: usize,
        /// Values expected.
        expected: usize,
    },
    /// A disc cannot be drawn.
    #[error("radius {radius} of point {index}: a disc needs a finite radius above zero")]
    Radius {
        /// The first point concerned.
        index: usize,
        /// Its radius, in scene units.
        radius: f64,
    },
    /// A picture size that cannot be drawn.
    #[error("a picture of {width} x {height} pixels: each side must lie in 16..=16384")]
    Size {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// A direction that is none.
    #[error(
        "the {name} direction {direction:?} is not a direction: give three finite numbers, not all zero"
    )]
    Direction {
        /// Which argument: "view" or "up".
        name: &'static str,
        /// Its value.
        direction: [f64; 3],
    },
    /// Coordinates that do not divide into points.
    #[error(
        "{count} coordinates are no whole number of points of dimension {dimension}; expected a dimension of at least 1 that divides them"
    )]
    Dimension {
        /// Numbers given.
        count: usize,
        /// Numbers a point.
        dimension: usize,
    },
    /// The principal axes were not found.
    #[error(
        "no principal axes in dimension {dimension}: the eigenvalue iteration did not converge; scale the coordinates to about 1"
    )]
    PrincipalAxes {
        /// Numbers a point.
        dimension: usize,
    },
    /// The picture could not be encoded.
    #[error("the picture could not be encoded as PNG")]
    Encode(#[from] png::EncodingError),
}
