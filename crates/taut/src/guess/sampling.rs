//! A coarse, even sampling of an implicit surface, grown from seeds, and its graph.
//!
//! Each sample throws candidates one spacing away along the surface; a candidate is kept unless a
//! sample lies too near (dart throwing by expansion: Bridson, "Fast Poisson Disk Sampling in
//! Arbitrary Dimensions", SIGGRAPH 2007 sketches). The spacing shrinks where the surface bends.

use std::collections::HashMap;

use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::graph::Graph;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::implicit::{Equations, ImplicitSurface};
use crate::surface::{Geometry, Node, Surface};
use crate::{Matrix, Vector};

/// An implicit surface with a coarse sampling to find first guesses on.
pub struct Sampled<const D: usize, E> {
    surface: ImplicitSurface<D, E>,
    tree: Tree<D>,
    samples: Vec<Sample<D>>,
}

/// A sample: its point, its normal and tangent frame, and the spacing there.
#[derive(Clone, Debug)]
struct Sample<const D: usize> {
    point: Vector<D>,
    /// Columns 0..m normal, m..D tangent.
    basis: Matrix<D>,
    spacing: f64,
}

/// The part of space that the sampling covers.
#[derive(Clone, Copy, Debug)]
struct Region<const D: usize> {
    low: Vector<D>,
    high: Vector<D>,
}

/// Samples aimed for; at least a quarter and at most three times as many are accepted.
const SAMPLES: usize = 500;
/// Growth stops here: an incomplete sampling still guides paths near its seeds.
const MOST_SAMPLES: usize = 6000;
/// Radians that the surface turns within one spacing.
const TURNING: f64 = 0.6;
/// Two samples are at least this share of the smaller spacing apart.
const EXCLUSION: f64 = 0.7;
/// Samples up to this many spacings apart may be connected.
const REACH: f64 = 1.9;
/// Candidates thrown per sample and tangent dimension.
const THROWS: usize = 5;

impl<const D: usize, E: Equations<D>> Sampled<D, E> {
    /// The point of the surface that `x` is pulled back to (12), and how far it moved.
    ///
    /// # Errors
    /// [`Error::NoFoot`] where the pull-back does not arrive.
    pub fn node_near(&self, x: &Vector<D>) -> Result<(Node<D, ()>, f64), Error> {
        let node = self.surface.node_near(x)?;
        Ok((node, (node.point - x).norm()))
    }

    /// The samples' points.
    #[must_use]
    pub fn samples(&self) -> Vec<Vector<D>> {
        self.samples.iter().map(|s| s.point).collect()
    }

    /// A unit normal (the first of m) at each sample.
    #[must_use]
    pub fn sample_normals(&self) -> Vec<Vector<D>> {
        self.samples
            .iter()
            .map(|s| s.basis.column(0).into_owned())
            .collect()
    }
}

impl<const D: usize, E: Equations<D>> ImplicitSurface<D, E> {
    fn node_near(&self, x: &Vector<D>) -> Result<Node<D, ()>, Error> {
        let mut scratch = Geometry::new(D - self.intrinsic_dimension());
        match self.foot(x, &mut (), &mut scratch) {
            Some(point) => Ok(Node { point, place: () }),
            None => Err(Error::NoFoot {
                point: format!("{:?}", x.as_slice()),
                reason: self.why_no_foot(x),
            }),
        }
    }
}

