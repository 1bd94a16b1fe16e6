//! Weighted least squares for a chart's heights, of all degrees at once.
//!
//! Let V'WV = L L' be the normal matrix of the highest degree; L is kept as its transpose, by rows.
//! The rows z = L^-1 v are then the monomials made orthonormal over the samples in order of degree.
//! Every lower degree is a leading part of the same factor, and the predictions, leverages and
//! leave-one-out residuals of all degrees are partial sums. Everything that has an entry for each
//! sample is kept in columns, so that loops run over samples.

use crate::Vector;
use crate::surface::atlas::polynomial::{HIGHEST_DEGREE, Monomials};

/// Heights over scaled tangent coordinates, ready to be fitted.
#[derive(Default)]
pub(crate) struct Samples {
    /// k columns of tangent coordinates, of size about 1.
    pub coordinates: Vec<f64>,
    /// m columns of heights, in the input's units.
    pub heights: Vec<f64>,
    /// The weight of each sample.
    pub weights: Vec<f64>,
}

impl Samples {
    /// Takes points in a frame, each with m heights and then its tangent coordinates, weighted
    /// towards the origin. Returns the scale by which it divides the coordinates.
    pub fn set<const D: usize>(
        &mut self,
        m: usize,
        points: impl ExactSizeIterator<Item = Vector<D>>,
    ) -> f64 {
        let rows = points.len();
        self.heights.resize(m * rows, 0.0);
        self.coordinates.resize((D - m) * rows, 0.0);
        for (i, point) in points.enumerate() {
            for a in 0..m {
                self.heights[a * rows + i] = point[a];
            }
            for j in m..D {
                self.coordinates[(j - m) * rows + i] = point[j];
            }
        }
        self.weights.clear();
        self.weights.resize(rows, 0.0);
        for column in self.coordinates.chunks(rows.max(1)) {
            for (sum, u) in self.weights.iter_mut().zip(column) {
                *sum += u * u;
            }
        }
        let farthest = self.weights.iter().copied().fold(0.0, f64::max);
        let scale = farthest.sqrt().max(f64::MIN_POSITIVE);
        for value in &mut self.coordinates {
            *value /= scale;
        }
        for weight in &mut self.weights {
            *weight = (1.0 - 0.9 * *weight / (scale * scale)).powi(2);
        }
        scale
    }
}

/// How well one degree fits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quality {
    /// Weighted root mean square of leave-one-out residuals, over all m heights.
    pub leave_one_out: f64,
    /// Weighted root mean square residual, corrected for the degrees of freedom.
    pub sigma: f64,
}

/// A factored least-squares problem; its memory serves the next one.
#[derive(Default)]
pub(crate) struct LeastSquares {
    /// The number of samples.
    rows: usize,
    /// Number of coefficients of the highest degree that the samples might determine.
    count: usize,
    /// The highest degree whose coefficients the samples do determine.
    degree: usize,
    /// L' as an upper triangle by rows, stride `count`.
    triangle: Vec<f64>,
    /// L^-1 V'Wh, `count` entries for each height.
    projected: Vec<f64>,
    /// A column of values at the samples for each monomial v.
    columns: Vec<f64>,
    /// Whether the columns have been made orthonormal, to z, which is done when first needed.
    orthonormal: bool,
    /// A column of intermediate values.
    weighted: Vec<f64>,
    residuals: Vec<f64>,
    /// Squares of what leaving out a sample leaves of it, in the order of the samples.
    squares: Vec<f64>,
    /// Those squares of the samples near the origin, sorted.
    sorted: Vec<f64>,
}

/// Most samples whose residual is compared with a neighbour's.
const PROBED: usize = 64;

/// Weight of a sample above which it helps to say how far off the fit samples usually lie.
const INNER_WEIGHT: f64 = 0.25;
/// The median of a normal deviate's square.
const MEDIAN_SQUARE: f64 = 0.455;
/// Least share that a sample's own weight in the fit at its place must leave to the others for it
/// to be judged a stray.
const LEAST_LEFT: f64 = 0.5;
/// Factor by which a stray's square exceeds the largest of noise, as medians of few samples err.
const STRAY: f64 = 2.5;
/// Number of samples beside a stray that are compared with it.
const STRAY_NEIGHBOURS: usize = 5;
/// Factor by which the square of a stray exceeds the median square of the samples beside it.
const ALONE: f64 = 25.0;
/// Strays are no more than one in this many samples.
const FEW_STRAYS: usize = 6;
/// Pivot, as a share of the largest, below which the samples do not determine the coefficient.
const SMALLEST_PIVOT: f64 = 1e-9;

