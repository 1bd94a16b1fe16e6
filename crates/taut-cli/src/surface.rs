//! From settings to a surface ready for queries: the one place where the dimension becomes a type.

use taut_core::correction;
use taut_core::error::Error;
use taut_core::field::{self, Cost, Field, Fields, Logarithm, Sources, Value};
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_core::result::Path;
use taut_core::surface::{Geometry, Node, Surface};
use taut_core::{Vector, parallel};

use crate::answer::{Answer, FoundPath, LocatedEnd, Outcome, Place, coordinates, flat};
use crate::clouds;
use crate::equations;
use crate::exit::Failure;
use crate::matrix::fill::{self, Keep, Work};
use crate::models;
use crate::progress::Progress;
use crate::settings::{self, End};

/// What to ask of every pair.
pub struct Request {
    pub correction: correction::Settings,
    /// Further paths besides the shortest, at most.
    pub alternatives: usize,
}

/// A surface with ends located on it, its dimension forgotten.
pub trait Prepared: Sync {
    /// Coordinates of a point.
    fn dimension(&self) -> usize;

    /// Finds the paths between two of the ends.
    fn answer(&self, pair: [usize; 2], request: &Request) -> Answer;

    /// Refuses an end that has no place on the surface.
    fn check_ends(&self) -> Result<(), Failure>;

    /// Finds the paths of a table's blocks, and hands over each block when it is done.
    fn fill(&self, work: &Work<'_>, keep: Keep<'_>) -> Result<(), Failure>;

    /// Points of the surface for a picture.
    fn samples(&self) -> FlatSamples;
}

/// A surface that knows the user's way of naming its points.
pub trait Locate<const D: usize>: Guide<D> {
    /// The node of an end, and how far the point was moved onto the surface.
    fn locate(&self, end: &End) -> Result<(Node<D, Self::Place>, f64), Error>;

    /// How far at most the points lie from the surface near a node that it was fitted to, where that is known of points
    /// that are not kept.
    fn farthest_point(&self, _node: &Node<D, Self::Place>) -> Option<f64> {
        None
    }

    /// What was subtracted from the input's coordinates.
    fn centre(&self) -> Vector<D>;

    /// What speaks against all answers, in sentences.
    fn doubts(&self) -> Vec<String> {
        Vec::new()
    }

    /// How many spacings of the points an end lies off the surface that was moved by so much onto it, where that is more
    /// than points usually do.
    fn spacings_off(&self, _node: &Node<D, Self::Place>, _moved: f64) -> Option<f64> {
        None
    }

    /// Whether the `surface_error` of paths is an estimate, or unknown.
    fn estimates_its_error(&self) -> bool {
        true
    }

    /// Points of the surface for a picture.
    fn samples(&self) -> Samples<D>;

    /// Makes the surface ready for fields of distances, or of costs, which only clouds have.
    fn fields<'a>(
        geodesics: &'a Geodesics<D, Self>,
        _cost: Option<&Cost>,
    ) -> Result<Fields<'a, D, Self>, Error>
    where
        Self: Sized,
    {
        Ok(Fields::new(geodesics))
    }

    /// The field at the rows that the surface was put through, if it keeps any; `None` for rows without a place on it.
    fn at_rows(
        &self,
        _fields: &Fields<'_, D, Self>,
        _field: &Field<D>,
    ) -> Option<Vec<Option<Value<D>>>>
    where
        Self: Sized,
    {
        None
    }

    /// The logarithms of the same rows; within, `None` for unreached ones.
    fn logarithms_of_rows(
        &self,
        _fields: &Fields<'_, D, Self>,
        _field: &Field<D>,
    ) -> Result<Option<Vec<Option<Option<Logarithm<D>>>>>, Error>
    where
        Self: Sized,
    {
        Ok(None)
    }

    /// The field as far as the `count` nearest of the surface's own points, if it has any.
    fn nearest(
        fields: &Fields<'_, D, Self>,
        sources: Sources<'_, D, Self::Place>,
        _count: usize,
        settings: &field::Settings,
    ) -> Result<Field<D>, Error>
    where
        Self: Sized,
    {
        fields.from(sources, settings)
    }
}

/// Points of a surface, relative to its centre.
pub struct Samples<const D: usize> {
    pub points: Vec<Vector<D>>,
    /// Normals and radii of discs that cover the surface, where they are known.
    pub discs: Option<(Vec<Vector<D>>, Vec<f64>)>,
}

