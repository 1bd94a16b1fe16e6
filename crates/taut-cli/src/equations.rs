//! Surfaces F(x) = 0 made ready: written equations and named shapes.

use taut_core::error::Error;
use taut_core::geodesics::Geodesics;
use taut_core::guess::sampling::{Extent, Sampled};
use taut_core::surface::implicit::{Equations, ImplicitSurface};
use taut_core::surface::shapes::Shape;
use taut_core::surface::{Geometry, Node, Surface};
use taut_core::{Matrix, Vector, parallel};
use taut_formula::Formula;

use crate::answer::{coordinates, padded};
use crate::check::Facts;
use crate::exit::Failure;
use crate::progress::Progress;
use crate::settings::{Bounds, End, EquationSettings, Law};
use crate::surface::{Locate, Located, Prepared, Samples, corners, spread, with_size};

/// Equations of either kind, for as many variables as the engine's vectors have.
pub enum System {
    Formula(Box<Formula>),
    Shape(Shape),
}

impl<const D: usize> Equations<D> for System {
    fn count(&self) -> usize {
        match self {
            Self::Formula(formula) => Equations::<D>::count(&**formula),
            Self::Shape(shape) => Equations::<D>::count(shape),
        }
    }

    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]) {
        match self {
            Self::Formula(formula) => formula.gradients(x, values, gradients),
            Self::Shape(shape) => shape.gradients(x, values, gradients),
        }
    }

    fn hessians(
        &self,
        x: &Vector<D>,
        values: &mut [f64],
        gradients: &mut [Vector<D>],
        hessians: &mut [Matrix<D>],
    ) {
        match self {
            Self::Formula(formula) => formula.hessians(x, values, gradients, hessians),
            Self::Shape(shape) => shape.hessians(x, values, gradients, hessians),
        }
    }
}

/// The box of a shape is widened by this share of its size, so that the surface lies inside.
const SLACK: f64 = 0.01;

/// Makes the surface ready and locates the ends on it.
pub fn prepare(
    settings: &EquationSettings,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    with_size!(settings.dimension, located(settings, ends, progress))
}

fn located<const D: usize>(
    settings: &EquationSettings,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    let geodesics = geodesics::<D>(settings, &ends, progress)?;
    let located = Located::new(geodesics, settings.dimension, ends, None);
    Ok(Box::new(located))
}

/// The surface sampled from the ends of queries.
pub fn geodesics<'a, const D: usize>(
    settings: &EquationSettings,
    ends: impl IntoIterator<Item = &'a End>,
    progress: &Progress,
) -> Result<Geodesics<D, Sampled<D, System>>, Failure> {
    let ends = points_of(ends, settings.dimension)?;
    let seeds: Vec<Vector<D>> = ends.iter().map(|point| padded(point)).collect();
    sampled(settings, &ends, &seeds, progress)
}

/// Half the side of the box where a surface is looked for first when nothing says where it is.
const SEARCHED: f64 = 2.0;
/// The box is made larger by this factor while no point of the surface is found in it, so many times at most.
const WIDER: f64 = 4.0;
const MOST_WIDENINGS: i32 = 10;
/// Points from which it is looked for.
const TRIES: usize = 64;

/// What is known of the surface without a query.
pub fn facts(settings: &EquationSettings, progress: &Progress) -> Result<Facts, Failure> {
    with_size!(settings.dimension, facts_in(settings, progress))
}

fn facts_in<const D: usize>(
    settings: &EquationSettings,
    progress: &Progress,
) -> Result<Facts, Failure> {
    let region = searched::<D>(settings)?;
    let seeds = seeds::<D>(settings, &region, "--bounds")?;
    let geodesics = sampled(settings, &[&region.low, &region.high], &seeds, progress)?;
    let samples = geodesics.surface().samples();
    let (low, high) = corners(&samples);
    Ok(Facts {
        surface: settings.law.to_string(),
        coordinates: settings.dimension,
        intrinsic_dimension: Surface::intrinsic_dimension(geodesics.surface()),
        points: None,
        charts: None,
        low: coordinates(&low, settings.dimension),
        high: coordinates(&high, settings.dimension),
        components: geodesics.component_sizes().to_vec(),
        warnings: Vec::new(),
    })
}