impl LeastSquares {
    /// Factors up to the degree `highest` and returns the degree reached; `None` where the samples
    /// do not even determine a constant and slopes. With coordinates of size 1 the condition leaves
    /// ten digits. O(n c^2).
    pub fn factor(
        &mut self,
        monomials: &Monomials,
        highest: usize,
        samples: &Samples,
    ) -> Option<usize> {
        let rows = samples.weights.len();
        let wanted = (1..=highest.min(HIGHEST_DEGREE))
            .rev()
            .find(|degree| monomials.count(*degree) < rows)?;
        let count = monomials.count(wanted);
        (self.rows, self.count, self.orthonormal) = (rows, count, false);
        monomials.columns(&samples.coordinates, rows, count, &mut self.columns);
        let heights = samples.heights.len() / rows;
        self.triangle.clear();
        self.triangle.resize(count * count, 0.0);
        self.projected.clear();
        self.projected.resize(heights * count, 0.0);
        self.weighted.resize(rows, 0.0);
        for a in 0..count {
            let column = &self.columns[a * rows..(a + 1) * rows];
            for ((product, v), weight) in self.weighted.iter_mut().zip(column).zip(&samples.weights)
            {
                *product = v * weight;
            }
            let right = self.columns[a * rows..].chunks_exact(rows);
            let row = &mut self.triangle[a * count + a..(a + 1) * count];
            for (entry, column) in row.iter_mut().zip(right) {
                *entry = dot(&self.weighted, column);
            }
            for (j, height) in samples.heights.chunks_exact(rows).enumerate() {
                self.projected[j * count + a] = dot(&self.weighted, height);
            }
        }
        let determined = cholesky(&mut self.triangle, count);
        self.degree = (1..=wanted)
            .rev()
            .find(|d| monomials.count(*d) <= determined)?;
        let used = monomials.count(self.degree);
        for row in self.projected.chunks_mut(count) {
            forward(&self.triangle, count, &mut row[..used]);
        }
        Some(self.degree)
    }

    /// The coefficients of a degree up to the one reached, one row for each height.
    pub fn coefficients(&self, monomials: &Monomials, degree: usize, coefficients: &mut Vec<f64>) {
        let used = monomials.count(degree);
        coefficients.clear();
        for projected in self.projected.chunks(self.count) {
            let start = coefficients.len();
            coefficients.extend_from_slice(&projected[..used]);
            let x = &mut coefficients[start..];
            for i in (0..used).rev() {
                let mut sum = x[i];
                for j in i + 1..used {
                    sum -= self.triangle[i * self.count + j] * x[j];
                }
                x[i] = sum / self.triangle[i * self.count + i];
            }
        }
    }

    /// Solves L z = v for every sample.
    fn orthonormalise(&mut self, used: usize) {
        if self.orthonormal {
            return;
        }
        self.orthonormal = true;
        for a in 0..used {
            let (done, rest) = self.columns.split_at_mut(a * self.rows);
            let column = &mut rest[..self.rows];
            for (b, z) in done.chunks_exact(self.rows).enumerate() {
                add(column, -self.triangle[b * self.count + a], z);
            }
            let inverse = self.triangle[a * self.count + a].recip();
            for value in column {
                *value *= inverse;
            }
        }
    }

