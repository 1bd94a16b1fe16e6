//! Building the atlas: cells, charts, and the graph of charts that share points.

use rayon::prelude::*;

use crate::cloud::Cloud;
use crate::error::Error;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::fit;
use crate::surface::atlas::polynomial::Monomials;
use crate::surface::atlas::sheets::{self, Neighbourhood};
use crate::surface::atlas::{Atlas, Lists};
use crate::{Matrix, Vector};

/// A chart with the points it was fitted to and those of its cell, as tree indices.
struct Built<const D: usize> {
    chart: Chart<D>,
    members: Vec<u32>,
    own: Vec<u32>,
}

/// A fit whose scatter exceeds this many spacings may gain from more points.
const NOISY: f64 = 0.02;
/// Most points of a chart's fit, in multiples of the smallest neighbourhood.
const MOST_GROWTH: usize = 16;
/// Growth stops when the scatter rises by this factor: the model no longer follows the surface.
const RISE: f64 = 1.15;

impl<const D: usize> Atlas<D> {
    /// A smooth surface of dimension `intrinsic_dimension` through the points.
    ///
    /// # Errors
    /// [`Error::TooFewPoints`] or [`Error::NoTangentPlane`] where the points carry no such surface.
    ///
    /// O(n log n) time, O(n) memory.
    pub fn new(cloud: Cloud<D>, intrinsic_dimension: usize) -> Result<Self, Error> {
        let monomials = Monomials::new(intrinsic_dimension);
        let needed = intrinsic_dimension + 2;
        if cloud.points.len() < needed {
            return Err(Error::TooFewPoints {
                found: cloud.points.len(),
                needed,
            });
        }
        let tree = Tree::new(&cloud.points);
        let built: Vec<Built<D>> = tree
            .leaves()
            .into_par_iter()
            .flat_map_iter(|leaf| cell(&tree, &monomials, leaf))
            .collect();
        if built.is_empty() {
            return Err(Error::NoTangentPlane {
                dimension: intrinsic_dimension,
            });
        }
        let mut owner_in_tree = vec![u32::MAX; cloud.points.len()];
        for (i, b) in built.iter().enumerate() {
            for point in &b.own {
                owner_in_tree[*point as usize] = i as u32;
            }
        }
        let neighbours = neighbours(&built, &owner_in_tree, &monomials, &tree);
        let charts: Vec<Chart<D>> = built.into_iter().map(|b| b.chart).collect();
        adopt(&tree, &mut owner_in_tree, &charts);
        let mut owners = vec![0; cloud.points.len()];
        for (owner, index) in owner_in_tree.iter().zip(&tree.order) {
            owners[*index as usize] = *owner;
        }
        Ok(Self {
            cloud,
            charts,
            owners,
            neighbours,
            monomials,
            tree,
        })
    }
}

/// The charts of one cell: one per sheet, seeded from the points not yet covered.
fn cell<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    leaf: std::ops::Range<usize>,
) -> Vec<Built<D>> {
    let mut left: Vec<u32> = leaf.map(|i| i as u32).collect();
    let mut built = Vec::new();
    let mut found = Vec::new();
    while !left.is_empty() {
        let mean = left.iter().fold(Vector::<D>::zeros(), |sum, i| {
            sum + tree.points[*i as usize]
        }) / left.len() as f64;
        let gap = |i: &u32| (tree.points[*i as usize] - mean).norm_squared();
        let Some(seed) = left
            .iter()
            .copied()
            .min_by(|a, b| gap(a).total_cmp(&gap(b)))
        else {
            break;
        };
        let chart = chart(tree, monomials, seed, &mut found);
        let Some((chart, members)) = chart.filter(|(_, members)| members.contains(&seed)) else {
            // An outlier, or no surface here: adopted by a chart later.
            left.retain(|i| *i != seed);
            continue;
        };
        let (own, rest): (Vec<u32>, Vec<u32>) = left.iter().partition(|i| members.contains(i));
        left = rest;
        built.push(Built {
            chart,
            members,
            own,
        });
    }
    built
}

