//! Named formulas against dual numbers, an independent implementation.

mod oracle;

use num_dual::DualNum;
use oracle::{Answer, Dual, evaluate, variables};
use taut_core::Vector;
use taut_formula::Formula;

/// Compares with `truth` at `x`, relative to the largest entry of each derivative.
fn compare<const D: usize>(text: &str, x: &Vector<D>, truth: impl Fn([Dual<D>; D]) -> Dual<D>) {
    let formula = Formula::parse(&[text], Some(D)).unwrap_or_else(|error| panic!("{error}"));
    let found = &evaluate(&formula, x)[0];
    let truth = Answer::from(truth(variables(x)));
    assert!(
        truth.entries().all(f64::is_finite),
        "{text} at {x:?}: {truth:?}"
    );
    let gradient_error =
        (found.gradient - truth.gradient).amax() / truth.gradient.amax().max(1e-30);
    let hessian_error = (found.hessian - truth.hessian).amax() / truth.hessian.amax().max(1e-30);
    let value_error = (found.value - truth.value).abs() / truth.value.abs().max(1.0);
    let worst = value_error.max(gradient_error).max(hessian_error);
    assert!(
        worst < 2e-14,
        "{text} at {x:?}: {worst:e}\n{found:?}\n{truth:?}"
    );
}

/// Points with coordinates between 0.1 and 0.9, away from each other.
fn points<const D: usize>() -> impl Iterator<Item = Vector<D>> {
    (0..50).map(|n| Vector::from_fn(|row, _| 0.5 + 0.4 * ((n * D + row) as f64 * 1.7).sin()))
}

fn compare3(text: &str, truth: impl Fn(Dual<3>, Dual<3>, Dual<3>) -> Dual<3>) {
    for x in points::<3>() {
        compare(text, &x, |[x, y, z]| truth(x, y, z));
    }
}

#[test]
fn surfaces() {
    compare3("x^2 + y^2 + z^2 = 1", |x, y, z| x * x + y * y + z * z - 1.0);
    compare3("(sqrt(x^2+y^2)-1)^2 + z^2 - 0.16", |x, y, z| {
        ((x * x + y * y).sqrt() - 1.0).powi(2) + z * z - 0.16
    });
    compare3("x^2/9 + y^2/4 + z^2 = 1", |x, y, z| {
        x * x / 9.0 + y * y / 4.0 + z * z - 1.0
    });
    compare3(
        "(x^2 + 9/4*y^2 + z^2 - 1)^3 = x^2*z^3 + 9/80*y^2*z^3",
        |x, y, z| {
            (x * x + y * y * 2.25 + z * z - 1.0).powi(3)
                - x * x * z.powi(3)
                - y * y * z.powi(3) * 0.1125
        },
    );
    compare3(
        "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)",
        |x, y, z| x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos(),
    );
}

#[test]
fn functions() {
    compare3("exp(x*y) - ln(z) + log(x)", |x, y, z| {
        (x * y).exp() - z.ln() + x.ln()
    });
    compare3("tan(x*y*z)", |x, y, z| (x * y * z).tan());
    compare3("asin(x*y) + acos(z*y)", |x, y, z| {
        (x * y).asin() + (z * y).acos()
    });
    compare3("atan(x/y) + z", |x, y, z| (x / y).atan() + z);
    compare3("atan2(y - z, x + z*z)", |x, y, z| (y - z).atan2(x + z * z));
    compare3("sinh(x) * cosh(y) * tanh(z)", |x, y, z| {
        x.sinh() * y.cosh() * z.tanh()
    });
    compare3("sqrt(x)*sqrt(y/z)", |x, y, z| x.sqrt() * (y / z).sqrt());
    compare3("abs(x - 2)*abs(y)*z", |x, y, z| (-x + 2.0) * y * z);
    compare3("sign(x - 2)*y*z", |_, y, z| -y * z);
    compare3(
        "min(x, y + 2, z + 3) * max(x - 3, y*z, z - 3)",
        |x, y, z| x * y * z,
    );
}

#[test]
fn powers() {
    compare3("x^7*y**3/z^2", |x, y, z| x.powi(7) * y.powi(3) / z.powi(2));
    compare3("x^-3 + y^(-1) + z^0", |x, y, _| {
        x.powi(-3) + y.recip() + 1.0
    });
    compare3("x^1.5 + y^-0.5 + z^(-3/2)", |x, y, z| {
        x.powf(1.5) + y.powf(-0.5) + z.powf(-1.5)
    });
    compare3("x^(1/3) + y^-0.7 + z^41", |x, y, z| {
        x.powf(1.0 / 3.0) + y.powf(-0.7) + z.powi(41)
    });
    compare3("x^(y*z)", |x, y, z| x.powd(y * z));
    compare3("2^(x*y) + e^z", |x, y, z| {
        (x * y * std::f64::consts::LN_2).exp() + z.exp()
    });
    compare3("x^y^z", |x, y, z| x.powd(y.powd(z)));
    compare3("pow(x + y, z)", |x, y, z| (x + y).powd(z));
}

