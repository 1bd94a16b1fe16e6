//! From jets on rays to jets at the nodes of the graph: those of one branch are averaged, those of others
//! kept apart.

use crate::field::fan::Sample;
use crate::field::frame::{Frame, ON_SURFACE};
use crate::field::jet::{Heading, Jet, norm, turned_by};

/// A way in which a distance may reach the neighbourhood of a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Branch {
    /// In the node's frame.
    pub jet: Jet,
    pub source: u32,
    /// Estimated error of the distance.
    pub error: f64,
    /// Estimated error of the angle at the source.
    pub angle_error: f64,
    /// How much shorter than another branch it must be to be believed, for it rests on jets far away.
    pub doubt: f64,
    /// So near the source that distances are measured from there.
    pub at_source: bool,
    /// No ray came by: carried on along the graph.
    pub carried: bool,
}

impl Branch {
    /// What branches are compared by.
    pub fn believed(&self) -> f64 {
        self.jet.distance + self.doubt
    }
}

/// Jets farther away than this many spacings are not looked at.
pub(crate) const REACH: f64 = 1.6;
/// Cosine between directions of one branch, and its distances' largest difference in spacings.
pub(crate) const SAME_DIRECTION: f64 = 0.98;
pub(crate) const SAME_DISTANCE: f64 = 0.1;
/// Jets weigh (r^2 + (NEAREST spacings)^2)^-2.
pub(crate) const NEAREST: f64 = 0.1;
pub(crate) const MOST_BRANCHES: usize = 4;
/// Nodes this near the source, in spacings, measure from there.
pub(crate) const AT_SOURCE: f64 = 0.75;

/// Jets of one branch being averaged.
struct Group {
    first: Jet,
    source: u32,
    surface_error: f64,
    doubt: f64,
    weight: f64,
    /// Sums of weight times the value less the first's.
    distance: f64,
    squares: f64,
    gradient: [f64; 2],
    curvature: f64,
    change: f64,
    angle: f64,
    angle_squares: f64,
    turn: f64,
    bow: f64,
}

impl Group {
    fn takes(&self, jet: &Jet, source: u32, spacing: f64) -> bool {
        let (a, b) = (self.first.gradient, jet.gradient);
        self.source == source
            && self.first.heading.is_bent() == jet.heading.is_bent()
            && a[0] * b[0] + a[1] * b[1] >= SAME_DIRECTION
            && (jet.distance - self.first.distance).abs() <= SAME_DISTANCE * spacing
    }

    fn add(&mut self, jet: &Jet, weight: f64) {
        let more = jet.distance - self.first.distance;
        self.weight += weight;
        self.distance += weight * more;
        self.squares += weight * more * more;
        self.gradient[0] += weight * jet.gradient[0];
        self.gradient[1] += weight * jet.gradient[1];
        self.curvature += weight * jet.curvature;
        self.change += weight * jet.change;
        let turned = turned_by(self.first.heading.angle, jet.heading.angle);
        self.angle += weight * turned;
        self.angle_squares += weight * turned * turned;
        self.turn += weight * jet.heading.turn;
        self.bow += weight * jet.heading.bow;
    }

    fn branch(&self) -> Branch {
        let inverse = self.weight.recip();
        let mean = self.distance * inverse;
        let length = norm(self.gradient);
        let turned = self.angle * inverse;
        Branch {
            jet: Jet {
                distance: self.first.distance + mean,
                gradient: self.gradient.map(|g| g / length),
                curvature: self.curvature * inverse,
                change: self.change * inverse,
                heading: Heading {
                    angle: self.first.heading.angle + turned,
                    turn: self.turn * inverse,
                    bow: self.bow * inverse,
                },
            },
            source: self.source,
            angle_error: (self.angle_squares * inverse - turned * turned)
                .max(0.0)
                .sqrt(),
            error: (self.squares * inverse - mean * mean).max(0.0).sqrt() + self.surface_error,
            doubt: self.doubt,
            at_source: false,
            carried: false,
        }
    }
}

/// The branches at a node with a frame, least distance first, of the jets near it and of sources beside it.
pub(crate) fn branches<'a, const D: usize>(
    frame: &Frame<D>,
    spacing: f64,
    doubt_far: f64,
    near: impl Iterator<Item = (&'a Sample<D>, u32)>,
    sources: impl Iterator<Item = (&'a Frame<D>, f64, u32)>,
) -> Vec<Branch> {
    let reach = REACH * spacing;
    let mut jets: Vec<(f64, f64, Jet, &Sample<D>, u32)> = near
        .filter_map(|(sample, source)| {
            let squared = (sample.frame.point - frame.point).norm_squared();
            let jet = (squared <= reach * reach)
                .then(|| sample.jet.carried(&sample.frame, frame))
                .flatten()?;
            let least = NEAREST * spacing;
            let weight =
                (squared / (spacing * spacing) + least * least / (spacing * spacing)).powi(-2);
            let doubt = sample.doubt + doubt_far * squared / spacing;
            Some((weight, doubt, jet, sample, source))
        })
        .collect();
    // Straight rays first: there may be many that came round a rough rim.
    jets.sort_by(|a, b| {
        let bent = |jet: &Jet| jet.heading.is_bent();
        bent(&a.2).cmp(&bent(&b.2)).then(b.0.total_cmp(&a.0))
    });
    let mut groups: Vec<Group> = Vec::new();
    for (weight, doubt, jet, sample, source) in jets {
        let mut group = groups
            .iter()
            .position(|group| group.takes(&jet, source, spacing));
        if group.is_none() && groups.len() < MOST_BRANCHES {
            group = Some(groups.len());
            groups.push(Group {
                first: jet,
                source,
                surface_error: sample.surface_error,
                doubt,
                weight: 0.0,
                distance: 0.0,
                squares: 0.0,
                gradient: [0.0; 2],
                curvature: 0.0,
                change: 0.0,
                angle: 0.0,
                angle_squares: 0.0,
                turn: 0.0,
                bow: 0.0,
            });
        }
        if let Some(group) = group {
            groups[group].add(&jet, weight);
        }
    }
    let mut branches: Vec<Branch> = groups.iter().map(Group::branch).collect();
    for (source, start, index) in sources {
        let length = norm(source.log(&frame.point, ON_SURFACE));
        if length > AT_SOURCE * spacing {
            continue;
        }
        branches.retain(|b| {
            b.source != index || (b.jet.distance - start - length).abs() > SAME_DISTANCE * spacing
        });
        let here = Jet {
            distance: start + length,
            gradient: [1.0, 0.0],
            curvature: 0.0,
            change: 0.0,
            heading: Heading::default(),
        };
        branches.push(Branch {
            jet: Jet::of_point(source, start, frame).unwrap_or(here),
            source: index,
            error: source.log_error(length),
            angle_error: source.log_error(length) / length.max(f64::MIN_POSITIVE),
            doubt: 0.0,
            at_source: true,
            carried: false,
        });
    }
    branches.sort_by(|a, b| a.believed().total_cmp(&b.believed()));
    if let Some(least) = branches.first().map(|b| b.jet.distance) {
        branches.retain(|b| b.jet.distance <= least + 2.0 * spacing);
    }
    branches
}
