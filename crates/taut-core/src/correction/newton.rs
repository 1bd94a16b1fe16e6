//! Newton's method for the energy of a path whose nodes stay on the surface.
//!
//! The Hessian on the surface couples the nodes of an element by T_i' K_ij T_j and adds <g_i, II>
//! to the diagonal, where g is the energy's gradient and II the second fundamental form. For degree
//! 1 this is the block-tridiagonal matrix of the flow (10), with the curvature term that makes
//! convergence quadratic. Levenberg's shift of the diagonal is a flow step of the size 1 / shift.

mod escape;
mod shift;

use crate::Vector;
use crate::correction::band::Band;
use crate::correction::curve::{Curve, Measure};
use crate::surface::{Geometry, Node, Surface};

/// How well a level (a path on fixed elements) was solved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solved {
    /// Whether the relative error of the length left by the last Newton step is below the level's
    /// tolerance.
    pub converged: bool,
    /// Energy and length of the path.
    pub measure: Measure,
    /// Estimated relative error of the length that the last step left.
    pub left: f64,
    /// The number of directions in which the path shortens at second order (the Morse index);
    /// `None` where the Hessian is singular to rounding, because the end points are conjugate.
    pub index: Option<usize>,
    /// Number of Newton steps taken.
    pub steps: usize,
}

/// Buffers of the solver, kept between levels.
pub(crate) struct Solver<const D: usize, P> {
    geometries: Vec<Geometry<D>>,
    tangents: Vec<[Vector<D>; D]>,
    pull: Vec<Vector<D>>,
    trial_pull: Vec<Vector<D>>,
    band: Band,
    base: Band,
    residual: Vec<f64>,
    step: Vec<f64>,
    masses: Vec<f64>,
    squared_speed: f64,
    trial: Vec<Node<D, P>>,
    /// Whether the geometries are those at the nodes of the path last solved.
    is_current: bool,
    pub scratch: Geometry<D>,
}

/// Stiffness of a rim (the boundary of the surface), in units of L^2 / resolution^2. With it, a
/// path round a hole of a few spacings sinks into the rim by less than a twentieth of a chart's
/// radius.
const RIM_STIFFNESS: f64 = 40.0;
/// Most shifts that are tried for one step.
const MOST_SHIFTS: usize = 24;
/// Relative change of the length below which Newton's last step is not taken. A larger step is
/// taken even within the tolerance, because it betters the guess for what follows.
const NOT_WORTH_A_STEP: f64 = 1e-10;
/// Longest step of a node on a cloud, in radii of its chart, so that no node leaps over a hole.
const LONGEST_NODE_STEP: f64 = 0.6;

impl<const D: usize, P: Copy + Send + Sync + std::fmt::Debug> Solver<D, P> {
    pub fn new(codimension: usize) -> Self {
        Self {
            geometries: Vec::new(),
            tangents: Vec::new(),
            pull: Vec::new(),
            trial_pull: Vec::new(),
            band: Band::default(),
            base: Band::default(),
            residual: Vec::new(),
            step: Vec::new(),
            masses: Vec::new(),
            squared_speed: 0.0,
            trial: Vec::new(),
            is_current: false,
            scratch: Geometry::new(codimension),
        }
    }

