//! Symmetric banded factorisation L D L', with the inertia that certifies stability.

/// A symmetric banded matrix, its lower band stored by columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Band {
    size: usize,
    half_width: usize,
    entries: Vec<f64>,
}

impl Band {
    /// Makes this a zero matrix with `half_width` subdiagonals, keeping its memory.
    pub fn reset(&mut self, size: usize, half_width: usize) {
        self.size = size;
        self.half_width = half_width;
        self.entries.clear();
        self.entries.resize(size * (half_width + 1), 0.0);
    }

    /// Adds a value to the entry (row, column), where column <= row <= column + half width.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.entries[column * self.half_width + row] += value;
    }

    /// Factors the matrix in place. Returns the number of negative pivots, which by Sylvester's law
    /// is the number of negative eigenvalues, or `None` where a pivot vanishes to rounding.
    ///
    /// There is no pivoting: the count of signs stays right for indefinite matrices, and the
    /// callers solve only with positive definite ones. O(size * half_width^2), less where columns
    /// end in zeros.
    pub fn factor(&mut self) -> Option<usize> {
        let width = self.half_width + 1;
        let original: Vec<f64> = self.entries.iter().step_by(width).copied().collect();
        let mut negative = 0;
        for column in 0..self.size {
            let (current, after) = self.entries[column * width..].split_at_mut(width);
            let pivot = current[0];
            if !(pivot.abs() > 1e-14 * original[column].abs() && pivot.is_finite()) {
                return None;
            }
            negative += usize::from(pivot < 0.0);
            // Below its last entry a column of elements is zero and stays zero.
            let count = current.iter().rposition(|v| *v != 0.0).unwrap_or(0);
            let below = &mut current[1..=count];
            for (i, other) in after.chunks_mut(width).take(count).enumerate() {
                let factor = below[i] / pivot;
                for (target, value) in other.iter_mut().zip(&below[i..]) {
                    *target -= factor * value;
                }
                below[i] = factor;
            }
        }
        Some(negative)
    }

    /// Solves with the factors, in place.
    pub fn solve(&self, x: &mut [f64]) {
        let width = self.half_width + 1;
        for (i, column) in self.entries.chunks(width).enumerate() {
            let (value, below) = (x[i], &mut x[i + 1..]);
            for (target, entry) in below.iter_mut().zip(&column[1..]) {
                *target -= entry * value;
            }
        }
        for (i, column) in self.entries.chunks(width).enumerate().rev() {
            let below = x[i + 1..].iter().zip(&column[1..]);
            let sum: f64 = below.map(|(value, entry)| value * entry).sum();
            x[i] = x[i] / column[0] - sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Band;
    use nalgebra::DMatrix;

    /// A pseudo-random symmetric banded matrix, both banded and dense.
    fn sample(size: usize, half_width: usize, shift: f64) -> (Band, DMatrix<f64>) {
        let mut band = Band::default();
        band.reset(size, half_width);
        let mut dense = DMatrix::zeros(size, size);
        let mut state = 1u64;
        for row in 0..size {
            for column in row.saturating_sub(half_width)..=row {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                let mut value = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
                if row == column {
                    value += shift;
                }
                band.add(row, column, value);
                dense[(row, column)] = value;
                dense[(column, row)] = value;
            }
        }
        (band, dense)
    }

    #[test]
    fn solves_and_counts_like_a_dense_eigensolver() {
        for (size, half_width) in [(1, 0), (2, 3), (7, 2), (20, 5), (33, 1)] {
            for shift in [0.0, 0.7, 4.0, -4.0] {
                let (mut band, dense) = sample(size, half_width, shift);
                let negative = band.factor().expect("regular");
                let eigenvalues = dense.clone().symmetric_eigenvalues();
                assert_eq!(negative, eigenvalues.iter().filter(|e| **e < 0.0).count());
                let right: Vec<f64> = (0..size).map(|i| (i as f64).sin() + 0.1).collect();
                let mut x = right.clone();
                band.solve(&mut x);
                let product = &dense * nalgebra::DVector::from_vec(x);
                for i in 0..size {
                    assert!((product[i] - right[i]).abs() < 1e-9, "row {i}");
                }
            }
        }
    }
}
