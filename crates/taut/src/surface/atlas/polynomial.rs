//! Polynomials in k variables up to a total degree: monomials, values, gradients, Hessians.

use std::collections::HashMap;

/// The monomials of k variables up to a degree, by ascending total degree.
#[derive(Clone, Debug)]
pub(crate) struct Monomials {
    /// Number of variables k.
    pub variables: usize,
    /// Row-major exponents, k a monomial.
    exponents: Vec<u8>,
    /// For each monomial but the first, an earlier one and the variable that it is the product of.
    factors: Vec<(usize, usize)>,
    /// Number of monomials up to each degree.
    counts: Vec<usize>,
}

/// Highest degree of a chart.
pub(crate) const HIGHEST_DEGREE: usize = 4;

impl Monomials {
    pub fn new(variables: usize) -> Self {
        let mut exponents = Vec::new();
        let mut counts = Vec::new();
        for degree in 0..=HIGHEST_DEGREE {
            let mut current = vec![0; variables];
            append(&mut exponents, &mut current, 0, degree as u8);
            counts.push(exponents.len() / variables);
        }
        let factors = factors(&exponents, variables);
        Self {
            variables,
            exponents,
            factors,
            counts,
        }
    }

    /// The number of monomials up to `degree`.
    pub fn count(&self, degree: usize) -> usize {
        self.counts[degree]
    }

    /// The values of the first `count` monomials at many points, in columns as the coordinates are.
    pub fn columns(&self, coordinates: &[f64], rows: usize, count: usize, out: &mut Vec<f64>) {
        out.resize(count * rows, 0.0);
        out[..rows].fill(1.0);
        for (i, (before, variable)) in (1..count).zip(&self.factors) {
            let (done, rest) = out.split_at_mut(i * rows);
            let before = &done[before * rows..(before + 1) * rows];
            let u = &coordinates[variable * rows..(variable + 1) * rows];
            for ((value, before), u) in rest[..rows].iter_mut().zip(before).zip(u) {
                *value = before * u;
            }
        }
    }

    /// Value, gradient and upper triangle of the Hessian (row-major k x k, both halves) of a
    /// polynomial at `u`. What the caller leaves unread of the Hessian of two variables costs nothing.
    #[inline]
    pub fn evaluate(
        &self,
        coefficients: &[f64],
        u: &[f64],
        gradient: &mut [f64],
        hessian: &mut [f64],
    ) -> f64 {
        if self.variables == 2 {
            return evaluate_two(coefficients, [u[0], u[1]], gradient, hessian);
        }
        let k = self.variables;
        gradient.fill(0.0);
        hessian.fill(0.0);
        let mut value = 0.0;
        for (exponents, c) in self.exponents.chunks(k).zip(coefficients) {
            let power =
                |i: usize, less: u8| (0..exponents[i] - less).fold(1.0, |power, _| power * u[i]);
            let without = |a: usize, b: usize| -> f64 {
                (0..k)
                    .filter(|i| *i != a && *i != b)
                    .map(|i| power(i, 0))
                    .product()
            };
            value += c * without(k, k);
            for i in 0..k {
                let e = exponents[i];
                if e == 0 {
                    continue;
                }
                gradient[i] += c * f64::from(e) * power(i, 1) * without(i, k);
                if e > 1 {
                    hessian[i * k + i] += c * f64::from(e * (e - 1)) * power(i, 2) * without(i, k);
                }
                for j in 0..i {
                    if exponents[j] > 0 {
                        let factor = f64::from(e * exponents[j]);
                        let entry = c * factor * power(i, 1) * power(j, 1) * without(i, j);
                        hessian[i * k + j] += entry;
                        hessian[j * k + i] += entry;
                    }
                }
            }
        }
        value
    }
}

/// Appends all exponents of total `left`, lexicographically descending.
fn append(exponents: &mut Vec<u8>, current: &mut [u8], variable: usize, left: u8) {
    if variable + 1 == current.len() {
        current[variable] = left;
        exponents.extend_from_slice(current);
        return;
    }
    for e in (0..=left).rev() {
        current[variable] = e;
        append(exponents, current, variable + 1, left - e);
    }
    current[variable] = 0;
}

/// See [`Monomials::factors`].
fn factors(exponents: &[u8], variables: usize) -> Vec<(usize, usize)> {
    let mut places = HashMap::new();
    let mut factors = Vec::new();
    for (exponent, i) in exponents.chunks(variables).zip(0..) {
        if let Some(variable) = exponent.iter().position(|e| *e > 0) {
            let mut lower = exponent.to_vec();
            lower[variable] -= 1;
            factors.extend(places.get(lower.as_slice()).map(|place| (*place, variable)));
        }
        places.insert(exponent, i);
    }
    factors
}

