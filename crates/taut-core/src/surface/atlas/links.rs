//! The graph of charts: which charts continue each other on one sheet, and which meet in a cell.

use rayon::slice::ParallelSliceMut;

use crate::spatial::tree::Tree;
use crate::surface::atlas::build::Built;
use crate::surface::atlas::chart::{Chart, ChartJet};
use crate::surface::atlas::polynomial::Monomials;
use crate::{Vector, parallel};

/// Roughness, as a multiple of the usual one, above which a chart is linked to none.
const ROUGHER: f64 = 5.0;
/// Roughness, in spacings, up to which a chart may be linked in any case.
const ROUGH_SPACINGS: f64 = 0.5;
/// Number of own points below which a group of charts is stray if others claim its points too.
const STRAY_POINTS: usize = 50;
/// Least share of the points that two charts have in common at which they must agree to be linked.
const SHARE: f64 = 0.5;
/// Usual residual of charts, in spacings, above which noise may fill the gap between sheets here
/// and there.
const BLURRED: f64 = 0.1;
/// Agreement of a chart with others, as a share of what is usual, below which it is linked to none
/// where noise may fill gaps.
const LONELY: f64 = 0.6;
/// Agreement of a chart with others, as a share of what is usual, below which it is linked to none
/// if it also fits badly.
const LESS: f64 = 0.85;
/// Residual of a chart, in usual residuals, above which it fits badly.
const WORSE: f64 = 1.6;
/// Largest secant of the angle between a chart's surface and its plane: a chart means nothing where
/// its surface is steeper than 60 degrees.
pub(super) const STEEPEST_SECANT: f64 = 2.0;
/// Least squared cosine of the angle between the normals of charts that agree.
const ALIGNED: f64 = 0.5;
/// Largest distance of a point from two charts that agree there, in spacings.
const AGREEING: f64 = 0.35;

/// A chart that continues another, and whether its normal points to the same side (1) or not (-1).
pub(super) type Link = (u32, i8);

/// What the points of one chart's fit that lie in the cell of another say about the two charts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Vote {
    pair: (u32, u32),
    shared: u32,
    agreeing: u32,
    /// The number of agreeing points at which the normals point to the same side, less that of the
    /// other agreeing points.
    same_side: i32,
}

/// For each chart, the charts that share points with it and agree with it there.
pub(super) fn links<const D: usize>(
    built: &[Built<D>],
    owners: &[u32],
    monomials: &Monomials,
    tree: &Tree<D>,
) -> Vec<Vec<Link>> {
    let usual = Usual::of(built);
    let of = |i: usize| -> Vec<Vote> {
        let b = &built[i];
        let members = b.members.iter().map(|p| (owners[*p as usize], *p));
        let mut others: Vec<(u32, u32)> = members
            .filter(|(j, _)| *j != u32::MAX && *j as usize != i)
            .collect();
        others.sort_unstable();
        let shared = others.chunk_by(|a, b| a.0 == b.0);
        let votes = shared.map(|shared| {
            let (i, j) = (i as u32, shared[0].0);
            let mut vote = Vote {
                pair: (i.min(j), i.max(j)),
                shared: shared.len() as u32,
                agreeing: 0,
                same_side: 0,
            };
            for (_, p) in shared {
                let x = &tree.points[*p as usize];
                let other = &built[j as usize].chart;
                if let Some(side) = usual.agree(&b.chart, other, x, monomials) {
                    vote.agreeing += 1;
                    vote.same_side += i32::from(side);
                }
            }
            vote
        });
        votes.collect()
    };
    let mut votes = parallel::map(built.len(), of).concat();
    votes.par_sort_unstable();
    let lonely = lonely(&votes, built, &usual);
    let mut links = vec![Vec::new(); built.len()];
    // All votes of a pair decide together whether its charts are linked, and on which side their
    // normals are.
    for votes in votes.chunk_by(|a, b| a.pair == b.pair) {
        let (i, j) = votes[0].pair;
        let sum = |of: fn(&Vote) -> i32| votes.iter().map(of).sum::<i32>();
        let agreeing = f64::from(sum(|v| v.agreeing as i32));
        let rough = [i, j]
            .iter()
            .any(|c| lonely[*c as usize] || usual.rough(&built[*c as usize].chart));
        if !rough && agreeing >= SHARE * f64::from(sum(|v| v.shared as i32)) {
            let side = if sum(|v| v.same_side) >= 0 { 1 } else { -1 };
            links[i as usize].push((j, side));
            links[j as usize].push((i, side));
        }
    }
    links
}

