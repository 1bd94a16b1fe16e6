//! A surface of some dimension and kind made ready, and what is asked of it without naming either.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use taut_core::error::Error as EngineError;
use taut_core::field::{self, Fields, Ground, Logarithm, Source, Value};
use taut_core::geodesics::Geodesics;
use taut_core::surface::{Geometry, Node, Surface};
use taut_core::{Vector, parallel, result};

use crate::kind::{Kind, Located, Place, locate};
use crate::size::{coordinates, flat, padded};
use crate::{
    Check, Distances, End, Error, FieldOptions, Logarithms, Matrix, Path, PathOptions, Shot,
};

/// Hears how many of how many parts of a long work are done, and says whether to go on.
pub type Progress<'a> = &'a (dyn Fn(usize, usize) -> bool + Sync);

/// What can be asked of a surface.
pub(crate) trait Ask: Send + Sync {
    fn dimension(&self) -> usize;
    fn intrinsic_dimension(&self) -> usize;
    fn paths_between(
        &self,
        ends: [&End; 2],
        options: &PathOptions,
        most: usize,
    ) -> Result<Vec<Path>, Error>;
    fn matrix(
        &self,
        ends: [&[End]; 2],
        options: &PathOptions,
        progress: Progress<'_>,
    ) -> Result<Matrix, Error>;
    fn field(
        self: Arc<Self>,
        sources: &[(End, f64)],
        options: &FieldOptions,
    ) -> Result<Arc<dyn AskField>, Error>;
    fn shoot(&self, from: &End, vector: &[f64], options: &FieldOptions) -> Result<Shot, Error>;
    fn tangents(&self, points: &[End]) -> Vec<f64>;
    fn check(&self) -> Check;
}

/// What can be asked of a field.
pub(crate) trait AskField: Send + Sync {
    fn at_rows(&self) -> Result<Distances, Error>;
    fn at(&self, points: &[End]) -> Distances;
    fn logarithms_at_rows(&self) -> Result<Logarithms, Error>;
    fn logarithms_at(&self, points: &[End]) -> Result<Logarithms, Error>;
}

/// A surface made ready.
pub(crate) struct Ready<const D: usize> {
    geodesics: Geodesics<D, Kind<D>>,
    /// The number of coordinates of a point.
    dimension: usize,
    /// What fields start from, found for the first.
    ground: OnceLock<Result<Arc<Ground<D, Place<D>>>, EngineError>>,
    doubts: Vec<String>,
}

impl<const D: usize> Ready<D> {
    pub fn new(geodesics: Geodesics<D, Kind<D>>, dimension: usize) -> Self {
        Self {
            doubts: geodesics.surface().doubts(),
            geodesics,
            dimension,
            ground: OnceLock::new(),
        }
    }

    fn locate(&self, end: &End) -> Result<Located<D>, Error> {
        let found = locate(self.geodesics.surface(), self.dimension, end);
        found.map_err(|reason| Error::NoPlace {
            end: end.clone(),
            reason,
        })
    }

    fn ground(&self) -> Result<Arc<Ground<D, Place<D>>>, Error> {
        let made = || Kind::fields(&self.geodesics, None).map(|fields| Arc::clone(fields.ground()));
        Ok(self.ground.get_or_init(made).clone()?)
    }

    fn fields(&self) -> Result<Fields<'_, D, Kind<D>>, Error> {
        Ok(Fields::on(&self.geodesics, self.ground()?))
    }

    /// A path in the coordinates of the input, whose ends were moved so far.
    fn path(&self, path: &result::Path<D>, moved: [f64; 2]) -> Path {
        let centre = self.geodesics.surface().origin();
        Path {
            status: path.status,
            length: path.length,
            length_error: path.length_error,
            surface_error: path.surface_error,
            shortest: path.shortest,
            stable: path.stable,
            dimension: self.dimension,
            points: flat(&path.points, &centre, self.dimension),
            arc_length: path.arc_length.clone(),
            moved,
            doubts: self.doubts.clone(),
        }
    }
}

