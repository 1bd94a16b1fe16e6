//! From jets on rays to jets at the nodes of the graph: jets of one branch (one way round) are
//! averaged, and those of other branches are kept apart.

use crate::Vector;
use crate::field::plane::norm;
use crate::field::rays::fan::Sample;
use crate::field::rays::frame::{Frame, ON_SURFACE};
use crate::field::rays::jet::{Heading, Jet};
use crate::field::rays::piece::Piece;
use crate::order::sort_by_number;

/// A way by which a distance may reach the neighbourhood of a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Branch {
    /// The jet of the distance, in the node's frame.
    pub jet: Jet,
    /// The index of the source that the way comes from.
    pub source: u32,
    /// Estimated error of the distance at the node, in the input's units.
    pub error: f64,
    /// By how much the node's branches miss the distances of the node's neighbours, in the input's
    /// units.
    pub missed: f64,
    /// Estimated error of the angle at the source, in radians.
    pub angle_error: f64,
    /// How much shorter than another branch this one must be to be believed, in the input's units,
    /// because it rests on jets that are far away.
    pub doubt: f64,
    /// The piece of the source that distances are measured from directly, if the source is near by.
    pub piece: Option<u32>,
    /// Whether no ray came by, so that the branch was carried on along the graph.
    pub carried: bool,
}

impl Branch {
    /// Whether the rays draw together within a few spacings of the graph's nodes.
    pub fn is_focused(&self, spacing: f64) -> bool {
        self.jet.curvature * spacing < -FOCUSED_RAYS
    }

    /// The distance by which branches are compared.
    pub fn believed(&self) -> f64 {
        self.jet.distance + self.doubt
    }
}

/// Rays are focused where they meet within the spacing divided by this; jets of neighbouring nodes
/// are then looked at too.
pub(crate) const FOCUSED_RAYS: f64 = 0.3;
/// Largest distance of a jet that a node takes into account, in spacings of the graph's nodes.
pub(crate) const JET_REACH: f64 = 1.6;
/// Least cosine between the directions of jets of one branch.
pub(crate) const SAME_DIRECTION: f64 = 0.98;
/// Largest difference between the distances of jets of one branch, in spacings of the graph's
/// nodes.
pub(crate) const SAME_DISTANCE: f64 = 0.1;
/// Width below which the rays of one kind are not kept apart from those of other kinds, in spacings
/// of the graph's nodes.
const NARROW: f64 = 1.0;
/// Distance, in spacings of the graph's nodes, that keeps the weight of near jets finite: a jet
/// weighs (r^2 + (WEIGHT_FLOOR spacings)^2)^-2.
pub(crate) const WEIGHT_FLOOR: f64 = 0.1;
/// Most branches that a node keeps.
pub(crate) const MOST_BRANCHES: usize = 4;
/// Largest distance from a point source, in spacings of the graph's nodes, at which a node measures
/// from the source itself.
pub(crate) const NODE_AT_SOURCE: f64 = 0.75;
/// Largest distance from a curve, in spacings of the graph's nodes, at which a node measures from
/// pieces of the curve.
const AT_CURVE: f64 = 1.25;
/// Largest distance of the pieces of a curve that a node near the curve holds, in spacings of the
/// graph's nodes. Every point whose nearest node this is has its nearest piece among them.
const PIECES_AROUND: f64 = 1.7;
/// How far beyond the last ray of a kind, on the side without rays of its kind, jets are still
/// known, in spacings of the graph's nodes.
pub(crate) const BEYOND: f64 = 0.01;

/// The weighted sums of the jets of one branch, which are being averaged.
struct Group {
    /// The first jet, from which differences are taken.
    first: Jet,
    source: u32,
    surface_error: f64,
    /// The doubt of the first jet of the group, in the input's units.
    doubt: f64,
    weight: f64,
    /// Sum of weight times the distance less that of the first jet.
    distance: f64,
    /// Sum of weight times the square of the distance less that of the first jet.
    squares: f64,
    gradient: [f64; 2],
    curvature: f64,
    curvature_rate: f64,
    curvature_rate_error: f64,
    step_error: f64,
    angle: f64,
    angle_squares: f64,
    turn: f64,
    turn_rate: f64,
}

impl Group {
    /// Whether a jet belongs to the same branch as this group.
    fn takes(&self, jet: &Jet, source: u32, spacing: f64) -> bool {
        let (a, b) = (self.first.gradient, jet.gradient);
        self.source == source
            && (self.first.heading.range == jet.heading.range
                || (is_narrow(&self.first, spacing) && is_narrow(jet, spacing)))
            && self.first.heading.is_diffracted() == jet.heading.is_diffracted()
            && a[0] * b[0] + a[1] * b[1] >= SAME_DIRECTION
            && (jet.distance - self.first.distance).abs() <= SAME_DISTANCE * spacing
    }

