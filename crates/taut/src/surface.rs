//! The surface that everything is asked of.

use std::sync::Arc;

use taut_core::cloud::Cloud;
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::{Atlas, FitSettings, Model};
use taut_core::surface::shapes::Shape;
use taut_core::{Vector, parallel};

use crate::equations::{Bounds, Implicit, Law};
use crate::ready::{Ask, AskField, Progress, Ready};
use crate::size::intrinsic_dimension;
use crate::{
    Check, CloudOptions, Distances, End, Error, FieldOptions, Logarithms, Matrix, Path,
    PathOptions, Shot, by_size,
};

/// A surface, made ready to be asked for geodesics. A clone shares all of it and costs nothing.
#[derive(Clone)]
pub struct Surface {
    ready: Arc<dyn Ask>,
}

impl std::fmt::Debug for Surface {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut shown = formatter.debug_struct("Surface");
        shown.field("coordinates", &self.coordinates());
        shown.field("intrinsic_dimension", &self.intrinsic_dimension());
        shown.finish_non_exhaustive()
    }
}

impl Surface {
    /// A smooth surface through points of two or three coordinates, row-major.
    ///
    /// # Errors
    /// As [`from_cloud`](Self::from_cloud).
    ///
    /// O(n log n) time and O(n) memory in the points.
    pub fn from_points(rows: &[f64], coordinates: usize) -> Result<Self, Error> {
        Self::from_cloud(rows, coordinates, &CloudOptions::default())
    }

    /// A smooth surface of any dimension through points, row-major: charts of polynomials, blended.
    ///
    /// Rows with a value that is not finite, and rows absurdly far from all others, have no place
    /// on the surface. Rows of the same coordinates count once.
    ///
    /// # Errors
    /// [`Error::RaggedRows`], [`Error::Coordinates`], [`Error::Dimension`], and [`Error::Engine`]
    /// where the points are too few, all one, or span no surface of the dimension.
    ///
    /// O(n log n) time and O(n) memory in the points.
    pub fn from_cloud(
        rows: &[f64],
        coordinates: usize,
        options: &CloudOptions,
    ) -> Result<Self, Error> {
        check_rows(rows, coordinates)?;
        Self::made(coordinates, &Given::Points(rows, options, None))
    }

    /// A surface of few large charts that keep within `accuracy` of the points, in the input's
    /// units; a thousandth of the diagonal of their box if `None`. Rows are taken for the points of
    /// the model nearest to them.
    ///
    /// # Errors
    /// As [`from_cloud`](Self::from_cloud), and [`Error::Engine`] where no surface fits.
    ///
    /// O(n log n) time and O(n) memory in the points.
    pub fn fit(
        rows: &[f64],
        coordinates: usize,
        options: &CloudOptions,
        accuracy: Option<f64>,
    ) -> Result<Self, Error> {
        check_rows(rows, coordinates)?;
        Self::made(coordinates, &Given::Points(rows, options, Some(accuracy)))
    }

    /// A surface that was fitted before, of points of so many coordinates.
    ///
    /// # Errors
    /// [`Error::Engine`] where the model contradicts itself.
    pub fn from_model(model: &Model, coordinates: usize) -> Result<Self, Error> {
        Self::made(coordinates, &Given::Model(model))
    }

    /// The surface F(x) = 0 of an equation in x, y, z (or x1 to x16), such as `"x^2 + y^2 + z^2 =
    /// 1"`.
    ///
    /// The surface is looked for about the origin, in boxes ever larger, and sampled as far as it
    /// goes.
    ///
    /// # Errors
    /// As [`from_equations`](Self::from_equations).
    pub fn from_equation(text: &str) -> Result<Self, Error> {
        Self::from_equations(&[text], 3, None)
    }

    /// The surface on which all of some equations hold, within a box (the lowest and the highest
    /// coordinates) if one is given. [`taut_formula`] has the language.
    ///
    /// # Errors
    /// [`Error::Formula`] where a text cannot be read, [`Error::NotFound`] where no point of the
    /// surface is found, and [`Error::Engine`] for as many equations as coordinates or more.
    pub fn from_equations(
        texts: &[&str],
        coordinates: usize,
        bounds: Option<[&[f64]; 2]>,
    ) -> Result<Self, Error> {
        let texts = texts.iter().map(|text| (*text).to_owned()).collect();
        Self::from_implicit(&Implicit {
            law: Law::Texts(texts),
            dimension: coordinates,
            bounds: bounds.map(|[low, high]| Bounds {
                low: low.to_vec(),
                high: high.to_vec(),
            }),
        })
    }

    /// A shape by its name and numbers, such as `"torus:2,0.7"`.
    ///
    /// # Errors
    /// [`Error::Shape`] where the name or the numbers cannot be read.
    pub fn from_shape(text: &str) -> Result<Self, Error> {
        let shape = Shape::parse(text)?;
        Self::from_implicit(&Implicit {
            dimension: shape.dimension(),
            law: Law::Shape(shape),
            bounds: None,
        })
    }