impl<const D: usize> Ask for Ready<D> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn intrinsic_dimension(&self) -> usize {
        self.geodesics.surface().intrinsic_dimension()
    }

    fn paths_between(
        &self,
        [from, to]: [&End; 2],
        options: &PathOptions,
        most: usize,
    ) -> Result<Vec<Path>, Error> {
        let ((from, a), (to, b)) = (self.locate(from)?, self.locate(to)?);
        let settings = options.correction();
        let mut paths = match most {
            1 => vec![self.geodesics.path(&from, &to, &settings)],
            _ => self.geodesics.alternatives(&from, &to, &settings, most),
        };
        if paths.is_empty() {
            paths.push(result::Path::none());
        }
        Ok(paths.iter().map(|path| self.path(path, [a, b])).collect())
    }

    fn matrix(
        &self,
        [sources, targets]: [&[End]; 2],
        options: &PathOptions,
        progress: Progress<'_>,
    ) -> Result<Matrix, Error> {
        let nodes = |ends: &[End]| -> Result<Vec<Node<D, Place<D>>>, Error> {
            let located = ends.iter().map(|end| Ok(self.locate(end)?.0));
            located.collect()
        };
        let (from, to) = (nodes(sources)?, nodes(targets)?);
        let columns = parallel::map(to.len(), |j| self.geodesics.origin(&to[j]));
        let settings = options.correction();
        let (done, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
        let mut matrix = Matrix {
            rows: from.len(),
            columns: to.len(),
            lengths: Vec::with_capacity(from.len() * to.len()),
            errors: Vec::with_capacity(from.len() * to.len()),
            status: Vec::with_capacity(from.len() * to.len()),
        };
        let total = from.len() * to.len();
        for start in &from {
            let row = self.geodesics.origin(start);
            let found = parallel::map(to.len(), |j| {
                if stopped.load(Ordering::Relaxed) {
                    return (f64::NAN, f64::NAN, result::Status::Unknown);
                }
                let path = self.geodesics.path_between(&row, &columns[j], &settings);
                if !progress(done.fetch_add(1, Ordering::Relaxed) + 1, total) {
                    stopped.store(true, Ordering::Relaxed);
                }
                let error = path.length_error + path.surface_error;
                (path.length, error, path.status)
            });
            if stopped.load(Ordering::Relaxed) {
                return Err(Error::Cancelled);
            }
            matrix.lengths.extend(found.iter().map(|entry| entry.0));
            matrix.errors.extend(found.iter().map(|entry| entry.1));
            matrix.status.extend(found.iter().map(|entry| entry.2));
        }
        Ok(matrix)
    }

    fn field(
        self: Arc<Self>,
        sources: &[(End, f64)],
        options: &FieldOptions,
    ) -> Result<Arc<dyn AskField>, Error> {
        let located = sources.iter().map(|(end, start)| {
            let (node, _) = self.locate(end)?;
            let start = *start;
            Ok(Source { node, start })
        });
        let located: Vec<Source<D, Place<D>>> = located.collect::<Result<_, Error>>()?;
        let ground = self.ground()?;
        let fields = Fields::on(&self.geodesics, Arc::clone(&ground));
        let field = fields.from(&located[..], &options.settings())?;
        Ok(Arc::new(FoundField {
            sources: sources.len() as u32,
            field,
            ground,
            ready: self,
        }))
    }

    fn shoot(&self, from: &End, vector: &[f64], options: &FieldOptions) -> Result<Shot, Error> {
        let (node, _) = self.locate(from)?;
        if vector.len() != self.dimension {
            return Err(Error::NoPlace {
                end: End::from(vector),
                reason: format!(
                    "found a vector of {} coordinates, expected {} as the surface's points have",
                    vector.len(),
                    self.dimension
                ),
            });
        }
        let shot = self
            .fields()?
            .exponential(&node, &padded(vector), &options.settings())?;
        let centre = self.geodesics.surface().origin();
        Ok(Shot {
            dimension: self.dimension,
            points: flat(&shot.points, &centre, self.dimension),
            arc_length: shot.arc_length,
            complete: shot.complete,
            error: shot.error,
        })
    }

    fn tangents(&self, points: &[End]) -> Vec<f64> {
        let surface = self.geodesics.surface();
        let k = surface.intrinsic_dimension();
        let of = |scratch: &mut Geometry<D>, i: usize| -> Vec<f64> {
            let located = self.locate(&points[i]).ok();
            let is_known =
                located.is_some_and(|(node, _)| surface.geometry(&node.point, node.place, scratch));
            if !is_known {
                return vec![f64::NAN; k * self.dimension];
            }
            let tangent = |j| coordinates(&scratch.tangent(j), self.dimension);
            (0..k).flat_map(tangent).collect()
        };
        parallel::map_with(points.len(), || Geometry::new(D - k), of).concat()
    }

    fn check(&self) -> Check {
        let report = self.geodesics.surface().report();
        Check {
            coordinates: self.dimension,
            intrinsic_dimension: self.intrinsic_dimension(),
            parts: self.geodesics.component_sizes().to_vec(),
            spacing: report.as_ref().map(|report| report.spacing[1]),
            noise: report.as_ref().map(|report| report.noise),
            doubts: self.doubts.clone(),
        }
    }
}