/// The part of space where the surface is looked for: as given, else the first of boxes ever larger where it is found.
pub fn searched<const D: usize>(settings: &EquationSettings) -> Result<Bounds, Failure> {
    if let Some(bounds) = bounds(settings, &[]) {
        return Ok(bounds);
    }
    let about_zero = |side: f64| Bounds {
        low: vec![-side; settings.dimension],
        high: vec![side; settings.dimension],
    };
    for widening in 0..MOST_WIDENINGS {
        let region = about_zero(SEARCHED * WIDER.powi(widening));
        if !feet::<D>(settings, &region)?.is_empty() {
            return Ok(region);
        }
    }
    Ok(about_zero(SEARCHED * WIDER.powi(MOST_WIDENINGS)))
}

/// Points of the surface to start from within a region; where there are none, `flags` say where it lies.
pub fn seeds<const D: usize>(
    settings: &EquationSettings,
    region: &Bounds,
    flags: &str,
) -> Result<Vec<Vector<D>>, Failure> {
    let seeds: Vec<Vector<D>> = match &settings.law {
        Law::Shape(shape) => shape.seeds().iter().map(|seed| padded(seed)).collect(),
        Law::Texts(_) => feet(settings, region)?,
    };
    if seeds.is_empty() {
        return Err(Failure::Usage(format!(
            "{}: found no point of the surface between {:?} and {:?}; say where it lies with {flags}",
            settings.law, region.low, region.high
        )));
    }
    Ok(seeds)
}

/// Points of the surface within a region, from tries spread over it.
fn feet<const D: usize>(
    settings: &EquationSettings,
    region: &Bounds,
) -> Result<Vec<Vector<D>>, Failure> {
    let surface = ImplicitSurface::new(system::<D>(settings)?, region.diagonal());
    let mut scratch = Geometry::new(Equations::<D>::count(surface.equations()));
    let (low, high): (Vector<D>, Vector<D>) = (padded(&region.low), padded(&region.high));
    let tries = (0..TRIES)
        .map(|i| low + (high - low).component_mul(&spread::<D>(i).map(|v| 0.5 + 0.5 * v)));
    let feet = tries.filter_map(|start| surface.foot(&start, &mut (), &mut scratch));
    Ok(feet
        .filter(|foot| region.holds(&foot.as_slice()[..settings.dimension]))
        .collect())
}

/// Samples the surface from `seeds`; the extent of `points` tells the scale where nothing else does.
fn sampled<const D: usize>(
    settings: &EquationSettings,
    points: &[&[f64]],
    seeds: &[Vector<D>],
    progress: &Progress,
) -> Result<Geodesics<D, Sampled<D, System>>, Failure> {
    progress.step("sampling the surface");
    let bounds = bounds(settings, points);
    let size = match &bounds {
        Some(bounds) => bounds.diagonal(),
        None => extent(points),
    };
    let surface = ImplicitSurface::new(system::<D>(settings)?, size);
    let bounds = bounds.map(|bounds| (padded(&bounds.low), padded(&bounds.high)));
    let found = Geodesics::of_implicit(surface, seeds, bounds);
    let found = found.map_err(|error| Failure::Surface {
        surface: settings.law.to_string(),
        error,
    })?;
    if let Some(doubt) = doubt(settings, found.surface()) {
        progress.note(&format!("{}: {doubt}", settings.law));
    }
    Ok(found)
}

/// Surfaces of more dimensions than this are never sampled all the way.
const MOST_COVERED: usize = 3;

/// What the sampling leaves unknown.
fn doubt<const D: usize>(
    settings: &EquationSettings,
    sampled: &Sampled<D, System>,
) -> Option<String> {
    match sampled.extent() {
        Extent::Whole | Extent::WithinBounds => None,
        Extent::Endless => {
            let (low, high) = corners(&sampled.samples());
            let [low, high] = [low, high].map(|v| coordinates(&v, settings.dimension));
            Some(format!(
                "the surface goes on beyond the part that was searched: it is sampled between {low:.3?} and {high:.3?}, and what lies beyond is unknown; name the part that you mean with --bounds"
            ))
        }
        Extent::Part if Surface::intrinsic_dimension(sampled) > MOST_COVERED => None,
        Extent::Part => Some(
            "the samples leave out parts of the surface, which has very fine detail or points without a tangent plane: where no way is found, it is unknown whether there is one"
                .to_owned(),
        ),
    }
}

