//! What can be wrong with the input of a query.

use thiserror::Error;

/// Why a surface cannot be built or a query cannot be asked.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// Fewer finite points than a surface needs.
    #[error(
        "too few points: found {found} distinct finite points, expected at least {needed}; give more points"
    )]
    TooFewPoints {
        /// Finite points found.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// Every point is the same.
    #[error("all {found} points coincide, so there is no spacing and no tangent plane")]
    AllCoincide {
        /// Finite points found.
        found: usize,
    },
    /// A cloud so small or so large that squares and products of lengths are no numbers.
    #[error(
        "found points that reach {found:e} far, expected 1e-50 to 1e50; multiply the coordinates by a power of ten"
    )]
    BadExtent {
        /// The largest difference of two points' coordinates.
        found: f64,
    },
    /// More points than the indices hold.
    #[error("too many points: found {found}, the limit is 2^32 - 2; thin or split the cloud")]
    TooManyPoints {
        /// Points found.
        found: usize,
    },
    /// The points lie on a line or curve, not on a surface of the dimension asked for.
    #[error(
        "no surface of dimension {dimension}: the points lie on a set of lower dimension, so there is no tangent plane"
    )]
    NoTangentPlane {
        /// The intrinsic dimension asked for.
        dimension: usize,
    },
    /// A cell's interval that is no length.
    #[error("a cell cannot be {found} long; give a positive length in the points' units")]
    BadInterval {
        /// The interval given.
        found: f64,
    },
    /// An accuracy that is no length.
    #[error("the accuracy cannot be {found}; give a positive length in the points' units")]
    BadAccuracy {
        /// The accuracy given.
        found: f64,
    },
    /// Points through which no surface was fitted that could be kept.
    #[error(
        "no surface fits{}: found {found}, expected {expected}; leave out points that stray or crowd, or give another accuracy",
        near_text(.place.as_deref())
    )]
    BadFit {
        /// Coordinates of the middle of the chart; `None` for what all share.
        place: Option<String>,
        /// What the fit came to.
        found: String,
        /// What it should.
        expected: String,
    },
    /// A model of a surface that contradicts itself.
    #[error("{}found {found}, expected {expected}; fit the model again", chart_text(*.chart))]
    BadModel {
        /// The chart, the first is 0; `None` for what all share.
        chart: Option<usize>,
        /// What the model says.
        found: String,
        /// What it should.
        expected: String,
    },
    /// A row that is not a point: out of range or not finite.
    #[error("there is no point {row}: {reason}")]
    NoSuchPoint {
        /// The row asked for.
        row: usize,
        /// Out of range, or dropped because not finite.
        reason: &'static str,
    },
    /// A start or end point that cannot be pulled back onto the surface.
    #[error("the point ({point}) cannot be pulled back onto the surface: {reason}")]
    NoFoot {
        /// Coordinates.
        point: String,
        /// What went wrong.
        reason: &'static str,
    },
    /// Equations whose surface has no dimension left or that do not fit the space.
    #[error(
        "{equations} equations in {dimension} variables leave no surface of dimension 1 or more"
    )]
    NoDimensionLeft {
        /// Number of equations.
        equations: usize,
        /// Number of variables.
        dimension: usize,
    },
    /// Something that only the points of a cloud have, on a surface of another kind.
    #[error("found a surface without points of its own, expected one put through a cloud")]
    NoCloud,
    /// Costs on a surface of more than two dimensions.
    #[error("costs need a curve or a two-dimensional surface, found one of dimension {dimension}")]
    NoCosts {
        /// The surface's dimension.
        dimension: usize,
    },
    /// Logarithms where distances are not found by rays from points of a two-dimensional surface.
    #[error("logarithms need a smooth two-dimensional surface, point sources and no costs")]
    NoDirections,
    /// Isolines on a surface that is not two-dimensional.
    #[error("isolines need a two-dimensional surface, found one of dimension {dimension}")]
    NoIsolines {
        /// The surface's dimension.
        dimension: usize,
    },
    /// Curves as sources on a surface that is not two-dimensional.
    #[error(
        "a curve as source needs a two-dimensional surface, found one of dimension {dimension}"
    )]
    NoCurves {
        /// The surface's dimension.
        dimension: usize,
    },
    /// Two vertices of a curve that no geodesic was found between.
    #[error(
        "no geodesic joins vertices {edge} and {} of the curve, counted from 0 ({reason})",
        edge + 1
    )]
    NoEdge {
        /// The first of the two, counted from 0.
        edge: usize,
        /// How the path between them ended.
        reason: &'static str,
    },
    /// Another number of costs than rows.
    #[error("found {found} costs for {expected} points; give one for each")]
    WrongCosts {
        /// Costs given.
        found: usize,
        /// Rows of the input.
        expected: usize,
    },
    /// A cost that is not positive.
    #[error(
        "the cost of point {row} is {found}; give a positive number, or infinity where nothing passes"
    )]
    BadCost {
        /// The row.
        row: usize,
        /// Its cost.
        found: f64,
    },
    /// A factor of slopes that is negative or not finite.
    #[error("the factor for the grade of a slope cannot be {found}; give a number of at least 0")]
    BadSlope {
        /// The factor given.
        found: f64,
    },
    /// No source for particles to leave from.
    #[error("no source: particles need a point of the surface to start from")]
    NoSources,
    /// Particles that find no end of room.
    #[error(
        "the surface seems to go on without end: it has room for more than {particles} particles at distances of {size}, which was taken for its size; bound the part to cover"
    )]
    Endless {
        /// Particles that it has room for.
        particles: usize,
        /// The length taken for the surface's extent.
        size: f64,
    },
}

fn near_text(place: Option<&str>) -> String {
    place.map_or(String::new(), |place| format!(" near ({place})"))
}

fn chart_text(chart: Option<usize>) -> String {
    chart.map_or(String::new(), |i| format!("chart {i}: "))
}