/// Points of a surface in the coordinates of the input, row-major.
pub struct FlatSamples {
    pub dimension: usize,
    pub points: Vec<f64>,
    /// Normals in the shape of `points` and radii of discs that cover the surface, where known.
    pub discs: Option<(Vec<f64>, Vec<f64>)>,
}

/// A surface of R^D made ready, and ends on it.
pub struct Located<const D: usize, S: Guide<D>> {
    pub geodesics: Geodesics<D, S>,
    dimension: usize,
    ends: Vec<EndNode<D, S::Place>>,
    doubts: Vec<String>,
}

/// An end as the user named it; its node and how far it was moved there, or why it has none.
struct EndNode<const D: usize, P> {
    named: End,
    located: Result<(Node<D, P>, f64), String>,
}

/// Calls a function with the smallest size of vectors that holds `dimension` coordinates. Each size costs
/// a minute of compilation; a padded coordinate costs a query some of its speed.
macro_rules! with_size {
    ($dimension:expr, $function:ident $(<$further:ident>)? ($($arguments:tt)*)) => {
        match $dimension {
            0..=3 => $function::<3 $(, $further)?>($($arguments)*),
            4..=6 => $function::<6 $(, $further)?>($($arguments)*),
            7..=16 => $function::<16 $(, $further)?>($($arguments)*),
            found => Err(crate::exit::Failure::Usage(format!(
                "found {found} coordinates for each point, expected at most 16; project the points first"
            ))),
        }
    };
}
pub(crate) use with_size;

/// Makes a surface ready and locates the ends on it.
pub fn prepare(
    source: &settings::Source,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    match source {
        settings::Source::Cloud(settings) => clouds::prepare(settings, ends, progress),
        settings::Source::Model(file) => models::prepare(file, ends, progress),
        settings::Source::Equations(settings) => equations::prepare(settings, ends, progress),
    }
}

impl<const D: usize, S: Locate<D>> Located<D, S> {
    /// Locates points of `dimension` coordinates; `rows_kept` are the file's rows that were read, where some
    /// were not.
    pub fn new(
        geodesics: Geodesics<D, S>,
        dimension: usize,
        ends: Vec<End>,
        rows_kept: Option<&[usize]>,
    ) -> Self {
        let located = parallel::map(ends.len(), |i| {
            locate(geodesics.surface(), dimension, rows_kept, &ends[i])
        });
        let of = |(named, located)| EndNode { named, located };
        let ends = ends.into_iter().zip(located).map(of).collect();
        Self {
            doubts: geodesics.surface().doubts(),
            geodesics,
            dimension,
            ends,
        }
    }

    /// The nodes of the ends, or why one cannot be used.
    pub fn nodes(&self) -> Result<Vec<Node<D, S::Place>>, Failure> {
        let node = |end: &EndNode<D, S::Place>| match &end.located {
            Ok((node, _)) => Ok(*node),
            Err(reason) => Err(Failure::End {
                end: end.named.to_string(),
                reason: reason.clone(),
            }),
        };
        self.ends.iter().map(node).collect()
    }

    /// A path in the coordinates of the input.
    pub fn found(&self, path: &Path<D>) -> FoundPath {
        let surface = self.geodesics.surface();
        let mut found = FoundPath::new(path, &surface.centre(), self.dimension);
        found.surface_error = found
            .surface_error
            .filter(|_| surface.estimates_its_error());
        found
    }

    fn paths(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        request: &Request,
    ) -> Vec<FoundPath> {
        let mut paths = match request.alternatives {
            0 => vec![self.geodesics.path(from, to, &request.correction)],
            more => self
                .geodesics
                .alternatives(from, to, &request.correction, more + 1),
        };
        if paths.is_empty() {
            paths.push(Path::none());
        }
        paths.iter().map(|path| self.found(path)).collect()
    }
}

/// The node of an end named for points of `dimension` coordinates, and how far it was moved there, or why it
/// has none; `rows_kept` are the file's rows that were read, where some were not.
pub fn locate<const D: usize, S: Locate<D>>(
    surface: &S,
    dimension: usize,
    rows_kept: Option<&[usize]>,
    end: &End,
) -> Result<(Node<D, S::Place>, f64), String> {
    let located = match (end, rows_kept) {
        (End::Point(point), _) if point.len() != dimension => {
            return Err(format!(
                "found {} coordinates, expected {dimension}, as many as the points of the surface have",
                point.len()
            ));
        }
        (End::Row(row), Some(rows)) => surface.locate(&End::Row(row_read(*row, rows)?)),
        (end, _) => surface.locate(end),
    };
    located.map_err(|error| error.to_string())
}

