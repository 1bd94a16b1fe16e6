//! The shortest geodesic where the ends are nearly conjugate: there guesses on a graph cannot tell ways apart that differ by
//! little, and the shortest is found among all that rays find.

use crate::correction::newton::Solver;
use crate::correction::{self, Scheme, Settings, Straight, shares};
use crate::geodesics::fan::{Arrival, Sweep, sweep};
use crate::geodesics::ray::Aim;
use crate::result::{Path, Status};
use crate::surface::{Node, Surface};

/// Ends are nearly conjugate where rays from one have come together at the other to this share of how far they ran apart: on
/// equations, whose samples are few, and on clouds, whose graphs tell more ways apart.
const CONJUGATE: f64 = 0.3;
const CONJUGATE_ON_CLOUDS: f64 = 0.07;
/// Rays are followed so much farther than the shortest path known.
const LONGER: f64 = 1.03;
/// Arrivals that by shooting are longer than the shortest by less than this share are pulled taut.
const CLOSE: f64 = 1e-5;
/// An arrival turns by so much on an element, in radians.
const TURNING: f64 = 1.6;
/// A path pulled taut has not moved farther halfway, in shares of its length.
const SAME_PLACE: f64 = 0.01;
const MOST_PULLED: usize = 8;
/// Errors of rays, relative, by the surface's own error, from which on they tell nothing.
const MOST_ROUGH: f64 = 1e-4;
const MOST_RAYS: usize = 192;
const MOST_RAYS_OF_PROOF: usize = 4096;

/// Whether a path between nodes whose rays come together to a share `spread` has nearly conjugate ends.
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

/// Paths between two nodes, and what rays know of them.
#[derive(Clone, Debug)]
pub(crate) struct Found<const D: usize> {
    pub paths: Vec<Path<D>>,
    /// Geodesics found by rays that could not be pulled taut to the tolerance: of these the length is known.
    unsure: Vec<Path<D>>,
    /// Length of the shortest arrival of rays that missed none; not a number where they may have.
    shortest: f64,
}

impl<const D: usize> Default for Found<D> {
    fn default() -> Self {
        Self {
            paths: Vec::new(),
            unsure: Vec::new(),
            shortest: f64::NAN,
        }
    }
}

impl<const D: usize> Found<D> {
    /// Adds paths other than those known.
    pub fn merge(&mut self, paths: Vec<Path<D>>) {
        for path in paths {
            if !self.paths.iter().any(|other| other.is_same(&path)) {
                self.paths.push(path);
            }
        }
    }

    /// The shortest path converged, and rays found no shorter one and missed none.
    pub fn proves_shortest(&self) -> bool {
        let best = self.paths.iter().filter(|path| path.converged());
        let best = best.map(|path| path.length).fold(f64::INFINITY, f64::min);
        (best / self.shortest - 1.0).abs() <= CLOSE
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

    /// The paths, the best one first, then by their lengths: what converged before what did not, and what left the surface
    /// last. A geodesic that did not converge but is shorter than all that did shows that none of them is the shortest.
    pub fn best_first(mut self) -> Vec<Path<D>> {
        let proven = self.proves_shortest();
        let order = |a: &Path<D>, b: &Path<D>| {
            let trust = distrust(a).cmp(&distrust(b));
            trust.then(a.length.total_cmp(&b.length))
        };
        self.paths.sort_by(order);
        self.unsure.sort_by(order);
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

/// A path that converged is trusted before one that did not, and one that left the surface last.
fn distrust<const D: usize>(path: &Path<D>) -> u8 {
    match path.status {
        Status::Converged => 0,
        Status::NotTaut | Status::NotResolved => 1,
        Status::OffSurface | Status::NoPath | Status::Unknown => 2,
    }
}

/// The geodesics that rays find between the ends of a guess, up to a length that is known; nothing where rays say nothing: on
/// surfaces of other dimensions and on rough ones.
pub(crate) fn by_rays<const D: usize, S: Surface<D>>(
    surface: &S,
    guess: &[Node<D, S::Place>],
    known: f64,
    settings: &Settings,
    solver: &mut Solver<D, S::Place>,
) -> Found<D> {
    let mut found = Found::default();
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
    let most_rays = if settings.prove_shortest {
        MOST_RAYS_OF_PROOF
    } else {
        MOST_RAYS
    };
    let Some(Sweep { arrivals, covered }) = sweep(&aim, from, LONGER * known, most_rays) else {
        return found;
    };
    let Some(shortest) = arrivals.first().map(Arrival::length) else {
        return found;
    };
    let near = |arrival: &&Arrival<D, S::Place>| arrival.length() <= (1.0 + CLOSE) * shortest;
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
        // Else it is another geodesic than the one that arrived.
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
    let elements = (arrival.turning() / TURNING).ceil().max(1.0) as usize;
    let shares = shares(elements);
    let inner = shares[1..shares.len() - 1].iter();
    let mut nodes = aim.nodes_at(&arrival.ray, inner.map(|share| share * length))?;
    nodes.insert(0, *from);
    nodes.push(aim.target);
    Straight::along(aim.surface, elements, nodes, solver)
}
