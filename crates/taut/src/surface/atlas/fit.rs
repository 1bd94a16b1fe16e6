//! Weighted least squares for a chart's heights, of all degrees at once.
//!
//! With the normal matrix V'WV = L L' of the highest degree (kept as its transpose, by rows), the rows z = L^-1 v are the monomials made
//! orthonormal over the samples in order of degree: every lower degree is a leading part of the same
//! factor, and predictions, leverages and leave-one-out residuals of all degrees are partial sums.

use crate::surface::atlas::polynomial::{HIGHEST_DEGREE, Monomials};

/// Heights over scaled tangent coordinates, ready to be fitted.
#[derive(Default)]
pub(crate) struct Samples {
    /// Row-major tangent coordinates, k a sample, of size about 1.
    pub coordinates: Vec<f64>,
    /// Row-major heights, m a sample.
    pub heights: Vec<f64>,
    /// Weights.
    pub weights: Vec<f64>,
}

/// How well one degree fits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quality {
    /// Weighted root mean square of leave-one-out residuals (over all m heights).
    pub leave_one_out: f64,
    /// Weighted root mean square residual corrected for the degrees of freedom.
    pub sigma: f64,
}

/// The factored least-squares problem.
pub(crate) struct Factored {
    /// Number of coefficients of the highest degree that the samples determine.
    count: usize,
    /// Degree of that many coefficients.
    pub degree: usize,
    heights: usize,
    /// L', row-major upper triangle, stride `count`.
    triangle: Vec<f64>,
    /// L^-1 V'Wh, `count` for each height.
    projected: Vec<f64>,
    /// Row-major z, `count` a sample.
    orthonormal: Vec<f64>,
}

/// Samples whose residual is compared with a neighbour's.
const PROBED: usize = 64;

/// A pivot below this share of the largest means that the samples do not determine the coefficient.
const SMALLEST_PIVOT: f64 = 1e-9;

impl Factored {
    /// Factors up to `highest` degree; `None` where the samples do not even determine a constant and
    /// slopes. With coordinates of size 1 the condition leaves ten digits. O(n c^2).
    pub fn new(monomials: &Monomials, highest: usize, samples: &Samples) -> Option<Self> {
        let rows = samples.weights.len();
        let heights = samples.heights.len() / rows.max(1);
        let wanted = (1..=highest.min(HIGHEST_DEGREE))
            .rev()
            .find(|degree| monomials.count(*degree) < rows)?;
        let count = monomials.count(wanted);
        let mut orthonormal = vec![0.0; rows * count];
        let mut triangle = vec![0.0; count * count];
        let mut projected = vec![0.0; heights * count];
        let k = monomials.variables;
        for (i, v) in orthonormal.chunks_mut(count).enumerate() {
            monomials.values(&samples.coordinates[i * k..(i + 1) * k], v);
            let weight = samples.weights[i];
            for a in 0..count {
                let scaled = weight * v[a];
                add(
                    &mut triangle[a * count + a..(a + 1) * count],
                    scaled,
                    &v[a..],
                );
                for j in 0..heights {
                    projected[j * count + a] += scaled * samples.heights[i * heights + j];
                }
            }
        }
        let determined = cholesky(&mut triangle, count);
        let degree = (1..=wanted)
            .rev()
            .find(|d| monomials.count(*d) <= determined)?;
        let mut factored = Self {
            count,
            degree,
            heights,
            triangle,
            projected: Vec::new(),
            orthonormal: Vec::new(),
        };
        let used = monomials.count(degree);
        for row in projected
            .chunks_mut(count)
            .chain(orthonormal.chunks_mut(count))
        {
            factored.forward(&mut row[..used]);
        }
        factored.projected = projected;
        factored.orthonormal = orthonormal;
        Some(factored)
    }

    /// Solves L y = x in place for the leading part of length x.len().
    fn forward(&self, x: &mut [f64]) {
        let used = x.len();
        for j in 0..used {
            let row = &self.triangle[j * self.count..j * self.count + used];
            let (done, rest) = x.split_at_mut(j + 1);
            done[j] /= row[j];
            add(rest, -done[j], &row[j + 1..]);
        }
    }

    /// The coefficients of a degree up to [`degree`](Self::degree), one row per height.
    pub fn coefficients(&self, monomials: &Monomials, degree: usize) -> Vec<f64> {
        let used = monomials.count(degree);
        let mut coefficients = Vec::with_capacity(self.heights * used);
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
        coefficients
    }

    /// The quality of fit of degrees 1, 2, ... up to [`degree`](Self::degree).
    pub fn qualities(&self, monomials: &Monomials, samples: &Samples) -> Vec<Quality> {
        let mut sums = [Sums::default(); HIGHEST_DEGREE];
        for (i, z) in self.orthonormal.chunks(self.count).enumerate() {
            let weight = samples.weights[i];
            for j in 0..self.heights {
                let projected = &self.projected[j * self.count..];
                let height = samples.heights[i * self.heights + j];
                let (mut leverage, mut prediction, mut term) = (0.0, 0.0, 0);
                for degree in 0..=self.degree {
                    while term < monomials.count(degree) {
                        leverage += weight * z[term] * z[term];
                        prediction += z[term] * projected[term];
                        term += 1;
                    }
                    if degree > 0 {
                        sums[degree - 1].add(weight, height - prediction, leverage);
                    }
                }
            }
        }
        sums[..self.degree].iter().map(Sums::quality).collect()
    }

