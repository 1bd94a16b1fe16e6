//! The particle system (1)-(4): forces, moves, births.

use crate::error::Error;
use crate::guess::particles::particle::{Particle, ParticleGeometry};
use crate::guess::particles::random::Random;
use crate::guess::particles::walk::walks;
use crate::guess::particles::{Region, Settings, Spread};
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::{Geometry, Node, Surface, named};
use crate::{Vector, parallel};

/// Particles on a surface.
pub(super) struct Swarm<'a, const D: usize, S: Surface<D>> {
    surface: &'a S,
    region: Option<Region<D>>,
    spread: Spread,
    seed: u64,
    pub particles: Vec<Particle<D, S::Place>>,
    /// The particles near each particle.
    neighbours: Vec<Vec<u32>>,
    /// The most that any particle may have moved since the neighbours were found, in its spacings.
    drifted: f64,
    /// The distance to its neighbours that each particle strives for, in the input's units.
    spacings: Vec<f64>,
    /// The distance between particles where the curvature is the mean one, in the input's units.
    pub epsilon: f64,
    mean_curvature: f64,
    /// The number of births so far, which seeds the next one's random directions.
    births: u64,
    /// Whether trajectories are recorded.
    pub records: bool,
}

/// Largest move of a particle, in spacings, before neighbours are found anew.
const STALE: f64 = 0.4;
/// The decay length of the exponential force, in spacings.
const FORCE_DECAY: f64 = 0.5;
/// The distance beyond which forces are cut off, in spacings.
const FORCE_CUTOFF: f64 = 2.0;
/// Longest step of a move, in spacings and in radii of curvature.
const LONGEST_MOVE: f64 = 0.4;
/// Largest correction of a move by Newton-Raphson, as a share of the move; a move that needs more
/// is halved.
const LARGEST_CORRECTION: f64 = 0.5;
/// Most times that a move is halved before it is left out.
const MOVE_HALVINGS: usize = 3;
/// Distance of a particle from its last recorded location at which a new one is recorded, in
/// spacings.
const RECORD: f64 = 1.0;
/// Curvature, in mean curvatures, above which larger curvatures count as this one.
const SHARPEST: f64 = 8.0;

/// The inverse square of the spacing, in epsilons, where the curvature is `ratio` mean ones. It
/// gives even turning between neighbours, as in (17)-(18), with a floor so that flat parts are
/// covered too.
fn adapted(ratio: f64) -> f64 {
    0.25 + ratio.min(SHARPEST).powi(2)
}

/// Number of neighbours that are looked at per particle of a surface of dimension k: those within
/// the cut-off at rest.
pub(super) fn neighbour_count(k: usize) -> usize {
    match k {
        1 => 4,
        2 => 18,
        3 => 36,
        _ => 48,
    }
}

impl<'a, const D: usize, S: Surface<D>> Swarm<'a, D, S> {
    /// A swarm of the sources alone.
    pub fn new(
        surface: &'a S,
        sources: &[Node<D, S::Place>],
        fixed: bool,
        epsilon: f64,
        settings: &Settings<D>,
    ) -> Result<Self, Error> {
        if sources.is_empty() {
            return Err(Error::NoSources);
        }
        let mut scratch = Geometry::new(D - surface.intrinsic_dimension());
        let particles = sources
            .iter()
            .zip(0..)
            .map(|(node, source)| {
                let frame = ParticleGeometry::at(surface, node, &mut scratch).ok_or_else(|| {
                    Error::NoFoot {
                        point: named(surface, &node.point),
                        reason: "the surface has no tangent space there; move the source",
                    }
                })?;
                Ok(Particle {
                    node: *node,
                    frame,
                    source,
                    fixed,
                    trajectory: vec![*node],
                    birthplace: (source, 1),
                })
            })
            .collect::<Result<Vec<_>, Error>>()?;
        let mut swarm = Self {
            surface,
            region: settings.region,
            spread: settings.spread,
            seed: settings.seed,
            particles,
            neighbours: Vec::new(),
            drifted: f64::INFINITY,
            spacings: Vec::new(),
            epsilon,
            mean_curvature: 0.0,
            births: 0,
            records: false,
        };
        swarm.weigh_curvature();
        swarm.search();
        Ok(swarm)
    }

    pub fn intrinsic_dimension(&self) -> usize {
        self.surface.intrinsic_dimension()
    }

    pub fn codimension(&self) -> usize {
        D - self.surface.intrinsic_dimension()
    }

    /// The mean curvature over the area that the particles stand for, 1 / length.
    pub fn mean_curvature(&self) -> f64 {
        self.mean_curvature
    }

    /// Finds the mean curvature, each particle weighted by the area that it stands for, and then
    /// the spacings.
    fn weigh_curvature(&mut self) {
        let k = self.surface.intrinsic_dimension() as i32;
        let (mut sum, mut area) = (0.0, 0.0);
        for particle in &self.particles {
            let share = self.relative_spacing(particle).powi(k);
            sum += share * particle.frame.curvature;
            area += share;
        }
        self.mean_curvature = sum / area;
        self.respace();
    }