    /// The quality of fit of the degrees from 1 to the one reached; that of higher degrees is
    /// unspecified.
    pub fn qualities(
        &mut self,
        monomials: &Monomials,
        samples: &Samples,
    ) -> [Quality; HIGHEST_DEGREE] {
        self.orthonormalise(monomials.count(self.degree));
        let rows = self.rows;
        let mut sums = [Sums::default(); HIGHEST_DEGREE];
        let leverages = &mut self.weighted;
        leverages.fill(0.0);
        self.residuals.clear();
        self.residuals.extend_from_slice(&samples.heights);
        let mut term = 0;
        for degree in 0..=self.degree {
            while term < monomials.count(degree) {
                let column = &self.columns[term * rows..(term + 1) * rows];
                for (leverage, z) in leverages.iter_mut().zip(column) {
                    *leverage += z * z;
                }
                for (j, residuals) in self.residuals.chunks_exact_mut(rows).enumerate() {
                    add(residuals, -self.projected[j * self.count + term], column);
                }
                term += 1;
            }
            if degree > 0 {
                for residuals in self.residuals.chunks_exact(rows) {
                    for ((residual, leverage), weight) in
                        residuals.iter().zip(&*leverages).zip(&samples.weights)
                    {
                        sums[degree - 1].add(*weight, *residual, weight * leverage);
                    }
                }
            }
        }
        sums.map(|sum| sum.quality())
    }

    /// Finds the strays: samples that the others leave far off, of which there are few. They are
    /// outliers, which would pull the fit towards them. They are judged by what leaving each sample
    /// out leaves of it in the highest degree, right after [`qualities`](Self::qualities), whose
    /// residuals are used. Among noise there are none, and no sample is far off that is off by less
    /// than `least`.
    pub fn strays(&mut self, samples: &Samples, least: f64, strays: &mut Vec<u32>) {
        strays.clear();
        let rows = self.rows;
        // What a polynomial does not follow far out counts less.
        let factors = &mut self.weighted;
        for (leverage, weight) in factors.iter_mut().zip(&samples.weights) {
            let left = 1.0 - weight * *leverage;
            // Where a sample decides for itself, the others do not tell whether it is far off.
            *leverage = if left >= LEAST_LEFT {
                (weight / INNER_WEIGHT).min(1.0) / (left * left)
            } else {
                0.0
            };
        }
        let squares = &mut self.squares;
        squares.clear();
        squares.resize(rows, 0.0);
        for residuals in self.residuals.chunks_exact(rows) {
            for ((square, residual), factor) in squares.iter_mut().zip(residuals).zip(&*factors) {
                *square += factor * residual * residual;
            }
        }
        let sorted = &mut self.sorted;
        sorted.clear();
        let inner = squares.iter().zip(&samples.weights);
        sorted.extend(inner.filter(|s| *s.1 > INNER_WEIGHT).map(|s| *s.0));
        let middle = sorted.len() / 2;
        if middle == 0 {
            return;
        }
        let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
        // The square of the largest of n normal deviates is about 2 ln n.
        let most = STRAY * (2.0 * (rows as f64).ln() + 12.0) * median / MEDIAN_SQUARE;
        let most = most.max(least * least);
        let far = (0..).zip(&*squares).filter(|(_, square)| **square > most);
        strays.extend(far.map(|(i, _)| i));
        if strays.len() * FEW_STRAYS > rows {
            strays.clear();
        }
        strays.retain(|stray| self.is_alone(samples, *stray as usize));
    }

    /// Whether the samples right beside a sample lie much nearer to the fit. Where the surface has
    /// detail that the polynomial does not follow, they are off as well.
    fn is_alone(&self, samples: &Samples, stray: usize) -> bool {
        let rows = self.rows;
        let mut beside = [(f64::INFINITY, 0.0); STRAY_NEIGHBOURS];
        for i in (0..rows).filter(|i| *i != stray) {
            let columns = samples.coordinates.chunks_exact(rows);
            let squared: f64 = columns.map(|c| (c[i] - c[stray]).powi(2)).sum();
            if squared < beside[STRAY_NEIGHBOURS - 1].0 {
                beside[STRAY_NEIGHBOURS - 1] = (squared, self.squares[i]);
                beside.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            }
        }
        let mut off = beside.map(|b| b.1);
        off.sort_unstable_by(f64::total_cmp);
        off[STRAY_NEIGHBOURS / 2] * ALONE < self.squares[stray]
    }

