//! Polynomials in k variables up to a total degree: monomials, values, gradients, Hessians.

use std::cmp::Ordering;
use std::collections::HashMap;

/// The monomials of k variables up to a degree, by ascending total degree.
#[derive(Clone, Debug)]
pub(crate) struct Monomials {
    /// Number of variables k.
    pub variables: usize,
    /// The exponents of the monomials, by rows of k.
    exponents: Vec<u8>,
    /// For each monomial but the first, an earlier monomial and the variable whose product it is.
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

    /// Value, gradient and Hessian (k x k entries by rows, both halves) of a polynomial at `u`.
    /// What the caller leaves unread of the Hessian of two variables costs nothing.
    #[inline(always)]
    pub fn evaluate(
        &self,
        coefficients: &[f64],
        u: &[f64],
        gradient: &mut [f64],
        hessian: &mut [f64],
    ) -> f64 {
        if u.len() == 2 {
            return evaluate_two(coefficients, [u[0], u[1]], gradient, hessian);
        }
        self.evaluate_any(coefficients, u, gradient, hessian)
    }

    fn evaluate_any(
        &self,
        coefficients: &[f64],
        u: &[f64],
        gradient: &mut [f64],
        hessian: &mut [f64],
    ) -> f64 {
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

/// Appends all exponents of total `left`, in descending lexicographic order.
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

/// For each monomial but the first, an earlier monomial and the variable whose product it is; see
/// [`Monomials::factors`].
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

/// The case of two variables, in which the atlas of a surface in space spends its time.
#[inline(always)]
fn evaluate_two(c: &[f64], u: [f64; 2], gradient: &mut [f64], hessian: &mut [f64]) -> f64 {
    match c.len() {
        15 => horner::<4>(c, u, gradient, hessian),
        10 => horner::<3>(c, u, gradient, hessian),
        6 => horner::<2>(c, u, gradient, hessian),
        3 => horner::<1>(c, u, gradient, hessian),
        _ => horner::<0>(c, u, gradient, hessian),
    }
}

/// Horner's scheme in y over polynomials in x, each by Horner's scheme with its derivatives.
#[inline(always)]
fn horner<const DEGREE: usize>(
    c: &[f64],
    [x, y]: [f64; 2],
    gradient: &mut [f64],
    hessian: &mut [f64],
) -> f64 {
    // Second derivatives by the same variable are halved until the end.
    let (mut h, mut hx, mut hy) = (0.0, 0.0, 0.0);
    let (mut hxx, mut hxy, mut hyy) = (0.0, 0.0, 0.0);
    for b in (0..=DEGREE).rev() {
        let (mut p, mut px, mut pxx) = (0.0, 0.0, 0.0);
        let degree = DEGREE - b;
        for a in (0..=degree).rev() {
            let done = degree - a;
            pxx = raised(pxx, x, px, done, 2);
            px = raised(px, x, p, done, 1);
            p = raised(p, x, c[(a + b) * (a + b + 1) / 2 + b], done, 0);
        }
        hyy = raised(hyy, y, hy, degree, 2);
        hy = raised(hy, y, h, degree, 1);
        h = raised(h, y, p, degree, 0);
        hxy = raised(hxy, y, hx, degree, 2);
        hx = raised(hx, y, px, degree, 1);
        hxx = raised(hxx, y, pxx, degree, 2);
    }
    gradient.copy_from_slice(&[hx, hy]);
    hessian.copy_from_slice(&[2.0 * hxx, hxy, hxy, 2.0 * hyy]);
    h
}

/// A step of Horner's scheme, sum x + next, after `done` other steps. The sum is 0 until it gets
/// its first term, after `first` steps.
#[inline(always)]
fn raised(sum: f64, x: f64, next: f64, done: usize, first: usize) -> f64 {
    match done.cmp(&first) {
        Ordering::Less => 0.0,
        Ordering::Equal => next,
        Ordering::Greater => sum * x + next,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_variables_agree_with_the_general_case() {
        // This is a polynomial of three variables that ignores the third.
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