/// A field on a surface that it keeps alive.
struct FoundField<const D: usize> {
    ready: Arc<Ready<D>>,
    /// What the field was found on.
    ground: Arc<Ground<D, Place<D>>>,
    field: field::Field<D>,
    sources: u32,
}

impl<const D: usize> AskField for FoundField<D> {
    fn at_rows(&self) -> Result<Distances, Error> {
        let fields = self.fields();
        let surface = self.ready.geodesics.surface();
        let values = surface.at_rows(&fields, &self.field);
        Ok(distances(values.ok_or(Error::NoRows)?))
    }

    fn at(&self, points: &[End]) -> Distances {
        let fields = self.fields();
        let at = |i: usize| {
            let (node, _) = self.ready.locate(&points[i]).ok()?;
            Some(fields.at(&self.field, &node))
        };
        distances(parallel::map(points.len(), at))
    }

    fn logarithms_at_rows(&self) -> Result<Logarithms, Error> {
        let fields = self.fields();
        let surface = self.ready.geodesics.surface();
        let found = surface.logarithms_of_rows(&fields, &self.field)?;
        let found = found.ok_or(Error::NoRows)?;
        Ok(self.logarithms(&fields, found.into_iter().map(Option::flatten)))
    }

    fn logarithms_at(&self, points: &[End]) -> Result<Logarithms, Error> {
        let fields = self.fields();
        let at = |i: usize| match self.ready.locate(&points[i]) {
            Ok((node, _)) => fields.logarithm(&self.field, &node),
            Err(_) => Ok(None),
        };
        let found: Result<Vec<_>, EngineError> =
            parallel::map(points.len(), at).into_iter().collect();
        Ok(self.logarithms(&fields, found?.into_iter()))
    }
}

impl<const D: usize> FoundField<D> {
    fn fields(&self) -> Fields<'_, D, Kind<D>> {
        Fields::on(&self.ready.geodesics, Arc::clone(&self.ground))
    }

    fn logarithms(
        &self,
        fields: &Fields<'_, D, Kind<D>>,
        found: impl Iterator<Item = Option<Logarithm<D>>>,
    ) -> Logarithms {
        let dimension = self.ready.dimension;
        let tangents = (0..self.sources).filter_map(|source| {
            let tangents = fields.source_tangents(&self.field, source)?;
            Some(tangents.map(|tangent: Vector<D>| coordinates(&tangent, dimension)))
        });
        let mut all = Logarithms {
            tangents: tangents.collect(),
            ..Logarithms::default()
        };
        for logarithm in found {
            let known = logarithm.as_ref();
            all.vectors.push(known.map_or([f64::NAN; 2], |l| l.vector));
            all.error.push(known.map_or(f64::NAN, |l| l.error));
            all.source.push(known.map(|l| l.source));
            let transported = known.and_then(|l| l.transported);
            all.transported.push(transported.map_or_else(
                || [vec![f64::NAN; dimension], vec![f64::NAN; dimension]],
                |tangents| tangents.map(|tangent| coordinates(&tangent, dimension)),
            ));
        }
        all
    }
}

/// Values as columns.
fn distances<const D: usize>(values: Vec<Option<Value<D>>>) -> Distances {
    let mut all = Distances::default();
    for value in values {
        let distance = value.as_ref().map_or(f64::NAN, |value| value.distance);
        let known = value.filter(|_| distance.is_finite());
        all.distance.push(distance);
        all.error
            .push(known.as_ref().map_or(f64::NAN, |value| value.error));
        all.source.push(known.map(|value| value.source));
    }
    all
}