impl<const D: usize, E: Equations<D>> ImplicitSurface<D, E> {
    /// Why a point has no foot.
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
    /// Makes an implicit surface ready for path queries: samples the components that hold the
    /// `seeds` (pulled back onto the surface), within `bounds` (low and high corner) where given, and
    /// else as far around the seeds as it takes to connect them.
    ///
    /// # Errors
    /// [`Error::NoDimensionLeft`] for D or more equations, [`Error::NoFoot`] for seeds that cannot be
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
        let starts: Vec<Vector<D>> = seeds
            .iter()
            .map(|seed| surface.node_near(seed).map(|node| node.point))
            .collect::<Result<_, _>>()?;
        let mut region = Region::around(&starts, surface.size());
        if let Some((low, high)) = bounds {
            region = Region { low, high };
        }
        for _ in 0..6 {
            let (samples, clipped) = sample(&surface, &starts, &region);
            let graph = connect(&surface, &samples);
            if bounds.is_some() || !clipped || graph.components().1.len() == 1 {
                return Ok(ready(surface, samples, graph));
            }
            region = region.doubled();
        }
        let (samples, _) = sample(&surface, &starts, &region);
        let graph = connect(&surface, &samples);
        Ok(ready(surface, samples, graph))
    }
}

fn ready<const D: usize, E: Equations<D>>(
    surface: ImplicitSurface<D, E>,
    samples: Vec<Sample<D>>,
    graph: Graph<D, ()>,
) -> Geodesics<D, Sampled<D, E>> {
    let points: Vec<Vector<D>> = samples.iter().map(|s| s.point).collect();
    let sampled = Sampled {
        surface,
        tree: Tree::new(&points),
        samples,
    };
    Geodesics::with_graph(sampled, graph)
}

