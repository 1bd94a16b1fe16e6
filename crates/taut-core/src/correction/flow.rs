//! The paper's own correction: geodesic curvature flow of a polyline, (5)-(10), with its node rules
//! (17)-(21). It is of second order in the spacing, and is kept to be compared with Newton's
//! method.
//!
//! What the paper leaves open is decided here:
//! - The time step of (9) starts at L^2, where the slowest mode of a straight path decays tenfold a
//!   step. A step that lengthens the path, or whose nodes are pulled back by more than half their
//!   way, is repeated with a quarter of the time step.
//! - (10) is solved directly: in coordinates normal to the curve, weighted by the nodes' shares of
//!   the length, its matrix is symmetric, positive definite and banded, so conjugate gradients save
//!   nothing.
//! - exp(-r) in (17) hides a length: distances are measured in mean loads sigma_i (1 /
//!   r_i + floor). C_ss is normal to the curve and so has no part along it, where nodes may move.
//!   It acts through the load, whose equilibrium is the sigma_i / r_i = Cst that (21) assumes. Only
//!   neighbours repel each other.
//! - An interval gets a new node where its sigma_i / r_i exceeds the Cst of (21) at the tolerance.
//! - A level (between insertions) ends when the decrease still to come, extrapolated geometrically,
//!   is a tenth of the tolerance. The whole ends when (20) is within the tolerance and two levels
//!   agree to it.

use crate::Vector;
use crate::correction::band::Band;
use crate::correction::curve::{Curve, Measure};
use crate::correction::newton::{Solved, Solver};
use crate::correction::{COARSE_SEGMENTS, Settings, Taut, finish, length};
use crate::result::{Path, Status};
use crate::surface::{Node, Surface};

/// Most steps of a level.
const MOST_FLOW_STEPS: usize = 200;
/// Most levels, between which nodes are inserted.
const MOST_FLOW_LEVELS: usize = 64;
/// Most times that a step is refused and repeated with a shorter time.
const MOST_REFUSALS: usize = 30;
/// Number of first steps of a level that also spread the nodes.
const SPREADING_STEPS: usize = 8;
/// Distance of two nodes, as a share of the intervals before and after, below which they have met.
const MET: f64 = 0.05;

/// A polyline that flows on a surface.
struct Flow<'a, const D: usize, S: Surface<D>> {
    surface: &'a S,
    solver: &'a mut Solver<D, S::Place>,
    nodes: Vec<Node<D, S::Place>>,
    /// At each interior node, the tangent directions normal to the curve.
    normals: Vec<[Vector<D>; D]>,
    band: Band,
    steps: usize,
}

/// How a level ended.
enum Outcome {
    /// The polyline is taut on its nodes; the number is the length that it would still lose.
    Taut(f64),
    /// The polyline is not taut after the most steps.
    Slow,
    /// The surface has no tangent space at a node, or no foot near enough.
    Lost,
}

/// Pulls a guess taut by the paper's scheme, as far as the tolerance and the number of nodes allow.
/// Each step is O(nodes), and a relative tolerance takes about turning / sqrt(24 tolerance) nodes.
///
/// The length is the sum of arcs in (20), and its error is at least (20) itself.
pub(crate) fn flow<const D: usize, S: Surface<D>>(
    surface: &S,
    guess: &[Node<D, S::Place>],
    settings: &Settings,
    solver: &mut Solver<D, S::Place>,
) -> Path<D> {
    let mut flow = Flow {
        surface,
        nodes: Vec::new(),
        normals: Vec::new(),
        band: Band::default(),
        steps: 0,
        solver,
    };
    flow.start(guess);
    if flow.chords().iter().sum::<f64>() == 0.0 {
        return flow.finish(Status::Converged, 0.0);
    }
    let mut before = f64::INFINITY;
    for _ in 0..MOST_FLOW_LEVELS {
        let left = match flow.level(settings.tolerance) {
            Outcome::Taut(left) => left,
            Outcome::Slow => return flow.finish(Status::NotTaut, f64::INFINITY),
            Outcome::Lost => return flow.finish(Status::OffSurface, f64::INFINITY),
        };
        let (chords, arcs) = (flow.chords(), flow.arcs());
        let length: f64 = arcs.iter().sum();
        let excess = length - chords.iter().sum::<f64>(); // (20)
        let disagreement = (length - before).abs();
        let error = (excess.max(disagreement) + left) / length;
        if error <= settings.tolerance {
            return flow.finish(Status::Converged, error);
        }
        let marked = flow.marked(&chords, settings.tolerance);
        let added = marked.iter().filter(|marked| **marked).count();
        if flow.nodes.len() + added > settings.most_nodes {
            return flow.finish(Status::NotResolved, error);
        }
        flow.insert(&marked);
        before = length;
    }
    flow.finish(Status::NotResolved, f64::INFINITY)
}

