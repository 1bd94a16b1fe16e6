//! The discrete path: polynomial elements through nodes on the surface.
//!
//! Elements of degree 1 are the paper's polyline with energy E = 1/2 sum sigma_i^2. Elements of
//! higher degrees keep the same unknowns, the nodes on the surface, and the same energy, with
//! spectral accuracy.

use crate::Vector;
use crate::correction::element::{Element, MAXIMUM_DEGREE, element};
use crate::surface::{Geometry, Node, Surface};

/// A path on a surface: elements of one degree, where neighbours share their end node.
#[derive(Clone, Debug)]
pub(crate) struct Curve<const D: usize, P> {
    /// Polynomial degree p of every element.
    pub degree: usize,
    /// The share of the path's parameter that each element takes. The shares sum to 1, and at the
    /// minimum of the energy they are the elements' shares of the length.
    pub spans: Vec<f64>,
    /// The nodes of the path; element e owns nodes e p ..= (e + 1) p.
    pub nodes: Vec<Node<D, P>>,
}

/// Energy and length of a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measure {
    /// E = 1/2 integral of |x'|^2 over the parameter, in squared units of length.
    pub energy: f64,
    /// The integral of |x'| over the parameter, in the input's units.
    pub length: f64,
}

impl<const D: usize, P: Copy> Curve<D, P> {
    /// The reference element of the path's elements.
    pub fn element(&self) -> &'static Element {
        element(self.degree)
    }

    /// Energy and length of the path; `pull` receives the energy's gradient with respect to every
    /// node.
    pub fn measure(&self, pull: &mut Vec<Vector<D>>) -> Measure {
        let reference = self.element();
        let count = self.degree + 1;
        pull.clear();
        pull.resize(self.nodes.len(), Vector::zeros());
        let mut measure = Measure {
            energy: 0.0,
            length: 0.0,
        };
        for (e, span) in self.spans.iter().enumerate() {
            let first = e * self.degree;
            let velocities = self.velocities(e);
            let scale = 2.0 / span;
            for q in 0..count {
                let velocity = velocities[q];
                let weight = reference.weights[q];
                let squared = velocity.norm_squared();
                measure.energy += 0.5 * scale * weight * squared;
                measure.length += weight * squared.sqrt();
                let row = &reference.derivative[q * count..(q + 1) * count];
                let weighted = velocity * (scale * weight);
                for (slope, target) in row.iter().zip(&mut pull[first..]) {
                    *target += weighted * *slope;
                }
            }
        }
        measure
    }

    /// The derivatives of element e with respect to its own parameter in [-1, 1], at its nodes.
    pub fn velocities(&self, e: usize) -> [Vector<D>; MAXIMUM_DEGREE + 1] {
        let reference = self.element();
        let count = self.degree + 1;
        let nodes = &self.nodes[e * self.degree..];
        let mut velocities = [Vector::zeros(); MAXIMUM_DEGREE + 1];
        // Differences are taken first, so that the rounding of large coordinates cancels exactly.
        let mut offsets = [Vector::<D>::zeros(); MAXIMUM_DEGREE + 1];
        for j in 1..count {
            offsets[j] = nodes[j].point - nodes[0].point;
        }
        for q in 0..count {
            let row = &reference.derivative[q * count..(q + 1) * count];
            for j in 1..count {
                velocities[q] += offsets[j] * row[j];
            }
        }
        velocities
    }

    /// The length from the start to each node. The speed, a polynomial to the accuracy of the
    /// element, is integrated by interpolating it at the Gauss-Lobatto nodes.
    pub fn arc_lengths(&self) -> Vec<f64> {
        let reference = self.element();
        let count = self.degree + 1;
        let mut lengths = vec![0.0];
        let mut start = 0.0;
        for e in 0..self.spans.len() {
            let velocities = self.velocities(e);
            for row in reference.integration.chunks(count).skip(1) {
                let within: f64 = (0..count).map(|q| row[q] * velocities[q].norm()).sum();
                lengths.push(start + within);
            }
            start = lengths[lengths.len() - 1];
        }
        lengths
    }

    /// The parameter of every node, from 0 to 1.
    pub fn parameters(&self) -> Vec<f64> {
        let reference = self.element();
        let mut parameters = vec![0.0];
        let mut start = 0.0;
        for span in &self.spans {
            let within = reference.nodes[1..]
                .iter()
                .map(|x| start + 0.5 * (1.0 + x) * span);
            parameters.extend(within);
            start += span;
        }
        parameters
    }

    /// The point of element e at `x` in [-1, 1], which lies off the surface by the interpolation
    /// error, and the place of the node nearest to it.
    pub fn interpolate(&self, e: usize, x: f64) -> Node<D, P> {
        let reference = self.element();
        let count = self.degree + 1;
        let mut row = [0.0; MAXIMUM_DEGREE + 1];
        reference.interpolation(x, &mut row[..count]);
        let nodes = &self.nodes[e * self.degree..];
        let mut point = nodes[0].point;
        for j in 1..count {
            point += (nodes[j].point - nodes[0].point) * row[j];
        }
        let nearest = (0..count)
            .min_by(|a, b| {
                let gap = |i: usize| (reference.nodes[i] - x).abs();
                gap(*a).total_cmp(&gap(*b))
            })
            .unwrap_or(0);
        Node {
            point,
            place: nodes[nearest].place,
        }
    }

    /// The same path on other elements, whose ends are `knots`, ascending from 0 to 1 in this
    /// path's parameter. Elements that the path already has keep their nodes.
    ///
    /// `None` where a new node finds no foot.
    pub fn refit<S: Surface<D, Place = P>>(
        &self,
        surface: &S,
        degree: usize,
        knots: &[f64],
        scratch: &mut Geometry<D>,
    ) -> Option<Self> {
        let reference = element(degree);
        let mut nodes = Vec::with_capacity((knots.len() - 1) * degree + 1);
        nodes.push(self.nodes[0]);
        let mut at = Cursor::new(&self.spans);
        for pair in knots.windows(2) {
            if let Some(e) = at.whole(pair[0], pair[1]).filter(|_| degree == self.degree) {
                nodes.extend(&self.nodes[e * degree + 1..=(e + 1) * degree]);
                continue;
            }
            for x in &reference.nodes[1..] {
                let parameter = pair[0] + 0.5 * (1.0 + x) * (pair[1] - pair[0]);
                let (e, local) = at.seek(parameter);
                let mut node = self.interpolate(e, local);
                node.point = surface.foot(&node.point, &mut node.place, scratch)?;
                nodes.push(node);
            }
        }
        if let (Some(last), Some(end)) = (nodes.last_mut(), self.nodes.last()) {
            *last = *end;
        }
        Some(Self {
            degree,
            spans: knots.windows(2).map(|pair| pair[1] - pair[0]).collect(),
            nodes,
        })
    }
}

