//! Random expression trees against dual numbers.

mod oracle;

use nalgebra::SMatrix;
use num_dual::{Derivative, DualNum};
use oracle::{Answer, Dual, evaluate, variables};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taut_core::Vector;
use taut_formula::{ErrorKind, Formula};

#[derive(Debug, Clone)]
enum Tree {
    Variable(usize),
    Constant(f64),
    Unary(Unary, Box<Tree>),
    Binary(Binary, Box<Tree>, Box<Tree>),
    Power(Box<Tree>, f64),
}

#[derive(Debug, Clone, Copy)]
enum Unary {
    Negate,
    Sqrt,
    Exp,
    Log,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Abs,
}

#[derive(Debug, Clone, Copy)]
enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Atan2,
    Min,
    Max,
}

impl Tree {
    fn text(&self) -> String {
        match self {
            Self::Variable(index) => format!("x{}", index + 1),
            Self::Constant(value) => format!("({value:?})"),
            Self::Unary(Unary::Negate, a) => format!("(-{})", a.text()),
            Self::Unary(name, a) => format!("{}({})", format!("{name:?}").to_lowercase(), a.text()),
            Self::Binary(name, a, b) => {
                let (a, b) = (a.text(), b.text());
                match name {
                    Binary::Add => format!("({a} + {b})"),
                    Binary::Subtract => format!("({a} - {b})"),
                    Binary::Multiply => format!("({a} * {b})"),
                    Binary::Divide => format!("({a} / {b})"),
                    Binary::Power => format!("({a})^({b})"),
                    Binary::Atan2 => format!("atan2({a}, {b})"),
                    Binary::Min => format!("min({a}, {b})"),
                    Binary::Max => format!("max({a}, {b})"),
                }
            }
            Self::Power(a, exponent) => format!("({})^({exponent:?})", a.text()),
        }
    }

    fn has_variable(&self) -> bool {
        match self {
            Self::Variable(_) => true,
            Self::Constant(_) => false,
            Self::Unary(_, a) | Self::Power(a, _) => a.has_variable(),
            Self::Binary(_, a, b) => a.has_variable() || b.has_variable(),
        }
    }

    /// The dual number, `round` applied to the result of every operation.
    fn dual<const D: usize>(
        &self,
        x: &[Dual<D>; D],
        round: &mut impl FnMut(Dual<D>) -> Dual<D>,
    ) -> Dual<D> {
        let result = match self {
            Self::Variable(index) => x[*index],
            Self::Constant(value) => constant(*value),
            Self::Unary(name, a) => unary(*name, a.dual(x, round)),
            Self::Binary(Binary::Power, a, b) if !b.has_variable() => {
                a.dual(x, round).powf(b.dual(x, round).re)
            }
            Self::Binary(name, a, b) => {
                let (a, b) = (a.dual(x, round), b.dual(x, round));
                binary(*name, a, b)
            }
            Self::Power(a, exponent) if exponent.fract() == 0.0 => {
                a.dual(x, round).powi(*exponent as i32)
            }
            Self::Power(a, exponent) => a.dual(x, round).powf(*exponent),
        };
        round(result)
    }
}

/// A constant whose derivatives are stored zeros: 0 times infinity is then NaN, as in a formula
/// where the zero depends on the point.
fn constant<const D: usize>(value: f64) -> Dual<D> {
    let (gradient, hessian) = (SMatrix::zeros(), SMatrix::zeros());
    Dual::new(value, Derivative::some(gradient), Derivative::some(hessian))
}

fn unary<const D: usize>(name: Unary, a: Dual<D>) -> Dual<D> {
    match name {
        // The oracle uses 1 - tanh^2 and 1 - a^2, which cancel.
        Unary::Asin | Unary::Acos if a.re.abs() > 0.99 => constant(f64::NAN),
        Unary::Tanh if a.re.abs() > 4.0 => constant(f64::NAN),
        Unary::Negate => -a,
        Unary::Sqrt => a.sqrt(),
        Unary::Exp => a.exp(),
        Unary::Log => a.ln(),
        Unary::Sin => a.sin(),
        Unary::Cos => a.cos(),
        Unary::Tan => a.tan(),
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Sinh => a.sinh(),
        Unary::Cosh => a.cosh(),
        Unary::Tanh => a.tanh(),
        Unary::Abs if a.re < 0.0 => -a,
        Unary::Abs if a.re == 0.0 => a * 0.0,
        Unary::Abs => a,
    }
}

fn binary<const D: usize>(name: Binary, a: Dual<D>, b: Dual<D>) -> Dual<D> {
    match name {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => a / b,
        Binary::Power => a.powd(b),
        Binary::Atan2 => {
            // The oracle's own atan2 is atan(a/b), inaccurate where a/b is large.
            let steep = a.re.abs() > b.re.abs();
            let angle = if steep {
                -(b / a).atan()
            } else {
                (a / b).atan()
            };
            Dual::new(a.re.atan2(b.re), angle.v1, angle.v2)
        }
        Binary::Min if b.re < a.re || b.re.is_nan() => b,
        Binary::Max if b.re > a.re || b.re.is_nan() => b,
        Binary::Min | Binary::Max => a,
    }
}

