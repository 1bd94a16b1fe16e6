//! What every surface of the command can do.

use taut::equations::spread;
use taut::kind::Kind;
use taut::size::flat;
use taut_core::surface::{Geometry, Node, Surface};
use taut_core::{Vector, parallel};

use crate::exit::Failure;

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

/// Says that no size of vectors holds so many coordinates.
pub fn too_many(found: usize) -> Failure {
    Failure::Usage(format!(
        "found {found} coordinates for each point, expected at most 16; project the points first"
    ))
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

/// Points about each centre for a picture.
const SPRINKLED: usize = 100;
/// How far out they lie, in the centre's reach.
const SPREAD: f64 = 1.2;
/// How large their discs are, in the centre's reach.
const DISC: f64 = 0.2;

impl<const D: usize> Samples<D> {
    /// Points of a surface: those that it was put through, else points on its charts or about its
    /// samples.
    pub fn of(surface: &Kind<D>) -> Self {
        match surface {
            Kind::Atlas(atlas) if atlas.has_points() => Self::of_cloud(atlas.cloud()),
            Kind::Atlas(atlas) => Self::of_charts(atlas),
            Kind::MovingLeastSquares(surface) => Self::of_cloud(surface.atlas().cloud()),
            Kind::Equations(sampled) => Self::of_equations(sampled),
        }
    }

    /// Points of a surface about some of its nodes, each as far as a length, with discs that
    /// cover it.
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