/// Finds the spans that hold ascending parameters.
pub(crate) struct Cursor<'a> {
    spans: &'a [f64],
    index: usize,
    start: f64,
}

impl<'a> Cursor<'a> {
    pub fn new(spans: &'a [f64]) -> Self {
        Self {
            spans,
            index: 0,
            start: 0.0,
        }
    }

    /// The span that holds `parameter`, and the place within the span in [-1, 1]. Parameters must
    /// be asked for in ascending order.
    pub fn seek(&mut self, parameter: f64) -> (usize, f64) {
        while self.index + 1 < self.spans.len() && parameter > self.start + self.spans[self.index] {
            self.start += self.spans[self.index];
            self.index += 1;
        }
        let local = 2.0 * (parameter - self.start) / self.spans[self.index] - 1.0;
        (self.index, local.clamp(-1.0, 1.0))
    }

    /// The span that begins and ends at two parameters, up to rounding, if there is one. Parameters
    /// must be asked for in ascending order.
    pub fn whole(&mut self, from: f64, to: f64) -> Option<usize> {
        let (index, local) = self.seek(from);
        let index = index + usize::from(local > 0.0);
        let span = *self.spans.get(index)?;
        let start = if local > 0.0 {
            self.start + self.spans[self.index]
        } else {
            self.start
        };
        let off = (from - start).abs().max((to - from - span).abs());
        (off <= 1e-12).then_some(index)
    }
}

/// The place halfway along the chords between points; the origin where there are none.
pub(crate) fn halfway<const D: usize>(
    points: impl Iterator<Item = Vector<D>> + Clone,
) -> Vector<D> {
    let chords = || points.clone().zip(points.clone().skip(1));
    let mut left = 0.5 * chords().map(|(a, b)| (b - a).norm()).sum::<f64>();
    for (a, b) in chords() {
        let length = (b - a).norm();
        if left <= length && length > 0.0 {
            return a.lerp(&b, left / length);
        }
        left -= length;
    }
    points.last().unwrap_or_else(Vector::zeros)
}