/// The two-variable case, by powers: the atlas of a surface in space spends its time here.
#[inline]
fn evaluate_two(c: &[f64], [x, y]: [f64; 2], gradient: &mut [f64], hessian: &mut [f64]) -> f64 {
    let mut value = c[0];
    let (mut gx, mut gy, mut hxx, mut hxy, mut hyy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    if c.len() >= 3 {
        value += c[1] * x + c[2] * y;
        gx += c[1];
        gy += c[2];
    }
    let (xx, xy, yy) = (x * x, x * y, y * y);
    if c.len() >= 6 {
        value += c[3] * xx + c[4] * xy + c[5] * yy;
        gx += 2.0 * c[3] * x + c[4] * y;
        gy += c[4] * x + 2.0 * c[5] * y;
        hxx += 2.0 * c[3];
        hxy += c[4];
        hyy += 2.0 * c[5];
    }
    if c.len() >= 10 {
        value += (c[6] * x + c[7] * y) * xx + (c[8] * x + c[9] * y) * yy;
        gx += 3.0 * c[6] * xx + 2.0 * c[7] * xy + c[8] * yy;
        gy += c[7] * xx + 2.0 * c[8] * xy + 3.0 * c[9] * yy;
        hxx += 6.0 * c[6] * x + 2.0 * c[7] * y;
        hxy += 2.0 * c[7] * x + 2.0 * c[8] * y;
        hyy += 2.0 * c[8] * x + 6.0 * c[9] * y;
    }
    if c.len() >= 15 {
        value += (c[10] * xx + c[11] * xy + c[12] * yy) * xx + (c[13] * xy + c[14] * yy) * yy;
        gx += (4.0 * c[10] * x + 3.0 * c[11] * y) * xx + (2.0 * c[12] * x + c[13] * y) * yy;
        gy += (c[11] * x + 2.0 * c[12] * y) * xx + (3.0 * c[13] * x + 4.0 * c[14] * y) * yy;
        hxx += 12.0 * c[10] * xx + 6.0 * c[11] * xy + 2.0 * c[12] * yy;
        hxy += 3.0 * c[11] * xx + 4.0 * c[12] * xy + 3.0 * c[13] * yy;
        hyy += 2.0 * c[12] * xx + 6.0 * c[13] * xy + 12.0 * c[14] * yy;
    }
    gradient[0] = gx;
    gradient[1] = gy;
    hessian[0] = hxx;
    hessian[1] = hxy;
    hessian[2] = hxy;
    hessian[3] = hyy;
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_variables_agree_with_the_general_case() {
        // A polynomial of three variables that ignores the third.
        let (two, three) = (Monomials::new(2), Monomials::new(3));
        let u = [0.3, -0.7, 0.0];
        for degree in 1..=HIGHEST_DEGREE {
            let coefficients: Vec<f64> = (0..two.count(degree))
                .map(|i| (1.0 + i as f64).sin())
                .collect();
            let mut embedded = vec![0.0; three.count(degree)];
            for (exponents, c) in two.exponents.chunks(2).zip(&coefficients) {
                let place = three
                    .exponents
                    .chunks(3)
                    .position(|e| e[0] == exponents[0] && e[1] == exponents[1] && e[2] == 0);
                embedded[place.expect("there")] = *c;
            }
            let (mut g2, mut h2) = ([0.0; 2], [0.0; 4]);
            let (mut g3, mut h3) = ([0.0; 3], [0.0; 9]);
            let v2 = two.evaluate(&coefficients, &u, &mut g2, &mut h2);
            let v3 = three.evaluate(&embedded, &u, &mut g3, &mut h3);
            let mut monomials = Vec::new();
            two.columns(&u[..2], 1, coefficients.len(), &mut monomials);
            let direct: f64 = monomials
                .iter()
                .zip(&coefficients)
                .map(|(m, c)| m * c)
                .sum();
            for (a, b) in [
                (v2, v3),
                (v2, direct),
                (g2[0], g3[0]),
                (g2[1], g3[1]),
                (h2[0], h3[0]),
                (h2[1], h3[1]),
                (h2[3], h3[4]),
            ] {
                assert!((a - b).abs() < 1e-13, "degree {degree}: {a} {b}");
            }
        }
    }
}
