//! Building the atlas: cells, charts, and the graph of charts that share points.

use rayon::prelude::*;

use crate::cloud::Cloud;
use crate::error::Error;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::fit::Factored;
use crate::surface::atlas::polynomial::Monomials;
use crate::surface::atlas::rim::Rim;
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
/// Radii of charts that one element of a path may span where charts are noisy.
const DETAIL: f64 = 2.0;
/// Most points of a chart's fit, in multiples of the smallest neighbourhood.
const MOST_GROWTH: usize = 16;
/// A higher degree must bring the leave-one-out error below this share of the best lower one's.
const DEGREE_GAIN: f64 = 0.95;
/// A smaller neighbourhood must bring it below this share of a larger one's.
const SMALLER_GAIN: f64 = 0.7;
/// Residuals that correlate more than this with their neighbours' are the surface's, not noise.
const MISFIT: f64 = 0.35;
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
        let mut built: Vec<Built<D>> = tree
            .leaves()
            .into_par_iter()
            .flat_map_iter(|leaf| cell(&tree, &monomials, leaf))
            .collect();
        if built.is_empty() {
            return Err(Error::NoTangentPlane {
                dimension: intrinsic_dimension,
            });
        }
        let mut owner_in_tree = owners(&built, cloud.points.len());
        let mut links = links(&built, &owner_in_tree, &monomials);
        if drop_stray(&mut built, &links) {
            owner_in_tree = owners(&built, cloud.points.len());
            links = self::links(&built, &owner_in_tree, &monomials);
        }
        let neighbours = neighbours(&built, &links, &tree);
        let own: Vec<Vec<u32>> = built.iter().map(|b| b.own.clone()).collect();
        let charts: Vec<Chart<D>> = built.into_iter().map(|b| b.chart).collect();
        let roughness = median(charts.iter().map(|c| c.residual / c.spacing));
        let detail = if roughness > NOISY {
            DETAIL * median(charts.iter().map(|c| c.radius))
        } else {
            0.0
        };
        let rim = Rim::new(
            &charts,
            &own,
            &tree.points,
            &neighbours,
            intrinsic_dimension,
        );
        let outliers = owner_in_tree.iter().filter(|o| **o == u32::MAX).count();
        adopt(&tree, &monomials, &mut owner_in_tree, &charts);
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
            rim,
            outliers,
            detail,
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
        let mut chart = chart;
        let extent = own
            .iter()
            .map(|i| (tree.points[*i as usize] - chart.origin).norm())
            .fold(2.0 * chart.spacing, f64::max);
        // Every point of the cell lies well inside the support.
        chart.radius = chart.radius.max(1.25 * extent);
        built.push(Built {
            chart,
            members,
            own,
        });
    }
    built
}

/// Fits the chart around a point. Clean points get the usual neighbourhood; where residuals of
/// neighbours agree, the surface turns within few spacings and smaller ones are tried; where they do
/// not, they are noise, and larger ones are taken while that only averages it (Lepski's rule).
fn chart<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    seed: u32,
    found: &mut Vec<Neighbour>,
) -> Option<(Chart<D>, Vec<u32>)> {
    let usual = 3 * monomials.count(4) + 5;
    let mut fit = |wanted: usize| {
        let neighbourhood = sheets::grow(tree, monomials, seed, wanted, found)?;
        let fitted = fit_chart(tree, monomials, seed, &neighbourhood)?;
        Some((fitted, neighbourhood.members))
    };
    let first = fit(usual);
    let clean = |f: &Fitted<D>| f.chart.residual <= NOISY * f.chart.spacing;
    if let Some((fitted, members)) = &first
        && clean(fitted)
    {
        return Some((fitted.chart.clone(), members.clone()));
    }
    if first
        .as_ref()
        .is_none_or(|(fitted, _)| fitted.misfit > MISFIT)
    {
        let smaller = [usual / 2, usual / 4 + 1].into_iter().filter_map(&mut fit);
        let mut candidates = first.into_iter().chain(smaller);
        let mut best = candidates.next()?;
        for candidate in candidates {
            if candidate.0.chart.residual < SMALLER_GAIN * best.0.chart.residual {
                best = candidate;
            }
        }
        return Some((best.0.chart, best.1));
    }
    let mut best = first?;
    let first = best.0.clone();
    let mut growth = 2;
    while growth <= MOST_GROWTH {
        let Some((next, members)) = fit(growth * usual) else {
            break;
        };
        let moved = (next.chart.origin - best.0.chart.origin).norm();
        let allowed = 2.0 * (next.chart.height_error + best.0.chart.height_error);
        if next.sigma > RISE * first.sigma || moved > allowed || next.misfit > MISFIT {
            break;
        }
        best = (next, members);
        growth *= 2;
    }
    let mut chart = best.0.chart;
    chart.radius = chart.radius.min(first.chart.radius);
    chart.spacing = first.chart.spacing;
    Some((chart, best.1))
}