/// The equations for vectors of size D: surplus variables are 0.
pub fn system<const D: usize>(settings: &EquationSettings) -> Result<System, Failure> {
    match &settings.law {
        Law::Shape(shape) => Ok(System::Shape(shape.clone())),
        Law::Texts(texts) => {
            let surplus = (settings.dimension + 1..=D).map(|index| format!("x{index} = 0"));
            let texts: Vec<String> = texts.iter().cloned().chain(surplus).collect();
            let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
            let formula = Formula::parse(&texts, Some(D))?;
            Ok(System::Formula(Box::new(formula)))
        }
    }
}

/// The ends' coordinates; a row of a file means nothing here.
pub fn points_of<'a>(
    ends: impl IntoIterator<Item = &'a End>,
    dimension: usize,
) -> Result<Vec<&'a [f64]>, Failure> {
    let point = |end: &'a End| match end {
        End::Point(point) if point.len() == dimension => Ok(point.as_slice()),
        _ => Err(Failure::End {
            end: end.to_string(),
            reason: format!(
                "expected {dimension} coordinates, one for each variable of the equations"
            ),
        }),
    };
    ends.into_iter().map(point).collect()
}

/// The part of space to sample: as given, or the box of a shape if it holds all points.
pub fn bounds(settings: &EquationSettings, points: &[&[f64]]) -> Option<Bounds> {
    let Law::Shape(shape) = &settings.law else {
        return settings.bounds.clone();
    };
    let slack = SLACK * shape.size();
    let (low, high) = shape.region();
    let region = Bounds {
        low: low.iter().map(|v| v - slack).collect(),
        high: high.iter().map(|v| v + slack).collect(),
    };
    let closed = shape.bounds().is_some();
    (closed || points.iter().all(|point| region.holds(point))).then_some(region)
}

/// A length of the order of the region that the points span.
pub fn extent(points: &[&[f64]]) -> f64 {
    let largest = points
        .iter()
        .copied()
        .flatten()
        .fold(0.0_f64, |m, v| m.max(v.abs()));
    match points.split_first() {
        Some((first, rest)) => {
            let mut span = Bounds {
                low: first.to_vec(),
                high: first.to_vec(),
            };
            for point in rest {
                for (i, value) in point.iter().enumerate() {
                    span.low[i] = span.low[i].min(*value);
                    span.high[i] = span.high[i].max(*value);
                }
            }
            let candidates = [span.diagonal(), largest, 1.0];
            candidates
                .into_iter()
                .find(|size| *size > 0.0)
                .unwrap_or(1.0)
        }
        None => 1.0,
    }
}

impl<const D: usize> Locate<D> for Sampled<D, System> {
    fn locate(&self, end: &End) -> Result<(Node<D, Vector<D>>, f64), Error> {
        match end {
            End::Point(point) => self.node_near(&padded(point)),
            End::Row(row) => Err(Error::NoSuchPoint {
                row: *row,
                reason: "a surface given by equations has no rows; give coordinates",
            }),
        }
    }

    fn centre(&self) -> Vector<D> {
        Vector::zeros()
    }

    fn samples(&self) -> Samples<D> {
        let points = Sampled::samples(self);
        let centres = parallel::map(points.len(), |i| {
            let node = Node {
                point: points[i],
                place: points[i],
            };
            (node, nearest(&points[i], &points))
        });
        Samples::about(self, &centres)
    }
}

/// Distance to the nearest other point.
fn nearest<const D: usize>(point: &Vector<D>, points: &[Vector<D>]) -> f64 {
    let distances = points.iter().map(|other| (other - point).norm());
    distances
        .filter(|distance| *distance > 0.0)
        .fold(f64::INFINITY, f64::min)
}
