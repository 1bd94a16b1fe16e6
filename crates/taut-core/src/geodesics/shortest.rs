//! The shortest geodesic where the ends are nearly conjugate. There guesses on a graph cannot tell
//! apart ways that differ by little, and the shortest is found among all the geodesics that rays
//! find.

use crate::correction::ELEMENT_TURNING;
use crate::correction::newton::Solver;
use crate::correction::{self, Scheme, Settings, Straight, shares};
use crate::geodesics::fan::{Arrival, Sweep, sweep};
use crate::geodesics::ray::Aim;
use crate::order::sort_by_number;
use crate::result::{Path, Status};
use crate::surface::{Node, Surface};

/// Spread of rays from one end at the other, as a share of how far they ran apart, below which the
/// ends are nearly conjugate, on equations, whose samples are few.
const CONJUGATE: f64 = 0.3;
/// Spread of rays from one end at the other, as a share of how far they ran apart, below which the
/// ends are nearly conjugate, on clouds, whose graphs tell more ways apart.
const CONJUGATE_ON_CLOUDS: f64 = 0.07;
/// Length to which rays are followed, as a multiple of that of the shortest path known.
const SWEEP_LENGTH: f64 = 1.03;
/// Share of the shortest length by which other arrivals may be longer, by shooting, to be pulled
/// taut as well. It is also how well lengths must agree for a path to be proven shortest.
const CLOSE_ARRIVAL: f64 = 1e-5;
/// Farthest that the middle of an arrival may move when it is pulled taut, as a share of its
/// length, for it to be the same geodesic.
const SAME_PLACE: f64 = 0.01;
/// Most arrivals that are pulled taut.
const MOST_PULLED: usize = 8;
/// Relative error of rays, because of the surface's own error, above which they tell nothing.
const MOST_ROUGH: f64 = 1e-4;
/// Most rays of a sweep for nearly conjugate ends.
const MOST_RAYS: usize = 192;
/// Most rays of a sweep that is asked to prove that a path is the shortest.
const MOST_RAYS_OF_PROOF: usize = 4096;

/// Whether the ends of a path are nearly conjugate, where rays along it come together to a share
/// `spread` of how far they ran apart.
pub(crate) fn nearly_conjugate<const D: usize, S: Surface<D>>(
    surface: &S,
    guess: &[Node<D, S::Place>],
    spread: f64,
) -> bool {
    let on_cloud = |node: &Node<D, S::Place>| surface.resolution(node.place) > 0.0;
    let most = if guess.first().is_some_and(on_cloud) {
        CONJUGATE_ON_CLOUDS
    } else {
        CONJUGATE
    };
    spread < most
}

/// Paths between two nodes, and what rays know about them.
#[derive(Clone, Debug)]
pub(crate) struct FoundByRays<const D: usize> {
    pub paths: Vec<Path<D>>,
    /// Geodesics found by rays that could not be pulled taut to the tolerance, so that only their
    /// length is known.
    unsure: Vec<Path<D>>,
    /// Length of the shortest arrival, where rays missed none; not a number where they may have
    /// missed some.
    shortest: f64,
}

impl<const D: usize> Default for FoundByRays<D> {
    fn default() -> Self {
        Self {
            paths: Vec::new(),
            unsure: Vec::new(),
            shortest: f64::NAN,
        }
    }
}

impl<const D: usize> FoundByRays<D> {
    /// Adds the paths that differ from those known.
    pub fn merge(&mut self, paths: Vec<Path<D>>) {
        for path in paths {
            if !self.paths.iter().any(|other| other.is_same(&path)) {
                self.paths.push(path);
            }
        }
    }

    /// Whether the shortest path converged, and rays found no shorter one and missed none.
    pub fn proves_shortest(&self) -> bool {
        let best = self.paths.iter().filter(|path| path.converged());
        let best = best.map(|path| path.length).fold(f64::INFINITY, f64::min);
        (best / self.shortest - 1.0).abs() <= CLOSE_ARRIVAL
            && self.unsure.iter().all(|path| path.length >= best)
    }

    /// Shoots rays to find out whether any path is shorter than those known.
    pub fn prove<S: Surface<D>>(
        &mut self,
        surface: &S,
        ends: &[Node<D, S::Place>],
        settings: &Settings,
        solver: &mut Solver<D, S::Place>,
    ) {
        let lengths = self.paths.iter().map(|path| path.length);
        let known = lengths.fold(f64::INFINITY, f64::min);
        if self.proves_shortest() || !known.is_finite() {
            return;
        }
        let found = by_rays(surface, ends, known, settings, solver);
        self.shortest = found.shortest;
        self.unsure.extend(found.unsure);
        self.merge(found.paths);
    }