    /// Multiplies epsilon by a factor.
    pub fn widen(&mut self, factor: f64) {
        self.epsilon *= factor;
        self.respace();
    }

    /// Finds the spacing of each particle.
    fn respace(&mut self) {
        let spacing = |particle| self.epsilon * self.relative_spacing(particle);
        self.spacings = self.particles.iter().map(spacing).collect();
    }

    /// The spacing at a particle, in epsilons.
    fn relative_spacing(&self, particle: &Particle<D, S::Place>) -> f64 {
        if self.spread == Spread::Even || self.mean_curvature == 0.0 {
            return 1.0;
        }
        adapted(particle.frame.curvature / self.mean_curvature)
            .sqrt()
            .recip()
    }

    /// The distance to its neighbours that a particle strives for.
    pub fn spacing(&self, i: u32) -> f64 {
        self.spacings[i as usize]
    }

    /// The mean of the spacings at two particles.
    pub fn mean_spacing(&self, i: u32, j: u32) -> f64 {
        0.5 * (self.spacing(i) + self.spacing(j))
    }

    /// Whether a step along the surface leads from one particle to another.
    pub fn walkable(&self, i: u32, j: u32) -> bool {
        self.same_sheet(i, j) && self.leads_to(&self.particles[i as usize].node, j)
    }

    /// Whether a step along the surface leads from a point of it to a particle.
    pub fn leads_to(&self, from: &Node<D, S::Place>, to: u32) -> bool {
        let mut scratch = Geometry::new(self.codimension());
        let to = &self.particles[to as usize].node.point;
        walks(self.surface, from, to, &mut scratch)
    }

    /// Records where a particle is; returns the number of its records.
    pub fn record(&mut self, i: u32) -> usize {
        let particle = &mut self.particles[i as usize];
        let last = particle.trajectory.last().map(|node| node.point);
        if last != Some(particle.node.point) {
            particle.trajectory.push(particle.node);
        }
        particle.trajectory.len()
    }

    pub fn neighbours(&self, i: u32) -> &[u32] {
        &self.neighbours[i as usize]
    }

    pub fn distance(&self, i: u32, j: u32) -> f64 {
        let [a, b] = [i, j].map(|i| self.particles[i as usize].node.point);
        (a - b).norm()
    }