    fn from_implicit(implicit: &Implicit) -> Result<Self, Error> {
        Self::made(implicit.dimension, &Given::Law(implicit))
    }

    /// The one place where the dimension of space becomes a type.
    fn made(coordinates: usize, given: &Given<'_>) -> Result<Self, Error> {
        by_size!(
            coordinates,
            |found| Error::Coordinates { found },
            ready(coordinates, given)
        )
    }

    /// The number of coordinates of a point.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.ready.dimension()
    }

    /// The dimension of the surface.
    #[must_use]
    pub fn intrinsic_dimension(&self) -> usize {
        self.ready.intrinsic_dimension()
    }

    /// The shortest geodesic found between two points, pulled taut to the tolerance.
    ///
    /// # Errors
    /// [`Error::NoPlace`] for an end that has no place on the surface.
    ///
    /// Some milliseconds at most on most surfaces.
    pub fn path(
        &self,
        from: impl Into<End>,
        to: impl Into<End>,
        options: &PathOptions,
    ) -> Result<Path, Error> {
        let (from, to) = (from.into(), to.into());
        let mut paths = self.ready.paths_between([&from, &to], options, 1)?;
        Ok(paths.swap_remove(0))
    }

    /// Up to `most` distinct geodesics between two points, one for each way round that was found,
    /// shortest first.
    ///
    /// # Errors
    /// As [`path`](Self::path).
    pub fn alternatives(
        &self,
        from: impl Into<End>,
        to: impl Into<End>,
        options: &PathOptions,
        most: usize,
    ) -> Result<Vec<Path>, Error> {
        let (from, to) = (from.into(), to.into());
        self.ready
            .paths_between([&from, &to], options, most.max(2))
            .map(|mut paths| {
                paths.truncate(most);
                paths
            })
    }

    /// The paths of many pairs of ends, in their order and on all threads; what is wrong with a
    /// pair's ends is its own answer.
    #[must_use]
    pub fn paths<E>(&self, pairs: &[[E; 2]], options: &PathOptions) -> Vec<Result<Path, Error>>
    where
        E: Clone + Into<End> + Sync,
    {
        parallel::map(pairs.len(), |i| {
            let [from, to] = pairs[i].clone();
            self.path(from, to, options)
        })
    }

    /// Lengths of the paths from each source to each target.
    ///
    /// # Errors
    /// [`Error::NoPlace`] for an end that has no place on the surface.
    pub fn matrix<E>(
        &self,
        sources: &[E],
        targets: &[E],
        options: &PathOptions,
    ) -> Result<Matrix, Error>
    where
        E: Clone + Into<End>,
    {
        self.matrix_with(sources, targets, options, &|_, _| true)
    }

    /// As [`matrix`](Self::matrix). `progress` hears how many paths of how many are found, from any
    /// thread, and gives up by answering `false`.
    ///
    /// # Errors
    /// As [`matrix`](Self::matrix), and [`Error::Cancelled`].
    pub fn matrix_with<E>(
        &self,
        sources: &[E],
        targets: &[E],
        options: &PathOptions,
        progress: Progress<'_>,
    ) -> Result<Matrix, Error>
    where
        E: Clone + Into<End>,
    {
        let ends = |list: &[E]| -> Vec<End> { list.iter().cloned().map(Into::into).collect() };
        let (sources, targets) = (ends(sources), ends(targets));
        self.ready.matrix([&sources, &targets], options, progress)
    }

    /// Distances from the nearest of some sources to every row that the surface was put through.
    ///
    /// # Errors
    /// [`Error::NoPlace`] for a source without a place on the surface, [`Error::NoRows`] where the
    /// surface was not put through points, and [`Error::Engine`] without sources.
    ///
    /// About O(n) time and memory in the points.
    pub fn distances<E>(&self, sources: &[E], options: &FieldOptions) -> Result<Distances, Error>
    where
        E: Clone + Into<End>,
    {
        self.field(sources, options)?.at_rows()
    }

    /// The distance from the nearest of some sources, to be asked for anywhere.
    ///
    /// # Errors
    /// [`Error::NoPlace`] for a source without a place on the surface, and [`Error::Engine`]
    /// without sources.
    pub fn field<E>(&self, sources: &[E], options: &FieldOptions) -> Result<Field, Error>
    where
        E: Clone + Into<End>,
    {
        let sources: Vec<(End, f64)> = sources
            .iter()
            .map(|source| (source.clone().into(), 0.0))
            .collect();
        let found = Arc::clone(&self.ready).field(&sources, options)?;
        Ok(Field { found })
    }

    /// The logarithms, at the nearest of some sources, of every row that the surface was put
    /// through: the vectors whose geodesics lead there.
    ///
    /// # Errors
    /// As [`distances`](Self::distances), and [`Error::Engine`] on rough clouds and on surfaces of
    /// other dimensions than 2.
    pub fn log<E>(&self, sources: &[E], options: &FieldOptions) -> Result<Logarithms, Error>
    where
        E: Clone + Into<End>,
    {
        self.field(sources, options)?.logarithms_at_rows()
    }

    /// The geodesic that leaves a point along a vector, as long as the part of the vector that is
    /// tangent to the surface.
    ///
    /// # Errors
    /// [`Error::NoPlace`] for a point without a place on the surface or a vector of another number
    /// of coordinates, and [`Error::Engine`] where the vector has no tangential part.
    pub fn exp(
        &self,
        from: impl Into<End>,
        vector: &[f64],
        options: &FieldOptions,
    ) -> Result<Shot, Error> {
        self.ready.shoot(&from.into(), vector, options)
    }

    /// Orthonormal tangents of the surface at some points: k vectors of as many coordinates as the
    /// points have, one point after the other; not numbers at those without a place on the surface.
    /// O(1) for each point.
    #[must_use]
    pub fn tangents<E: Clone + Into<End>>(&self, points: &[E]) -> Vec<f64> {
        let points: Vec<End> = points.iter().cloned().map(Into::into).collect();
        self.ready.tangents(&points)
    }

    /// What is known of the surface, and what speaks against answers on it.
    #[must_use]
    pub fn check(&self) -> Check {
        self.ready.check()
    }
}

