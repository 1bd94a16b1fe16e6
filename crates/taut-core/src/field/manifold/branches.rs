//! From jets on rays to jets at the nodes of the graph, in any dimension: jets of one branch (one
//! way round) are averaged.

use crate::field::manifold::cover::Sample;
use crate::field::manifold::frame::{Frame, axis};
use crate::field::manifold::jet::Jet;
use crate::field::rays::branches::{
    JET_REACH, MOST_BRANCHES, NODE_AT_SOURCE, SAME_DIRECTION, SAME_DISTANCE, WEIGHT_FLOOR,
};
use crate::field::rays::frame::ON_SURFACE;
use crate::order::sort_by_number;
use crate::{Matrix, Vector};

/// A way by which a distance may reach the neighbourhood of a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Branch<const D: usize> {
    /// The jet of the distance, in the node's frame.
    pub jet: Jet<D>,
    /// The index of the source that the way comes from.
    pub source: u32,
    /// Estimated error of the distance, in the input's units.
    pub error: f64,
    /// Whether the node is so near the source that distances are measured from the source itself.
    pub at_source: bool,
}

/// Largest share of the way to where rays meet that a jet is carried.
const CARRIED_DRAWN: f64 = 0.6;

/// The weighted sums of the jets of one branch, which are being averaged.
struct Group<const D: usize> {
    /// The first jet, from which differences are taken.
    first: Jet<D>,
    source: u32,
    surface_error: f64,
    weight: f64,
    /// Sum of weight times the distance less that of the first jet.
    distance: f64,
    /// Sum of weight times the square of the distance less that of the first jet.
    squares: f64,
    gradient: Vector<D>,
    shape: Matrix<D>,
}

impl<const D: usize> Group<D> {
    /// Whether a jet belongs to the same branch as this group.
    fn takes(&self, jet: &Jet<D>, source: u32, spacing: f64) -> bool {
        self.source == source
            && self.first.gradient.dot(&jet.gradient) >= SAME_DIRECTION
            && (jet.distance - self.first.distance).abs() <= SAME_DISTANCE * spacing
    }

    /// Adds a jet with its weight to the sums.
    fn add(&mut self, jet: &Jet<D>, weight: f64) {
        let more = jet.distance - self.first.distance;
        self.weight += weight;
        self.distance += weight * more;
        self.squares += weight * more * more;
        self.gradient += jet.gradient * weight;
        self.shape += jet.shape * weight;
    }

    /// The branch that the averaged jets make.
    fn branch(&self) -> Branch<D> {
        let inverse = self.weight.recip();
        let mean = self.distance * inverse;
        Branch {
            jet: Jet {
                distance: self.first.distance + mean,
                gradient: self.gradient.normalize(),
                shape: self.shape * inverse,
            },
            source: self.source,
            error: (self.squares * inverse - mean * mean).max(0.0).sqrt() + self.surface_error,
            at_source: false,
        }
    }
}

/// The branches at a node with a frame, least distance first, from the jets near it and the sources
/// beside it.
pub(crate) fn branches<'a, const D: usize>(
    frame: &Frame<D>,
    spacing: f64,
    near: impl Iterator<Item = (&'a Sample<D>, u32)>,
    sources: impl Iterator<Item = (&'a Frame<D>, f64, u32)>,
) -> Vec<Branch<D>> {
    let reach = JET_REACH * spacing;
    let mut jets: Vec<(f64, Jet<D>, &Sample<D>, u32)> = near
        .filter_map(|(sample, source)| {
            let squared = (sample.frame.point - frame.point).norm_squared();
            let jet = (squared <= reach * reach)
                .then(|| sample.carried(frame))
                .flatten()?;
            let weight = (squared / (spacing * spacing) + WEIGHT_FLOOR * WEIGHT_FLOOR).powi(-2);
            Some((weight, jet, sample, source))
        })
        .collect();
    // Where rays draw together, a jet is good for a share of the way to where they meet.
    let good = |sample: &Sample<D>| {
        let off = (sample.frame.point - frame.point).norm();
        sample.jet.spreads_faster(-CARRIED_DRAWN / off)
    };
    if jets.iter().any(|jet| good(jet.2)) {
        jets.retain(|jet| good(jet.2));
    }
    sort_by_number(&mut jets, |jet| -jet.0);
    let mut groups: Vec<Group<D>> = Vec::new();
    for (weight, jet, sample, source) in jets {
        let taking = groups
            .iter()
            .position(|group| group.takes(&jet, source, spacing));
        if let Some(taking) = taking {
            groups[taking].add(&jet, weight);
        } else if groups.len() < MOST_BRANCHES {
            let mut group = Group {
                first: jet,
                source,
                surface_error: sample.surface_error,
                weight: 0.0,
                distance: 0.0,
                squares: 0.0,
                gradient: Vector::zeros(),
                shape: Matrix::zeros(),
            };
            group.add(&jet, weight);
            groups.push(group);
        }
    }
    let mut branches: Vec<Branch<D>> = groups.iter().map(Group::branch).collect();
    for (source, start, index) in sources {
        let length = source.log(&frame.point, ON_SURFACE).norm();
        if length > NODE_AT_SOURCE * spacing {
            continue;
        }
        branches.retain(|b| {
            b.source != index || (b.jet.distance - start - length).abs() > SAME_DISTANCE * spacing
        });
        let here = Jet {
            distance: start + length,
            gradient: axis(0),
            shape: Matrix::zeros(),
        };
        branches.push(Branch {
            jet: Jet::of_point(source, start, frame).unwrap_or(here),
            source: index,
            error: length * (length * source.curvature()).powi(4) / 24.0,
            at_source: true,
        });
    }
    sort_by_number(&mut branches, |branch| branch.jet.distance);
    if let Some(least) = branches.first().map(|b| b.jet.distance) {
        branches.retain(|b| b.jet.distance <= least + 2.0 * spacing);
    }
    branches
}