/// The position of a file's row among those that were read.
fn row_read(row: usize, rows_kept: &[usize]) -> Result<usize, String> {
    rows_kept.binary_search(&row).map_err(|_| {
        "the row is not among those read (left out by --class, marked invalid, or past the end)"
            .to_owned()
    })
}

impl<const D: usize, S: Locate<D>> Prepared for Located<D, S> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn answer(&self, pair: [usize; 2], request: &Request) -> Answer {
        let centre = self.geodesics.surface().centre();
        let ends = pair.map(|end| &self.ends[end]);
        let mut paths = match ends.map(|end| &end.located) {
            [Ok((from, _)), Ok((to, _))] => self.paths(from, to, request),
            _ => vec![FoundPath {
                outcome: Outcome::UnusableEnd,
                ..FoundPath::new(&Path::none(), &centre, self.dimension)
            }],
        };
        Answer {
            path: paths.remove(0),
            alternatives: paths,
            ends: ends.map(|end| LocatedEnd {
                named: end.named.clone(),
                place: end.located.clone().map(|(node, moved)| Place {
                    point: coordinates(&(node.point + centre), self.dimension),
                    moved,
                    farthest: self.geodesics.surface().farthest_point(&node),
                    off: self.geodesics.surface().spacings_off(&node, moved),
                }),
            }),
            doubts: self.doubts.clone(),
        }
    }

    fn check_ends(&self) -> Result<(), Failure> {
        self.nodes().map(|_| ())
    }

    fn fill(&self, work: &Work<'_>, keep: Keep<'_>) -> Result<(), Failure> {
        fill::fill(self, work, keep)
    }

    fn samples(&self) -> FlatSamples {
        let surface = self.geodesics.surface();
        flat_samples(&surface.samples(), &surface.centre(), self.dimension)
    }
}

/// Samples in the coordinates of the input.
pub fn flat_samples<const D: usize>(
    samples: &Samples<D>,
    centre: &Vector<D>,
    dimension: usize,
) -> FlatSamples {
    let discs = samples.discs.as_ref();
    FlatSamples {
        dimension,
        points: flat(&samples.points, centre, dimension),
        discs: discs
            .map(|(normals, radii)| (flat(normals, &Vector::zeros(), dimension), radii.clone())),
    }
}

/// Points about each centre for a picture; how far out and how large their discs are, in the centre's reach.
const SPRINKLED: usize = 100;
const SPREAD: f64 = 1.2;
const DISC: f64 = 0.2;

impl<const D: usize> Samples<D> {
    /// Points of a surface about some of its nodes, each as far as a length, with discs that cover it.
    pub fn about<S: Surface<D>>(surface: &S, centres: &[(Node<D, S::Place>, f64)]) -> Self {
        let codimension = D - surface.intrinsic_dimension();
        let scratch = || Geometry::new(codimension);
        let sprinkled = parallel::map_with(centres.len(), scratch, |scratch, i| {
            let (centre, reach) = &centres[i];
            let offsets = (0..SPRINKLED).map(|i| spread::<D>(i) * (SPREAD * reach));
            let found = offsets.filter_map(|offset| {
                let mut place = centre.place;
                let point = surface.foot(&(centre.point + offset), &mut place, scratch)?;
                let known = surface.geometry(&point, place, scratch)
                    && surface.beyond_rim(&point, place).is_none();
                known.then(|| (point, (scratch.normal(0), DISC * reach)))
            });
            found.collect::<Vec<_>>()
        });
        let (points, discs): (Vec<_>, (Vec<_>, Vec<_>)) = sprinkled.into_iter().flatten().unzip();
        Self {
            points,
            discs: (codimension == 1).then_some(discs),
        }
    }
}

/// The terms of a sequence that fills the cube |x_i| < 1 evenly (Roberts, "The unreasonable
/// effectiveness of quasirandom sequences", 2018).
pub fn spread<const D: usize>(term: usize) -> Vector<D> {
    let ratio = (0..32).fold(2.0_f64, |g, _| (1.0 + g).powf(1.0 / (D as f64 + 1.0)));
    Vector::from_fn(|i, _| {
        let step = ratio.powi(-(i as i32 + 1));
        2.0 * (0.5 + step * (term as f64 + 1.0)).fract() - 1.0
    })
}

/// Lowest and highest coordinates.
pub fn corners<const D: usize>(points: &[Vector<D>]) -> (Vector<D>, Vector<D>) {
    points.iter().fold(
        (
            Vector::repeat(f64::INFINITY),
            Vector::repeat(f64::NEG_INFINITY),
        ),
        |(low, high), point| (low.inf(point), high.sup(point)),
    )
}
