//! Principal axes: directions that turn with the points.

use crate::{Matrix, Vector};

/// Difference of the scatters along two axes, as a share of the largest scatter, below which the
/// axes have no directions of their own.
const DISTINCT: f64 = 1e-6;
/// Scatter, as a share of the largest, below which it counts as none.
const NO_SCATTER: f64 = 1e-12;

/// Sum of the outer products of the points' offsets from their mean.
pub(crate) fn scatter<const D: usize>(
    points: impl ExactSizeIterator<Item = Vector<D>> + Clone,
) -> Matrix<D> {
    let mean = mean(points.clone());
    points.fold(Matrix::zeros(), |sum, point| {
        let offset = point - mean;
        sum + offset * offset.transpose()
    })
}

fn mean<const D: usize>(points: impl ExactSizeIterator<Item = Vector<D>>) -> Vector<D> {
    let count = points.len() as f64;
    points.fold(Vector::zeros(), |sum, point| sum + point) / count
}

/// An orthonormal frame, by rows, that turns with the points: their principal axes, longest last,
/// each pointing to the side where the points reach farther. It is the coordinate axes where two
/// principal axes are not distinct. O(n) for n points.
pub(crate) fn axes<const D: usize>(points: &[Vector<D>]) -> Matrix<D> {
    principal_axes(points).unwrap_or_else(Matrix::identity)
}

/// The principal axes of the points; `None` where two of them are not distinct.
fn principal_axes<const D: usize>(points: &[Vector<D>]) -> Option<Matrix<D>> {
    let (values, vectors) = eigen(&scatter(points.iter().copied()))?;
    let largest = values[D - 1];
    let alike =
        |pair: &[f64]| pair[0] > NO_SCATTER * largest && pair[1] - pair[0] <= DISTINCT * largest;
    if values.as_slice().windows(2).any(alike) {
        return None;
    }
    let mut axes = vectors.transpose();
    let mean = mean(points.iter().copied());
    let skewness = points.iter().fold(Vector::<D>::zeros(), |sum, point| {
        let along = axes * (point - mean);
        sum + along.component_mul(&along).component_mul(&along)
    });
    for (axis, skewness) in skewness.iter().enumerate() {
        if *skewness < 0.0 {
            axes.row_mut(axis).neg_mut();
        }
    }
    Some(axes)
}

/// Eigenvalues, ascending, and eigenvectors (columns) of a symmetric matrix.
pub(crate) fn eigen<const D: usize>(matrix: &Matrix<D>) -> Option<(Vector<D>, Matrix<D>)> {
    let (values, vectors) = in_any_order(matrix)?;
    let mut order: [usize; D] = std::array::from_fn(|i| i);
    order.sort_unstable_by(|a, b| values[*a].total_cmp(&values[*b]).then(a.cmp(b)));
    Some((
        Vector::from_fn(|row, _| values[order[row]]),
        Matrix::from_fn(|row, column| vectors[(row, order[column])]),
    ))
}

/// Eigenvalues and eigenvectors of a symmetric matrix in any order. In space the size is known to
/// the solver at compile time.
fn in_any_order<const D: usize>(matrix: &Matrix<D>) -> Option<(Vector<D>, Matrix<D>)> {
    if D == 3 {
        let fixed = nalgebra::Matrix3::from_column_slice(matrix.as_slice());
        let eigen = nalgebra::SymmetricEigen::try_new(fixed, f64::EPSILON, 200)?;
        return Some((
            Vector::from_column_slice(eigen.eigenvalues.as_slice()),
            Matrix::from_column_slice(eigen.eigenvectors.as_slice()),
        ));
    }
    let dynamic = nalgebra::DMatrix::from_column_slice(D, D, matrix.as_slice());
    let eigen = nalgebra::SymmetricEigen::try_new(dynamic, f64::EPSILON, 200)?;
    Some((
        Vector::from_column_slice(eigen.eigenvalues.as_slice()),
        Matrix::from_column_slice(eigen.eigenvectors.as_slice()),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a lopsided box, with its sides along the given axes.
    fn lopsided(axes: &Matrix<3>) -> Vec<Vector<3>> {
        (0..60)
            .map(|i| {
                let [a, b, c] = [i % 5, i / 5 % 4, i / 20].map(f64::from);
                axes.transpose() * Vector::<3>::new(a * a, 3.0 * b * b, 0.5 * c * c)
            })
            .collect()
    }

    #[test]
    fn coordinates_along_the_axes_do_not_turn_with_the_points() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let turn = Matrix::<3>::from_column_slice(turn.matrix().as_slice());
        let (straight, turned) = (lopsided(&Matrix::<3>::identity()), lopsided(&turn));
        let (first, second) = (axes(&straight), axes(&turned));
        assert_ne!(second, Matrix::<3>::identity());
        for (p, q) in straight.iter().zip(&turned) {
            assert!((first * p - second * q).amax() < 1e-12);
        }
    }

    #[test]
    fn a_cube_keeps_the_coordinate_axes() {
        let corners: Vec<Vector<3>> = (0..8)
            .map(|i| Vector::<3>::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)))
            .collect();
        assert_eq!(axes(&corners), Matrix::<3>::identity());
    }
}