    /// Pulls the path taut on its present elements, in at most `most_steps` steps. It ends when
    /// Newton's step leaves a relative error of the length below `tolerance`, or when the step
    /// would itself change the length by less than that and than is worth a step.
    ///
    /// `None` where the surface has no tangent space at a node.
    pub fn solve<S: Surface<D, Place = P>>(
        &mut self,
        surface: &S,
        curve: &mut Curve<D, P>,
        tolerance: f64,
        most_steps: usize,
    ) -> Option<Solved> {
        self.is_current = false;
        let mut measure = curve.measure(&mut self.pull);
        let mut level = Solved {
            converged: false,
            measure,
            left: f64::INFINITY,
            index: None,
            steps: 0,
        };
        if curve.nodes.len() < 3 || measure.energy == 0.0 {
            level.converged = true;
            level.left = 0.0;
            level.index = Some(0);
            return Some(level);
        }
        self.weigh(curve);
        let k = surface.intrinsic_dimension();
        let mut shift = 0.0;
        let least_shift = shift::least_shift(tolerance);
        let mut last_change = None;
        // Each round makes one step, with the first shift of the Hessian that gives one of use.
        while level.steps < most_steps {
            let rim = self.assemble(surface, curve, measure)?;
            let penalised = measure.energy + rim;
            let mut accepted = None;
            for _ in 0..MOST_SHIFTS {
                let index = self.factor(shift);
                let mut moved = f64::INFINITY;
                if shift == 0.0 {
                    level.index = index;
                }
                if index == Some(0) {
                    let decrement = self.newton_step();
                    let change = 0.5 * decrement / measure.energy;
                    if shift == 0.0 && rim == 0.0 && change < tolerance.min(NOT_WORTH_A_STEP) {
                        (level.converged, level.left) = (true, change);
                        self.is_current = true;
                        return Some(level);
                    }
                    if shift == least_shift && rim == 0.0 {
                        let singular = level.index != Some(0);
                        let left = shift::left_by_regularised(change, shift, singular);
                        if left < shift::most_left(tolerance) {
                            (level.converged, level.left) = (true, left);
                            level.index = level.index.filter(|_| !singular);
                            self.is_current = true;
                            return Some(level);
                        }
                    }
                    moved = self.longest_step(k) / measure.length;
                    let trusted = shift::is_trusted(shift, moved);
                    let attempt = trusted.then(|| self.attempt(surface, curve, measure));
                    if let Some((trial, energy)) = attempt.flatten() {
                        let rounding = 1e-14 * (curve.degree * curve.degree) as f64 * penalised;
                        let wanted = shift::least_decrease(shift, decrement);
                        if energy <= penalised - wanted + rounding {
                            accepted = Some((trial, change));
                            break;
                        }
                    }
                    if change < 1e-15 {
                        break;
                    }
                }
                shift = shift::next_shift(shift, least_shift, moved);
            }
            level.steps += 1;
            let Some((trial, change)) = accepted else {
                // No step lowers the energy. The path is as taut as rounding allows, if Newton's
                // last step says so.
                level.converged = level.left < tolerance;
                break;
            };
            std::mem::swap(&mut curve.nodes, &mut self.trial);
            measure = trial;
            std::mem::swap(&mut self.pull, &mut self.trial_pull);
            level.measure = measure;
            level.left = if shift == 0.0 || rim > 0.0 {
                shift::left_by(change, last_change, rim)
            } else {
                shift::left_by_regularised(change, shift, level.index != Some(0))
            };
            last_change = (shift == 0.0).then_some(change);
            if shift == 0.0 && level.left < tolerance {
                level.converged = true;
                break;
            }
            shift = if shift > 16.0 { shift / 16.0 } else { 0.0 };
        }
        Some(level)
    }

    /// The longest move of a node that the step asks for.
    fn longest_step(&self, k: usize) -> f64 {
        let squares = self
            .step
            .chunks(k)
            .map(|step| step.iter().map(|s| s * s).sum());
        squares.fold(0.0, f64::max).sqrt()
    }

    /// The Gauss curvature of a surface of dimension 2 at interior node `i` of the path last
    /// solved, as it was before the last step.
    pub fn gauss_curvature(&self, i: usize) -> f64 {
        let [first, both, last] = self.geometries[i - 1].second_fundamental_form();
        first.dot(&last) - both.norm_squared()
    }

    /// Prepares [`geodesic_curvature`](Self::geodesic_curvature) at the nodes of a curve.
    pub fn weigh_pulls(&mut self, curve: &Curve<D, P>) {
        self.squared_speed = 2.0 * curve.measure(&mut self.pull).energy;
        self.weigh(curve);
    }