/// The distance from some sources, all over a surface. A clone shares all of it.
#[derive(Clone)]
pub struct Field {
    found: Arc<dyn AskField>,
}

impl Field {
    /// The distances of the rows that the surface was put through.
    ///
    /// # Errors
    /// [`Error::NoRows`] where it was not put through points.
    pub fn at_rows(&self) -> Result<Distances, Error> {
        self.found.at_rows()
    }

    /// The distances of some points; not a number for those without a place on the surface.
    #[must_use]
    pub fn at<E: Clone + Into<End>>(&self, points: &[E]) -> Distances {
        let points: Vec<End> = points.iter().cloned().map(Into::into).collect();
        self.found.at(&points)
    }

    /// The logarithms of the rows that the surface was put through.
    ///
    /// # Errors
    /// [`Error::NoRows`], and [`Error::Engine`] where directions at the sources are not known.
    pub fn logarithms_at_rows(&self) -> Result<Logarithms, Error> {
        self.found.logarithms_at_rows()
    }

    /// The logarithms of some points.
    ///
    /// # Errors
    /// [`Error::Engine`] where directions at the sources are not known.
    pub fn logarithms_at<E: Clone + Into<End>>(&self, points: &[E]) -> Result<Logarithms, Error> {
        let points: Vec<End> = points.iter().cloned().map(Into::into).collect();
        self.found.logarithms_at(&points)
    }
}

fn check_rows(rows: &[f64], coordinates: usize) -> Result<(), Error> {
    if coordinates > 0 && !rows.len().is_multiple_of(coordinates) {
        return Err(Error::RaggedRows {
            values: rows.len(),
            dimension: coordinates,
        });
    }
    Ok(())
}

/// What a surface is made of.
enum Given<'a> {
    /// Points that it goes through, or that it is fitted to within an accuracy.
    Points(&'a [f64], &'a CloudOptions, Option<Option<f64>>),
    Model(&'a Model),
    Law(&'a Implicit),
}

fn ready<const D: usize>(coordinates: usize, given: &Given<'_>) -> Result<Surface, Error> {
    let atlas = match given {
        Given::Points(rows, options, fitted) => {
            let intrinsic = intrinsic_dimension::<D>(options.dimension, coordinates)?;
            let cloud = Cloud::<D>::new(rows, coordinates)?;
            match *fitted {
                None => Atlas::new(cloud, intrinsic)?,
                Some(accuracy) => {
                    let settings = FitSettings {
                        accuracy,
                        normals: None,
                    };
                    Atlas::fit(cloud, intrinsic, &settings)?.0
                }
            }
        }
        Given::Model(model) => Atlas::from_model(model)?,
        Given::Law(implicit) => {
            let searched = implicit.searched::<D>()?;
            let seeds: Vec<Vector<D>> = implicit.seeds(&searched)?;
            let sampled = implicit.sampled(&[&searched.low, &searched.high], &seeds)?;
            return Ok(Surface {
                ready: Arc::new(Ready::new(sampled.into_kind(), coordinates)),
            });
        }
    };
    let geodesics = Geodesics::of_atlas(atlas).into_kind();
    Ok(Surface {
        ready: Arc::new(Ready::new(geodesics, coordinates)),
    })
}
