//! Paths that are roughly taut: straightened guesses, or geodesics shot from one end.

use crate::correction::Taut;
use crate::correction::curve::Curve;
use crate::correction::element::element;
use crate::correction::newton::{Solved, Solver};
use crate::correction::nodes::{self, Profile};
use crate::surface::{Node, Surface};

/// A path pulled roughly taut, with the length and turning of its segments.
pub(crate) struct Straight<const D: usize, P> {
    pub taut: Taut<D, P>,
    pub(super) profile: Profile,
    /// How far apart geodesics that leave one end side by side are at the other end, as a share of
    /// the farthest that they come apart before. It is 0 where the ends are conjugate, below 0
    /// where they are beyond conjugate points, and 1 where it is not known.
    pub spread: f64,
}

/// Degree of the elements that a shot geodesic is put on.
const SHOT_DEGREE: usize = 10;

/// The places of the nodes of a shot geodesic on a number of elements, as shares of its length from
/// 0 to 1.
pub(crate) fn shares(elements: usize) -> Vec<f64> {
    let reference = element(SHOT_DEGREE);
    let of = |e: usize, x: &f64| (e as f64 + 0.5 * (1.0 + x)) / elements as f64;
    let within = (0..elements).flat_map(|e| reference.nodes[1..].iter().map(move |x| of(e, x)));
    std::iter::once(0.0).chain(within).collect()
}

impl<const D: usize, P: Copy + Send + Sync + std::fmt::Debug> Straight<D, P> {
    /// The angle by which the surface's normal turns along the path, in radians.
    pub fn turning(&self) -> f64 {
        self.profile.turning
    }

    /// A geodesic given by its nodes at the [`shares`] of its length, on a number of elements;
    /// `None` where a node has no foot on the surface.
    pub fn along<S: Surface<D, Place = P>>(
        surface: &S,
        elements: usize,
        nodes: Vec<Node<D, P>>,
        solver: &mut Solver<D, P>,
    ) -> Option<Self> {
        let mut curve = Curve {
            degree: SHOT_DEGREE,
            spans: vec![1.0 / elements as f64; elements],
            nodes,
        };
        let last = curve.nodes.len() - 1;
        for node in &mut curve.nodes[1..last] {
            let scratch = &mut solver.scratch;
            node.point = surface.foot(&node.point, &mut node.place, scratch)?;
        }
        let profile = nodes::profile(surface, &curve.nodes, &mut solver.scratch);
        let measure = curve.measure(&mut Vec::new());
        let level = Solved {
            converged: false,
            measure,
            left: f64::INFINITY,
            index: None,
            steps: 0,
        };
        let taut = Taut {
            curve,
            level,
            steps: 0,
        };
        Some(Self {
            taut,
            profile,
            spread: 1.0,
        })
    }
}

/// The Jacobi field J'' = -K J, J(0) = 0, at the end of a polyline just solved, over its largest
/// value; K is constant from node to node.
pub(super) fn spread<const D: usize, S: Surface<D>>(
    surface: &S,
    curve: &Curve<D, S::Place>,
    profile: &Profile,
    solver: &Solver<D, S::Place>,
) -> f64 {
    let last = curve.nodes.len() - 1;
    if surface.intrinsic_dimension() != 2 || last < 2 || profile.length == 0.0 {
        return 1.0;
    }
    let (mut j, mut slope, mut most) = (0.0_f64, 1.0, 0.0_f64);
    let mut before = solver.gauss_curvature(1);
    for (i, length) in profile.lengths.iter().enumerate() {
        let after = solver.gauss_curvature((i + 1).min(last - 1));
        let (c, s, rate) = propagator(0.5 * (before + after), *length);
        (j, slope) = (c * j + s * slope, rate * j + c * slope);
        before = after;
        if j <= 0.0 {
            return -1.0;
        }
        most = most.max(j);
    }
    j / most
}

/// The entries of the matrix that takes J and J' over a length where the Gauss curvature is
/// constant.
fn propagator(gauss: f64, length: f64) -> (f64, f64, f64) {
    let root = gauss.abs().sqrt();
    let x = root * length;
    if x < 1e-4 {
        return (1.0, length, -gauss * length);
    }
    if gauss > 0.0 {
        let (sin, cos) = x.sin_cos();
        (cos, sin / root, -root * sin)
    } else {
        (x.cosh(), x.sinh() / root, root * x.sinh())
    }
}