/// Fits the chart around a point: the smallest neighbourhood if its points are clean, larger ones
/// while that only averages noise (Lepski's rule).
fn chart<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    seed: u32,
    found: &mut Vec<Neighbour>,
) -> Option<(Chart<D>, Vec<u32>)> {
    let smallest = 3 * monomials.count(4) + 5;
    let neighbourhood = sheets::grow(tree, monomials, seed, smallest, found)?;
    let first = fit_chart(tree, monomials, seed, &neighbourhood)?;
    let members = neighbourhood.members;
    let (mut best, mut best_members) = (first.clone(), members);
    let mut growth = 2;
    while first.sigma > NOISY * first.chart.spacing && growth <= MOST_GROWTH {
        let Some(larger) = sheets::grow(tree, monomials, seed, growth * smallest, found) else {
            break;
        };
        let Some(next) = fit_chart(tree, monomials, seed, &larger) else {
            break;
        };
        let moved = (next.chart.origin - best.chart.origin).norm();
        let allowed = 2.0 * (next.chart.height_error + best.chart.height_error);
        if next.sigma > RISE * first.sigma || moved > allowed {
            break;
        }
        best = next;
        best_members = larger.members;
        growth *= 2;
    }
    best.chart.radius = first.chart.radius;
    best.chart.spacing = first.chart.spacing;
    Some((best.chart, best_members))
}

#[derive(Clone)]
struct Fitted<const D: usize> {
    chart: Chart<D>,
    sigma: f64,
}

/// Turns the frame to the surface at the seed, then fits the degree with the least leave-one-out error.
fn fit_chart<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    seed: u32,
    neighbourhood: &Neighbourhood<D>,
) -> Option<Fitted<D>> {
    let k = monomials.variables;
    let m = D - k;
    let mut frame = neighbourhood.frame;
    let mut origin = tree.points[seed as usize];
    for _ in 0..2 {
        let (samples, scale) = sheets::samples(tree, &origin, &neighbourhood.members, &frame, k);
        let Some(rough) = [2, 1]
            .iter()
            .find_map(|degree| fit::fit(monomials, *degree, &samples))
        else {
            break;
        };
        (origin, frame) = turned(&origin, &frame, &rough.coefficients, scale, k);
    }
    let (samples, scale) = sheets::samples(tree, &origin, &neighbourhood.members, &frame, k);
    let mut best: Option<(usize, fit::Fit)> = None;
    for degree in [1, 2, 3, 4] {
        if let Some(fitted) = fit::fit(monomials, degree, &samples)
            && best
                .as_ref()
                .is_none_or(|(_, b)| fitted.leave_one_out < b.leave_one_out)
        {
            best = Some((degree, fitted));
        }
    }
    let (degree, fitted) = best?;
    let count = monomials.count(degree);
    for a in 0..m {
        let height = fitted.coefficients[a * count];
        origin += frame.column(a) * height;
    }
    let mut coefficients = fitted.coefficients;
    for a in 0..m {
        coefficients[a * count] = 0.0;
    }
    Some(Fitted {
        chart: Chart {
            origin,
            frame,
            radius: scale,
            coefficients,
            degree: degree as u8,
            scale,
            spacing: neighbourhood.spacing,
            residual: fitted.leave_one_out,
            height_error: fitted.leave_one_out * fitted.leverage.sqrt().min(1.0),
        },
        sigma: fitted.sigma,
    })
}

/// The frame turned so that the fitted heights have no slope at the origin, which moves onto them.
fn turned<const D: usize>(
    origin: &Vector<D>,
    frame: &Matrix<D>,
    coefficients: &[f64],
    scale: f64,
    k: usize,
) -> (Vector<D>, Matrix<D>) {
    let m = D - k;
    let count = coefficients.len() / m;
    let mut moved = *origin;
    let mut turned = Matrix::<D>::zeros();
    for a in 0..m {
        moved += frame.column(a) * coefficients[a * count];
        let mut normal = frame.column(a).into_owned();
        for j in 0..k {
            normal -= frame.column(m + j) * (coefficients[a * count + 1 + j] / scale);
        }
        for b in 0..a {
            let done = turned.column(b).into_owned();
            normal -= done * done.dot(&normal);
        }
        turned.set_column(a, &normal.normalize());
    }
    sheets::complete(&mut turned, m);
    (moved, turned)
}