    /// The paths, the best one first. The order is by status (converged paths first, and those that
    /// left the surface last) and then by length. A geodesic that did not converge but is shorter
    /// than all that did comes first, because it shows that none of them is the shortest.
    pub fn best_first(mut self) -> Vec<Path<D>> {
        let proven = self.proves_shortest();
        for paths in [&mut self.paths, &mut self.unsure] {
            sort_by_number(paths, |path| path.length);
            sort_by_number(paths, |path| f64::from(distrust(path)));
        }
        if let Some(unsure) = self.unsure.first()
            && (self.paths.first())
                .is_none_or(|best| unsure.length < best.length - best.length_error)
        {
            self.paths.insert(0, unsure.clone());
        }
        if let Some(best) = self.paths.first_mut() {
            best.shortest = proven;
        }
        self.paths
    }
}

/// The rank of a path by its status: a path that converged is trusted before one that did not, and
/// one that left the surface last.
fn distrust<const D: usize>(path: &Path<D>) -> u8 {
    match path.status {
        Status::Converged => 0,
        Status::NotTaut | Status::NotResolved => 1,
        Status::OffSurface | Status::NoPath | Status::Unknown => 2,
    }
}

/// The geodesics between the ends of a guess that rays find, up to a little more than a known
/// length. There are none where rays tell nothing: on surfaces of other dimensions than 2, and on
/// rough ones.
pub(crate) fn by_rays<const D: usize, S: Surface<D>>(
    surface: &S,
    guess: &[Node<D, S::Place>],
    known: f64,
    settings: &Settings,
    solver: &mut Solver<D, S::Place>,
) -> FoundByRays<D> {
    let mut found = FoundByRays::default();
    let [from, .., to] = guess else { return found };
    let smooth = surface.intrinsic_dimension() == 2 && surface.detail() == 0.0;
    if !smooth || settings.scheme != Scheme::Newton || known.is_nan() || known <= 0.0 {
        return found;
    }
    let aim = Aim {
        surface,
        target: *to,
        scale: known,
    };
    if aim.roughness(from) > MOST_ROUGH {
        return found;
    }
    // What arrives almost as soon as the first is pulled taut too: shooting tells lengths only so
    // well.
    let most_rays = if settings.prove_shortest {
        MOST_RAYS_OF_PROOF
    } else {
        MOST_RAYS
    };
    let Some(Sweep { arrivals, covered }) = sweep(&aim, from, SWEEP_LENGTH * known, most_rays)
    else {
        return found;
    };
    let Some(shortest) = arrivals.first().map(Arrival::length) else {
        return found;
    };
    let near =
        |arrival: &&Arrival<D, S::Place>| arrival.length() <= (1.0 + CLOSE_ARRIVAL) * shortest;
    let near: Vec<_> = arrivals.iter().take_while(near).collect();
    let mut pulled = near.len() <= MOST_PULLED;
    for arrival in near.into_iter().take(MOST_PULLED) {
        let Some(straight) = straight(&aim, from, arrival, solver) else {
            pulled = false;
            continue;
        };
        let halfway = straight.taut.halfway();
        let path = correction::tighten(surface, straight, settings, solver);
        let moved = (path.halfway() - halfway).norm();
        // If the path has moved, it is another geodesic than the one that arrived.
        pulled &= moved <= SAME_PLACE * path.length;
        if path.converged() {
            found.merge(vec![path]);
        } else {
            found.unsure.push(path);
        }
    }
    if covered && pulled {
        found.shortest = shortest;
    }
    found
}

/// An arrival put on elements.
fn straight<const D: usize, S: Surface<D>>(
    aim: &Aim<D, S>,
    from: &Node<D, S::Place>,
    arrival: &Arrival<D, S::Place>,
    solver: &mut Solver<D, S::Place>,
) -> Option<Straight<D, S::Place>> {
    let length = arrival.pass.knot.length;
    let elements = (arrival.turning() / ELEMENT_TURNING).ceil().max(1.0) as usize;
    let shares = shares(elements);
    let inner = shares[1..shares.len() - 1].iter();
    let mut nodes = aim.nodes_at(&arrival.ray, inner.map(|share| share * length))?;
    nodes.insert(0, *from);
    nodes.push(aim.target);
    Straight::along(aim.surface, elements, nodes, solver)
}
