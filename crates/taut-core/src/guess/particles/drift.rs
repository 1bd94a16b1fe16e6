//! The procedure of sampling [3.1.4]: particles drift from their sources until they have met and
//! the surface is covered.

use crate::error::Error;
use crate::guess::particles::Settings;
use crate::guess::particles::sources::SourceClasses;
use crate::guess::particles::swarm::Swarm;
use crate::surface::{Node, Surface};

/// What the procedure of sampling ends with.
pub(super) struct Drifted<'a, const D: usize, S: Surface<D>> {
    pub swarm: Swarm<'a, D, S>,
    pub joined: SourceClasses,
    pub meetings: Vec<Meeting>,
    pub steps: usize,
    /// Whether the procedure ended because there was hardly any room left.
    covered: bool,
}

/// A meeting of two particles, each with the number of locations that it had recorded by then.
pub(super) struct Meeting(pub [(u32, usize); 2]);

/// Number of particles born at a source at a time, per dimension of the surface, plus one: the
/// paper's 5 on surfaces.
const LITTER: usize = 2;
/// Distance from its source at which a particle is born, in spacings.
const BIRTH_AT_SOURCE: f64 = 0.3;
/// Number of steps that the loop looks back: it ends if there was no room for a birth and no
/// meeting in them.
const RECENT: usize = 20;
/// Share of the particles up to which births and meetings in the recent steps are few enough to end
/// the loop, once all sources are joined.
const QUIET: f64 = 0.02;
/// Largest share of the particles that may have room for the surface to count as covered, where the
/// number of particles ended the loop and all sources are joined.
const ROOMY: f64 = 0.1;
/// Factor by which epsilon grows where the particles do not cover the surface.
const WIDENING: f64 = 1.25;
/// Most times that the procedure is begun, each time with a larger epsilon.
const MOST_BEGINNINGS: usize = 6;

/// Runs the procedure of sampling, and begins it anew with a larger epsilon if `count` particles do
/// not cover the surface.
pub(super) fn drift<'a, const D: usize, S: Surface<D>>(
    surface: &'a S,
    sources: &[Node<D, S::Place>],
    count: usize,
    mut epsilon: f64,
    settings: &Settings<D>,
) -> Result<Drifted<'a, D, S>, Error> {
    let mut beginnings = 1;
    loop {
        let swarm = Swarm::new(surface, sources, true, epsilon, settings)?;
        let drifted = drift_once(swarm, sources.len(), count);
        if drifted.covered || beginnings == MOST_BEGINNINGS {
            return Ok(drifted);
        }
        epsilon *= WIDENING;
        beginnings += 1;
    }
}

/// The loop of the procedure: births (a), moves (b), meetings (c), records (d).
fn drift_once<const D: usize, S: Surface<D>>(
    mut swarm: Swarm<'_, D, S>,
    sources: usize,
    count: usize,
) -> Drifted<'_, D, S> {
    swarm.records = true;
    let mut joined = SourceClasses::new(sources);
    let mut meetings = Vec::new();
    let mut recent = [usize::MAX; RECENT];
    let mut full = 0;
    let mut steps = 0;
    while !settled(&swarm, &joined, &recent) && full < RECENT {
        let wanted = give_births(&mut swarm, sources, count);
        full += usize::from(wanted > 0 && swarm.particles.len() >= count);
        let classes = joined.class_of_each();
        swarm.step(|a, b| classes[a as usize] == classes[b as usize]);
        let met = meet(&mut swarm, &mut joined, &mut meetings);
        recent.rotate_right(1);
        recent[0] = wanted + met;
        steps += 1;
    }
    swarm.refresh();
    let roomy = recent.iter().fold(0_usize, |sum, r| sum.saturating_add(*r)) as f64 / RECENT as f64;
    let nearly = joined.classes() == 1 && roomy <= ROOMY * swarm.particles.len() as f64;
    Drifted {
        covered: nearly || settled(&swarm, &joined, &recent),
        swarm,
        joined,
        meetings,
        steps,
    }
}

/// Whether nothing happened for a while, or little once all sources are joined.
fn settled<const D: usize, S: Surface<D>>(
    swarm: &Swarm<'_, D, S>,
    joined: &SourceClasses,
    recent: &[usize; RECENT],
) -> bool {
    let happened = recent.iter().fold(0_usize, |sum, r| sum.saturating_add(*r));
    let little = QUIET * swarm.particles.len() as f64;
    happened == 0 || (joined.classes() == 1 && happened as f64 <= little)
}

/// Gives births where the nearest neighbour is farther than epsilon, up to `count` particles:
/// several at sources, one at particles on their way. Returns how many particles had room.
fn give_births<const D: usize, S: Surface<D>>(
    swarm: &mut Swarm<'_, D, S>,
    sources: usize,
    count: usize,
) -> usize {
    swarm.refresh();
    let litter = LITTER * swarm.intrinsic_dimension() + 1;
    let roomy: Vec<u32> = (0..swarm.particles.len() as u32)
        .filter(|i| swarm.room(*i) > 1.0)
        .collect();
    for i in &roomy {
        if swarm.particles.len() >= count {
            break;
        }
        let children = if (*i as usize) < sources { litter } else { 1 };
        swarm.give_birth(*i, children, BIRTH_AT_SOURCE);
    }
    roomy.len()
}

/// Joins the sources whose particles have come within epsilon; returns how many joined.
fn meet<const D: usize, S: Surface<D>>(
    swarm: &mut Swarm<'_, D, S>,
    joined: &mut SourceClasses,
    meetings: &mut Vec<Meeting>,
) -> usize {
    let before = joined.classes();
    if before == 1 {
        return 0;
    }
    let classes = joined.class_of_each();
    let of = |swarm: &Swarm<'_, D, S>, i: u32| swarm.particles[i as usize].source as usize;
    let count = swarm.particles.len() as u32;
    let mut near: Vec<[u32; 2]> = Vec::new();
    for i in 0..count {
        let others = swarm.neighbours(i).iter();
        near.extend(others.filter_map(|&j| {
            let apart = classes[of(swarm, i)] != classes[of(swarm, j)];
            (apart && i < j && swarm.distance(i, j) < swarm.mean_spacing(i, j)).then_some([i, j])
        }));
    }
    for [i, j] in near {
        let (a, b) = (of(swarm, i) as u32, of(swarm, j) as u32);
        if swarm.walkable(i, j) && joined.join(a, b) {
            meetings.push(Meeting([i, j].map(|i| (i, swarm.record(i)))));
        }
    }
    before - joined.classes()
}
