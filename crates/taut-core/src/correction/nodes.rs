//! Where the nodes go: they are spread by curvature, (17)-(18), and inserted where the error
//! demands it.
//!
//! The paper moves samples by repulsion until sigma_i / r_i is constant. Here the energy keeps each
//! element's share of the length at its span. So the same equilibrium is reached at once by
//! choosing the spans: their ends divide the integral of a floor plus the curvature evenly.

use crate::Vector;
use crate::correction::curve::{Cursor, Curve};
use crate::surface::{Geometry, Node, Surface};

/// The length and the turning (integral of the normal curvature) of a polyline's segments.
pub(crate) struct Profile {
    /// Lengths of the segments, in the input's units.
    pub lengths: Vec<f64>,
    /// Angles by which the surface's normal turns along the segments, in radians.
    pub turnings: Vec<f64>,
    /// Sum of the lengths, in the input's units.
    pub length: f64,
    /// Sum of the turnings, in radians.
    pub turning: f64,
}

/// Measures a polyline of nodes on a surface.
pub(crate) fn profile<const D: usize, S: Surface<D>>(
    surface: &S,
    nodes: &[Node<D, S::Place>],
    scratch: &mut Geometry<D>,
) -> Profile {
    let mut lengths = Vec::with_capacity(nodes.len());
    let mut turnings = Vec::with_capacity(nodes.len());
    for pair in nodes.windows(2) {
        let chord = pair[1].point - pair[0].point;
        let length = chord.norm();
        let curvature = if length > 0.0 && surface.geometry(&pair[0].point, pair[0].place, scratch)
        {
            let tangential = scratch.project(&chord);
            let size = tangential.norm();
            if size > 0.0 {
                scratch.normal_curvature(&(tangential / size)).norm()
            } else {
                0.0
            }
        } else {
            0.0
        };
        lengths.push(length);
        // A polyline cannot show more than half a turn per segment.
        turnings.push((curvature * length).min(std::f64::consts::PI));
    }
    Profile {
        length: lengths.iter().sum(),
        turning: turnings.iter().sum(),
        lengths,
        turnings,
    }
}

impl Profile {
    /// The ends of `count` spans that divide the integral of floor plus curvature evenly, as
    /// ascending fractions of the length from 0 to 1.
    pub fn knots(&self, count: usize) -> Vec<f64> {
        let floor = (0.5 * self.turning).max(1.0) / self.length;
        let loads: Vec<f64> = self
            .lengths
            .iter()
            .zip(&self.turnings)
            .map(|(length, turning)| floor * length + turning)
            .collect();
        let total: f64 = loads.iter().sum();
        let mut knots = vec![0.0];
        let (mut segment, mut load_before, mut length_before) = (0, 0.0, 0.0);
        for i in 1..count {
            let target = total * i as f64 / count as f64;
            while segment + 1 < loads.len() && load_before + loads[segment] < target {
                load_before += loads[segment];
                length_before += self.lengths[segment];
                segment += 1;
            }
            let within = ((target - load_before) / loads[segment]).clamp(0.0, 1.0);
            knots.push((length_before + within * self.lengths[segment]) / self.length);
        }
        knots.push(1.0);
        knots
    }
}

/// A polyline with nodes at the given fractions of the guess's length, pulled onto the surface. A
/// node without a foot takes the guess's own nearest node.
pub(crate) fn resample<const D: usize, S: Surface<D>>(
    surface: &S,
    guess: &[Node<D, S::Place>],
    profile: &Profile,
    knots: &[f64],
    scratch: &mut Geometry<D>,
) -> Curve<D, S::Place> {
    let shares: Vec<f64> = profile.lengths.iter().map(|l| l / profile.length).collect();
    let mut at = Cursor::new(&shares);
    let inner = &knots[1..knots.len() - 1];
    let mut nodes = Vec::with_capacity(knots.len());
    nodes.push(guess[0]);
    for knot in inner {
        let (segment, local) = at.seek(*knot);
        let weight = 0.5 * (1.0 + local);
        let (a, b) = (&guess[segment], &guess[segment + 1]);
        let nearer = if weight < 0.5 { a } else { b };
        let point: Vector<D> = a.point * (1.0 - weight) + b.point * weight;
        let mut place = nearer.place;
        nodes.push(match surface.foot(&point, &mut place, scratch) {
            Some(point) => Node { point, place },
            None => *nearer,
        });
    }
    nodes.push(guess[guess.len() - 1]);
    Curve {
        degree: 1,
        spans: knots.windows(2).map(|pair| pair[1] - pair[0]).collect(),
        nodes,
    }
}

/// Sagitta of a segment, as a share of its length, above which the segment no longer follows the
/// surface. An arc of 2 radians has 0.27.
const LEAP: f64 = 0.3;

/// Whether a segment of a polyline leaves the surface instead of following it.
pub(crate) fn leaps<const D: usize, S: Surface<D>>(
    surface: &S,
    curve: &Curve<D, S::Place>,
    scratch: &mut Geometry<D>,
) -> bool {
    curve.nodes.windows(2).any(|pair| {
        let middle = (pair[0].point + pair[1].point) * 0.5;
        let allowed = LEAP * (pair[1].point - pair[0].point).norm();
        let mut place = pair[0].place;
        let foot = surface.foot(&middle, &mut place, scratch);
        allowed > 0.0 && foot.is_none_or(|foot| (foot - middle).norm() > allowed)
    })
}

/// The ends of the spans of a curve, from 0 to 1, after the marked elements are halved.
pub(crate) fn insert(spans: &[f64], marked: &[bool]) -> Vec<f64> {
    let mut knots = vec![0.0];
    let mut start = 0.0;
    for (span, marked) in spans.iter().zip(marked) {
        if *marked {
            knots.push(start + 0.5 * span);
        }
        start += span;
        knots.push(start);
    }
    if let Some(last) = knots.last_mut() {
        *last = 1.0;
    }
    knots
}
