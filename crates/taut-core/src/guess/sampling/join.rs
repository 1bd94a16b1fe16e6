//! The graph of samples: two samples are joined where a walk along the surface leads from one to
//! the other.

use crate::Vector;
use crate::guess::graph::Graph;
use crate::guess::sampling::grow::{Sample, same_side};
use crate::guess::sampling::walk::Walker;
use crate::guess::{JOINED, STEEPEST_CHORD};
use crate::parallel;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::implicit::{Equations, ImplicitSurface};
use crate::surface::{Geometry, Node, Surface};

/// Factor by which the number of neighbours that are looked at grows while layers of other sheets
/// fill it.
pub(super) const WIDER: usize = 4;

/// Connects samples that are a step along the surface apart.
pub(super) fn join<const D: usize, E: Equations<D>>(
    surface: &ImplicitSurface<D, E>,
    samples: &[Sample<D>],
    tree: &Tree<D>,
    links: &[[u32; 2]],
) -> Graph<D, Vector<D>> {
    let m = D - surface.intrinsic_dimension();
    let widest = samples.iter().map(|s| s.spacing).fold(0.0, f64::max);
    let scratch = || (Walker::new(surface), Vec::new());
    let mut lists = parallel::map_with(samples.len(), scratch, |(walker, found), i| {
        let sample = &samples[i];
        if !walker.look(&sample.point) {
            return Vec::new();
        }
        let geometry = walker.scratch.clone();
        let is_joined = |walker: &mut Walker<'_, D, E>, j: u32| {
            let other = &samples[j as usize];
            j as usize != i
                && one_step(sample, other, m)
                && is_foretold(&geometry, sample, other)
                && walker.arrives(&sample.point, &other.point, sample.gap.min(other.gap))
        };
        let reach = JOINED * widest;
        let mut seen = 0;
        let mut list: Vec<u32> = Vec::new();
        let most = edge_count(D - m);
        // Other sheets may fill the nearest neighbours, so more are asked for until enough are
        // joined or all in reach are seen.
        let mut count = most;
        loop {
            tree.nearest(&sample.point, count, found);
            for neighbour in found.iter().skip(seen) {
                let j = tree.order[neighbour.index as usize];
                if list.len() < most && is_joined(walker, j) {
                    list.push(j);
                }
            }
            if is_enough(found, count, reach) || list.len() == most {
                return list;
            }
            seen = found.len();
            count *= WIDER;
        }
    });
    for i in 0..lists.len() {
        for j in lists[i].clone() {
            if !lists[j as usize].contains(&(i as u32)) {
                lists[j as usize].push(i as u32);
            }
        }
    }
    add_links(&mut lists, links);
    let nodes = samples.iter().map(|sample| node(&sample.point)).collect();
    let along_arc = |i: usize, j: usize, chord: f64| arc(&samples[i], &samples[j], m).max(chord);
    Graph::with_lengths(nodes, lists.iter().map(Vec::as_slice), along_arc)
}

/// Adds the links between parts that nothing else connects.
fn add_links(lists: &mut [Vec<u32>], links: &[[u32; 2]]) {
    let mut roots: Vec<u32> = (0..lists.len() as u32).collect();
    for i in 0..lists.len() {
        for j in &lists[i] {
            unite(&mut roots, i as u32, *j);
        }
    }
    for [i, j] in links {
        if unite(&mut roots, *i, *j) {
            lists[*i as usize].push(*j);
            lists[*j as usize].push(*i);
        }
    }
}

/// Makes two parts one; `false` where they were one before.
fn unite(roots: &mut [u32], i: u32, j: u32) -> bool {
    let [i, j] = [i, j].map(|mut node| {
        while roots[node as usize] != node {
            roots[node as usize] = roots[roots[node as usize] as usize];
            node = roots[node as usize];
        }
        node
    });
    roots[i.max(j) as usize] = i.min(j);
    i != j
}

/// Length of the arc between two samples whose chord leaves the surface at the larger of the angles
/// at both, so that distances along the graph are not shorter than along the surface.
fn arc<const D: usize>(a: &Sample<D>, b: &Sample<D>, m: usize) -> f64 {
    let chord = b.point - a.point;
    let length = chord.norm();
    let sine = across(a, &chord, m).max(across(b, &chord, m)) / length;
    let angle = sine.min(1.0).asin();
    if angle > 0.0 {
        length * angle / sine
    } else {
        length
    }
}

/// How far a vector leads off the tangent plane at a sample.
fn across<const D: usize>(sample: &Sample<D>, vector: &Vector<D>, m: usize) -> f64 {
    let squares = (0..m).map(|i| sample.basis.column(i).dot(vector).powi(2));
    squares.sum::<f64>().sqrt()
}

/// A node of the surface at one of its points.
pub(super) fn node<const D: usize>(point: &Vector<D>) -> Node<D, Vector<D>> {
    Node {
        point: *point,
        place: *point,
    }
}

/// Whether the neighbours found are all there are, or reach as far as is looked.
pub(super) fn is_enough(found: &[Neighbour], asked: usize, reach: f64) -> bool {
    found.len() < asked || found.last().is_none_or(|last| last.squared > reach * reach)
}

/// Number of neighbours that are looked at per sample of a surface of dimension k.
pub(super) fn edge_count(k: usize) -> usize {
    match k {
        1 => 6,
        2 => 24,
        3 => 40,
        _ => 60,
    }
}

/// How far a neighbour may always lie off the surface as the second order at a sample predicts it,
/// as a share of the way.
const OFF_PREDICTED: f64 = 0.02;
/// How much farther a neighbour may lie off the predicted surface, as a share of the way, per
/// square of the way in spacings.
const OFF_BY_SQUARE: f64 = 0.12;

/// Whether a neighbour lies about where the second order at a sample, whose geometry is given,
/// predicts the surface. Neighbours on other layers mostly do not.
pub(super) fn is_foretold<const D: usize>(
    geometry: &Geometry<D>,
    a: &Sample<D>,
    b: &Sample<D>,
) -> bool {
    let chord = b.point - a.point;
    let along = geometry.project(&chord);
    let off = chord - along - geometry.normal_curvature(&along) * 0.5;
    let length = along.norm();
    let spacings = length / a.spacing.min(b.spacing);
    off.norm() <= (OFF_PREDICTED + OFF_BY_SQUARE * spacings * spacings) * length
}

/// Whether the chord between two samples is short and runs along the surface at both ends.
pub(super) fn one_step<const D: usize>(a: &Sample<D>, b: &Sample<D>, m: usize) -> bool {
    let chord = b.point - a.point;
    let length = chord.norm();
    let along = |sample: &Sample<D>| across(sample, &chord, m) <= STEEPEST_CHORD * length;
    length <= JOINED * a.spacing.max(b.spacing)
        && along(a)
        && along(b)
        && same_side(&a.basis, &b.basis, m)
}