    /// The geodesic curvature |P x''| / |x'|^2 at interior node `i`, from the energy's gradient;
    /// `scratch` holds the geometry there.
    pub fn geodesic_curvature(&self, i: usize) -> f64 {
        let residual = self.scratch.project(&self.pull[i]).norm();
        residual / self.masses[i] / self.squared_speed
    }

    /// Puts the geometry at a node of the path last solved into `scratch`, if it is known; it is
    /// known from the last step if this did not move the path.
    pub fn recall(&mut self, node: usize, nodes: usize) -> bool {
        let known = self.is_current && (1..nodes - 1).contains(&node);
        if known {
            std::mem::swap(&mut self.scratch, &mut self.geometries[node - 1]);
        }
        known
    }

    /// Finds each node's share of the parameter: the lumped mass matrix.
    fn weigh(&mut self, curve: &Curve<D, P>) {
        let reference = curve.element();
        self.masses.clear();
        self.masses.resize(curve.nodes.len(), 0.0);
        for (e, span) in curve.spans.iter().enumerate() {
            for (j, weight) in reference.weights.iter().enumerate() {
                self.masses[e * curve.degree + j] += 0.5 * span * weight;
            }
        }
    }

    /// Computes the residual and the Hessian at the present nodes; returns the rim's share of the
    /// energy.
    fn assemble<S: Surface<D, Place = P>>(
        &mut self,
        surface: &S,
        curve: &Curve<D, P>,
        measure: Measure,
    ) -> Option<f64> {
        let k = surface.intrinsic_dimension();
        let interior = curve.nodes.len() - 2;
        let codimension = D - k;
        self.geometries
            .resize_with(interior.max(self.geometries.len()), || {
                Geometry::new(codimension)
            });
        self.tangents.resize(interior, [Vector::zeros(); D]);
        self.residual.clear();
        self.residual.resize(interior * k, 0.0);
        self.step.resize(interior * k, 0.0);
        self.base
            .reset(interior * k, (curve.degree + 1).min(interior) * k - 1);
        let mut rim_energy = 0.0;
        for i in 0..interior {
            let node = &curve.nodes[i + 1];
            let geometry = &mut self.geometries[i];
            if !surface.geometry(&node.point, node.place, geometry) {
                return None;
            }
            let mut pull = self.pull[i + 1];
            let rim = surface.beyond_rim(&node.point, node.place);
            let stiffness = rim.map_or(0.0, |_| self.rim_stiffness(surface, node, measure, i + 1));
            if let Some((depth, gradient)) = rim {
                rim_energy += 0.5 * stiffness * depth * depth;
                pull += gradient * (stiffness * depth);
            }
            // The force of the rim acts through the second fundamental form, too.
            let form = self.geometries[i].second_form(&pull);
            let tangents = &mut self.tangents[i];
            for (j, tangent) in tangents[..k].iter_mut().enumerate() {
                *tangent = self.geometries[i].tangent(j);
            }
            for a in 0..k {
                self.residual[i * k + a] = tangents[a].dot(&pull);
                let curved = form * tangents[a];
                for b in 0..=a {
                    let mut entry = curved.dot(&tangents[b]);
                    if let Some((_, gradient)) = rim {
                        entry +=
                            stiffness * gradient.dot(&tangents[a]) * gradient.dot(&tangents[b]);
                    }
                    self.base.add(i * k + a, i * k + b, entry);
                }
            }
        }
        self.couple(curve, k);
        Some(rim_energy)
    }

