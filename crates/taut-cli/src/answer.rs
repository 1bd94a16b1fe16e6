//! What a query found, its dimension forgotten: numbers in the units and coordinates of the input.

use taut::End;
use taut::size::flat;
use taut_core::Vector;
use taut_core::result::{Path, Status};

use crate::exit::Exit;
use crate::numbers::significant;

/// A start or end point.
pub struct LocatedEnd {
    /// As the user named it.
    pub named: End,
    /// Where it lies on the surface, or why it cannot be used.
    pub place: Result<Place, String>,
}

impl LocatedEnd {
    /// See [`Place::warning`].
    pub fn warning(&self) -> Option<String> {
        self.place.as_ref().ok()?.warning()
    }
}

/// A point on the surface.
pub struct Place {
    pub point: Vec<f64>,
    /// How far the end was moved onto the surface.
    pub moved: f64,
    /// How far the points lie from the surface there that it was fitted to, where it does not keep
    /// them.
    pub farthest: Option<f64>,
    /// How many spacings of the points that is, where it is more than points usually are off the
    /// surface.
    pub off: Option<f64>,
}

impl Place {
    /// That the end lies farther from a model than what this was fitted to.
    pub fn warning(&self) -> Option<String> {
        let farthest = self.farthest.filter(|farthest| self.moved > *farthest)?;
        Some(format!(
            "{:.1e} from the model, though the points that it was fitted to lie within {farthest:.1e} of it there: the end may mean another part of the surface",
            self.moved
        ))
    }
}

/// How a pair was answered.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    Asked(Status),
    /// An end has no place on the surface: there was nothing to ask.
    UnusableEnd,
}

impl Outcome {
    /// One word for the output.
    pub fn word(self) -> &'static str {
        match self {
            Self::Asked(status) => status.word(),
            Self::UnusableEnd => "unusable-end",
        }
    }
}

/// A path found, or the word that there is none.
pub struct FoundPath {
    pub outcome: Outcome,
    /// None where there is no path.
    pub length: Option<f64>,
    /// Estimated error of the length on the surface taken; None if unknown.
    pub length_error: Option<f64>,
    /// What the surface adds; 0 for equations, None if unknown.
    pub surface_error: Option<f64>,
    pub stable: bool,
    /// Known to be the shortest; else unknown.
    pub shortest: bool,
    pub max_geodesic_curvature: Option<f64>,
    pub max_off_surface: Option<f64>,
    pub steps: usize,
    /// Row-major, nodes x dimension.
    pub points: Vec<f64>,
    /// As `points`.
    pub normals: Vec<f64>,
    /// Length up to each node.
    pub arc_length: Vec<f64>,
}

/// The answer for one pair of ends.
pub struct Answer {
    pub ends: [LocatedEnd; 2],
    /// The shortest path.
    pub path: FoundPath,
    /// Further paths, shortest first.
    pub alternatives: Vec<FoundPath>,
    /// What speaks against all answers on the surface, in sentences.
    pub doubts: Vec<String>,
}

impl Answer {
    pub fn exit(&self) -> Exit {
        match self.path.outcome {
            Outcome::Asked(Status::Converged) => Exit::Success,
            Outcome::UnusableEnd => Exit::BadInput,
            Outcome::Asked(Status::NoPath) => Exit::NoPath,
            Outcome::Asked(Status::Unknown) => Exit::Unknown,
            Outcome::Asked(Status::NotTaut | Status::NotResolved | Status::OffSurface) => {
                Exit::NotConverged
            }
        }
    }

    /// Why the pair cannot be used, end by end.
    pub fn refusals(&self) -> impl Iterator<Item = (&End, &str)> {
        self.ends
            .iter()
            .filter_map(|end| Some((&end.named, end.place.as_ref().err()?.as_str())))
    }

    /// What speaks against this answer, in sentences.
    pub fn warnings(&self) -> Vec<String> {
        let outlying = self.ends.iter().filter_map(|end| {
            let off = end.place.as_ref().ok()?.off?;
            Some(outlying(&end.named, off))
        });
        outlying.chain(self.doubts.iter().cloned()).collect()
    }

    /// All paths, shortest first.
    pub fn paths(&self) -> impl Iterator<Item = &FoundPath> {
        std::iter::once(&self.path).chain(&self.alternatives)
    }
}

/// Says that an end lies off the surface, by `spacings` of its points.
pub fn outlying(end: &End, spacings: f64) -> String {
    format!(
        "{end} is no point of the surface: it lies {} spacings off it, and the answer is for the place that it was moved to",
        significant(spacings)
    )
}

impl FoundPath {
    /// Moves a path by `centre` and keeps the first `dimension` coordinates.
    pub fn new<const D: usize>(path: &Path<D>, centre: &Vector<D>, dimension: usize) -> Self {
        let exists = path.status != Status::NoPath;
        let known = |value: f64| (exists && value.is_finite()).then_some(value);
        Self {
            outcome: Outcome::Asked(path.status),
            length: known(path.length),
            length_error: known(path.length_error),
            surface_error: known(path.surface_error),
            stable: path.stable,
            shortest: path.shortest,
            max_geodesic_curvature: known(path.max_geodesic_curvature),
            max_off_surface: known(path.max_off_surface),
            steps: path.steps,
            points: flat(&path.points, centre, dimension),
            normals: flat(&path.normals, &Vector::zeros(), dimension),
            arc_length: path.arc_length.clone(),
        }
    }

    /// From a point to itself: nothing has to be found.
    pub fn nowhere() -> Self {
        Self {
            outcome: Outcome::Asked(Status::Converged),
            length: Some(0.0),
            length_error: Some(0.0),
            surface_error: Some(0.0),
            stable: true,
            shortest: true,
            max_geodesic_curvature: Some(0.0),
            max_off_surface: None,
            steps: 0,
            points: Vec::new(),
            normals: Vec::new(),
            arc_length: Vec::new(),
        }
    }

    pub fn nodes(&self) -> usize {
        self.arc_length.len()
    }
}
