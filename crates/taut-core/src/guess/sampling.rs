//! A coarse, even sampling of an implicit surface, grown from seeds, and its graph.
//!
//! Samples are joined where a walk along the surface leads from one to the other, so that layers
//! near each other stay apart. A node remembers the point of the surface where it was last; its
//! next foot is one that a walk from there reaches.

mod grow;
mod join;
mod net;
mod region;
mod walk;
mod ways;

use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::surface::implicit::{Equations, ImplicitSurface};
use crate::surface::{Geometry, Node, Surface};
use crate::{Vector, parallel};
use join::node;
use net::SampleNet;
use region::Region;
use walk::Walker;

/// An implicit surface with a coarse sampling on which first guesses are found.
pub struct Sampled<const D: usize, E> {
    surface: ImplicitSurface<D, E>,
    net: SampleNet<D>,
}

/// How much of the components that hold the seeds was sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All of the components.
    Whole,
    /// What lies within the bounds given; the components go on beyond.
    WithinBounds,
    /// What lies about the seeds; the components have no end as far as was looked.
    Endless,
    /// A part; the components have too much detail, or places that samples do not pass.
    Part,
}

/// How near a walk must come to the foot of a point, as a share of the way.
const FOOT_EXACTNESS: f64 = 1e-4;
/// Least intrinsic dimension in which samples leave much of a surface out, so that ways are walked
/// as well.
const MANY_DIMENSIONS: usize = 4;

impl<const D: usize, E: Equations<D>> Sampled<D, E> {
    /// The point of the surface that `x` is pulled back to (12), as a node, and the distance that
    /// it moved.
    ///
    /// # Errors
    /// [`Error::NoFoot`] where the pull-back does not arrive.
    pub fn node_near(&self, x: &Vector<D>) -> Result<(Node<D, Vector<D>>, f64), Error> {
        let point = self.surface.point_near(x)?;
        Ok((node(&point), (point - x).norm()))
    }

    /// The points of the samples.
    #[must_use]
    pub fn samples(&self) -> Vec<Vector<D>> {
        self.net.samples.iter().map(|s| s.point).collect()
    }

    /// A unit normal (the first of m) at each sample.
    #[must_use]
    pub fn sample_normals(&self) -> Vec<Vector<D>> {
        let normal = |i: usize| self.net.samples[i].basis.column(0).into_owned();
        (0..self.net.samples.len()).map(normal).collect()
    }

    /// How much of the surface was sampled.
    #[must_use]
    pub fn extent(&self) -> Extent {
        self.net.extent
    }
}

impl<const D: usize, E: Equations<D>> ImplicitSurface<D, E> {
    /// The point of the surface that `x` is pulled back to.
    fn point_near(&self, x: &Vector<D>) -> Result<Vector<D>, Error> {
        let mut scratch = Geometry::new(D - self.intrinsic_dimension());
        let foot = self.foot(x, &mut (), &mut scratch);
        foot.ok_or_else(|| Error::NoFoot {
            point: format!("{:?}", x.as_slice()),
            reason: self.why_no_foot(x),
        })
    }
}

impl<const D: usize, E: Equations<D>> ImplicitSurface<D, E> {
    /// Why a point has no foot, in words for a message.
    fn why_no_foot(&self, x: &Vector<D>) -> &'static str {
        let count = self.equations().count();
        let (mut values, mut gradients) = (vec![0.0; count], vec![Vector::zeros(); count]);
        self.equations().gradients(x, &mut values, &mut gradients);
        let is_finite = values.iter().all(|value| value.is_finite())
            && gradients
                .iter()
                .all(|gradient| gradient.iter().all(|value| value.is_finite()));
        if is_finite {
            "Newton-Raphson does not arrive; start nearer, away from points where the gradient vanishes"
        } else {
            "an equation or its gradient is not finite there; start where all are, or write them without the pole"
        }
    }
}