#[derive(Clone)]
struct Fitted<const D: usize> {
    chart: Chart<D>,
    sigma: f64,
    /// See [`Factored::misfit`]; only looked at where the fit is not clean.
    misfit: f64,
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
    let (samples, scale) = sheets::samples(tree, &origin, &neighbourhood.members, &frame, k);
    if let Some(rough) = Factored::new(monomials, 2, &samples) {
        let coefficients = rough.coefficients(monomials, rough.degree);
        (origin, frame) = turned(&origin, &frame, &coefficients, scale, k);
    }
    let (samples, scale) = sheets::samples(tree, &origin, &neighbourhood.members, &frame, k);
    let factored = Factored::new(monomials, 4, &samples)?;
    let qualities = factored.qualities(monomials, &samples);
    let mut best = (1, *qualities.first()?);
    for candidate in (1..).zip(qualities) {
        if candidate.1.leave_one_out < DEGREE_GAIN * best.1.leave_one_out {
            best = candidate;
        }
    }
    let (degree, quality) = best;
    let spacing = spread(scale, neighbourhood.members.len(), k);
    let misfit = if quality.leave_one_out > NOISY * spacing {
        factored.misfit(monomials, degree, &samples)
    } else {
        0.0
    };
    let mut coefficients = factored.coefficients(monomials, degree);
    let count = monomials.count(degree);
    for a in 0..m {
        origin += frame.column(a) * std::mem::take(&mut coefficients[a * count]);
    }
    Some(Fitted {
        chart: Chart {
            origin,
            frame,
            radius: scale,
            coefficients,
            degree: degree as u8,
            scale,
            spacing,
            residual: quality.leave_one_out,
            height_error: quality.leave_one_out
                * factored
                    .variance_at_origin(monomials, degree)
                    .sqrt()
                    .min(1.0),
        },
        sigma: quality.sigma,
        misfit,
    })
}

