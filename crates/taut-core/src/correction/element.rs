//! Reference elements: Gauss-Lobatto nodes with their quadrature, differentiation and
//! interpolation.
//!
//! Sources: Canuto, Hussaini, Quarteroni, Zang, "Spectral Methods: Fundamentals in Single Domains"
//! (2006), section 2.3 (nodes, weights, derivative matrix); Berrut, Trefethen, "Barycentric
//! Lagrange Interpolation", SIAM Review 46 (2004).

use std::sync::OnceLock;

/// The highest degree of an element.
pub(crate) const MAXIMUM_DEGREE: usize = 16;

/// A polynomial element of a degree p on [-1, 1].
#[derive(Debug)]
pub(crate) struct Element {
    /// The p + 1 Gauss-Lobatto nodes, ascending from -1 to 1.
    pub nodes: Vec<f64>,
    /// The quadrature weights, exact to degree 2 p - 1.
    pub weights: Vec<f64>,
    /// The derivative at node i of the Lagrange polynomial j, (p + 1)^2 entries by rows.
    pub derivative: Vec<f64>,
    /// The integral of the product of the derivatives of the Lagrange polynomials i and j,
    /// (p + 1)^2 entries by rows.
    pub stiffness: Vec<f64>,
    /// The Legendre coefficient i of the Lagrange polynomial j, (p + 1)^2 entries by rows.
    pub legendre: Vec<f64>,
    /// The integral from -1 to node i of the Lagrange polynomial j, (p + 1)^2 entries by rows.
    pub integration: Vec<f64>,
    /// The barycentric weights of the nodes.
    barycentric: Vec<f64>,
}

/// The element of a degree, 1 to [`MAXIMUM_DEGREE`]; it is computed once.
pub(crate) fn element(degree: usize) -> &'static Element {
    static ELEMENTS: OnceLock<Vec<Element>> = OnceLock::new();
    &ELEMENTS.get_or_init(|| (1..=MAXIMUM_DEGREE).map(Element::new).collect())[degree - 1]
}

impl Element {
    fn new(degree: usize) -> Self {
        let nodes = lobatto_nodes(degree);
        let count = degree + 1;
        let scale = 2.0 / (degree * count) as f64;
        let end_values: Vec<f64> = nodes.iter().map(|x| legendre(degree, *x).0).collect();
        let weights: Vec<f64> = end_values.iter().map(|l| scale / (l * l)).collect();
        let barycentric: Vec<f64> = (0..count)
            .map(|j| {
                let product: f64 = (0..count)
                    .filter(|i| *i != j)
                    .map(|i| nodes[j] - nodes[i])
                    .product();
                1.0 / product
            })
            .collect();
        let mut derivative = vec![0.0; count * count];
        for i in 0..count {
            for j in (0..count).filter(|j| *j != i) {
                let entry = barycentric[j] / barycentric[i] / (nodes[i] - nodes[j]);
                derivative[i * count + j] = entry;
                // Rows sum to zero, as the derivative of a constant is zero.
                derivative[i * count + i] -= entry;
            }
        }
        let mut stiffness = vec![0.0; count * count];
        for i in 0..count {
            for j in 0..count {
                stiffness[i * count + j] = (0..count)
                    .map(|q| weights[q] * derivative[q * count + i] * derivative[q * count + j])
                    .sum();
            }
        }
        let mut coefficients = vec![0.0; count * count];
        for i in 0..count {
            // Gauss-Lobatto quadrature integrates P_p^2 to 2/p instead of 2/(2p+1).
            let norm = if i == degree {
                2.0 / degree as f64
            } else {
                2.0 / (2 * i + 1) as f64
            };
            for j in 0..count {
                coefficients[i * count + j] = weights[j] * legendre(i, nodes[j]).0 / norm;
            }
        }
        let mut integration = vec![0.0; count * count];
        for (i, x) in nodes.iter().enumerate() {
            for n in 0..count {
                // The integral of P_n from -1 is (P_{n+1} - P_{n-1}) / (2 n + 1).
                let integral = match n {
                    0 => x + 1.0,
                    _ => (legendre(n + 1, *x).0 - legendre(n - 1, *x).0) / (2 * n + 1) as f64,
                };
                for j in 0..count {
                    integration[i * count + j] += integral * coefficients[n * count + j];
                }
            }
        }
        Self {
            nodes,
            weights,
            derivative,
            stiffness,
            legendre: coefficients,
            integration,
            barycentric,
        }
    }