impl<const D: usize, E: Equations<D>> Geodesics<D, Sampled<D, E>> {
    /// Makes an implicit surface ready for path queries. It samples the components that hold the
    /// `seeds`, which are pulled back onto the surface: within `bounds` (low and high corner) where
    /// given, and else all of them. Of components without end it samples as much around the seeds
    /// as it takes to connect them; [`Sampled::extent`] tells.
    ///
    /// # Errors
    /// [`Error::NoDimensionLeft`] for D or more equations, [`Error::NoFoot`] where no seed can be
    /// pulled back.
    pub fn of_implicit(
        surface: ImplicitSurface<D, E>,
        seeds: &[Vector<D>],
        bounds: Option<(Vector<D>, Vector<D>)>,
    ) -> Result<Self, Error> {
        let equations = surface.equations().count();
        if equations >= D || equations == 0 {
            return Err(Error::NoDimensionLeft {
                equations,
                dimension: D,
            });
        }
        let seeds = parallel::map(seeds.len(), |i| surface.point_near(&seeds[i]));
        let (on_surface, off): (Vec<_>, Vec<_>) = seeds.into_iter().partition(Result::is_ok);
        let seeds: Vec<Vector<D>> = on_surface.into_iter().flatten().collect();
        if let (true, Some(Err(error))) = (seeds.is_empty(), off.into_iter().next()) {
            return Err(error);
        }
        let bounds = bounds.map(|(low, high)| Region { low, high });
        let (net, graph) = SampleNet::new(&surface, &seeds, bounds.as_ref());
        Ok(Self::with_graph(Sampled { surface, net }, graph))
    }
}

impl<const D: usize, E: Equations<D>> Surface<D> for Sampled<D, E> {
    /// The point of the surface where the node was last, on the sheet that it stays on.
    type Place = Vector<D>;

    fn intrinsic_dimension(&self) -> usize {
        self.surface.intrinsic_dimension()
    }

    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut Vector<D>,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        let foot = self.surface.foot(x, &mut (), scratch);
        let is_clear = |foot: &Vector<D>| {
            (foot - *place).norm_squared() < self.net.clearance * self.net.clearance
        };
        let foot = foot.filter(is_clear).or_else(|| {
            let mut walker = Walker::new(&self.surface);
            walker.toward(place, x, self.net.gap, FOOT_EXACTNESS, |_| ())
        })?;
        *place = foot;
        Some(foot)
    }

    fn find_place(&self, x: &Vector<D>, place: &mut Vector<D>, _scratch: &mut Geometry<D>) -> bool {
        *place = *x;
        true
    }

    fn geometry(&self, x: &Vector<D>, _place: Vector<D>, out: &mut Geometry<D>) -> bool {
        self.surface.geometry(x, (), out)
    }
}

impl<const D: usize, E: Equations<D>> Guide<D> for Sampled<D, E> {
    fn entrances(&self, node: &Node<D, Vector<D>>, visit: &mut dyn FnMut(u32)) {
        let mut walker = Walker::new(&self.surface);
        self.net.entrances(&node.point, &mut walker, visit);
    }

    fn ways(
        &self,
        from: &Node<D, Vector<D>>,
        to: &Node<D, Vector<D>>,
        is_joined: bool,
    ) -> Vec<Vec<Node<D, Vector<D>>>> {
        if is_joined && self.intrinsic_dimension() < MANY_DIMENSIONS {
            return Vec::new();
        }
        let mut walker = Walker::new(&self.surface);
        let ends = [&from.point, &to.point];
        let ways = ways::ways(&mut walker, ends, &self.samples(), self.net.gap, is_joined);
        let nodes = |way: Vec<Vector<D>>| way.iter().map(node).collect();
        ways.into_iter().map(nodes).collect()
    }

    fn passes_tip(&self, way: &[Node<D, Vector<D>>]) -> bool {
        self.net.passes_tip(way)
    }

    /// Whether one of the two nodes lies on a component that was sampled whole, and the other on
    /// another component.
    fn apart(&self, from: Option<u32>, to: Option<u32>) -> bool {
        let is_whole = |node: u32| !self.net.open[node as usize];
        from.zip(to)
            .is_some_and(|(from, to)| is_whole(from) || is_whole(to))
    }
}