impl<const D: usize> Region<D> {
    fn around(points: &[Vector<D>], size: f64) -> Self {
        let low = points
            .iter()
            .fold(Vector::<D>::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = points
            .iter()
            .fold(Vector::<D>::repeat(f64::NEG_INFINITY), |high, p| {
                high.sup(p)
            });
        let margin = Vector::repeat((high - low).norm().max(size));
        Self {
            low: low - margin,
            high: high + margin,
        }
    }

    fn doubled(&self) -> Self {
        let half = (self.high - self.low) * 0.5;
        Self {
            low: self.low - half,
            high: self.high + half,
        }
    }

    fn holds(&self, x: &Vector<D>) -> bool {
        (0..D).all(|i| self.low[i] <= x[i] && x[i] <= self.high[i])
    }
}

/// Samples about [`SAMPLES`] points; also says whether the surface goes on beyond the region.
fn sample<const D: usize, E: Equations<D>>(
    surface: &ImplicitSurface<D, E>,
    starts: &[Vector<D>],
    region: &Region<D>,
) -> (Vec<Sample<D>>, bool) {
    let k = surface.intrinsic_dimension() as f64;
    let mut spacing = (region.high - region.low).amax() / 16.0;
    let mut result = grow(surface, starts, region, spacing);
    for _ in 0..8 {
        let count = result.0.len();
        let bound_by_turning = result.0.iter().all(|s| s.spacing < spacing);
        if (SAMPLES / 4..=3 * SAMPLES).contains(&count) || (count > SAMPLES && bound_by_turning) {
            break;
        }
        let factor = (count as f64 / SAMPLES as f64).powf(1.0 / k);
        spacing *= factor.clamp(0.2, 5.0);
        result = grow(surface, starts, region, spacing);
    }
    result
}

/// Grows samples of the given spacing from the starts.
fn grow<const D: usize, E: Equations<D>>(
    surface: &ImplicitSurface<D, E>,
    starts: &[Vector<D>],
    region: &Region<D>,
    spacing: f64,
) -> (Vec<Sample<D>>, bool) {
    let k = surface.intrinsic_dimension();
    let mut scratch = Geometry::new(D - k);
    let mut found = Found {
        samples: Vec::new(),
        buckets: HashMap::new(),
        width: spacing,
        codimension: D - k,
    };
    let mut clipped = false;
    for start in starts {
        if let Some(sample) = measure(surface, start, spacing, &mut scratch)
            && !found.crowded(&sample)
        {
            found.add(sample);
        }
    }
    let mut next = 0;
    while next < found.samples.len() && found.samples.len() < MOST_SAMPLES {
        let from = found.samples[next].clone();
        for direction in directions::<D>(k, next) {
            let mut step = Vector::zeros();
            for j in 0..k {
                step += from.basis.column(D - k + j) * direction[j];
            }
            let target = from.point + step * from.spacing;
            let Some(point) = surface.foot(&target, &mut (), &mut scratch) else {
                continue;
            };
            if (point - target).norm() > 0.5 * from.spacing {
                continue;
            }
            if !region.holds(&point) {
                clipped = true;
                continue;
            }
            if let Some(sample) = measure(surface, &point, spacing, &mut scratch)
                && !found.crowded(&sample)
            {
                found.add(sample);
            }
        }
        next += 1;
    }
    let incomplete = next < found.samples.len();
    (found.samples, clipped || incomplete)
}

/// Unit directions in k dimensions, spread by a low-discrepancy sequence that differs per sample.
fn directions<const D: usize>(k: usize, sample: usize) -> Vec<[f64; D]> {
    let mut all = Vec::new();
    if k == 1 {
        for sign in [1.0, -1.0] {
            let mut direction = [0.0; D];
            direction[0] = sign;
            all.push(direction);
        }
        return all;
    }
    if k == 2 {
        let turn = 0.61803398875 * sample as f64;
        for i in 0..7 {
            let angle = std::f64::consts::TAU * (i as f64 / 7.0 + turn);
            let mut direction = [0.0; D];
            (direction[1], direction[0]) = angle.sin_cos();
            all.push(direction);
        }
        return all;
    }
    // Gaussian deviates by Box-Muller from a fixed generator.
    let mut state = 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(sample as u64 + 1);
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    for _ in 0..THROWS * k {
        let mut direction = [0.0; D];
        for value in &mut direction[..k] {
            *value = (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
        }
        let norm = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        for value in &mut direction {
            *value /= norm;
        }
        all.push(direction);
    }
    all
}

/// The sample at a point of the surface; `None` where it has no tangent space.
fn measure<const D: usize, E: Equations<D>>(
    surface: &ImplicitSurface<D, E>,
    point: &Vector<D>,
    spacing: f64,
    scratch: &mut Geometry<D>,
) -> Option<Sample<D>> {
    if !surface.geometry(point, (), scratch) {
        return None;
    }
    let curvature = scratch.curvature_bound();
    Some(Sample {
        point: *point,
        basis: scratch.basis,
        spacing: spacing.min(TURNING / curvature),
    })
}

/// Samples in buckets of their first three coordinates.
struct Found<const D: usize> {
    samples: Vec<Sample<D>>,
    buckets: HashMap<[i64; 3], Vec<u32>>,
    width: f64,
    codimension: usize,
}

impl<const D: usize> Found<D> {
    fn bucket(&self, x: &Vector<D>) -> [i64; 3] {
        std::array::from_fn(|i| {
            if i < D {
                (x[i] / self.width).floor() as i64
            } else {
                0
            }
        })
    }

    fn add(&mut self, sample: Sample<D>) {
        let bucket = self.bucket(&sample.point);
        let index = self.samples.len() as u32;
        self.buckets.entry(bucket).or_default().push(index);
        self.samples.push(sample);
    }

    fn crowded(&self, sample: &Sample<D>) -> bool {
        let [x, y, z] = self.bucket(&sample.point);
        for i in -1..=1 {
            for j in -1..=1 {
                for l in -1..=1 {
                    let Some(list) = self.buckets.get(&[x + i, y + j, z + l]) else {
                        continue;
                    };
                    for other in list.iter().map(|o| &self.samples[*o as usize]) {
                        let apart = EXCLUSION * sample.spacing.min(other.spacing);
                        let offset = other.point - sample.point;
                        if offset.norm_squared() < apart * apart
                            && same_side(&sample.basis, &other.basis, self.codimension)
                        {
                            return true;
                        }
                    }
                }
            }
        }
        false
    }
}

/// The normals agree well enough for the two points to lie on one sheet.
fn same_side<const D: usize>(a: &Matrix<D>, b: &Matrix<D>, m: usize) -> bool {
    (0..m).all(|i| {
        let normal = a.column(i);
        let kept: f64 = (0..m).map(|j| normal.dot(&b.column(j)).powi(2)).sum();
        kept > 0.1 && (m > 1 || normal.dot(&b.column(0)) > 0.0)
    })
}

/// Connects samples that are a step along the surface apart.
fn connect<const D: usize, E: Equations<D>>(
    surface: &ImplicitSurface<D, E>,
    samples: &[Sample<D>],
) -> Graph<D, ()> {
    let m = D - surface.intrinsic_dimension();
    let points: Vec<Vector<D>> = samples.iter().map(|s| s.point).collect();
    let tree = Tree::new(&points);
    let mut found = Vec::new();
    let mut lists = vec![Vec::new(); samples.len()];
    for (i, sample) in samples.iter().enumerate() {
        tree.nearest(&sample.point, edge_count(D - m), &mut found);
        for neighbour in &found {
            let j = tree.order[neighbour.index as usize];
            if j as usize != i && one_step(sample, &samples[j as usize], m) {
                lists[i].push(j);
            }
        }
    }
    for i in 0..lists.len() {
        for j in lists[i].clone() {
            if !lists[j as usize].contains(&(i as u32)) {
                lists[j as usize].push(i as u32);
            }
        }
    }
    let nodes = points
        .iter()
        .map(|point| Node {
            point: *point,
            place: (),
        })
        .collect();
    Graph::new(nodes, lists.iter().map(Vec::as_slice))
}

/// Neighbours looked at per sample.
fn edge_count(k: usize) -> usize {
    match k {
        1 => 6,
        2 => 24,
        3 => 40,
        _ => 60,
    }
}

/// The chord between two samples is short and runs along the surface at both ends.
fn one_step<const D: usize>(a: &Sample<D>, b: &Sample<D>, m: usize) -> bool {
    let chord = b.point - a.point;
    let length = chord.norm();
    let along = |basis: &Matrix<D>| {
        let across: f64 = (0..m).map(|i| basis.column(i).dot(&chord).powi(2)).sum();
        across.sqrt() <= 0.6 * length
    };
    length <= REACH * a.spacing.max(b.spacing)
        && along(&a.basis)
        && along(&b.basis)
        && same_side(&a.basis, &b.basis, m)
}

impl<const D: usize, E: Equations<D>> Surface<D> for Sampled<D, E> {
    type Place = ();

    fn intrinsic_dimension(&self) -> usize {
        self.surface.intrinsic_dimension()
    }

    fn foot(&self, x: &Vector<D>, place: &mut (), scratch: &mut Geometry<D>) -> Option<Vector<D>> {
        self.surface.foot(x, place, scratch)
    }

    fn find_place(&self, x: &Vector<D>, place: &mut (), scratch: &mut Geometry<D>) -> bool {
        self.surface.find_place(x, place, scratch)
    }

    fn geometry(&self, x: &Vector<D>, place: (), out: &mut Geometry<D>) -> bool {
        self.surface.geometry(x, place, out)
    }
}

impl<const D: usize, E: Equations<D>> Guide<D> for Sampled<D, E> {
    fn entrances(&self, node: &Node<D, ()>, visit: &mut dyn FnMut(u32)) {
        let k = self.intrinsic_dimension();
        let mut scratch = Geometry::new(D - k);
        let mut found: Vec<Neighbour> = Vec::new();
        self.tree
            .nearest(&node.point, edge_count(k) / 2, &mut found);
        let Some(here) = measure(&self.surface, &node.point, f64::INFINITY, &mut scratch) else {
            return;
        };
        for neighbour in &found {
            let index = self.tree.order[neighbour.index as usize];
            let there = &self.samples[index as usize];
            let here = Sample {
                spacing: there.spacing,
                ..here.clone()
            };
            if neighbour.squared == 0.0 || one_step(&here, there, D - k) {
                visit(index);
            }
        }
    }
}
