//! How well a sampling is spread, and whether it is denser where the surface curves.

use crate::spatial::tree::{Neighbour, Tree};
use crate::{Vector, parallel};

/// Measurements of a sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Mean distance to the nearest other point, in the surface's units.
    pub nearest: f64,
    /// Standard deviation over mean of the nearest neighbour's distance, in units of the spacing
    /// asked for there: 0 on a lattice, 0.52 for independent points of a plane.
    pub spread: f64,
    /// Spearman's rank correlation of the density with the curvature; 0 where all curvatures agree.
    pub density_follows_curvature: f64,
}

/// Number of neighbours from which the density about a point is estimated.
const DENSITY_NEIGHBOURS: usize = 12;
/// Share of the largest curvature below which two curvatures count as the same.
const SAME_CURVATURE: f64 = 1e-9;

impl Quality {
    /// Measures points with the curvature and the spacing asked for at each. O(n log n).
    pub(super) fn measure<const D: usize>(
        points: &[Vector<D>],
        curvatures: &[f64],
        spacings: &[f64],
    ) -> Self {
        if points.len() < 2 {
            return Self {
                nearest: 0.0,
                spread: 0.0,
                density_follows_curvature: 0.0,
            };
        }
        let tree = Tree::new(points);
        let of = |found: &mut Vec<Neighbour>, i: usize| {
            tree.nearest(&points[i], 1 + DENSITY_NEIGHBOURS, found);
            (found[1].squared.sqrt(), found[found.len() - 1].squared)
        };
        let distances = parallel::map_with(points.len(), Vec::new, of);
        let (nearest, far): (Vec<f64>, Vec<f64>) = distances.into_iter().unzip();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let relative: Vec<f64> = nearest.iter().zip(spacings).map(|(r, h)| r / h).collect();
        let centre = mean(&relative);
        let squares: Vec<f64> = relative.iter().map(|r| (r - centre).powi(2)).collect();
        let density: Vec<f64> = far.iter().map(|squared| -squared).collect();
        Self {
            nearest: mean(&nearest),
            spread: mean(&squares).sqrt() / centre,
            density_follows_curvature: rank_correlation(&density, &merged(curvatures)),
        }
    }
}

/// Curvatures rounded to steps, so that those which differ by rounding share a rank.
fn merged(curvatures: &[f64]) -> Vec<f64> {
    let step = SAME_CURVATURE * curvatures.iter().copied().fold(0.0, f64::max);
    if step == 0.0 {
        return curvatures.to_vec();
    }
    curvatures.iter().map(|c| (c / step).round()).collect()
}

/// Spearman's coefficient, the correlation of ranks. Tied values share the mean of their ranks; the
/// coefficient is 0 if all are tied.
fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (ranks(a), ranks(b));
    let middle = 0.5 * (a.len() as f64 - 1.0);
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - middle) * (b - middle)).sum()
    };
    let size = (product(&a, &a) * product(&b, &b)).sqrt();
    if size == 0.0 {
        0.0
    } else {
        product(&a, &b) / size
    }
}

/// The ranks of some values; tied values share the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for group in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let middle = first as f64 + 0.5 * (group.len() as f64 - 1.0);
        for i in group {
            ranks[*i] = middle;
        }
        first += group.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_correlate_as_spearman_says() {
        let rising = [1.0, 2.0, 4.0, 9.0];
        assert_eq!(rank_correlation(&rising, &[1.0, 8.0, 9.0, 20.0]), 1.0);
        assert_eq!(rank_correlation(&rising, &[3.0, 2.0, 1.0, 0.0]), -1.0);
        assert_eq!(rank_correlation(&rising, &[5.0; 4]), 0.0);
        // By the formula 1 - 6 sum d^2 / (n (n^2 - 1)) with d = 0, 1, 1, 0.
        let swapped = rank_correlation(&rising, &[1.0, 3.0, 2.0, 4.0]);
        assert!((swapped - 0.8).abs() < 1e-15);
    }

    #[test]
    fn a_lattice_is_spread_evenly() {
        let points: Vec<Vector<2>> = (0..400)
            .map(|i| Vector::<2>::new(f64::from(i % 20), f64::from(i / 20)))
            .collect();
        let quality = Quality::measure(&points, &[0.0; 400], &[1.0; 400]);
        assert_eq!((quality.nearest, quality.spread), (1.0, 0.0));
    }
}