    /// Adds the stiffness T_i' K_ij T_j of every element.
    fn couple(&mut self, curve: &Curve<D, P>, k: usize) {
        let reference = curve.element();
        let count = curve.degree + 1;
        let last = curve.nodes.len() - 1;
        for (e, span) in curve.spans.iter().enumerate() {
            let scale = 2.0 / span;
            for p in 0..count {
                let row = e * curve.degree + p;
                if row == 0 || row == last {
                    continue;
                }
                for q in 0..=p {
                    let column = e * curve.degree + q;
                    if column == 0 {
                        continue;
                    }
                    let entry = scale * reference.stiffness[p * count + q];
                    let (i, j) = (row - 1, column - 1);
                    if i == j {
                        for a in 0..k {
                            self.base.add(i * k + a, i * k + a, entry);
                        }
                        continue;
                    }
                    for a in 0..k {
                        for b in 0..k {
                            let product = self.tangents[i][a].dot(&self.tangents[j][b]);
                            self.base.add(i * k + a, j * k + b, entry * product);
                        }
                    }
                }
            }
        }
    }

    /// The stiffness of the rim at a node.
    fn rim_stiffness<S: Surface<D, Place = P>>(
        &self,
        surface: &S,
        node: &Node<D, P>,
        measure: Measure,
        i: usize,
    ) -> f64 {
        let resolution = surface.resolution(node.place);
        RIM_STIFFNESS * 2.0 * measure.energy / (resolution * resolution) * self.masses[i]
    }

    /// Factors the Hessian plus `shift` times the mass matrix; returns the number of negative
    /// pivots.
    fn factor(&mut self, shift: f64) -> Option<usize> {
        self.band.clone_from(&self.base);
        if shift > 0.0 {
            let k = self.residual.len() / (self.masses.len() - 2);
            for row in 0..self.residual.len() {
                self.band.add(row, row, shift * self.masses[1 + row / k]);
            }
        }
        self.band.factor()
    }

    /// Computes Newton's step; returns the predicted decrease of the energy.
    fn newton_step(&mut self) -> f64 {
        for (step, residual) in self.step.iter_mut().zip(&self.residual) {
            *step = -residual;
        }
        self.band.solve(&mut self.step);
        let slope: f64 = self
            .step
            .iter()
            .zip(&self.residual)
            .map(|(s, r)| s * r)
            .sum();
        -0.5 * slope
    }

    /// Takes the step, pulls every node back onto the surface, and measures the result; the nodes
    /// are left in `trial`. `None` where a node steps too far or finds no foot.
    fn attempt<S: Surface<D, Place = P>>(
        &mut self,
        surface: &S,
        curve: &mut Curve<D, P>,
        measure: Measure,
    ) -> Option<(Measure, f64)> {
        let k = surface.intrinsic_dimension();
        self.trial.clone_from(&curve.nodes);
        for i in 0..curve.nodes.len() - 2 {
            let node = &mut self.trial[i + 1];
            let step = &self.step[i * k..(i + 1) * k];
            let resolution = surface.resolution(node.place);
            let length = step.iter().map(|s| s * s).sum::<f64>().sqrt();
            if resolution > 0.0 && length > LONGEST_NODE_STEP * resolution {
                return None;
            }
            let mut along = Vector::zeros();
            for (tangent, s) in self.tangents[i].iter().zip(step) {
                along += tangent * *s;
            }
            // The target follows the surface to second order, so that the pull-back has little left
            // to do.
            let target = node.point + along + self.geometries[i].normal_curvature(&along) * 0.5;
            node.point = surface.foot(&target, &mut node.place, &mut self.scratch)?;
        }
        std::mem::swap(&mut curve.nodes, &mut self.trial);
        let trial = curve.measure(&mut self.trial_pull);
        std::mem::swap(&mut curve.nodes, &mut self.trial);
        let mut energy = trial.energy;
        for i in 1..self.trial.len() - 1 {
            let node = self.trial[i];
            if let Some((depth, _)) = surface.beyond_rim(&node.point, node.place) {
                energy += 0.5 * self.rim_stiffness(surface, &node, measure, i) * depth * depth;
            }
        }
        energy.is_finite().then_some((trial, energy))
    }
}