    /// Adds a jet with its weight to the sums.
    fn add(&mut self, jet: &Jet, surface_error: f64, weight: f64) {
        self.surface_error = self.surface_error.max(surface_error);
        let more = jet.distance - self.first.distance;
        self.weight += weight;
        self.distance += weight * more;
        self.squares += weight * more * more;
        self.gradient[0] += weight * jet.gradient[0];
        self.gradient[1] += weight * jet.gradient[1];
        self.curvature += weight * jet.curvature;
        self.curvature_rate += weight * jet.curvature_rate;
        self.curvature_rate_error += weight * jet.curvature_rate_error;
        self.step_error += weight * jet.step_error;
        let turned = self.first.heading.turned_to(&jet.heading);
        self.angle += weight * turned;
        self.angle_squares += weight * turned * turned;
        self.turn += weight * jet.heading.turn;
        self.turn_rate += weight * jet.heading.turn_rate;
    }

    /// The branch that the averaged jets make. Its error is the scatter of their distances, the
    /// error of carrying them, and the surface's error.
    fn branch(&self, spacing: f64) -> Branch {
        let inverse = self.weight.recip();
        let mean = self.distance * inverse;
        let length = norm(self.gradient);
        let turned = self.angle * inverse;
        let heading = Heading {
            angle: self.first.heading.angle + turned,
            turn: self.turn * inverse,
            turn_rate: self.turn_rate * inverse,
            range: self.first.heading.range,
        };
        Branch {
            jet: Jet {
                distance: self.first.distance + mean,
                gradient: self.gradient.map(|g| g / length),
                curvature: self.curvature * inverse,
                curvature_rate: self.curvature_rate * inverse,
                curvature_rate_error: self.curvature_rate_error * inverse,
                width: [heading.even(spacing); 2],
                step_error: self.step_error * inverse,
                heading,
            },
            source: self.source,
            missed: 0.0,
            angle_error: (self.angle_squares * inverse - turned * turned)
                .max(0.0)
                .sqrt(),
            error: (self.squares * inverse - mean * mean).max(0.0).sqrt()
                + self.step_error * inverse
                + self.surface_error,
            doubt: self.doubt + self.step_error * inverse,
            piece: None,
            carried: false,
        }
    }
}

/// The branches at a node with a frame, the shortest to be believed first, from the jets near it
/// and the pieces of sources beside it. `admits` tells whether a jet that was carried here may be
/// believed.
pub(crate) fn branches<'a, const D: usize>(
    frame: &Frame<D>,
    spacing: f64,
    doubt_far: f64,
    near: impl Iterator<Item = (&'a Sample<D>, u32)>,
    admits: impl Fn(&Jet, u32) -> bool,
    pieces: impl Iterator<Item = (&'a Piece<D>, u32)>,
) -> Vec<Branch> {
    let reach = JET_REACH * spacing;
    let mut jets: Vec<(f64, f64, Jet, &Sample<D>, u32)> = near
        .filter_map(|(sample, source)| {
            let squared = (sample.frame.point - frame.point).norm_squared();
            let jet = (squared <= reach * reach)
                .then(|| sample.jet.carried(&sample.frame, frame))
                .flatten()
                .filter(|jet| admits(jet, source))?;
            let least = WEIGHT_FLOOR * spacing;
            let weight =
                (squared / (spacing * spacing) + least * least / (spacing * spacing)).powi(-2);
            let doubt = sample.doubt + doubt_far * squared / spacing;
            Some((weight, doubt, jet, sample, source))
        })
        .collect();
    // The front of a curve of many short segments curves as the directions of the rays of all
    // segments together say.
    let fronts: Vec<(f64, Vector<D>, Vector<D>)> = jets
        .iter()
        .filter(|jet| is_narrow(&jet.2, spacing))
        .map(|jet| (jet.2.distance, jet.3.frame.point, jet.3.frame.tangents[0]))
        .collect();
    // Beyond the last ray of one kind there are rays of another kind, unless a rim of the surface
    // is in the way.
    let is_beside = |jet: &Jet| jet.heading.beyond() <= BEYOND * spacing;
    if jets.iter().any(|jet| is_beside(&jet.2)) {
        jets.retain(|jet| is_beside(&jet.2));
    }
    // Straight rays come first, because there may be many rays that came round a rough rim.
    sort_by_number(&mut jets, |jet| -jet.0);
    sort_by_number(&mut jets, |jet| f64::from(jet.2.heading.is_diffracted()));
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
                surface_error: 0.0,
                doubt,
                weight: 0.0,
                distance: 0.0,
                squares: 0.0,
                gradient: [0.0; 2],
                curvature: 0.0,
                curvature_rate: 0.0,
                curvature_rate_error: 0.0,
                step_error: 0.0,
                angle: 0.0,
                angle_squares: 0.0,
                turn: 0.0,
                turn_rate: 0.0,
            });
        }
        if let Some(group) = group {
            groups[group].add(&jet, sample.surface_error, weight);
        }
    }
    let of_group = |group: &Group| {
        let mut branch = group.branch(spacing);
        let narrow = is_narrow(&group.first, spacing);
        let of_curve = narrow.then(|| front_curvature(&fronts, &branch.jet, frame, spacing));
        if let Some(curvature) = of_curve.flatten() {
            branch.jet.heading.range = None;
            (branch.jet.curvature, branch.jet.curvature_rate) = (curvature, 0.0);
        }
        branch
    };
    let mut branches: Vec<Branch> = groups.iter().map(of_group).collect();
    add_pieces(&mut branches, &pieces.collect::<Vec<_>>(), frame, spacing);
    sort_by_number(&mut branches, Branch::believed);
    if let Some(least) = branches.first().map(|b| b.jet.distance) {
        branches.retain(|b| b.jet.distance <= least + 2.0 * spacing);
    }
    branches
}