    /// The values at `x` in [-1, 1] of the p + 1 Lagrange polynomials.
    pub fn interpolation(&self, x: f64, out: &mut [f64]) {
        let mut sum = 0.0;
        for (j, node) in self.nodes.iter().enumerate() {
            let gap = x - node;
            if gap == 0.0 {
                out.fill(0.0);
                out[j] = 1.0;
                return;
            }
            out[j] = self.barycentric[j] / gap;
            sum += out[j];
        }
        for value in out.iter_mut() {
            *value /= sum;
        }
    }
}

/// The Legendre polynomial P_n(x) and its derivative, by recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    if n == 0 {
        return (1.0, 0.0);
    }
    let (mut previous_slope, mut slope) = (0.0, 1.0);
    for i in 1..n {
        let factor = (2 * i + 1) as f64;
        let next = (factor * x * current - i as f64 * previous) / (i + 1) as f64;
        let next_slope = previous_slope + factor * current;
        (previous, current) = (current, next);
        (previous_slope, slope) = (slope, next_slope);
    }
    (current, slope)
}

/// The end points and the zeros of P_n', by Newton's method from the Chebyshev-Lobatto points.
fn lobatto_nodes(degree: usize) -> Vec<f64> {
    let n = degree as f64;
    let mut nodes: Vec<f64> = (0..=degree)
        .map(|i| -(std::f64::consts::PI * i as f64 / n).cos())
        .collect();
    for x in &mut nodes[1..degree] {
        for _ in 0..20 {
            let (value, slope) = legendre(degree, *x);
            // Legendre's equation gives the second derivative.
            let curvature = (2.0 * *x * slope - n * (n + 1.0) * value) / (1.0 - *x * *x);
            *x -= slope / curvature;
        }
    }
    for i in 0..=degree / 2 {
        let symmetric = 0.5 * (nodes[degree - i] - nodes[i]);
        nodes[i] = -symmetric;
        nodes[degree - i] = symmetric;
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_and_derivative_are_exact_for_polynomials() {
        for degree in 1..=MAXIMUM_DEGREE {
            let e = element(degree);
            for power in 0..2 * degree {
                let sum: f64 = (0..=degree)
                    .map(|i| e.weights[i] * e.nodes[i].powi(power as i32))
                    .sum();
                let truth = if power % 2 == 0 {
                    2.0 / (power + 1) as f64
                } else {
                    0.0
                };
                assert!(
                    (sum - truth).abs() < 1e-13,
                    "degree {degree} power {power}: {sum}"
                );
            }
            for i in 0..=degree {
                let slope: f64 = (0..=degree)
                    .map(|j| e.derivative[i * (degree + 1) + j] * e.nodes[j].powi(degree as i32))
                    .sum();
                let truth = degree as f64 * e.nodes[i].powi(degree as i32 - 1);
                assert!((slope - truth).abs() < 1e-11, "degree {degree} node {i}");
            }
        }
    }

    #[test]
    fn interpolation_reproduces_polynomials() {
        let e = element(6);
        let mut row = [0.0; 7];
        for x in [-1.0, -0.3, 0.123, 0.9999, 1.0] {
            e.interpolation(x, &mut row);
            let value: f64 = (0..7).map(|j| row[j] * e.nodes[j].powi(6)).sum();
            assert!((value - x.powi(6)).abs() < 1e-14);
        }
    }

    #[test]
    fn legendre_coefficients_of_a_legendre_polynomial_are_a_unit_vector() {
        let e = element(5);
        for n in 0..=5 {
            for i in 0..=5 {
                let coefficient: f64 = (0..6)
                    .map(|j| e.legendre[i * 6 + j] * legendre(n, e.nodes[j]).0)
                    .sum();
                assert!((coefficient - f64::from(u8::from(i == n))).abs() < 1e-13);
            }
        }
    }
}
