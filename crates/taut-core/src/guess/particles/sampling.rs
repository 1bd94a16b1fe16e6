//! Samplings for their own sake: a given number of particles that all repel each other.

use crate::Vector;
use crate::error::Error;
use crate::guess::particles::swarm::{Swarm, neighbour_count};
use crate::guess::particles::{Quality, Settings};
use crate::surface::{Node, Surface};

/// Points that are well spread over a surface.
#[derive(Clone, Debug)]
pub struct Sampling<const D: usize, P> {
    /// The points, the sources first.
    pub nodes: Vec<Node<D, P>>,
    /// A unit normal at each point (the first of m for codimension m).
    pub normals: Vec<Vector<D>>,
    /// The curvature (sum kappa_j^2)^(1/2) at each point, with kappa_j the principal curvatures, 1
    /// / length.
    pub curvatures: Vec<f64>,
    /// The distance to its neighbours that each point strives for, in the surface's units.
    pub spacings: Vec<f64>,
    /// How well the points are spread.
    pub quality: Quality,
}

/// Room of a particle, in spacings, above which it gives birth.
const ROOM: f64 = 1.0;
/// Distance from its parent at which a particle is born, in spacings.
const BIRTH_AT_PARENT: f64 = 0.5;
/// Share of the particles up to which births are few.
const FEW_BIRTHS: f64 = 0.02;
/// Number of rounds with few births, over the number of particles, after which the spacing shrinks:
/// few particles take longer to drift apart.
const PATIENCE: usize = 64;
/// Factor by which the spacing shrinks: it makes twice the particles on a surface.
const REFINEMENT: f64 = 0.707;
/// Number of steps between births.
const SETTLE: usize = 3;
/// Number of steps at the end, which even the particles out.
const RELAX: usize = 40;
/// Number of those last steps with the same neighbours.
const RELAX_PER_SEARCH: usize = 4;
/// Number of particles, a size apart, above which the surface is taken to have no end.
const ENDLESS: usize = 256;

/// Spreads `count` points over the components of a surface that hold the `sources`. The sources
/// stay where they are if `fixed`, and else float like all others.
///
/// A particle with room about it gives birth to another. When none has room, the spacing shrinks,
/// until there are `count` particles. It takes O(n log n) in their number, and gives the same bits
/// on any number of threads.
///
/// ```
/// use taut_core::Vector;
/// use taut_core::guess::particles::{Settings, sample};
/// use taut_core::surface::{Node, implicit::ImplicitSurface, shapes::Shape};
/// let ellipsoid = ImplicitSurface::new(Shape::parse("ellipsoid:3,2,1")?, 3.0);
/// let source = Node { point: Vector::<3>::new(3.0, 0.0, 0.0), place: () };
/// let sampling = sample(&ellipsoid, &[source], true, 500, &Settings::new(3.0))?;
/// assert_eq!(sampling.nodes.len(), 500);
/// assert!(sampling.quality.density_follows_curvature > 0.9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::NoSources`] without a source, [`Error::NoFoot`] for a source where the surface has no
/// tangent space, [`Error::Endless`] where particles a size apart find no end of room and no region
/// holds them.
pub fn sample<const D: usize, S: Surface<D>>(
    surface: &S,
    sources: &[Node<D, S::Place>],
    fixed: bool,
    count: usize,
    settings: &Settings<D>,
) -> Result<Sampling<D, S::Place>, Error> {
    let mut swarm = Swarm::new(surface, sources, fixed, settings.size, settings)?;
    fill(&mut swarm, count, settings)?;
    swarm.particles.truncate(count.max(sources.len()));
    for _ in 0..RELAX / RELAX_PER_SEARCH {
        swarm.refresh();
        let crowding = crowding(&swarm);
        swarm.widen(crowding);
        for _ in 0..RELAX_PER_SEARCH {
            swarm.step(|_, _| true);
        }
    }
    Ok(collect(&swarm))
}

/// Lets particles give birth until there are `count` of them.
pub(super) fn fill<const D: usize, S: Surface<D>>(
    swarm: &mut Swarm<'_, D, S>,
    count: usize,
    settings: &Settings<D>,
) -> Result<(), Error> {
    let (mut idle, mut refined) = (0, false);
    while swarm.particles.len() < count {
        swarm.refresh();
        let mut roomy: Vec<(f64, u32)> = (0..swarm.particles.len() as u32)
            .map(|i| (swarm.room(i), i))
            .filter(|(room, _)| *room > ROOM)
            .collect();
        roomy.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        roomy.truncate(count - swarm.particles.len());
        let born: usize = roomy
            .iter()
            .map(|(_, i)| swarm.give_birth(*i, 1, BIRTH_AT_PARENT))
            .sum();
        for _ in 0..SETTLE {
            swarm.step(|_, _| true);
        }
        let present = swarm.particles.len();
        idle = if born as f64 <= FEW_BIRTHS * present as f64 {
            idle + 1
        } else {
            0
        };
        if idle > PATIENCE / present {
            swarm.widen(REFINEMENT);
            (idle, refined) = (0, true);
        }
        if settings.region.is_none() && !refined && swarm.particles.len() > ENDLESS {
            return Err(Error::Endless {
                particles: ENDLESS,
                size: settings.size,
            });
        }
    }
    Ok(())
}

/// The mean distance to the first ring of neighbours, in spacings.
pub(super) fn crowding<const D: usize, S: Surface<D>>(swarm: &Swarm<'_, D, S>) -> f64 {
    let ring = neighbour_count(swarm.intrinsic_dimension()) / 3;
    let mut distances = Vec::new();
    for i in 0..swarm.particles.len() as u32 {
        let mut near: Vec<f64> = swarm
            .neighbours(i)
            .iter()
            .map(|j| swarm.distance(i, *j) / swarm.spacing(i))
            .collect();
        near.sort_unstable_by(f64::total_cmp);
        distances.extend(near.iter().take(ring.max(1)));
    }
    if distances.is_empty() {
        return 1.0;
    }
    distances.iter().sum::<f64>() / distances.len() as f64
}

fn collect<const D: usize, S: Surface<D>>(swarm: &Swarm<'_, D, S>) -> Sampling<D, S::Place> {
    let nodes: Vec<Node<D, S::Place>> = swarm.particles.iter().map(|p| p.node).collect();
    let points: Vec<Vector<D>> = nodes.iter().map(|node| node.point).collect();
    let curvatures: Vec<f64> = swarm.particles.iter().map(|p| p.frame.curvature).collect();
    let spacings: Vec<f64> = (0..nodes.len() as u32).map(|i| swarm.spacing(i)).collect();
    Sampling {
        normals: swarm
            .particles
            .iter()
            .map(|p| p.frame.basis.column(0).into_owned())
            .collect(),
        quality: Quality::measure(&points, &curvatures, &spacings),
        nodes,
        curvatures,
        spacings,
    }
}