/// Which charts agree with the others at far fewer of the points that they share than charts of
/// this cloud usually do, or at fewer and fit their points worse as well. They are fits across
/// layers that agree with one layer or the other by chance, and would join them.
fn lonely<const D: usize>(votes: &[Vote], built: &[Built<D>], usual: &Usual) -> Vec<bool> {
    if usual.roughness < BLURRED {
        return vec![false; built.len()];
    }
    let mut sums = vec![[0_u32; 2]; built.len()];
    for vote in votes {
        for chart in [vote.pair.0, vote.pair.1] {
            let [agreeing, shared] = &mut sums[chart as usize];
            *agreeing += vote.agreeing;
            *shared += vote.shared;
        }
    }
    let share = |[agreeing, shared]: &[u32; 2]| f64::from(*agreeing) / f64::from((*shared).max(1));
    let median = median(sums.iter().map(share));
    let is_lonely = |(b, sum): (&Built<D>, _)| {
        let worse = b.chart.residual > WORSE * usual.roughness * b.chart.spacing;
        share(sum) < median * if worse { LESS } else { LONELY }
    };
    built.iter().zip(&sums).map(is_lonely).collect()
}

/// Removes small groups of charts that share fitted points with others yet agree with none of them:
/// fits across layers, along rings of points, or to outliers. Their points are adopted later.
/// Returns whether there were any.
pub(super) fn drop_stray<const D: usize>(
    built: &mut Vec<Built<D>>,
    links: &[Vec<Link>],
    owners: &[u32],
) -> bool {
    let groups = groups(links);
    let mut points = vec![0; built.len()];
    for (b, group) in built.iter().zip(&groups) {
        points[*group as usize] += b.own.len();
    }
    let mut contested = vec![false; built.len()];
    for (b, group) in built.iter().zip(&groups) {
        let mut others = b.members.iter().map(|p| owners[*p as usize]);
        contested[*group as usize] |= others.any(|o| o != u32::MAX && groups[o as usize] != *group);
    }
    let stray = |group: u32| points[group as usize] < STRAY_POINTS && contested[group as usize];
    if groups.iter().all(|group| stray(*group)) {
        return false;
    }
    let before = built.len();
    let mut group = groups.iter();
    built.retain(|_| group.next().is_some_and(|group| !stray(*group)));
    built.len() < before
}

/// The connected group of each chart, named by its lowest chart.
pub(super) fn groups(links: &[Vec<Link>]) -> Vec<u32> {
    let mut groups = vec![u32::MAX; links.len()];
    let mut stack = Vec::new();
    for first in 0..links.len() as u32 {
        if groups[first as usize] != u32::MAX {
            continue;
        }
        groups[first as usize] = first;
        stack.push(first);
        while let Some(chart) = stack.pop() {
            for (next, _) in &links[chart as usize] {
                if groups[*next as usize] == u32::MAX {
                    groups[*next as usize] = first;
                    stack.push(*next);
                }
            }
        }
    }
    groups
}