    /// Correlation of each sample's residual with that of its nearest neighbour: near 0 for noise,
    /// near 1 where the polynomial does not follow the surface. It is taken over about [`PROBED`]
    /// of the samples, in O(n).
    pub fn misfit(&mut self, monomials: &Monomials, degree: usize, samples: &Samples) -> f64 {
        self.orthonormalise(monomials.count(self.degree));
        let rows = self.rows;
        self.residuals.clear();
        self.residuals.extend_from_slice(&samples.heights);
        for (j, residuals) in self.residuals.chunks_exact_mut(rows).enumerate() {
            let projected = &self.projected[j * self.count..];
            let columns = self.columns.chunks_exact(rows);
            for (y, column) in projected[..monomials.count(degree)].iter().zip(columns) {
                add(residuals, -y, column);
            }
        }
        let product = |a: usize, b: usize| -> f64 {
            let columns = self.residuals.chunks_exact(rows);
            columns.map(|column| column[a] * column[b]).sum()
        };
        let (mut together, mut alone) = (0.0, 0.0);
        for i in (0..rows).step_by(rows.div_ceil(PROBED)) {
            let squared = &mut self.weighted;
            squared.fill(0.0);
            for column in samples.coordinates.chunks_exact(rows) {
                let here = column[i];
                for (sum, there) in squared.iter_mut().zip(column) {
                    *sum += (here - there) * (here - there);
                }
            }
            squared[i] = f64::INFINITY;
            let least = least(squared);
            let nearest = squared.iter().position(|s| *s == least).unwrap_or(i);
            together += product(i, nearest);
            alone += 0.5 * (product(i, i) + product(nearest, nearest));
        }
        if alone > 0.0 { together / alone } else { 0.0 }
    }

    /// Variance of the height at the origin, in units of the variance of a sample of weight 1.
    pub fn variance_at_origin(&self, monomials: &Monomials, degree: usize) -> f64 {
        let mut unit = vec![0.0; monomials.count(degree)];
        unit[0] = 1.0;
        forward(&self.triangle, self.count, &mut unit);
        unit.iter().map(|v| v * v).sum()
    }
}

/// Solves L y = x in place for the leading part of length x.len(), where L' is given by rows.
fn forward(triangle: &[f64], stride: usize, x: &mut [f64]) {
    let used = x.len();
    for j in 0..used {
        let row = &triangle[j * stride..j * stride + used];
        let (done, rest) = x.split_at_mut(j + 1);
        done[j] /= row[j];
        add(rest, -done[j], &row[j + 1..]);
    }
}

/// Sums over the samples from which the quality of one degree follows.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    freedom: f64,
    squares: f64,
    left_out: f64,
}

impl Sums {
    fn add(&mut self, weight: f64, residual: f64, leverage: f64) {
        let left_out = residual / (1.0 - leverage).max(1e-9);
        self.weight += weight;
        self.freedom += weight * leverage;
        self.squares += weight * residual * residual;
        self.left_out += weight * left_out * left_out;
    }

    fn quality(&self) -> Quality {
        let freedom = (self.weight - self.freedom).max(1e-3 * self.weight);
        Quality {
            leave_one_out: (self.left_out / self.weight).sqrt(),
            sigma: (self.squares / freedom).sqrt(),
        }
    }
}

/// The scalar product, in four sums side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, rest_a) = a.as_chunks::<4>();
    let (b, rest_b) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

/// The least value, by eight comparisons side by side.
fn least(values: &[f64]) -> f64 {
    let smaller = |a: f64, b: f64| if b < a { b } else { a };
    let (chunks, rest) = values.as_chunks::<8>();
    let mut least = [f64::INFINITY; 8];
    for chunk in chunks {
        for lane in 0..8 {
            least[lane] = smaller(least[lane], chunk[lane]);
        }
    }
    least
        .iter()
        .chain(rest)
        .copied()
        .fold(f64::INFINITY, smaller)
}

/// Adds `factor` times `values` to `target`.
fn add(target: &mut [f64], factor: f64, values: &[f64]) {
    for (entry, value) in target.iter_mut().zip(values) {
        *entry += factor * value;
    }
}

