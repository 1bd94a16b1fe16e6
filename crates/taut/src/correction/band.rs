//! Symmetric banded factorisation L D L', with the inertia that certifies stability.

/// A symmetric banded matrix, the lower band stored by rows.
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

    /// Adds to the entry (row, column), column <= row <= column + half width.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.entries[row * (self.half_width + 1) + self.half_width + column - row] += value;
    }

    /// Factors in place. Returns the number of negative pivots, by Sylvester's law the number of
    /// negative eigenvalues, or `None` where a pivot vanishes to rounding.
    ///
    /// No pivoting: the sign count stays right for indefinite matrices, and the callers solve only
    /// with positive definite ones. O(size * half_width^2).
    pub fn factor(&mut self) -> Option<usize> {
        let width = self.half_width + 1;
        let mut negative = 0;
        for row in 0..self.size {
            let first = row.saturating_sub(self.half_width);
            let (done, current) = self.entries.split_at_mut(row * width);
            let current = &mut current[..width];
            // Offset that maps a column of this row to its place in `current`.
            let shift = self.half_width - row.min(self.half_width);
            let original = current[self.half_width].abs();
            let mut diagonal = current[self.half_width];
            for column in first..row {
                let place = shift + column - first;
                let other = &done[column * width..(column + 1) * width];
                let other_first = column.saturating_sub(self.half_width).max(first);
                let count = column - other_first;
                let here = &current[place - count..place];
                let there = &other[self.half_width - count..self.half_width];
                let dot: f64 = here.iter().zip(there).map(|(a, b)| a * b).sum();
                current[place] -= dot;
            }
            // The entries of this row are now L D; divide by D and update the diagonal.
            for column in first..row {
                let place = shift + column - first;
                let scaled = current[place];
                let factor = scaled / done[column * width + self.half_width];
                diagonal -= scaled * factor;
                current[place] = factor;
            }
            if !(diagonal.abs() > 1e-14 * original && diagonal.is_finite()) {
                return None;
            }
            negative += usize::from(diagonal < 0.0);
            current[self.half_width] = diagonal;
        }
        Some(negative)
    }

    /// Solves with the factors, in place.
    pub fn solve(&self, x: &mut [f64]) {
        let width = self.half_width + 1;
        for row in 0..self.size {
            let count = row.min(self.half_width);
            let band = &self.entries[row * width + self.half_width - count..][..count];
            let dot: f64 = band
                .iter()
                .zip(&x[row - count..row])
                .map(|(a, b)| a * b)
                .sum();
            x[row] -= dot;
        }
        for row in 0..self.size {
            x[row] /= self.entries[row * width + self.half_width];
        }
        for row in (0..self.size).rev() {
            let count = row.min(self.half_width);
            let band = &self.entries[row * width + self.half_width - count..][..count];
            let value = x[row];
            for (entry, target) in band.iter().zip(&mut x[row - count..row]) {
                *target -= entry * value;
            }
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