/// Whether the rays of a jet's kind fill so narrow a strip that they are not kept apart from
/// others. Where rays draw together, their own jets know best.
fn is_narrow(jet: &Jet, spacing: f64) -> bool {
    jet.heading.width() < NARROW * spacing && jet.curvature * spacing > -FOCUSED_RAYS
}

/// The curvature of the front at a jet, by linear regression over the directions of the rays beside
/// it. Each ray comes with the distance that it says and a point on it. `None` where all points are
/// in one spot.
fn front_curvature<const D: usize>(
    fronts: &[(f64, Vector<D>, Vector<D>)],
    jet: &Jet,
    frame: &Frame<D>,
    spacing: f64,
) -> Option<f64> {
    let [a, b] = jet.gradient;
    let (mut turned, mut squares) = (0.0, 0.0);
    for (distance, point, ray) in fronts {
        let ([u, v], [x, y]) = (frame.coordinates(ray), frame.log(point, ON_SURFACE));
        let turn = (a * v - b * u).atan2(a * u + b * v);
        let is_same = (distance - jet.distance).abs() <= SAME_DISTANCE * spacing;
        if is_same && turn.cos() >= SAME_DIRECTION {
            // The place to the left of the jet where the ray meets the front.
            let left = a * y - b * x - (a * x + b * y) * turn;
            turned += left * turn;
            squares += left * left;
        }
    }
    (squares > spacing * spacing).then(|| turned / squares)
}

/// Adds the branches of pieces of sources near a node. They take the place of the branches that
/// rays from there bring.
fn add_pieces<const D: usize>(
    branches: &mut Vec<Branch>,
    pieces: &[(&Piece<D>, u32)],
    frame: &Frame<D>,
    spacing: f64,
) {
    let slack = SAME_DISTANCE * spacing;
    let length = |piece: &Piece<D>| piece.way(&frame.point, ON_SURFACE).length;
    let of_curve = pieces.iter().filter(|(piece, _)| !piece.is_point());
    let nearest = of_curve.map(|(piece, _)| length(piece)).reduce(f64::min);
    let is_at_curve = nearest.is_some_and(|nearest| nearest <= AT_CURVE * spacing);
    for (piece, index) in pieces {
        let way = piece.way(&frame.point, ON_SURFACE);
        let is_near = if piece.is_point() {
            way.length <= NODE_AT_SOURCE * spacing
        } else {
            is_at_curve && way.length <= PIECES_AROUND * spacing
        };
        if !is_near {
            continue;
        }
        branches.retain(|b| {
            let distance = b.jet.distance - piece.start;
            // All of a curve that is this near is among the near pieces: rays that say such a
            // distance come from its far side.
            let is_other = piece.is_point() || distance > PIECES_AROUND * spacing - slack;
            let is_same = (distance - way.length).abs() <= slack;
            b.source != piece.source || b.piece.is_some() || (is_other && !is_same)
        });
        branches.push(Branch {
            jet: piece.jet(frame),
            source: piece.source,
            error: piece.error(&way),
            missed: 0.0,
            angle_error: piece.error(&way) / way.length.max(f64::MIN_POSITIVE),
            doubt: 0.0,
            piece: Some(*index),
            carried: false,
        });
    }
}