/// Cholesky factorisation in place on the upper triangle by rows; returns how many leading rows are
/// regular.
fn cholesky(a: &mut [f64], count: usize) -> usize {
    let largest = (0..count).map(|i| a[i * count + i]).fold(0.0, f64::max);
    for j in 0..count {
        let (above, below) = a.split_at_mut((j + 1) * count);
        let row = &mut above[j * count + j..];
        if row[0].is_nan() || row[0] <= SMALLEST_PIVOT * largest {
            return j;
        }
        let root = row[0].sqrt();
        for value in &mut *row {
            *value /= root;
        }
        for (i, target) in below.chunks_mut(count).enumerate() {
            let first = j + 1 + i;
            add(&mut target[first..], -row[1 + i], &row[1 + i..]);
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn samples(rows: usize) -> Samples {
        let x: Vec<f64> = (0..rows).map(|i| (1.7 * i as f64).sin()).collect();
        let y: Vec<f64> = (0..rows).map(|i| (2.3 * i as f64 + 0.4).cos()).collect();
        let both = || x.iter().zip(&y);
        Samples {
            heights: both().map(|(x, y)| (x + 0.5 * y).exp()).collect(),
            weights: both().map(|(x, y)| 1.0 - 0.25 * (x * x + y * y)).collect(),
            coordinates: [x.as_slice(), &y].concat(),
        }
    }

    #[test]
    fn agrees_with_dense_least_squares_and_true_leave_one_out() {
        let monomials = Monomials::new(2);
        let samples = samples(40);
        let mut fit = LeastSquares::default();
        assert_eq!(fit.factor(&monomials, 4, &samples), Some(4));
        for degree in 1..=4 {
            let count = monomials.count(degree);
            let at = |i: usize| [samples.coordinates[i], samples.coordinates[40 + i]];
            let solve = |skip: usize| {
                let mut design = DMatrix::zeros(40, count);
                let mut right = DVector::zeros(40);
                for i in (0..40).filter(|i| *i != skip) {
                    let mut row = Vec::new();
                    monomials.columns(&at(i), 1, count, &mut row);
                    let root = samples.weights[i].sqrt();
                    for j in 0..count {
                        design[(i, j)] = root * row[j];
                    }
                    right[i] = root * samples.heights[i];
                }
                design.svd(true, true).solve(&right, 1e-14).expect("solved")
            };
            let full = solve(usize::MAX);
            let mut coefficients = Vec::new();
            fit.coefficients(&monomials, degree, &mut coefficients);
            assert_eq!(coefficients.len(), count);
            for (a, b) in coefficients.iter().zip(full.iter()) {
                assert!((a - b).abs() < 1e-9, "degree {degree}: {a} {b}");
            }
            let (mut sum, mut total) = (0.0, 0.0);
            for i in 0..40 {
                let mut row = Vec::new();
                monomials.columns(&at(i), 1, count, &mut row);
                let prediction: f64 = row.iter().zip(solve(i).iter()).map(|(r, c)| r * c).sum();
                sum += samples.weights[i] * (samples.heights[i] - prediction).powi(2);
                total += samples.weights[i];
            }
            let quality = fit.qualities(&monomials, &samples)[degree - 1];
            let truth = f64::sqrt(sum / total);
            assert!(
                (quality.leave_one_out / truth - 1.0).abs() < 1e-6,
                "degree {degree}"
            );
        }
    }

    #[test]
    fn misfit_tells_noise_from_a_surface_not_followed() {
        let monomials = Monomials::new(2);
        let mut samples = samples(60);
        let mut fit = LeastSquares::default();
        assert_eq!(fit.factor(&monomials, 2, &samples), Some(2));
        assert!(fit.misfit(&monomials, 1, &samples) > 0.5);
        for (i, height) in samples.heights.iter_mut().enumerate() {
            *height = (12.9898 * (i + 1) as f64).sin() * 43758.5453 % 1.0;
        }
        assert_eq!(fit.factor(&monomials, 2, &samples), Some(2));
        assert!(fit.misfit(&monomials, 2, &samples) < 0.3);
    }

    #[test]
    fn samples_on_a_line_determine_no_plane() {
        let monomials = Monomials::new(2);
        let mut samples = samples(30);
        let (x, y) = samples.coordinates.split_at_mut(30);
        for (x, y) in x.iter().zip(y) {
            *y = 0.5 * x;
        }
        let mut fit = LeastSquares::default();
        assert_eq!(fit.factor(&monomials, 4, &samples), None);
    }
}