    /// Distance to the nearest particle of the same sheet, in spacings; infinite where none is
    /// near.
    pub fn room(&self, i: u32) -> f64 {
        let same_sheet = self
            .neighbours(i)
            .iter()
            .filter(|j| self.same_sheet(i, **j));
        let distances = same_sheet.map(|j| self.distance(i, *j) / self.spacing(i));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Whether the chord between two particles runs along the surface at both.
    pub fn same_sheet(&self, i: u32, j: u32) -> bool {
        let (a, b) = (&self.particles[i as usize], &self.particles[j as usize]);
        along(a, b, &(b.node.point - a.node.point), self.codimension())
    }

    /// Finds each particle's neighbours, if they may have changed; O(n log n).
    pub fn refresh(&mut self) {
        if self.drifted > STALE {
            self.search();
        }
    }

    fn search(&mut self) {
        let points: Vec<Vector<D>> = self.particles.iter().map(|p| p.node.point).collect();
        let tree = Tree::new(&points);
        let count = neighbour_count(self.surface.intrinsic_dimension());
        let of = |found: &mut Vec<Neighbour>, i: usize| {
            tree.nearest(&points[i], count + 1, found);
            let near = found.iter().map(|n| tree.order[n.index as usize]);
            near.filter(|j| *j as usize != i).collect()
        };
        self.neighbours = parallel::map_with(points.len(), Vec::new, of);
        self.drifted = 0.0;
    }

    /// Moves every particle that is not fixed once: (4), (1) and (12). `homologous` tells whether
    /// two sources repel each other's particles; other sources attract. O(n log n).
    pub fn step(&mut self, homologous: impl Fn(u32, u32) -> bool + Sync) {
        self.refresh();
        let this = &*self;
        let scratch = || Geometry::new(this.codimension());
        let moved = parallel::map_with(self.particles.len(), scratch, |scratch, i| {
            if this.particles[i].fixed {
                return None;
            }
            let step = this.velocity(i as u32, &homologous);
            this.advance(i as u32, &step, scratch)
        });
        let mut farthest = 0.0_f64;
        for (i, moved) in moved.into_iter().enumerate() {
            let Some((node, frame)) = moved else {
                continue;
            };
            let spacing = self.spacings[i];
            let record = if self.records {
                RECORD * spacing
            } else {
                f64::INFINITY
            };
            let particle = &mut self.particles[i];
            farthest = farthest.max((particle.node.point - node.point).norm() / spacing);
            (particle.node, particle.frame) = (node, frame);
            let last = particle.trajectory[particle.trajectory.len() - 1].point;
            if (last - node.point).norm() > record {
                particle.trajectory.push(node);
            }
        }
        self.drifted += farthest;
        self.weigh_curvature();
    }

    /// The resultant (4), projected (1). Lengths are measured in the particle's spacing, so that
    /// nothing depends on the unit. The curvature term (2) is sum_j (h kappa_j)^2 <v_j, u> v_j,
    /// where u is the sum of the other two forces. This orients each principal direction along the
    /// motion, and does not jump where two curvatures are equal and principal directions mean
    /// nothing.
    fn velocity(&self, i: u32, homologous: &(impl Fn(u32, u32) -> bool + Sync)) -> Vector<D> {
        let here = &self.particles[i as usize];
        let spacing = self.spacing(i);
        let m = self.codimension();
        let mut sum = Vector::zeros();
        for j in self.neighbours(i) {
            let there = &self.particles[*j as usize];
            let apart = here.node.point - there.node.point;
            let distance = apart.norm();
            let scale = self.mean_spacing(i, *j);
            if distance == 0.0 || distance > FORCE_CUTOFF * scale || !along(here, there, &apart, m)
            {
                continue;
            }
            let force = apart * ((-distance / (FORCE_DECAY * scale)).exp() / distance);
            if homologous(here.source, there.source) {
                sum += force;
            } else {
                sum -= force;
            }
        }
        let tangential = here.frame.project(&sum, self.codimension());
        let curved = here.frame.squared_shape * tangential * (spacing * spacing);
        // A particle in place among its first ring of neighbours moves back by less than it is off.
        let ring = neighbour_count(self.surface.intrinsic_dimension()) as f64 / 3.0;
        (tangential + curved) * (3.0 * spacing / ring)
    }

    /// The node and frame one step on; `None` where the particle cannot go there.
    fn advance(
        &self,
        i: u32,
        velocity: &Vector<D>,
        scratch: &mut Geometry<D>,
    ) -> Option<(Node<D, S::Place>, ParticleGeometry<D>)> {
        let here = &self.particles[i as usize];
        let longest = LONGEST_MOVE * self.spacing(i).min(here.frame.curvature.recip());
        let length = velocity.norm();
        if length == 0.0 {
            return None;
        }
        let mut step = velocity * (longest / length).min(1.0);
        for _ in 0..=MOVE_HALVINGS {
            if let Some(arrived) = self.land(here, &step, scratch) {
                return Some(arrived);
            }
            step *= 0.5;
        }
        None
    }

    /// Pulls a particle back onto the surface after a step (12); `None` unless it stays near and
    /// within the region.
    fn land(
        &self,
        from: &Particle<D, S::Place>,
        step: &Vector<D>,
        scratch: &mut Geometry<D>,
    ) -> Option<(Node<D, S::Place>, ParticleGeometry<D>)> {
        let target = from.node.point + step;
        let mut place = from.node.place;
        let point = self.surface.foot(&target, &mut place, scratch)?;
        let inside = self.region.is_none_or(|region| region.holds(&point))
            && self.surface.beyond_rim(&point, place).is_none();
        if !inside || (point - target).norm() > LARGEST_CORRECTION * step.norm() {
            return None;
        }
        let node = Node { point, place };
        let frame = ParticleGeometry::at(self.surface, &node, scratch)?;
        Some((node, frame))
    }

    /// Lets a particle give birth to others, `offset` spacings away in random directions; those
    /// that do not land are lost. Returns the number of particles born.
    pub fn give_birth(&mut self, i: u32, children: usize, offset: f64) -> usize {
        let mut scratch = Geometry::new(self.codimension());
        let parent = self.particles[i as usize].clone();
        let length = (offset * self.spacing(i)).min(LONGEST_MOVE / parent.frame.curvature);
        let birthplace = (i, if self.records { self.record(i) } else { 1 });
        let mut random = Random::new(self.seed, self.births);
        self.births += 1;
        let before = self.particles.len();
        let mut family = self.neighbours[i as usize].clone();
        family.push(i);
        for _ in 0..children {
            let step = random.tangent(&parent.frame.basis, self.codimension()) * length;
            let Some((node, frame)) = self.land(&parent, &step, &mut scratch) else {
                continue;
            };
            self.particles.push(Particle {
                node,
                frame,
                source: parent.source,
                fixed: false,
                trajectory: vec![parent.node],
                birthplace,
            });
            let child = self.spacings.len() as u32;
            self.spacings
                .push(self.epsilon * self.relative_spacing(&self.particles[child as usize]));
            // Until the next search, the child's neighbours are its parent's.
            for other in &family {
                self.neighbours[*other as usize].push(child);
            }
            self.neighbours.push(family.clone());
            family.push(child);
        }
        self.particles.len() - before
    }
}

/// Whether the chord between two particles runs along the surface at both.
fn along<const D: usize, P>(
    a: &Particle<D, P>,
    b: &Particle<D, P>,
    chord: &Vector<D>,
    m: usize,
) -> bool {
    a.frame.runs_along(chord, m) && b.frame.runs_along(chord, m)
}
