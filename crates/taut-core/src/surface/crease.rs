//! Creases: places where the tangent space turns at once, as at the edges of |x| + |y| + |z| = 1.
//!
//! A shortest path is smooth on both sides of a crease and bends at it. Rays and polynomial
//! elements do not bend, so a ray ends at a crease, and the error of a path across one is unknown.
//! Clouds have no creases: their charts are smooth.

use crate::Vector;
use crate::surface::{Geometry, Node, Surface};

/// Most that the tangent space may turn beyond what its curvature explains, in radians.
const UNEXPLAINED: f64 = 0.02;
/// Share of the distance between two nodes within which a turn counts as one at once.
const AT_ONCE: f64 = 1e-9;

/// Whether a unit tangent leads off a tangent space nearby by more than the surface turns on the
/// way, in radians.
pub(crate) fn is_unexplained(off: f64, turning: f64) -> bool {
    off > turning + UNEXPLAINED
}

impl<const D: usize> Geometry<D> {
    /// Whether unit vectors that are tangent nearby lead off the tangent space here by more than it
    /// turns on the way, in radians.
    pub(crate) fn is_creased<'a>(
        &self,
        tangents: impl IntoIterator<Item = &'a Vector<D>>,
        turning: f64,
    ) -> bool {
        tangents
            .into_iter()
            .any(|tangent| is_unexplained((tangent - self.project(tangent)).norm(), turning))
    }

    /// The unit tangents, of which there are as many as the surface has dimensions.
    fn tangents(&self) -> impl Iterator<Item = Vector<D>> {
        (0..self.intrinsic_dimension()).map(|j| self.tangent(j))
    }
}

/// What is known of the surface at one node of a path.
struct Side<const D: usize, P> {
    node: Node<D, P>,
    tangents: [Vector<D>; D],
    dimension: usize,
    curvature: f64,
}

impl<const D: usize, P: Copy> Side<D, P> {
    /// The side at a node whose geometry is given.
    fn new(node: &Node<D, P>, geometry: &Geometry<D>) -> Self {
        let mut tangents = [Vector::zeros(); D];
        for (kept, tangent) in tangents.iter_mut().zip(geometry.tangents()) {
            *kept = tangent;
        }
        Self {
            node: *node,
            tangents,
            dimension: geometry.intrinsic_dimension(),
            curvature: geometry.curvature_bound(),
        }
    }

    /// Whether the tangent space turns more on the way to a node, whose geometry is given, than the
    /// curvature at both ends explains.
    fn is_apart(&self, to: &Self, geometry: &Geometry<D>) -> bool {
        let way = (to.node.point - self.node.point).norm();
        geometry.is_creased(
            &self.tangents[..self.dimension],
            (self.curvature + to.curvature) * way,
        )
    }
}

/// Looks for creases along a path, node by node.
pub(crate) struct Search<const D: usize, P> {
    last: Option<Side<D, P>>,
    /// Whether the path crosses a crease.
    pub found: bool,
}

impl<const D: usize, P: Copy> Search<D, P> {
    pub fn new() -> Self {
        Self {
            last: None,
            found: false,
        }
    }

    /// Looks between the node before and this one, whose geometry is given.
    pub fn visit<S: Surface<D, Place = P>>(
        &mut self,
        surface: &S,
        node: &Node<D, P>,
        geometry: &Geometry<D>,
    ) {
        if self.found || surface.resolution(node.place) > 0.0 {
            return;
        }
        let side = Side::new(node, geometry);
        if let Some(last) = &self.last
            && last.is_apart(&side, geometry)
        {
            self.found = is_between(surface, last, &side);
        }
        self.last = Some(side);
    }
}

/// Whether a crease lies between two nodes: the turn is followed into the half that holds it until
/// that is so short that the surface turns at once, or until curvature explains it.
fn is_between<const D: usize, S: Surface<D>>(
    surface: &S,
    from: &Side<D, S::Place>,
    to: &Side<D, S::Place>,
) -> bool {
    let mut geometry = Geometry::new(D - surface.intrinsic_dimension());
    let side = |node: &Node<D, S::Place>, geometry: &mut Geometry<D>| {
        let known = surface.geometry(&node.point, node.place, geometry);
        known.then(|| Side::new(node, geometry))
    };
    let least = AT_ONCE * (to.node.point - from.node.point).norm();
    let mut ends = [from.node, to.node];
    while (ends[1].point - ends[0].point).norm() > least {
        let mut place = ends[0].place;
        let middle = (ends[0].point + ends[1].point) * 0.5;
        let Some(point) = surface.foot(&middle, &mut place, &mut geometry) else {
            return true;
        };
        let node = Node { point, place };
        let halves = [[ends[0], node], [node, ends[1]]];
        let next = halves.into_iter().find(|[a, b]| {
            let (Some(a), Some(b)) = (side(a, &mut geometry), side(b, &mut geometry)) else {
                return true;
            };
            a.is_apart(&b, &geometry)
        });
        let Some(next) = next else { return false };
        let shorter =
            (next[1].point - next[0].point).norm() < 0.75 * (ends[1].point - ends[0].point).norm();
        if !shorter {
            return true;
        }
        ends = next;
    }
    true
}
