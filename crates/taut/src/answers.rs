//! What is answered, in the coordinates and units of the input.

use taut_core::result::Status;

/// A geodesic between two points. Lengths are in the input's units.
#[derive(Clone, Debug)]
pub struct Path {
    /// How the query ended.
    pub status: Status,
    /// Length of the path; infinite where there is none, not a number where it is unknown.
    pub length: f64,
    /// Estimated absolute error of the length against the geodesic of the same surface.
    pub length_error: f64,
    /// Estimated absolute error that the surface adds, which was reconstructed from points; 0 for
    /// equations.
    pub surface_error: f64,
    /// Known to be the shortest path; `false` where that is not known.
    pub shortest: bool,
    /// The path is a strict local minimum of length.
    pub stable: bool,
    /// The number of coordinates of a point.
    pub dimension: usize,
    /// Points from start to end, row-major: `dimension` values each. Empty where there is no path.
    pub points: Vec<f64>,
    /// Length from the start to each point.
    pub arc_length: Vec<f64>,
    /// How far the two ends were moved onto the surface.
    pub moved: [f64; 2],
    /// What speaks against all answers on this surface, in sentences.
    pub doubts: Vec<String>,
}

impl Path {
    /// Whether the estimated relative error of the length is within the tolerance asked for.
    #[must_use]
    pub fn converged(&self) -> bool {
        self.status == Status::Converged
    }
}

/// Distances at some points, one value each in their order. Lengths are in the input's units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distances {
    /// From the nearest source: infinite where none leads to the point; not a number where the
    /// point has no place on the surface, or where it is unknown whether a way leads there.
    pub distance: Vec<f64>,
    /// Estimated absolute errors; not a number where the distance is none.
    pub error: Vec<f64>,
    /// The nearest source, counted from 0 in the order given; `None` where there is no distance.
    pub source: Vec<Option<u32>>,
}

/// Logarithms of some points: the vectors at the sources whose geodesics lead there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Logarithms {
    /// For each point two coordinates along the tangents of its source, in the input's units; not
    /// numbers where no geodesic leads to the point or it has no place on the surface.
    pub vectors: Vec<[f64; 2]>,
    /// Estimated absolute errors of the ends of the vectors.
    pub error: Vec<f64>,
    /// The nearest source.
    pub source: Vec<Option<u32>>,
    /// Of each source the two orthonormal tangents in which the vectors are given.
    pub tangents: Vec<[Vec<f64>; 2]>,
    /// The tangents of the nearest source, carried in parallel along the geodesic to each point;
    /// not numbers where no geodesic leads to the point or its last piece is not known.
    pub transported: Vec<[Vec<f64>; 2]>,
}

/// A geodesic shot from a point.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The number of coordinates of a point.
    pub dimension: usize,
    /// Points on it from the start on, row-major.
    pub points: Vec<f64>,
    /// Length from the start to each point.
    pub arc_length: Vec<f64>,
    /// Whether it was followed to its full length. If not, the surface ends, or is not known well
    /// enough to go on.
    pub complete: bool,
    /// Estimated absolute error of the end.
    pub error: f64,
}

impl Shot {
    /// The last point.
    #[must_use]
    pub fn end(&self) -> &[f64] {
        &self.points[self.points.len().saturating_sub(self.dimension)..]
    }
}

/// Lengths between sources and targets, row-major: a row for each source, a column for each target.
#[derive(Clone, Debug)]
pub struct Matrix {
    /// The number of sources.
    pub rows: usize,
    /// The number of targets.
    pub columns: usize,
    /// Lengths: infinite where no path exists, not a number where that is unknown or an end has no
    /// place.
    pub lengths: Vec<f64>,
    /// Estimated absolute errors of the lengths, those of the surface included.
    pub errors: Vec<f64>,
    /// How each query ended.
    pub status: Vec<Status>,
}

/// What is known of a surface before anything is asked of it.
#[derive(Clone, Debug)]
pub struct Check {
    /// The number of coordinates of a point.
    pub coordinates: usize,
    /// The dimension of the surface.
    pub intrinsic_dimension: usize,
    /// The number of nodes of the graph on each connected part, largest first.
    pub parts: Vec<usize>,
    /// Distance between neighbouring points, the median, where the surface was put through points.
    pub spacing: Option<f64>,
    /// Median distance of points from the surface fitted without them: the noise, where there is
    /// some.
    pub noise: Option<f64>,
    /// What speaks against all answers, in sentences.
    pub doubts: Vec<String>,
}