    /// Correlation of each sample's residual with its nearest neighbour's: near 0 for noise, near 1
    /// where the polynomial does not follow the surface. Over some [`PROBED`] of the samples: O(n).
    pub fn misfit(&self, monomials: &Monomials, degree: usize, samples: &Samples) -> f64 {
        let used = monomials.count(degree);
        let k = monomials.variables;
        let mut residuals = samples.heights.clone();
        for (i, z) in self.orthonormal.chunks(self.count).enumerate() {
            for (j, projected) in self.projected.chunks(self.count).enumerate() {
                let prediction: f64 = z[..used]
                    .iter()
                    .zip(&projected[..used])
                    .map(|(z, y)| z * y)
                    .sum();
                residuals[i * self.heights + j] -= prediction;
            }
        }
        let product = |a: usize, b: usize| -> f64 {
            let of = |i: usize| &residuals[i * self.heights..(i + 1) * self.heights];
            of(a).iter().zip(of(b)).map(|(x, y)| x * y).sum()
        };
        let rows = samples.weights.len();
        let (mut together, mut alone) = (0.0, 0.0);
        for i in (0..rows).step_by(rows.div_ceil(PROBED)) {
            let here = &samples.coordinates[i * k..(i + 1) * k];
            let (mut nearest, mut least) = (i, f64::INFINITY);
            for (j, there) in samples.coordinates.chunks_exact(k).enumerate() {
                let mut squared = 0.0;
                for a in 0..k {
                    squared += (here[a] - there[a]) * (here[a] - there[a]);
                }
                if squared < least && j != i {
                    (nearest, least) = (j, squared);
                }
            }
            together += product(i, nearest);
            alone += 0.5 * (product(i, i) + product(nearest, nearest));
        }
        if alone > 0.0 { together / alone } else { 0.0 }
    }

    /// Variance of the height at the origin, in units of the variance of a sample of weight 1.
    pub fn variance_at_origin(&self, monomials: &Monomials, degree: usize) -> f64 {
        let mut unit = vec![0.0; monomials.count(degree)];
        unit[0] = 1.0;
        self.forward(&mut unit);
        unit.iter().map(|v| v * v).sum()
    }
}

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

/// target += factor * values.
fn add(target: &mut [f64], factor: f64, values: &[f64]) {
    for (entry, value) in target.iter_mut().zip(values) {
        *entry += factor * value;
    }
}

/// Cholesky in place on the row-major upper triangle; returns how many leading rows are regular.
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
        let mut samples = Samples::default();
        for i in 0..rows {
            let (x, y) = ((1.7 * i as f64).sin(), (2.3 * i as f64 + 0.4).cos());
            samples.coordinates.extend([x, y]);
            samples.heights.push((x + 0.5 * y).exp());
            samples.weights.push(1.0 - 0.5 * (x * x + y * y) / 2.0);
        }
        samples
    }

    #[test]
    fn agrees_with_dense_least_squares_and_true_leave_one_out() {
        let monomials = Monomials::new(2);
        let samples = samples(40);
        let factored = Factored::new(&monomials, 4, &samples).expect("regular");
        for degree in 1..=4 {
            let count = monomials.count(degree);
            let solve = |skip: usize| {
                let mut design = DMatrix::zeros(40, count);
                let mut right = DVector::zeros(40);
                for i in (0..40).filter(|i| *i != skip) {
                    let mut row = vec![0.0; count];
                    monomials.values(&samples.coordinates[2 * i..2 * i + 2], &mut row);
                    let root = samples.weights[i].sqrt();
                    for j in 0..count {
                        design[(i, j)] = root * row[j];
                    }
                    right[i] = root * samples.heights[i];
                }
                design.svd(true, true).solve(&right, 1e-14).expect("solved")
            };
            let full = solve(usize::MAX);
            let coefficients = factored.coefficients(&monomials, degree);
            for (a, b) in coefficients.iter().zip(full.iter()) {
                assert!((a - b).abs() < 1e-9, "degree {degree}: {a} {b}");
            }
            let (mut sum, mut total) = (0.0, 0.0);
            for i in 0..40 {
                let mut row = vec![0.0; count];
                monomials.values(&samples.coordinates[2 * i..2 * i + 2], &mut row);
                let prediction: f64 = row.iter().zip(solve(i).iter()).map(|(r, c)| r * c).sum();
                sum += samples.weights[i] * (samples.heights[i] - prediction).powi(2);
                total += samples.weights[i];
            }
            let quality = factored.qualities(&monomials, &samples)[degree - 1];
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
        let smooth = Factored::new(&monomials, 2, &samples).expect("regular");
        assert!(smooth.misfit(&monomials, 1, &samples) > 0.5);
        for (i, height) in samples.heights.iter_mut().enumerate() {
            *height = (12.9898 * (i + 1) as f64).sin() * 43758.5453 % 1.0;
        }
        let noisy = Factored::new(&monomials, 2, &samples).expect("regular");
        assert!(noisy.misfit(&monomials, 2, &samples) < 0.3);
    }

    #[test]
    fn samples_on_a_line_determine_no_plane() {
        let monomials = Monomials::new(2);
        let mut samples = samples(30);
        for pair in samples.coordinates.chunks_mut(2) {
            pair[1] = 0.5 * pair[0];
        }
        assert!(Factored::new(&monomials, 4, &samples).is_none());
    }
}