#[test]
fn quotients() {
    compare3("(x*y + 1)/(x + y*z)", |x, y, z| (x * y + 1.0) / (x + y * z));
    compare3("1/(x*x + y*z)", |x, y, z| (x * x + y * z).recip());
    compare3("x/3 - y/z/x", |x, y, z| x / 3.0 - y / z / x);
}

#[test]
fn higher_dimensions() {
    for x in points::<2>() {
        compare("x^3*y - y^2", &x, |[x, y]| x.powi(3) * y - y * y);
    }
    for x in points::<16>() {
        compare("sqrt(x1^2 + x5^2 + x16*x7) + x2*x3*x16", &x, |x| {
            (x[0] * x[0] + x[4] * x[4] + x[15] * x[6]).sqrt() + x[1] * x[2] * x[15]
        });
    }
}

#[test]
fn several_equations_share_a_tape() {
    let texts = [
        "x1^2 + x2^2 = 0.5",
        "x3^2 + x4^2 = 0.5",
        "sin(x1^2 + x2^2)*x4",
    ];
    let together = Formula::parse(&texts, None).unwrap();
    assert_eq!((together.dimension(), together.equation_count()), (4, 3));
    for x in points::<4>() {
        for (answer, text) in evaluate(&together, &x).iter().zip(texts) {
            let alone = Formula::parse(&[text], Some(4)).unwrap();
            assert!(answer.entries().eq(evaluate(&alone, &x)[0].entries()));
        }
    }
    let apart: usize = texts
        .iter()
        .map(|text| {
            Formula::parse(&[text], Some(4))
                .unwrap()
                .operation_counts()
                .1
        })
        .sum();
    assert!(together.operation_counts().1 < apart);
}

#[test]
fn a_long_program_agrees_with_its_short_parts() {
    let term = |n: usize| format!("sin({n}*x*y + z/{n})*exp(-y^2/{n})");
    let terms: Vec<String> = (1..=40).map(term).collect();
    let sum = Formula::parse(&[&terms.join(" + ")], None).unwrap();
    assert!(sum.operation_counts().1 > 1000);
    for x in points::<3>() {
        let mut expected = vec![0.0; 13];
        for term in &terms {
            let part = Formula::parse(&[term], None).unwrap();
            for (total, entry) in expected.iter_mut().zip(evaluate(&part, &x)[0].entries()) {
                *total += entry;
            }
        }
        for (found, expected) in evaluate(&sum, &x)[0].entries().zip(expected) {
            assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1e3));
        }
    }
}

#[test]
fn whole_powers_are_smooth_at_zero_and_below() {
    let formula = Formula::parse(&["x^3 + y^2 + z^4 + x^2.5"], None).unwrap();
    let at_zero = &evaluate(&formula, &Vector::<3>::zeros())[0];
    assert_eq!(at_zero.gradient, Vector::<3>::zeros());
    assert_eq!(at_zero.hessian.diagonal(), Vector::<3>::new(0.0, 2.0, 0.0));
    let formula = Formula::parse(&["x^3 + y^-2 + z"], None).unwrap();
    let below = &evaluate(&formula, &Vector::<3>::new(-2.0, -0.5, 0.0))[0];
    assert_eq!(below.value, -4.0);
    assert_eq!(below.gradient, Vector::<3>::new(12.0, 16.0, 1.0));
    assert_eq!(below.hessian.diagonal(), Vector::<3>::new(-12.0, 96.0, 0.0));
}

#[test]
fn kinks_take_the_documented_piece() {
    let at = |text: &str, x: [f64; 2]| {
        let formula = Formula::parse(&[text], Some(2)).unwrap();
        evaluate(&formula, &Vector::<2>::from(x))[0].clone()
    };
    assert_eq!(
        at("abs(x) + y", [0.0, 1.0]).gradient,
        Vector::<2>::new(0.0, 1.0)
    );
    assert_eq!(
        at("abs(x) + y", [-3.0, 1.0]).gradient,
        Vector::<2>::new(-1.0, 1.0)
    );
    assert_eq!(
        at("min(x, 2*y)", [2.0, 1.0]).gradient,
        Vector::<2>::new(1.0, 0.0)
    );
    assert_eq!(
        at("max(2*y, x)", [2.0, 1.0]).gradient,
        Vector::<2>::new(0.0, 2.0)
    );
    assert_eq!(at("sign(x) + y", [0.0, 1.0]).value, 1.0);
}

#[test]
fn outside_the_domain_is_not_finite() {
    let texts = [
        "sqrt(x)",
        "log(x)",
        "asin(x - 1)",
        "x^0.3",
        "x^y",
        "min(sqrt(x), 1)",
        "max(1, ln(x))",
    ];
    for text in texts {
        let formula = Formula::parse(&[&format!("{text} + y")], Some(2)).unwrap();
        let answer = &evaluate(&formula, &Vector::<2>::new(-2.0, 0.5))[0];
        assert!(answer.value.is_nan(), "{text}: {answer:?}");
    }
    let formula = Formula::parse(&["1/x + log(x)*y"], Some(2)).unwrap();
    let answer = &evaluate(&formula, &Vector::<2>::new(0.0, 1.0))[0];
    assert!(!answer.value.is_finite());
}
