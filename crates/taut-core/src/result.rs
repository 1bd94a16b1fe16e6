//! What a query returns: values that carry their error estimate and status, never a bare number.

use std::fmt;

use crate::Vector;
use crate::correction::curve;

/// How a path query ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The estimated relative error is within the tolerance, and the path is taut.
    Converged,
    /// Newton's method stopped before the path was taut to the tolerance.
    NotTaut,
    /// The path is taut on its nodes, but the tolerance needs more nodes than are allowed, or is
    /// below what rounding leaves, or the path crosses a crease, where its error is unknown.
    NotResolved,
    /// The path left the part of space where the surface is defined.
    OffSurface,
    /// No path exists: the end points lie on different components, or only a hole lies between.
    NoPath,
    /// It is unknown whether a path exists: none was found, and the surface goes on where it was
    /// not looked at, or has places that no walk passes.
    Unknown,
}

impl Status {
    /// The status as one word, as the command line prints it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::NotTaut => "not-taut",
            Self::NotResolved => "not-resolved",
            Self::OffSurface => "off-surface",
            Self::NoPath => "no-path",
            Self::Unknown => "unknown",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.word())
    }
}

/// A geodesic between two points. Lengths are in the input's units.
#[derive(Clone, Debug)]
pub struct Path<const D: usize> {
    /// How the query ended.
    pub status: Status,
    /// Length of the path; infinite where there is none, not a number where it is unknown.
    pub length: f64,
    /// Estimated absolute error of the length against the geodesic of the same surface; infinite
    /// where it is unknown.
    pub length_error: f64,
    /// Estimated absolute error of the length that the surface itself adds, because it was
    /// reconstructed from points; 0 for equations.
    pub surface_error: f64,
    /// Whether the path is a strict local minimum of length, so that no direction shortens it at
    /// second order.
    pub stable: bool,
    /// Whether the path is known to be the shortest: rays in all directions from one end,
    /// everywhere dense enough that none could arrive unseen, found no shorter one. `false` where
    /// this is not known.
    pub shortest: bool,
    /// Largest geodesic curvature left, 1 / length.
    pub max_geodesic_curvature: f64,
    /// Largest distance of a node from the surface.
    pub max_off_surface: f64,
    /// The number of Newton (or flow) steps taken, over all levels.
    pub steps: usize,
    /// Nodes from start to end, on the surface and in its coordinates, which are centred for a
    /// cloud ([`Surface::origin`](crate::surface::Surface::origin) leads back to the input's);
    /// empty where there is no path.
    pub points: Vec<Vector<D>>,
    /// A unit normal at each node (the first of m for codimension m).
    pub normals: Vec<Vector<D>>,
    /// Length from the start to each node.
    pub arc_length: Vec<f64>,
}

impl<const D: usize> Path<D> {
    /// The answer where no path exists: infinitely long.
    #[must_use]
    pub fn none() -> Self {
        Self {
            status: Status::NoPath,
            length: f64::INFINITY,
            length_error: 0.0,
            surface_error: 0.0,
            stable: false,
            shortest: false,
            max_geodesic_curvature: 0.0,
            max_off_surface: 0.0,
            steps: 0,
            points: Vec::new(),
            normals: Vec::new(),
            arc_length: Vec::new(),
        }
    }

    /// The answer where the points are connected but no guess could be followed: its length is
    /// unknown.
    #[must_use]
    pub fn lost() -> Self {
        Self {
            status: Status::OffSurface,
            length: f64::NAN,
            length_error: f64::INFINITY,
            ..Self::none()
        }
    }

    /// The answer where it is unknown whether a path exists.
    #[must_use]
    pub fn unknown() -> Self {
        Self {
            status: Status::Unknown,
            ..Self::lost()
        }
    }

    /// The place halfway along the chords between the nodes.
    pub(crate) fn halfway(&self) -> Vector<D> {
        curve::halfway(self.points.iter().copied())
    }

    /// Whether both paths converged, to the same length and the same place halfway.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let slack = 2.0 * (self.length_error + other.length_error);
        self.converged()
            && other.converged()
            && (self.length - other.length).abs() <= slack
            && (self.halfway() - other.halfway()).norm() <= 0.01 * self.length
    }

    /// Whether the estimated relative error is within the tolerance asked for.
    #[must_use]
    pub fn converged(&self) -> bool {
        self.status == Status::Converged
    }
}
