//! Equations are refused with the bytes at fault, or evaluate to the same numbers by every way.

use taut_core::surface::implicit::Equations;
use taut_core::{Matrix, Vector};
use taut_formula::Formula;

/// Each line is an equation.
pub fn formula(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let equations: Vec<&str> = text.lines().take(MOST_EQUATIONS).collect();
    for dimension in [None, Some(3), Some(16)] {
        match Formula::parse(&equations, dimension) {
            Ok(formula) => evaluate(&formula, &equations),
            Err(error) => {
                let longest = equations.iter().map(|text| text.len()).max().unwrap_or(0);
                let span = error.span().unwrap_or(0..0);
                assert!(span.start <= span.end && span.end <= longest, "{span:?}");
                assert!(!error.to_string().is_empty());
            }
        }
    }
}

const MOST_EQUATIONS: usize = 4;

fn evaluate(formula: &Formula, equations: &[&str]) {
    assert_eq!(formula.equation_count(), equations.len());
    match formula.dimension() {
        2 => evaluate_in::<2>(formula),
        3 => evaluate_in::<3>(formula),
        4 => evaluate_in::<4>(formula),
        16 => evaluate_in::<16>(formula),
        found => assert!((2..=16).contains(&found)),
    }
}

const PLACES: [f64; 6] = [0.0, 0.7, -1.3, 1e-300, 1e300, f64::NEG_INFINITY];

fn evaluate_in<const D: usize>(formula: &Formula) {
    let count = formula.equation_count();
    let mut values = [vec![0.0; count], vec![0.0; count]];
    let mut gradients = [
        vec![Vector::<D>::zeros(); count],
        vec![Vector::zeros(); count],
    ];
    let mut hessians = vec![Matrix::<D>::zeros(); count];
    for place in PLACES {
        let x = Vector::<D>::from_fn(|i, _| place * (1.0 + 0.1 * i as f64));
        formula.gradients(&x, &mut values[0], &mut gradients[0]);
        formula.hessians(&x, &mut values[1], &mut gradients[1], &mut hessians);
        let [first, second] = &values;
        assert!(
            first.iter().zip(second).all(|(a, b)| same(*a, *b)),
            "{values:?}"
        );
        let [first, second] = &gradients;
        let pairs = first.iter().zip(second);
        assert!(
            pairs
                .into_iter()
                .all(|(a, b)| a.iter().zip(b).all(|(a, b)| same(*a, *b))),
            "{gradients:?}"
        );
        for hessian in &hessians {
            let transposed = hessian.transpose();
            assert!(hessian.iter().zip(&transposed).all(|(a, b)| same(*a, *b)));
        }
    }
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}