fn tree(dimension: usize) -> impl Strategy<Value = Tree> {
    let leaf = prop_oneof![
        3 => (0..dimension).prop_map(Tree::Variable),
        1 => prop_oneof![Just(2.0), Just(0.5), Just(-1.0), -3.0..3.0_f64].prop_map(Tree::Constant),
    ];
    leaf.prop_recursive(6, 40, 2, |inner| {
        use {Binary::*, Unary::*};
        let one = prop::sample::select(vec![
            Negate, Sqrt, Exp, Log, Sin, Cos, Tan, Asin, Acos, Atan, Sinh, Cosh, Tanh, Abs,
        ]);
        let two = prop::sample::select(vec![
            Add, Add, Add, Subtract, Subtract, Multiply, Multiply, Multiply, Divide, Divide,
            Binary::Power, Atan2, Min, Max,
        ]);
        let exponent =
            prop::sample::select(vec![2.0, 3.0, 4.0, 5.0, 7.0, -1.0, -2.0, -3.0, 0.5, 1.5, -0.5, 2.3]);
        let (a, b) = (inner.clone(), inner.clone());
        prop_oneof![
            3 => (one, a).prop_map(|(name, a)| Tree::Unary(name, a.into())),
            5 => (two, inner.clone(), b).prop_map(|(name, a, b)| Tree::Binary(name, a.into(), b.into())),
            2 => (inner, exponent).prop_map(|(a, exponent)| Tree::Power(a.into(), exponent)),
        ]
    })
}

/// Numbers from -1 to 1 that depend on nothing but the seed.
fn noise(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        seed = seed
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / (1_u64 << 30) as f64 - 1.0
    }
}

/// Changes every entry by a few units in its last place.
fn jitter<const D: usize>(a: Dual<D>, noise: &mut impl FnMut() -> f64) -> Dual<D> {
    let mut change = |entry: f64| entry * (1.0 + noise() * 8.0 * f64::EPSILON);
    let value = change(a.re);
    let gradient = a.v1.0.map(|gradient| gradient.map(&mut change));
    let hessian = a.v2.0.map(|hessian| hessian.map(&mut change));
    Dual::new(value, Derivative::new(gradient), Derivative::new(hessian))
}

/// NaN where an entry is so large or small that its products may leave the range of f64.
fn in_range<const D: usize>(a: Dual<D>) -> Dual<D> {
    let fits = |entry: f64| entry == 0.0 || (1e-40..1e40).contains(&entry.abs());
    match Answer::from(a).entries().all(fits) {
        true => a,
        false => constant(f64::NAN),
    }
}

/// Entries agree to 1e-12, or to what rounding every intermediate result does to the oracle, or
/// to a few rounding errors of the largest entry.
fn check<const D: usize>(tree: &Tree, x: &Vector<D>) -> Result<(), TestCaseError> {
    let text = tree.text();
    let formula = match Formula::parse(&[&text], Some(D)) {
        Ok(formula) => formula,
        Err(error) => {
            prop_assert_eq!(error.kind(), &ErrorKind::NoVariable, "{}", error);
            return Err(TestCaseError::reject("no variable left"));
        }
    };
    let found = &evaluate(&formula, x)[0];
    let truth = Answer::from(tree.dual(&variables(x), &mut in_range));
    let rounded: Vec<Answer<D>> = (1..=6)
        .map(|seed| {
            let mut noise = noise(seed);
            let mut round = |dual| jitter(in_range(dual), &mut noise);
            tree.dual(&variables(x), &mut round).into()
        })
        .collect();
    if !truth
        .entries()
        .chain(rounded.iter().flat_map(Answer::entries))
        .all(f64::is_finite)
    {
        return Err(TestCaseError::reject("outside the domain"));
    }
    let largest = truth.entries().map(f64::abs).fold(0.0, f64::max);
    for (index, (found, truth)) in found.entries().zip(truth.entries()).enumerate() {
        let spread = rounded
            .iter()
            .filter_map(|answer| answer.entries().nth(index))
            .map(|entry| (entry - truth).abs())
            .fold(0.0, f64::max);
        if spread > 1e-6 * truth.abs().max(1e-6) {
            return Err(TestCaseError::reject("ill-conditioned"));
        }
        let bound = 1e-12 * truth.abs() + 16.0 * spread + 1e-15 * largest;
        prop_assert!(
            (found - truth).abs() <= bound,
            "{} at {:?}: entry {}: {:e} against {:e}, bound {:e}",
            text,
            x.as_slice(),
            index,
            found,
            truth,
            bound
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, max_global_rejects: 100_000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn trees_of_three_variables(tree in tree(3), x in prop::array::uniform3(-2.0..2.0_f64)) {
        check(&tree, &Vector::<3>::from(x))?;
    }

    #[test]
    fn trees_of_nine_variables(tree in tree(9), x in prop::array::uniform9(0.1..2.0_f64)) {
        check(&tree, &Vector::<9>::from(x))?;
    }
}
