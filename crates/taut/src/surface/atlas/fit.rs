//! Weighted least squares for a chart's heights, with leave-one-out residuals.

use nalgebra::{DMatrix, DVector};

use crate::surface::atlas::polynomial::Monomials;

/// Heights over scaled tangent coordinates, ready to be fitted.
pub(crate) struct Samples {
    /// Row-major tangent coordinates, k a sample, of size about 1.
    pub coordinates: Vec<f64>,
    /// Row-major heights, m a sample.
    pub heights: Vec<f64>,
    /// Weights.
    pub weights: Vec<f64>,
}

/// A fitted polynomial for each of m heights.
pub(crate) struct Fit {
    /// m rows of coefficients.
    pub coefficients: Vec<f64>,
    /// Weighted root mean square of leave-one-out residuals (over all m heights).
    pub leave_one_out: f64,
    /// Weighted root mean square residual corrected for the degrees of freedom.
    pub sigma: f64,
    /// Variance of the height at the origin in units of the residual variance.
    pub leverage: f64,
}

/// Fits polynomials of `degree`; `None` where the samples do not determine them.
///
/// Normal equations by Cholesky: with coordinates of size 1 and degree <= 4 their condition leaves
/// ten digits. O(n c^2), c the number of coefficients.
pub(crate) fn fit(monomials: &Monomials, degree: usize, samples: &Samples) -> Option<Fit> {
    let k = monomials.variables;
    let count = monomials.count(degree);
    let rows = samples.weights.len();
    let m = samples.heights.len() / rows;
    if rows <= count {
        return None;
    }
    let mut design = DMatrix::<f64>::zeros(count, rows);
    for (u, mut column) in samples.coordinates.chunks(k).zip(design.column_iter_mut()) {
        monomials.values(u, column.as_mut_slice());
    }
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DMatrix::<f64>::zeros(count, m);
    for (i, weight) in samples.weights.iter().enumerate() {
        let v = design.column(i);
        for b in 0..count {
            let scaled = weight * v[b];
            for a in b..count {
                normal[(a, b)] += scaled * v[a];
            }
            for j in 0..m {
                right[(b, j)] += scaled * samples.heights[i * m + j];
            }
        }
    }
    let trace: f64 = (0..count).map(|i| normal[(i, i)]).fold(0.0, f64::max);
    let cholesky = normal.cholesky()?;
    let smallest = cholesky.l_dirty().diagonal().min();
    if smallest * smallest <= 1e-9 * trace {
        return None;
    }
    let solution = cholesky.solve(&right);
    let (mut leave_one_out, mut squares, mut weight_sum, mut freedom) = (0.0, 0.0, 0.0, 0.0);
    for (i, weight) in samples.weights.iter().enumerate() {
        let column = design.column(i).into_owned();
        let half = cholesky.l_dirty().solve_lower_triangular(&column)?;
        let leverage = (weight * half.norm_squared()).min(1.0 - 1e-9);
        for j in 0..m {
            let residual = samples.heights[i * m + j] - column.dot(&solution.column(j));
            squares += weight * residual * residual;
            let left_out = residual / (1.0 - leverage);
            leave_one_out += weight * left_out * left_out;
        }
        weight_sum += weight * m as f64;
        freedom += weight * leverage * m as f64;
    }
    let mut unit = DVector::zeros(count);
    unit[0] = 1.0;
    let half = cholesky.l_dirty().solve_lower_triangular(&unit)?;
    Some(Fit {
        coefficients: solution.as_slice().to_vec(),
        leave_one_out: (leave_one_out / weight_sum).sqrt(),
        sigma: (squares / (weight_sum - freedom).max(1e-3 * weight_sum)).sqrt(),
        leverage: half.norm_squared(),
    })
}
