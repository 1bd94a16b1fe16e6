//! From settings to a surface ready for queries: the one place where the dimension becomes a type.

use taut::End;
use taut::equations::spread;
use taut::kind::Kind;
use taut::size::{coordinates, flat};
use taut_core::correction;
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_core::result::Path;
use taut_core::surface::{Geometry, Node, Surface};
use taut_core::{Vector, parallel};

use crate::answer::{Answer, FoundPath, LocatedEnd, Outcome, Place};
use crate::clouds;
use crate::equations;
use crate::exit::Failure;
use crate::matrix::fill::{self, Keep, Work};
use crate::models;
use crate::progress::Progress;
use crate::settings;

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

/// A surface that can be shown.
pub trait Show<const D: usize>: Kind<D> {
    /// Points of the surface for a picture.
    fn samples(&self) -> Samples<D>;
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

/// Calls a function with the smallest size of vectors that holds `dimension` coordinates, as
/// [`taut::by_size`] does.
macro_rules! with_size {
    ($dimension:expr, $function:ident $(<$further:ident>)? ($($arguments:tt)*)) => {
        taut::by_size!(
            $dimension,
            $crate::surface::too_many,
            $function $(<$further>)? ($($arguments)*)
        )
    };
}
pub(crate) use with_size;

/// Says that no size of vectors holds so many coordinates.
pub fn too_many(found: usize) -> Failure {
    Failure::Usage(format!(
        "found {found} coordinates for each point, expected at most 16; project the points first"
    ))
}

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

impl<const D: usize, S: Show<D>> Located<D, S> {
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
pub fn locate<const D: usize, S: Show<D>>(
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

impl<const D: usize, S: Show<D>> Prepared for Located<D, S> {
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
