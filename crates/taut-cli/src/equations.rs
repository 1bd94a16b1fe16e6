//! Surfaces F(x) = 0 made ready: written equations and named shapes.

use taut::equations::{Implicit, System};
use taut::kind::Kind;
use taut::size::{coordinates, padded};
use taut::{End, Error};
use taut_core::geodesics::Geodesics;
use taut_core::guess::sampling::{Extent, Sampled};
use taut_core::surface::{Node, Surface};
use taut_core::{Vector, parallel};

use crate::exit::Failure;
use crate::progress::Progress;
use crate::surface::{Samples, corners};

/// The surface sampled from the ends of queries.
pub fn geodesics<const D: usize>(
    law: &Implicit,
    ends: &[End],
    progress: &Progress,
) -> Result<Geodesics<D, Kind<D>>, Failure> {
    let ends = points_of(ends, law.dimension)?;
    let seeds: Vec<Vector<D>> = ends.iter().map(|point| padded(point)).collect();
    Ok(sampled(law, &ends, &seeds, progress)?.into_kind())
}

/// All of the surface, as far as it is searched.
pub fn searched<const D: usize>(
    law: &Implicit,
    progress: &Progress,
) -> Result<Geodesics<D, Sampled<D, System>>, Failure> {
    let refused = |error| refused(law, "--bounds", error);
    let region = law.searched::<D>().map_err(refused)?;
    let seeds = law.seeds::<D>(&region).map_err(refused)?;
    sampled(law, &[&region.low, &region.high], &seeds, progress)
}

/// An error of a surface in the words of the command; `flags` say where the surface lies.
pub fn refused(law: &Implicit, flags: &str, error: Error) -> Failure {
    let surface = law.law.to_string();
    match error {
        Error::Formula(error) => Failure::Formula(error),
        Error::Engine(error) => Failure::Surface { surface, error },
        Error::NotFound { low, high } => Failure::Usage(format!(
            "{surface}: found no point of the surface between {low:?} and {high:?}; say where it lies with {flags}"
        )),
        other => Failure::Unfit {
            surface,
            reason: other.to_string(),
        },
    }
}

/// Samples the surface from `seeds`; the extent of `points` tells the scale where nothing else
/// does.
fn sampled<const D: usize>(
    law: &Implicit,
    points: &[&[f64]],
    seeds: &[Vector<D>],
    progress: &Progress,
) -> Result<Geodesics<D, Sampled<D, System>>, Failure> {
    progress.step("sampling the surface");
    let found = law.sampled(points, seeds);
    let found = found.map_err(|error| refused(law, "--bounds", error))?;
    if let Some(doubt) = doubt(law, found.surface()) {
        progress.note(&format!("{}: {doubt}", law.law));
    }
    Ok(found)
}

/// Surfaces of more dimensions than this are never sampled all the way.
const MOST_COVERED: usize = 3;

/// What the sampling leaves unknown.
fn doubt<const D: usize>(law: &Implicit, sampled: &Sampled<D, System>) -> Option<String> {
    match sampled.extent() {
        Extent::Whole | Extent::WithinBounds => None,
        Extent::Endless => {
            let (low, high) = corners(&sampled.samples());
            let [low, high] = [low, high].map(|v| coordinates(&v, law.dimension));
            Some(format!(
                "the surface goes on beyond the part that was searched: it is sampled between {low:.3?} and {high:.3?}, and what lies beyond is unknown; name the part that you mean with --bounds"
            ))
        }
        Extent::Part if Surface::intrinsic_dimension(sampled) > MOST_COVERED => None,
        Extent::Part => Some(
            "the samples leave out parts of the surface, which has very fine detail or points without a tangent plane: where no way is found, it is unknown whether there is one, and ways near those parts may be longer than the shortest by more than their errors say"
                .to_owned(),
        ),
    }
}

/// The ends' coordinates; a row of a file means nothing here.
pub fn points_of<'a>(ends: &'a [End], dimension: usize) -> Result<Vec<&'a [f64]>, Failure> {
    let point = |end: &'a End| match end {
        End::Point(point) if point.len() == dimension => Ok(point.as_slice()),
        _ => Err(Failure::End {
            end: end.to_string(),
            reason: format!(
                "expected {dimension} coordinates, one for each variable of the equations"
            ),
        }),
    };
    ends.iter().map(point).collect()
}

impl<const D: usize> Samples<D> {
    /// Points of a surface about its samples.
    pub fn of_equations(sampled: &Sampled<D, System>) -> Self {
        let points = sampled.samples();
        let centres = parallel::map(points.len(), |i| {
            let node = Node {
                point: points[i],
                place: points[i],
            };
            (node, nearest(&points[i], &points))
        });
        Self::about(sampled, &centres)
    }
}

/// Distance to the nearest other point.
fn nearest<const D: usize>(point: &Vector<D>, points: &[Vector<D>]) -> f64 {
    let distances = points.iter().map(|other| (other - point).norm());
    distances
        .filter(|distance| *distance > 0.0)
        .fold(f64::INFINITY, f64::min)
}
