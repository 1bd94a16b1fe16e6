//! Ways between two points that no samples join: they are walked and, if need be, grown as two
//! trees.

use crate::Vector;
use crate::guess::sampling::walk::Walker;
use crate::order::sort_by_number;
use crate::surface::implicit::Equations;

/// Number of samples that ways are tried through where no way is known.
const MANY_VIAS: usize = 24;
/// Number of samples that ways are tried through where some ways are known.
const FEW_VIAS: usize = 6;
/// Most ways that are kept, shortest first.
const MOST_WAYS: usize = 6;
/// Most attempts of the two trees to meet; it also limits the points of a tree.
const MOST_ATTEMPTS: usize = 300;
/// How near a walk comes to its end, as a share of its way: the end is met exactly or not at all.
const EXACTNESS: f64 = 1e-6;

/// A tree of walks from one end: points, each with the walk to it from the point before.
struct Tree<const D: usize> {
    points: Vec<Vector<D>>,
    ways: Vec<(usize, Vec<Vector<D>>)>,
}

/// Ways between two points of the surface. The first ones are straight walks, where these arrive;
/// others lead through some of the samples. Where there are none, trees are grown from both ends
/// until they meet (RRT-connect: Kuffner, LaValle, "RRT-Connect: An Efficient Approach to
/// Single-Query Path Planning", ICRA 2000).
pub(super) fn ways<const D: usize, E: Equations<D>>(
    walker: &mut Walker<'_, D, E>,
    [from, to]: [&Vector<D>; 2],
    samples: &[Vector<D>],
    gap: f64,
    is_joined: bool,
) -> Vec<Vec<Vector<D>>> {
    let mut found = Vec::new();
    found.extend(walk(walker, from, to, gap));
    found.extend(walk(walker, to, from, gap).map(reversed));
    let vias = if is_joined || !found.is_empty() {
        FEW_VIAS
    } else {
        MANY_VIAS
    };
    let stride = samples.len().div_ceil(vias).max(1);
    for via in samples.iter().step_by(stride) {
        let (Some(first), Some(second)) = (
            walk(walker, from, via, gap),
            walk(walker, to, via, gap).map(reversed),
        ) else {
            continue;
        };
        found.push([&first[..], &second[1..]].concat());
    }
    if found.is_empty() && !is_joined {
        found.extend(by_trees(walker, from, to, samples, gap));
    }
    sort_by_number(&mut found, |way| length(way));
    found.truncate(MOST_WAYS);
    found
}

/// The length of a way.
fn length<const D: usize>(way: &[Vector<D>]) -> f64 {
    way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}

fn reversed<const D: usize>(mut way: Vec<Vector<D>>) -> Vec<Vector<D>> {
    way.reverse();
    way
}

/// The points of a walk that arrives, ends included; `None` where it does not arrive.
fn walk<const D: usize, E: Equations<D>>(
    walker: &mut Walker<'_, D, E>,
    from: &Vector<D>,
    to: &Vector<D>,
    gap: f64,
) -> Option<Vec<Vector<D>>> {
    let way = as_far(walker, from, to, gap);
    let near = 10.0 * EXACTNESS * (to - from).norm();
    let end = way.last()?;
    ((end - to).norm() <= near).then(|| {
        let mut way = way;
        if let Some(last) = way.last_mut() {
            *last = *to;
        }
        way
    })
}

/// The points of a walk, as far as it goes.
fn as_far<const D: usize, E: Equations<D>>(
    walker: &mut Walker<'_, D, E>,
    from: &Vector<D>,
    to: &Vector<D>,
    gap: f64,
) -> Vec<Vector<D>> {
    let mut way = vec![*from];
    walker.toward(from, to, gap, EXACTNESS, |point| way.push(*point));
    way
}

/// A way by two trees of walks, grown from both ends by turns until they meet.
fn by_trees<const D: usize, E: Equations<D>>(
    walker: &mut Walker<'_, D, E>,
    from: &Vector<D>,
    to: &Vector<D>,
    samples: &[Vector<D>],
    gap: f64,
) -> Option<Vec<Vector<D>>> {
    let mut trees = [Tree::new(from), Tree::new(to)];
    for attempt in 0..MOST_ATTEMPTS {
        let goal = aim(samples, from, to, attempt);
        let [grown, other] = &mut trees;
        let grew = grown.grow(walker, &goal, gap);
        if grew {
            let reached = grown.points[grown.points.len() - 1];
            other.grow(walker, &reached, gap);
            let end = other.points[other.points.len() - 1];
            if (end - reached).norm() <= 100.0 * EXACTNESS * (to - from).norm() {
                let mut way = grown.way(grown.points.len() - 1);
                way.extend(
                    reversed(other.way(other.points.len() - 1))
                        .into_iter()
                        .skip(1),
                );
                return Some(if attempt % 2 == 0 { way } else { reversed(way) });
            }
        }
        trees.swap(0, 1);
    }
    None
}

/// Where the trees grow to at an attempt: samples, or points of a box about all samples.
fn aim<const D: usize>(
    samples: &[Vector<D>],
    from: &Vector<D>,
    to: &Vector<D>,
    attempt: usize,
) -> Vector<D> {
    // The generator is fixed, so that the same question has the same answer.
    let mut state = 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(attempt as u64 + 1);
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    if !samples.is_empty() && uniform() < 0.5 {
        return samples[((uniform() * samples.len() as f64) as usize).min(samples.len() - 1)];
    }
    let ends = [from, to].into_iter().chain(samples);
    let (low, high) = ends.fold(
        (
            Vector::repeat(f64::INFINITY),
            Vector::repeat(f64::NEG_INFINITY),
        ),
        |(low, high): (Vector<D>, Vector<D>), x| (low.inf(x), high.sup(x)),
    );
    low + (high - low).map(|side| side * uniform())
}

impl<const D: usize> Tree<D> {
    fn new(root: &Vector<D>) -> Self {
        Self {
            points: vec![*root],
            ways: vec![(0, Vec::new())],
        }
    }

    /// Walks from the tree's point nearest to a goal as far toward it as the walk goes; `false`
    /// where that is nowhere.
    fn grow<E: Equations<D>>(
        &mut self,
        walker: &mut Walker<'_, D, E>,
        goal: &Vector<D>,
        gap: f64,
    ) -> bool {
        let squared = |i: &usize| (self.points[*i] - goal).norm_squared();
        let nearest = (0..self.points.len()).min_by(|a, b| squared(a).total_cmp(&squared(b)));
        let Some(nearest) = nearest else {
            return false;
        };
        let way = as_far(walker, &self.points[nearest], goal, gap);
        if way.len() < 2 {
            return false;
        }
        self.points.push(way[way.len() - 1]);
        self.ways.push((nearest, way));
        true
    }

    /// The way from the root to a point of the tree.
    fn way(&self, mut point: usize) -> Vec<Vector<D>> {
        let mut way = vec![self.points[point]];
        while point > 0 {
            let (before, piece) = &self.ways[point];
            way.extend(piece.iter().rev().skip(1));
            point = *before;
        }
        reversed(way)
    }
}
