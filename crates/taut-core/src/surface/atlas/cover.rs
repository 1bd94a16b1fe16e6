//! Fewer and larger charts, as large as an accuracy allows.
//!
//! The charts of the cells know which points lie on one sheet, and follow all that the points show.
//! Here groups of them are replaced by one polynomial each, from the top of a hierarchy downwards
//! as in the partition of unity of Ohtake, Belyaev, Alexa, Turk, Seidel (Multi-level partition of
//! unity implicits, 2003). A group whose polynomial misses one of its points by more than the
//! accuracy is halved. A chart that stands alone is kept where its group of one would not do
//! better.

use crate::Vector;
use crate::spatial::principal;
use crate::surface::atlas::build::{Built, Draft};
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::checks::LARGEST_RADIUS;
use crate::surface::atlas::links::{self, Link, STEEPEST_SECANT};
use crate::surface::atlas::scale;
use crate::surface::atlas::sheets::{Neighbourhood, Sheet, Workspace};

/// Factor by which a chart reaches farther than the points that it stands for.
const GROUP_MARGIN: f64 = 1.6;
/// Share of a chart's radius within which its weight matters.
const WEIGHED: f64 = 0.9;
/// Least cosine of the angle between normals of a group.
const WIDEST_GROUP: f64 = 0.4;

/// Charts that stand for groups of other charts.
pub(super) struct Covering<const D: usize> {
    pub built: Vec<Built<D>>,
    pub linked: Vec<Vec<Link>>,
    /// For each chart, the charts that it stands for.
    pub groups: Vec<Vec<u32>>,
}

/// Covers a draft by larger charts that keep to its points within `accuracy`, in the input's units.
/// O(n log n).
pub(super) fn cover<const D: usize>(draft: &Draft<D>, accuracy: f64) -> Covering<D> {
    let all = links::groups(&draft.linked);
    let larger = Larger {
        draft,
        accuracy,
        reaches: draft.built.iter().map(|b| reach(draft, b)).collect(),
    };
    let mut charts: Vec<u32> = (0..all.len() as u32).collect();
    charts.sort_unstable_by_key(|i| (all[*i as usize], *i));
    let components = charts.chunk_by(|a, b| all[*a as usize] == all[*b as usize]);
    let (groups, built): (Vec<_>, Vec<_>) = components
        .flat_map(|component| larger.halved(component.to_vec()))
        .unzip();
    Covering {
        linked: linked(draft, &groups, &built),
        built,
        groups,
    }
}

/// The largest distance of a chart's own points from its origin.
fn reach<const D: usize>(draft: &Draft<D>, built: &Built<D>) -> f64 {
    let own = built.own.iter();
    own.map(|p| (draft.tree.points[*p as usize] - built.chart.origin).norm())
        .fold(0.0, f64::max)
}

/// What is needed to replace groups of charts by larger charts.
struct Larger<'a, const D: usize> {
    draft: &'a Draft<D>,
    accuracy: f64,
    reaches: Vec<f64>,
}

