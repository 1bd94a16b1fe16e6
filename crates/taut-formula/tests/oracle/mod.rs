//! What the derivative tests share: a formula's result beside that of dual numbers.

use num_dual::Dual2SVec64;
use taut_core::surface::implicit::Equations;
use taut_core::{Matrix, Vector};
use taut_formula::Formula;

pub type Dual<const D: usize> = Dual2SVec64<D>;

/// Value, gradient and Hessian.
#[derive(Debug, Clone)]
pub struct Answer<const D: usize> {
    pub value: f64,
    pub gradient: Vector<D>,
    pub hessian: Matrix<D>,
}

impl<const D: usize> Answer<D> {
    pub fn entries(&self) -> impl Iterator<Item = f64> {
        let derivatives = self.gradient.iter().chain(self.hessian.iter());
        std::iter::once(self.value).chain(derivatives.copied())
    }
}

impl<const D: usize> From<Dual<D>> for Answer<D> {
    fn from(dual: Dual<D>) -> Self {
        Self {
            value: dual.re,
            gradient: dual.v1.0.map_or_else(Vector::zeros, |row| row.transpose()),
            hessian: dual.v2.0.unwrap_or_else(Matrix::zeros),
        }
    }
}

/// The coordinates of a point as dual numbers.
pub fn variables<const D: usize>(x: &Vector<D>) -> [Dual<D>; D] {
    std::array::from_fn(|index| Dual::from(x[index]).derivative(index))
}

/// Every equation of `formula` at `x`; checks that the gradients alone are the same bits.
pub fn evaluate<const D: usize>(formula: &Formula, x: &Vector<D>) -> Vec<Answer<D>> {
    let count = formula.equation_count();
    // Left-overs of an earlier call must not show through.
    let mut values = vec![7.0; count];
    let mut gradients = vec![Vector::repeat(7.0); count];
    let mut hessians = vec![Matrix::repeat(7.0); count];
    formula.hessians(x, &mut values, &mut gradients, &mut hessians);
    let (mut same_values, mut same_gradients) =
        (vec![7.0; count], vec![Vector::repeat(7.0); count]);
    formula.gradients(x, &mut same_values, &mut same_gradients);
    let bits = |values: &[f64], gradients: &[Vector<D>]| -> Vec<u64> {
        let all = values.iter().chain(gradients.iter().flatten());
        all.map(|a| if a.is_nan() { u64::MAX } else { a.to_bits() })
            .collect()
    };
    assert_eq!(
        bits(&values, &gradients),
        bits(&same_values, &same_gradients)
    );
    let answers = values.into_iter().zip(gradients).zip(hessians);
    answers
        .map(|((value, gradient), hessian)| Answer {
            value,
            gradient,
            hessian,
        })
        .collect()
}