/// The lengths of a polyline's segments.
fn chords<const D: usize, P>(nodes: &[Node<D, P>]) -> Vec<f64> {
    nodes
        .windows(2)
        .map(|pair| (pair[1].point - pair[0].point).norm())
        .collect()
}

impl<const D: usize, S: Surface<D>> Flow<'_, D, S> {
    fn chords(&self) -> Vec<f64> {
        chords(&self.nodes)
    }

    /// Takes the guess's nodes, pulled onto the surface by (12) or (13) and without those that
    /// coincide, and inserts more between them until there are enough.
    fn start(&mut self, guess: &[Node<D, S::Place>]) {
        let total: f64 = chords(guess).iter().sum();
        let (first, last) = (guess[0], guess[guess.len() - 1]);
        self.nodes.push(first);
        for node in &guess[1..guess.len() - 1] {
            let mut node = *node;
            let foot = self
                .surface
                .foot(&node.point, &mut node.place, &mut self.solver.scratch);
            if let Some(point) = foot {
                node.point = point;
                let apart = |other: &Node<D, S::Place>| (other.point - point).norm() > 1e-9 * total;
                if self.nodes.last().is_none_or(apart) && apart(&last) {
                    self.nodes.push(node);
                }
            }
        }
        self.nodes.push(last);
        while total > 0.0 && self.nodes.len() <= COARSE_SEGMENTS {
            let count = self.nodes.len();
            self.insert(&vec![true; count - 1]);
            if self.nodes.len() == count {
                break;
            }
        }
    }

    /// C_ss at the interior nodes, from the triangle of the two unit chords that meet there,
    /// (7)-(8).
    fn second_derivatives(&self) -> Vec<Vector<D>> {
        let chords = self.chords();
        (1..self.nodes.len() - 1)
            .map(|i| {
                let ahead = (self.nodes[i + 1].point - self.nodes[i].point) / chords[i];
                let behind = (self.nodes[i].point - self.nodes[i - 1].point) / chords[i - 1];
                (ahead - behind) * (2.0 / (chords[i - 1] + chords[i]))
            })
            .collect()
    }

    /// 1 / r_i of each segment: the mean of |C_ss| at its ends.
    fn curvatures(&self) -> Vec<f64> {
        let inner: Vec<f64> = self.second_derivatives().iter().map(|c| c.norm()).collect();
        let at = |i: usize| match inner.len() {
            0 => 0.0,
            count => inner[i.clamp(1, count) - 1],
        };
        (0..self.nodes.len() - 1)
            .map(|i| 0.5 * (at(i) + at(i + 1)))
            .collect()
    }

    /// The arcs of (19) over the segments; their sum less that of the chords is (20).
    fn arcs(&self) -> Vec<f64> {
        let chords = self.chords();
        let pairs = chords.iter().zip(self.curvatures());
        pairs
            .map(|(chord, curvature)| length::arc(*chord, curvature))
            .collect()
    }

    /// Flows on a fixed number of nodes until the polyline is taut.
    fn level(&mut self, tolerance: f64) -> Outcome {
        let mut length: f64 = self.chords().iter().sum();
        let mut time = length * length;
        let mut last = f64::INFINITY;
        for step in 0..MOST_FLOW_STEPS {
            if self.nodes.len() < 3 || self.surface.intrinsic_dimension() == 1 {
                return Outcome::Taut(0.0);
            }
            if step < SPREADING_STEPS {
                self.part();
                self.spread();
                length = self.chords().iter().sum();
            }
            if !self.find_normals() {
                return Outcome::Lost;
            }
            self.steps += 1;
            let size = self.nodes.iter().fold(length, |a, n| a.max(n.point.amax()));
            let rounding = f64::EPSILON * size * self.nodes.len() as f64;
            let mut accepted = None;
            // A step that lengthens the path is refused and repeated with a shorter time.
            for _ in 0..MOST_REFUSALS {
                accepted = self
                    .stepped(time)
                    .filter(|(_, new)| *new <= length + rounding);
                if accepted.is_some() {
                    break;
                }
                time *= 0.25;
            }
            let Some((nodes, new)) = accepted else {
                return Outcome::Lost;
            };
            self.nodes = nodes;
            let decrease = length - new;
            length = new;
            time = (2.0 * time).min(length * length);
            if step >= SPREADING_STEPS {
                let ratio = decrease / last;
                let left = decrease * ratio / (1.0 - ratio);
                if decrease <= rounding || (ratio < 1.0 && left <= 0.1 * tolerance * length) {
                    return Outcome::Taut(left.max(0.0));
                }
            }
            last = decrease;
        }
        Outcome::Slow
    }

    /// Finds the tangent directions normal to the curve, k - 1 at every interior node, in which the
    /// geodesic curvature vector (6) lies.
    fn find_normals(&mut self) -> bool {
        let k = self.surface.intrinsic_dimension();
        let mut all = Vec::with_capacity(self.nodes.len() - 2);
        for nodes in self.nodes.windows(3) {
            let scratch = &mut self.solver.scratch;
            if !self
                .surface
                .geometry(&nodes[1].point, nodes[1].place, scratch)
            {
                return false;
            }
            let along = scratch
                .project(&(nodes[2].point - nodes[0].point))
                .normalize();
            // These are all tangents but the one nearest to the curve's, orthonormalised by Gram
            // and Schmidt.
            let mut order: [usize; D] = std::array::from_fn(|j| j);
            let alignment = |j: &usize| scratch.tangent(*j).dot(&along).abs();
            order[..k].sort_by(|a, b| alignment(a).total_cmp(&alignment(b)));
            let mut normals = [Vector::<D>::zeros(); D];
            for j in 0..k - 1 {
                let mut normal = scratch.tangent(order[j]);
                normal -= along * along.dot(&normal);
                for other in &normals[..j] {
                    normal -= other * other.dot(&normal);
                }
                normals[j] = normal.normalize();
            }
            all.push(normals);
        }
        self.normals = all;
        true
    }

    /// A step of (5) by backward Euler (9), (I - dt P A) X' = X (10), followed by (12) or (13) at
    /// every node. Returns the nodes and the sum of their chords.
    ///
    /// The motion X' - X is along the geodesic curvature vectors, N u with N normal to the curve
    /// and tangent to the surface. Multiplied by the nodes' shares (sigma_{i-1} + sigma_i) / 2 of
    /// the length, the system for u is symmetric. Motion along the curve is left out: it would let
    /// nodes cluster, which shortens chords.
    fn stepped(&mut self, time: f64) -> Option<(Vec<Node<D, S::Place>>, f64)> {
        let directions = self.surface.intrinsic_dimension() - 1;
        let chords = self.chords();
        let forces = self.second_derivatives();
        let interior = forces.len();
        let mut motion = vec![0.0; interior * directions];
        self.band
            .reset(interior * directions, 2.min(interior) * directions - 1);
        for i in 0..interior {
            let share = 0.5 * (chords[i] + chords[i + 1]);
            let stiffness = 1.0 / chords[i] + 1.0 / chords[i + 1];
            for a in 0..directions {
                let normal = &self.normals[i][a];
                motion[i * directions + a] = time * share * normal.dot(&forces[i]);
                self.band.add(
                    i * directions + a,
                    i * directions + a,
                    share + time * stiffness,
                );
                for b in (0..directions).filter(|_| i > 0) {
                    let coupling = normal.dot(&self.normals[i - 1][b]);
                    self.band.add(
                        i * directions + a,
                        (i - 1) * directions + b,
                        -time * coupling / chords[i],
                    );
                }
            }
        }
        if self.band.factor() != Some(0) {
            return None;
        }
        self.band.solve(&mut motion);
        let mut nodes = self.nodes.clone();
        for (i, node) in nodes[1..=interior].iter_mut().enumerate() {
            let shift = (0..directions).fold(Vector::zeros(), |sum: Vector<D>, a| {
                sum + self.normals[i][a] * motion[i * directions + a]
            });
            let target = node.point + shift;
            let foot = self
                .surface
                .foot(&target, &mut node.place, &mut self.solver.scratch)?;
            // A step that must be pulled back by more than half its way is too long.
            let rounding = 64.0 * f64::EPSILON * target.amax();
            if (foot - target).norm() > 0.5 * shift.norm() + rounding {
                return None;
            }
            node.point = foot;
        }
        let length = self::chords(&nodes).iter().sum();
        Some((nodes, length))
    }

    /// Drops nodes that met: a zigzag that is flattened across the path leaves pairs that nothing
    /// would part.
    fn part(&mut self) {
        let chords = self.chords();
        let last = chords.len() - 1;
        let short = |c: usize| {
            let before = if c > 0 { chords[c - 1] } else { f64::INFINITY };
            let after = if c < last {
                chords[c + 1]
            } else {
                f64::INFINITY
            };
            chords[c] < MET * before.min(after)
        };
        let mut kept = vec![self.nodes[0]];
        for i in 1..=last {
            if !(short(i - 1) || i == last && short(last)) {
                kept.push(self.nodes[i]);
            }
        }
        kept.push(self.nodes[last + 1]);
        self.nodes = kept;
    }

    /// One step of the repulsion (17)-(18) along the curve, followed by (12) or (13). No node moves
    /// by more than half an interval, so none passes another.
    fn spread(&mut self) {
        let chords = self.chords();
        let curvatures = self.curvatures();
        let turning: f64 = chords.iter().zip(&curvatures).map(|(s, c)| s * c).sum();
        let floor = (0.5 * turning).max(1.0) / chords.iter().sum::<f64>();
        let loads: Vec<f64> = chords
            .iter()
            .zip(&curvatures)
            .map(|(chord, curvature)| chord * (curvature + floor))
            .collect();
        let mean = loads.iter().sum::<f64>() / loads.len() as f64;
        let old = self.nodes.clone();
        for i in 1..old.len() - 1 {
            let push = (-loads[i - 1] / mean).exp() - (-loads[i] / mean).exp();
            let way = 0.5 * chords[i - 1].min(chords[i]) * push;
            let towards = if way > 0.0 { i } else { i - 1 };
            let direction = (old[towards + 1].point - old[towards].point) / chords[towards];
            let mut node = old[i];
            let moved = node.point + direction * way;
            let scratch = &mut self.solver.scratch;
            if let Some(point) = self.surface.foot(&moved, &mut node.place, scratch) {
                node.point = point;
                self.nodes[i] = node;
            }
        }
    }

    /// Marks the intervals that (21) finds too long for the tolerance, Cst^2 / 24 to leading order.
    /// If none is too long, all are marked, so that the next level shows what this one missed.
    fn marked(&self, chords: &[f64], tolerance: f64) -> Vec<bool> {
        let longest = (24.0 * tolerance).sqrt();
        let turnings = chords.iter().zip(self.curvatures());
        let marked: Vec<bool> = turnings.map(|(s, c)| s * c > longest).collect();
        if marked.contains(&true) {
            marked
        } else {
            vec![true; chords.len()]
        }
    }

    /// Halves the marked intervals; an interval whose middle has no foot stays.
    fn insert(&mut self, marked: &[bool]) {
        let mut nodes = vec![self.nodes[0]];
        for (pair, marked) in self.nodes.windows(2).zip(marked) {
            if *marked {
                let middle = (pair[0].point + pair[1].point) * 0.5;
                let mut place = pair[0].place;
                let scratch = &mut self.solver.scratch;
                if let Some(point) = self.surface.foot(&middle, &mut place, scratch) {
                    nodes.push(Node { point, place });
                }
            }
            nodes.push(pair[1]);
        }
        self.nodes = nodes;
    }

    /// The finished path, with the stability that Newton's matrix finds at its nodes.
    fn finish(mut self, status: Status, error: f64) -> Path<D> {
        let arcs = self.arcs();
        let chords = self.chords();
        let chord_sum: f64 = chords.iter().sum();
        let length: f64 = arcs.iter().sum();
        let shares = chords
            .iter()
            .map(|s| if chord_sum > 0.0 { s / chord_sum } else { 1.0 });
        let curve = Curve {
            degree: 1,
            spans: shares.collect(),
            nodes: std::mem::take(&mut self.nodes),
        };
        let index = self
            .solver
            .solve(self.surface, &mut curve.clone(), f64::INFINITY, 1)
            .and_then(|level| level.index);
        let level = Solved {
            converged: status == Status::Converged,
            measure: Measure {
                energy: 0.5 * chord_sum * chord_sum,
                length,
            },
            left: 0.0,
            index,
            steps: self.steps,
        };
        let taut = Taut {
            curve,
            level,
            steps: self.steps,
        };
        let mut path = finish(self.surface, taut, status, error, self.solver);
        path.arc_length = vec![0.0];
        for arc in arcs {
            let start = path.arc_length[path.arc_length.len() - 1];
            path.arc_length.push(start + arc);
        }
        path
    }
}

#[cfg(test)]
mod tests;