/// The distance of neighbouring points among `count` spread evenly over a k-ball.
fn spread(radius: f64, count: usize, k: usize) -> f64 {
    radius * (sheets::unit_ball(k) / count as f64).powf(1.0 / k as f64)
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

/// The chart of each point, as tree indices; `u32::MAX` for points of no chart.
fn owners<const D: usize>(built: &[Built<D>], count: usize) -> Vec<u32> {
    let mut owners = vec![u32::MAX; count];
    for (i, b) in built.iter().enumerate() {
        for point in &b.own {
            owners[*point as usize] = i as u32;
        }
    }
    owners
}

/// For each chart, the charts that share points with it and agree where the other lies.
fn links<const D: usize>(
    built: &[Built<D>],
    owners: &[u32],
    monomials: &Monomials,
) -> Vec<Vec<u32>> {
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
    let usual = Usual::of(built);
    let chart = |i: u32| &built[i as usize].chart;
    pairs.retain(|(i, j)| usual.agree(chart(*i), chart(*j), monomials));
    let mut links = vec![Vec::new(); built.len()];
    for (i, j) in pairs {
        links[i as usize].push(j);
    }
    links
}

/// Removes rough charts that agree with no other: fits across layers or to outliers. Their points
/// are adopted later. Returns whether there were any.
fn drop_stray<const D: usize>(built: &mut Vec<Built<D>>, links: &[Vec<u32>]) -> bool {
    let usual = Usual::of(built);
    let before = built.len();
    let mut list = links.iter();
    built.retain(|b| {
        let linked = list.next().is_some_and(|l| !l.is_empty());
        linked || !usual.rough(&b.chart)
    });
    // Where every chart is stray there is nothing better.
    built.len() < before && !built.is_empty()
}

/// The direct links, then the charts two steps away whose supports may meet in this chart's cell.
fn neighbours<const D: usize>(built: &[Built<D>], direct: &[Vec<u32>], tree: &Tree<D>) -> Lists {
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

/// How well charts of this cloud usually fit: what to hold a single one against.
struct Usual {
    height_error: f64,
    /// Residual in spacings.
    roughness: f64,
}

/// A chart this many times rougher than usual, and at least [`ROUGH_SPACINGS`], is rough.
const ROUGH: f64 = 5.0;
const ROUGH_SPACINGS: f64 = 0.15;

impl Usual {
    fn of<const D: usize>(built: &[Built<D>]) -> Self {
        Self {
            height_error: median(built.iter().map(|b| b.chart.height_error)),
            roughness: median(built.iter().map(|b| b.chart.residual / b.chart.spacing)),
        }
    }

    /// The chart fits its points much worse than others do.
    fn rough<const D: usize>(&self, chart: &Chart<D>) -> bool {
        chart.residual > chart.spacing * (ROUGH * self.roughness).max(ROUGH_SPACINGS)
    }

    /// Each chart's surface passes near the other's origin: the same sheet. A rough chart must not
    /// join what others keep apart, so it has to agree more closely, in direction too.
    fn agree<const D: usize>(&self, a: &Chart<D>, b: &Chart<D>, monomials: &Monomials) -> bool {
        let m = D - monomials.variables;
        let miss = |from: &Chart<D>, to: &Chart<D>| {
            let mut out = [0.0; D];
            from.offsets(monomials, &to.origin, &mut out);
            out[..m].iter().map(|v| v * v).sum::<f64>().sqrt()
        };
        let (one, other) = (miss(a, b), miss(b, a));
        let limit = 3.0 * self.height_error;
        let errors = a.height_error.min(limit) + b.height_error.min(limit);
        let slack = 0.35 * a.spacing.max(b.spacing) + 3.0 * errors;
        if self.rough(a) || self.rough(b) {
            let turned = (0..m).any(|i| {
                let normal = a.frame.column(i);
                let kept: f64 = (0..m).map(|j| normal.dot(&b.frame.column(j)).powi(2)).sum();
                kept < 0.5
            });
            return one.max(other) <= slack && !turned;
        }
        one.min(other) <= slack && one.max(other) <= 4.0 * slack
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Points that no chart fitted go to the chart of a near point whose surface passes nearest to them:
/// the nearest point may lie on another sheet.
fn adopt<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    owners: &mut [u32],
    charts: &[Chart<D>],
) {
    let orphans: Vec<usize> = (0..owners.len())
        .filter(|i| owners[*i] == u32::MAX)
        .collect();
    let m = D - monomials.variables;
    let mut found: Vec<Neighbour> = Vec::new();
    let miss = |point: &Vector<D>, owner: u32| {
        let mut offsets = [0.0; D];
        charts[owner as usize].offsets(monomials, point, &mut offsets);
        offsets[..m].iter().map(|v| v * v).sum::<f64>()
    };
    let adopted: Vec<u32> = orphans
        .iter()
        .map(|orphan| {
            let point = &tree.points[*orphan];
            let mut count = 32;
            loop {
                tree.nearest(point, count, &mut found);
                let near = found.iter().map(|n| owners[n.index as usize]);
                let best = near
                    .filter(|owner| *owner != u32::MAX)
                    .min_by(|a, b| miss(point, *a).total_cmp(&miss(point, *b)));
                if let Some(owner) = best {
                    return owner;
                }
                count *= 4;
            }
        })
        .collect();
    for (orphan, owner) in orphans.into_iter().zip(adopted) {
        owners[orphan] = owner;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roll of seven turns on a jittered grid of step 0.02, layers `gap` apart; with each point's angle.
    fn roll(gap: f64) -> (Vec<f64>, Vec<f64>) {
        let mut state = 1_u64;
        let mut jitter = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            0.02 * (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let growth = gap / std::f64::consts::TAU;
        let (mut coordinates, mut angles) = (Vec::new(), Vec::new());
        let mut start = 0.0;
        while start < 7.0 * std::f64::consts::TAU {
            for j in 0..50 {
                let angle = start + jitter() / (0.3 + growth * start);
                let radius = 0.3 + growth * angle;
                coordinates.extend([
                    radius * angle.cos(),
                    radius * angle.sin(),
                    0.02 * f64::from(j) + jitter(),
                ]);
                angles.push(angle);
            }
            start += 0.02 / (0.3 + growth * start);
        }
        (coordinates, angles)
    }

    /// How many neighbouring charts lie on different layers, and on how many components charts are.
    fn joined(gap: f64) -> (usize, usize) {
        let (coordinates, angles) = roll(gap);
        let cloud = Cloud::<3>::new(&coordinates, 3).expect("finite");
        let atlas = Atlas::new(cloud, 2).expect("a surface");
        let mut angle = vec![f64::NAN; atlas.charts.len()];
        for (owner, a) in atlas.owners.iter().zip(&angles) {
            angle[*owner as usize] = *a;
        }
        let mut wrong = 0;
        for (i, a) in angle.iter().enumerate() {
            let others = atlas.neighbours.of(i as u32).iter();
            wrong += others
                .filter(|j| (angle[**j as usize] - a).abs() > 2.0)
                .count();
        }
        let geodesics = crate::geodesics::Geodesics::of_atlas(atlas);
        (wrong, geodesics.component_sizes().len())
    }

    #[test]
    fn layers_two_nearest_distances_apart_stay_apart() {
        // The median distance to the nearest point of such a grid is 0.01526.
        for gap in [4.3, 3.0, 2.0] {
            assert_eq!(joined(gap * 0.01526), (0, 1), "gap {gap}");
        }
    }
}