impl<const D: usize> Larger<'_, D> {
    fn chart(&self, i: u32) -> &Chart<D> {
        &self.draft.built[i as usize].chart
    }

    /// The charts that stand for a connected group: one, or those of its halves.
    fn halved(&self, group: Vec<u32>) -> Vec<(Vec<u32>, Built<D>)> {
        if let Some(built) = self.one(&group) {
            return vec![(group, built)];
        }
        if let [alone] = group[..] {
            return vec![(group, self.draft.built[alone as usize].clone())];
        }
        let (low, high) = self.halves(group);
        let (mut low, high) = rayon::join(|| self.pieces(low), || self.pieces(high));
        low.extend(high);
        low
    }

    /// The charts that stand for the connected parts of a group.
    fn pieces(&self, group: Vec<u32>) -> Vec<(Vec<u32>, Built<D>)> {
        let pieces = self.connected(&group).into_iter();
        pieces.flat_map(|piece| self.halved(piece)).collect()
    }

    /// Halves of equal size along the longest principal axis.
    fn halves(&self, mut group: Vec<u32>) -> (Vec<u32>, Vec<u32>) {
        let origins = group.iter().map(|i| self.chart(*i).origin);
        let axis = match principal::eigen(&principal::scatter(origins)) {
            Some((_, axes)) => axes.column(D - 1).into_owned(),
            None => Vector::repeat(1.0),
        };
        let along = |i: &u32| axis.dot(&self.chart(*i).origin);
        group.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        let high = group.split_off(group.len() / 2);
        (group, high)
    }

    /// The parts of a group that links connect.
    fn connected(&self, group: &[u32]) -> Vec<Vec<u32>> {
        let mut left: std::collections::HashSet<u32> = group.iter().copied().collect();
        let mut parts = Vec::new();
        for first in group {
            if !left.remove(first) {
                continue;
            }
            let mut part = vec![*first];
            let mut next = 0;
            while let Some(chart) = part.get(next) {
                for (other, _) in &self.draft.linked[*chart as usize] {
                    if left.remove(other) {
                        part.push(*other);
                    }
                }
                next += 1;
            }
            parts.push(part);
        }
        parts
    }

    /// One chart for a connected group; `None` where it would miss a point by more than the
    /// accuracy.
    fn one(&self, group: &[u32]) -> Option<Built<D>> {
        let draft = self.draft;
        let point = |p: &u32| draft.tree.points[*p as usize];
        let own = || {
            group
                .iter()
                .flat_map(|i| draft.built[*i as usize].own.iter().map(move |p| (*i, *p)))
        };
        let mean =
            own().fold(Vector::zeros(), |sum, (_, p)| sum + point(&p)) / own().count() as f64;
        let gap = |p: &(u32, u32)| (point(&p.1) - mean).norm_squared();
        let (middle, seed) = own().min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
        if !self.flat(middle, group) {
            return None;
        }
        let centre = point(&seed);
        let own: Vec<u32> = own().map(|(_, p)| p).collect();
        let far = own
            .iter()
            .map(|p| (point(p) - centre).norm())
            .fold(0.0, f64::max);
        let radius = GROUP_MARGIN * far.max(2.0 * self.chart(middle).spacing);
        let members = self.members(middle, &centre, radius);
        let sheet = Sheet::new(&draft.tree, &draft.monomials, seed);
        let neighbourhood = Neighbourhood {
            members,
            frame: self.chart(middle).frame,
        };
        let fitted = scale::fit_chart(&sheet, &neighbourhood, &mut Workspace::default())?;
        let mut chart = fitted.chart;
        // The middle chart may know points that are farther off than these.
        chart.radius = radius.min(LARGEST_RADIUS * chart.scale);
        chart.height_error = chart.residual;
        let members = neighbourhood.members;
        let m = D - draft.monomials.variables;
        let keeps = |p: &u32| {
            let x = point(p);
            if (x - centre).norm() > WEIGHED * radius {
                return true;
            }
            let mut offsets = [0.0; D];
            chart.offsets(&draft.monomials, &x, &mut offsets);
            let squared: f64 = offsets[..m].iter().map(|v| v * v).sum();
            squared <= self.accuracy * self.accuracy
                && chart.steepness(&draft.monomials, &x) <= STEEPEST_SECANT
        };
        members.iter().all(keeps).then_some(Built {
            chart,
            members,
            own,
        })
    }

    /// Whether the normals of a group differ little enough for a height over one plane.
    fn flat(&self, middle: u32, group: &[u32]) -> bool {
        let m = D - self.draft.monomials.variables;
        let normal = self.chart(middle).frame.column(0).into_owned();
        m > 1
            || group
                .iter()
                .all(|i| normal.dot(&self.chart(*i).frame.column(0)).abs() >= WIDEST_GROUP)
    }

    /// The points within a radius that links lead to from a chart.
    fn members(&self, from: u32, centre: &Vector<D>, radius: f64) -> Vec<u32> {
        let mut seen = std::collections::HashSet::from([from]);
        let mut charts = vec![from];
        let mut members = Vec::new();
        let mut next = 0;
        while let Some(chart) = charts.get(next).copied() {
            let own = self.draft.built[chart as usize].own.iter().copied();
            members.extend(
                own.filter(|p| (self.draft.tree.points[*p as usize] - centre).norm() <= radius),
            );
            for (other, _) in &self.draft.linked[chart as usize] {
                let gap = (self.chart(*other).origin - centre).norm();
                if gap <= radius + self.reaches[*other as usize] && seen.insert(*other) {
                    charts.push(*other);
                }
            }
            next += 1;
        }
        members
    }
}

/// The links of charts that stand for groups, from the links of the charts in the groups.
fn linked<const D: usize>(
    draft: &Draft<D>,
    groups: &[Vec<u32>],
    built: &[Built<D>],
) -> Vec<Vec<Link>> {
    let mut group_of = vec![0; draft.built.len()];
    for (i, group) in groups.iter().enumerate() {
        for chart in group {
            group_of[*chart as usize] = i;
        }
    }
    // This is the side of its group's normal on which a chart's normal is.
    let side = |chart: u32| {
        let x = &draft.built[chart as usize].chart;
        let normal = built[group_of[chart as usize]]
            .chart
            .normal(&draft.monomials, &x.origin);
        if normal.dot(&x.frame.column(0)) >= 0.0 {
            1
        } else {
            -1
        }
    };
    let sides: Vec<i8> = (0..draft.built.len() as u32).map(side).collect();
    let mut votes: Vec<((usize, u32), i8)> = Vec::new();
    for (chart, links) in draft.linked.iter().enumerate() {
        for (other, turn) in links {
            let pair = (group_of[chart], group_of[*other as usize] as u32);
            if pair.0 != pair.1 as usize {
                votes.push((pair, sides[chart] * turn * sides[*other as usize]));
            }
        }
    }
    votes.sort_unstable();
    let mut linked = vec![Vec::new(); groups.len()];
    for votes in votes.chunk_by(|a, b| a.0 == b.0) {
        let (from, to) = votes[0].0;
        let sum: i32 = votes.iter().map(|vote| i32::from(vote.1)).sum();
        linked[from].push((to, if sum >= 0 { 1 } else { -1 }));
    }
    linked
}
