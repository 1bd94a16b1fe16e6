//! Points of any dimension as points of space.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::error::DrawError;

/// A map from R^d to space that shows a cloud's three widest directions: the identity for d up to
/// 3 (missing coordinates are 0), the three principal axes otherwise.
///
/// Make it from the cloud and apply it to the cloud and to the paths alike.
///
/// ```
/// use taut_draw::Projection;
///
/// let cloud = [0.0, 1.0, 2.0, 3.0];
/// let projection = Projection::new(2, &cloud)?;
/// assert_eq!(projection.apply(&cloud)?, [[0.0, 1.0, 0.0], [2.0, 3.0, 0.0]]);
/// # Ok::<(), taut_draw::DrawError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    dimension: usize,
    mean: Vec<f64>,
    /// Three rows of `dimension` numbers.
    axes: Vec<Vec<f64>>,
}

impl Projection {
    /// From a cloud's coordinates, point after point. Points with a non-finite coordinate do not
    /// count.
    ///
    /// # Errors
    ///
    /// [`DrawError::Dimension`] where `dimension` is 0 or does not divide the number of
    /// coordinates, [`DrawError::PrincipalAxes`] where the eigenvalue iteration fails.
    ///
    /// # Complexity
    ///
    /// O(n d^2 + d^3) for d above 3, O(d) otherwise.
    pub fn new(dimension: usize, coordinates: &[f64]) -> Result<Self, DrawError> {
        expect_whole_points(dimension, coordinates)?;
        if dimension <= 3 {
            return Ok(Self::identity(dimension));
        }
        let mean = mean(dimension, coordinates);
        let covariance = covariance(&mean, coordinates);
        let eigen = SymmetricEigen::try_new(covariance, f64::EPSILON, 1000 * dimension)
            .ok_or(DrawError::PrincipalAxes { dimension })?;
        let mut order: Vec<usize> = (0..dimension).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let axes = order[..3]
            .iter()
            .map(|&column| with_positive_peak(eigen.eigenvectors.column(column).iter().copied()))
            .collect();
        Ok(Self {
            dimension,
            mean,
            axes,
        })
    }

    fn identity(dimension: usize) -> Self {
        let axis = |row: usize| {
            (0..dimension)
                .map(|column| if row == column { 1.0 } else { 0.0 })
                .collect()
        };
        Self {
            dimension,
            mean: vec![0.0; dimension],
            axes: (0..3).map(axis).collect(),
        }
    }

    /// The places of the given points. Points with a non-finite coordinate become NaN.
    ///
    /// # Errors
    ///
    /// [`DrawError::Dimension`] where the coordinates are no whole number of points.
    pub fn apply(&self, coordinates: &[f64]) -> Result<Vec<[f64; 3]>, DrawError> {
        expect_whole_points(self.dimension, coordinates)?;
        let points = coordinates.chunks_exact(self.dimension);
        Ok(points.map(|point| self.apply_to_point(point)).collect())
    }

    fn apply_to_point(&self, point: &[f64]) -> [f64; 3] {
        if point.iter().any(|coordinate| !coordinate.is_finite()) {
            return [f64::NAN; 3];
        }
        std::array::from_fn(|row| {
            let terms = self.axes[row].iter().zip(point).zip(&self.mean);
            terms.map(|((a, x), m)| a * (x - m)).sum()
        })
    }
}

fn expect_whole_points(dimension: usize, coordinates: &[f64]) -> Result<(), DrawError> {
    let count = coordinates.len();
    if dimension == 0 || !count.is_multiple_of(dimension) {
        return Err(DrawError::Dimension { count, dimension });
    }
    Ok(())
}

fn finite_points(dimension: usize, coordinates: &[f64]) -> impl Iterator<Item = &[f64]> {
    coordinates
        .chunks_exact(dimension)
        .filter(|point| point.iter().all(|coordinate| coordinate.is_finite()))
}

fn mean(dimension: usize, coordinates: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; dimension];
    let mut count = 0.0;
    for point in finite_points(dimension, coordinates) {
        count += 1.0;
        for (total, coordinate) in sum.iter_mut().zip(point) {
            *total += coordinate;
        }
    }
    sum.iter()
        .map(|total| total / f64::max(count, 1.0))
        .collect()
}

/// The covariance, scaled so that its largest diagonal entry is 1.
fn covariance(mean: &[f64], coordinates: &[f64]) -> DMatrix<f64> {
    let dimension = mean.len();
    let mut sum = DMatrix::zeros(dimension, dimension);
    for point in finite_points(dimension, coordinates) {
        for row in 0..dimension {
            for column in 0..=row {
                sum[(row, column)] += (point[row] - mean[row]) * (point[column] - mean[column]);
            }
        }
    }
    sum.fill_upper_triangle_with_lower_triangle();
    let largest = sum.diagonal().max();
    if largest > 0.0 { sum / largest } else { sum }
}

/// The axis with the sign that makes its largest component positive.
fn with_positive_peak(axis: impl Iterator<Item = f64>) -> Vec<f64> {
    let axis: Vec<f64> = axis.collect();
    let peak = axis.iter().fold(
        0.0_f64,
        |peak, &c| if c.abs() > peak.abs() { c } else { peak },
    );
    let sign = 1.0_f64.copysign(peak);
    axis.iter().map(|component| sign * component).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_box_in_five_dimensions_keeps_its_three_longest_sides() {
        let sides = [4.0, 0.01, 2.0, 3.0, 0.02];
        let mut coordinates = Vec::new();
        for corner in 0..32_u32 {
            for (axis, side) in sides.iter().enumerate() {
                coordinates.push(f64::from(corner >> axis & 1) * side + 7.0);
            }
        }
        let points = Projection::new(5, &coordinates)
            .and_then(|projection| projection.apply(&coordinates))
            .unwrap();
        for (axis, side) in [4.0, 3.0, 2.0].into_iter().enumerate() {
            let largest = points.iter().map(|p| p[axis]).fold(f64::MIN, f64::max);
            assert!((largest - side / 2.0).abs() < 1e-12, "{axis}: {largest}");
        }
    }

    #[test]
    fn rows_with_nan_stay_apart() {
        let coordinates = [1.0, 2.0, 3.0, f64::NAN, 0.0, 0.0];
        let projection = Projection::new(3, &coordinates).unwrap();
        let points = projection.apply(&coordinates).unwrap();
        assert_eq!(points[0], [1.0, 2.0, 3.0]);
        assert!(points[1][0].is_nan());
        assert!(matches!(
            Projection::new(4, &coordinates),
            Err(DrawError::Dimension { count: 6, .. })
        ));
    }
}