/// For each chart, the charts whose supports may reach its cell: itself first, then the others by
/// distance.
///
/// Each chart's support floods the cells that it reaches along the links. So whatever cell a point
/// is seen from, the same charts are blended there, and the surface is continuous.
pub(super) fn neighbours<const D: usize>(
    built: &[Built<D>],
    links: &[Vec<Link>],
    tree: &Tree<D>,
) -> Vec<Vec<Link>> {
    let origin = |i: u32| built[i as usize].chart.origin;
    let gap = |i: u32, j: u32| (origin(i) - origin(j)).norm();
    let cell = |i: usize| {
        let points = built[i].own.iter();
        let own = points.map(|p| (tree.points[*p as usize] - origin(i as u32)).norm());
        let halves = links[i].iter().map(|j| 0.5 * gap(i as u32, j.0));
        own.chain(halves).fold(0.0, f64::max)
    };
    let cells = parallel::map(built.len(), cell);
    let reached = |i: usize| {
        let radius = built[i].chart.radius;
        let i = i as u32;
        let mut reached: Vec<Link> = vec![(i, 1)];
        let mut next = 0;
        while let Some((from, side)) = reached.get(next).copied() {
            next += 1;
            for (j, turn) in &links[from as usize] {
                // Charts that are linked directly are neighbours in the graph at any distance.
                let near = from == i || gap(i, *j) < radius + cells[*j as usize];
                if near && reached.iter().all(|r| r.0 != *j) {
                    reached.push((*j, side * turn));
                }
            }
        }
        reached
    };
    let mut lists = parallel::map(built.len(), reached);
    symmetrise(&mut lists);
    parallel::map(lists.len(), |i| {
        let mut list = lists[i].clone();
        let gap = |j| gap(i as u32, j);
        list[1..].sort_unstable_by(|a, b| gap(a.0).total_cmp(&gap(b.0)).then(a.0.cmp(&b.0)));
        list
    })
}

/// Adds j to i's list wherever i is in j's list.
fn symmetrise(lists: &mut [Vec<Link>]) {
    let known = &*lists;
    let missing = |i: usize| -> Vec<(usize, Link)> {
        let links = known[i].iter();
        links
            .map(|(j, side)| (*j as usize, (i as u32, *side)))
            .filter(|(j, (i, _))| known[*j].iter().all(|k| k.0 != *i))
            .collect()
    };
    for (j, link) in parallel::map(known.len(), missing).concat() {
        lists[j].push(link);
    }
}

/// How well charts of this cloud usually fit, against which a single chart is held.
struct Usual {
    height_error: f64,
    /// The usual residual, in spacings.
    roughness: f64,
}

impl Usual {
    fn of<const D: usize>(built: &[Built<D>]) -> Self {
        Self {
            height_error: median(built.iter().map(|b| b.chart.height_error)),
            roughness: median(built.iter().map(|b| b.chart.residual / b.chart.spacing)),
        }
    }

    /// Whether a chart fits its points much worse than others do.
    fn rough<const D: usize>(&self, chart: &Chart<D>) -> bool {
        chart.residual > chart.spacing * (ROUGHER * self.roughness).max(ROUGH_SPACINGS)
    }

    /// Whether both charts' surfaces pass near a point that they share, in the same direction: 1
    /// where their normals point to the same side there, -1 where they do not, and `None` where the
    /// charts do not agree.
    fn agree<const D: usize>(
        &self,
        a: &Chart<D>,
        b: &Chart<D>,
        x: &Vector<D>,
        monomials: &Monomials,
    ) -> Option<i8> {
        let m = D - monomials.variables;
        let (mut one, mut other) = (ChartJet::new(), ChartJet::new());
        a.jet(monomials, x, &mut one);
        b.jet(monomials, x, &mut other);
        let limit = 3.0 * self.height_error;
        let errors = a.height_error.min(limit) + b.height_error.min(limit);
        let slack = AGREEING * a.spacing.max(b.spacing) + 3.0 * errors;
        let passes = |jet: &ChartJet<D>| {
            let slopes = &jet.gradient[..m];
            let heights = jet.value[..m].iter().zip(slopes);
            let squared: f64 = heights.map(|(v, g)| v * v / g.norm_squared()).sum();
            squared <= slack * slack && slopes.iter().all(|g| g.norm() <= STEEPEST_SECANT)
        };
        let along = |normal: &Vector<D>| {
            let cosines = other.gradient[..m].iter();
            let squared = cosines.map(|g| normal.dot(g).powi(2) / g.norm_squared());
            squared.sum::<f64>() >= ALIGNED * normal.norm_squared()
        };
        (passes(&one) && passes(&other) && one.gradient[..m].iter().all(along)).then(|| {
            if one.gradient[0].dot(&other.gradient[0]) >= 0.0 {
                1
            } else {
                -1
            }
        })
    }
}

/// The median of some values; 0 of none.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