/// Charts that share points and agree where the other lies, then those two steps away whose supports
/// may meet in this chart's cell.
fn neighbours<const D: usize>(
    built: &[Built<D>],
    owners: &[u32],
    monomials: &Monomials,
    tree: &Tree<D>,
) -> Lists {
    let mut pairs: Vec<(u32, u32)> = built
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, b)| {
            let mut others: Vec<u32> = b
                .members
                .iter()
                .map(|p| owners[*p as usize])
                .filter(|j| *j != u32::MAX && *j as usize != i)
                .collect();
            others.sort_unstable();
            others.dedup();
            let i = i as u32;
            others.into_iter().flat_map(move |j| [(i, j), (j, i)])
        })
        .collect();
    pairs.par_sort_unstable();
    pairs.dedup();
    pairs.retain(|(i, j)| {
        agree(
            &built[*i as usize].chart,
            &built[*j as usize].chart,
            monomials,
        )
    });
    let mut direct = vec![Vec::new(); built.len()];
    for (i, j) in pairs {
        direct[i as usize].push(j);
    }
    let mut lists: Vec<Vec<u32>> = built
        .par_iter()
        .enumerate()
        .map(|(i, b)| {
            let cell = b
                .own
                .iter()
                .map(|p| (tree.points[*p as usize] - b.chart.origin).norm())
                .fold(0.0, f64::max);
            let mut reached: Vec<u32> = direct[i].clone();
            for j in &direct[i] {
                reached.extend_from_slice(&direct[*j as usize]);
            }
            reached.sort_unstable();
            reached.dedup();
            let gap = |j: u32| (built[j as usize].chart.origin - b.chart.origin).norm();
            reached.retain(|j| {
                *j as usize != i && gap(*j) < built[*j as usize].chart.radius + 1.5 * cell
            });
            reached.sort_by(|a, b| gap(*a).total_cmp(&gap(*b)).then(a.cmp(b)));
            reached.insert(0, i as u32);
            reached
        })
        .collect();
    symmetrise(&mut lists);
    Lists::from_vectors(&lists)
}

/// Adds j to i's list wherever i is in j's: the lists are a graph too.
fn symmetrise(lists: &mut [Vec<u32>]) {
    let known = &*lists;
    let missing: Vec<(usize, u32)> = known
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, list)| {
            list.iter()
                .map(move |j| (*j as usize, i as u32))
                .filter(|(j, i)| !known[*j].contains(i))
        })
        .collect();
    for (j, i) in missing {
        lists[j].push(i);
    }
}

/// Each chart's surface passes near the other's origin: the same sheet.
fn agree<const D: usize>(a: &Chart<D>, b: &Chart<D>, monomials: &Monomials) -> bool {
    let m = D - monomials.variables;
    let miss = |from: &Chart<D>, to: &Chart<D>| {
        let mut out = [0.0; D];
        from.offsets(monomials, &to.origin, &mut out);
        out[..m].iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    let (one, other) = (miss(a, b), miss(b, a));
    let slack = 0.35 * a.spacing.min(b.spacing) + 3.0 * (a.height_error + b.height_error);
    one.min(other) <= slack && one.max(other) <= 4.0 * slack
}

/// Points that no chart fitted go to the chart of the nearest point that has one.
fn adopt<const D: usize>(tree: &Tree<D>, owners: &mut [u32], charts: &[Chart<D>]) {
    debug_assert!(!charts.is_empty());
    let orphans: Vec<usize> = (0..owners.len())
        .filter(|i| owners[*i] == u32::MAX)
        .collect();
    let mut found: Vec<Neighbour> = Vec::new();
    let adopted: Vec<u32> = orphans
        .iter()
        .map(|orphan| {
            let mut count = 32;
            loop {
                tree.nearest(&tree.points[*orphan], count, &mut found);
                let near = found.iter().find(|n| owners[n.index as usize] != u32::MAX);
                if let Some(near) = near {
                    return owners[near.index as usize];
                }
                count *= 4;
            }
        })
        .collect();
    for (orphan, owner) in orphans.into_iter().zip(adopted) {
        owners[orphan] = owner;
    }
}
