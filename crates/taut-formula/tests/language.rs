//! What a text means, and what is wrong with it, to the byte.

use proptest::prelude::*;
use taut_core::Vector;
use taut_core::surface::implicit::Equations;
use taut_formula::{ErrorKind, Formula, FormulaError, MAXIMUM_DEPTH, MAXIMUM_LENGTH};

/// The value of `text` at (0.5, 3, -2).
fn value(text: &str) -> f64 {
    let formula = Formula::parse(&[text], Some(3)).unwrap_or_else(|error| panic!("{error}"));
    let (mut value, mut gradient) = ([0.0], [Vector::<3>::zeros()]);
    formula.gradients(&Vector::<3>::new(0.5, 3.0, -2.0), &mut value, &mut gradient);
    value[0]
}

fn error(text: &str) -> FormulaError {
    Formula::parse(&[text], None).expect_err(text)
}

#[test]
fn precedence() {
    assert_eq!(value("-y^2"), -9.0);
    assert_eq!(value("(-y)^2"), 9.0);
    assert_eq!(value("2^y^2"), 512.0);
    assert_eq!(value("2**y**2"), 512.0);
    assert_eq!(value("2^-y"), 0.125);
    assert_eq!(value("2^-y*2"), 0.25);
    assert_eq!(value("-y^-1*3"), -1.0);
    assert_eq!(value("1 - y - z"), 0.0);
    assert_eq!(value("12/y/2"), 2.0);
    assert_eq!(value("1 + y*2"), 7.0);
    assert_eq!(value("2*-y"), -6.0);
    assert_eq!(value("1--y"), 4.0);
    assert_eq!(value("+y"), 3.0);
    assert_eq!(value("y = 1 + 1"), 1.0);
    assert_eq!(value(" ( y\t*\n2 ) "), 6.0);
}

#[test]
fn numbers_and_names() {
    assert_eq!(value("x + 1.5e1"), 15.5);
    assert_eq!(value("x + .5E-1"), 0.55);
    assert_eq!(value("x*4."), 2.0);
    assert_eq!(value("x + pi"), 0.5 + std::f64::consts::PI);
    assert_eq!(value("x + e"), 0.5 + std::f64::consts::E);
    assert_eq!(value("x + 2e+2"), 200.5);
    assert_eq!(value("x1 + x2*x3"), -5.5);
    assert_eq!(value("ln(x) - log(x) + y"), 3.0);
    assert_eq!(value("max(x, y, z) - min(x, y, z)"), 5.0);
    assert_eq!(value("10^-3*y"), 0.003);
}

#[test]
fn dimensions() {
    let dimension = |texts: &[&str], asked| Formula::parse(texts, asked).map(|f| f.dimension());
    assert_eq!(dimension(&["x + y"], None), Ok(3));
    assert_eq!(dimension(&["x + y"], Some(2)), Ok(2));
    assert_eq!(dimension(&["x1 + x4"], None), Ok(4));
    assert_eq!(dimension(&["x1", "x16"], None), Ok(16));
    assert_eq!(dimension(&["x1"], None), Ok(2));
    assert_eq!(dimension(&["x1"], Some(9)), Ok(9));
    for wrong in [0, 1, 17] {
        let error = dimension(&["x1"], Some(wrong)).unwrap_err();
        assert_eq!(error.kind(), &ErrorKind::Dimension(wrong));
        assert_eq!((error.span(), error.equation()), (None, None));
    }
    assert_eq!(
        dimension(&[], None).unwrap_err().kind(),
        &ErrorKind::NoEquations
    );
}

#[test]
fn constants_fold_and_dead_code_goes() {
    let operations = |text: &str| Formula::parse(&[text], None).unwrap().operation_counts();
    assert_eq!(operations("x + sin(2)^2/3*exp(0)"), (1, 1));
    assert_eq!(operations("x*1 + 0*y - 0 = 0"), (0, 0));
    assert_eq!(operations("sin(x*y) - sin(y*x) + z"), (0, 0));
    assert_eq!(
        operations("x^2 + y^2 + z^2 = 1").0,
        operations("x^2 + y^2 + z^2 = 1").1
    );
}

#[test]
fn every_error_has_its_bytes() {
    use ErrorKind as E;
    let text = |text: &str| text.to_owned();
    let missing = |left: &str, right: &str| E::MissingOperator {
        left: text(left),
        right: text(right),
    };
    let cases = [
        ("", E::Empty, 0..0),
        ("  \n", E::Empty, 0..0),
        ("x + foo*y", E::UnknownName(text("foo")), 4..7),
        ("x0 + 1", E::UnknownName(text("x0")), 0..2),
        ("x01 + 1", E::UnknownName(text("x01")), 0..3),
        ("X + 1", E::UnknownName(text("X")), 0..1),
        ("x + 2y", missing("2", "y"), 4..6),
        ("x + 2 (y)", missing("2", "("), 4..7),
        ("(x)(y)", missing(")", "("), 2..4),
        ("x y", missing("x", "y"), 0..3),
        ("2e*x", missing("2", "e"), 0..2),
        ("x + sin y", E::MissingArguments("sin"), 4..7),
        ("x + sin", E::MissingArguments("sin"), 4..7),
        (
            "x + sin()",
            E::ArgumentCount {
                name: "sin",
                expected: "1",
                found: 0,
            },
            4..9,
        ),
        (
            "sin(x, y)",
            E::ArgumentCount {
                name: "sin",
                expected: "1",
                found: 2,
            },
            0..9,
        ),
        (
            "atan2(x,y,z)",
            E::ArgumentCount {
                name: "atan2",
                expected: "2",
                found: 3,
            },
            0..12,
        ),
        (
            "min(x) + 1",
            E::ArgumentCount {
                name: "min",
                expected: "2 or more",
                found: 1,
            },
            0..6,
        ),
        ("x +", E::ExpectedOperand(text("the end")), 3..3),
        ("x + * y", E::ExpectedOperand(text("\"*\"")), 4..5),
        ("()", E::ExpectedOperand(text("\")\"")), 1..2),
        ("= x", E::ExpectedOperand(text("\"=\"")), 0..1),
        ("x, y", E::ExpectedOperator(text("\",\"")), 1..2),
        ("(x, y)", E::ExpectedOperator(text("\",\"")), 2..3),
        ("(x = y)", E::ExpectedOperator(text("\"=\"")), 3..4),
        ("2*(x + (y", E::UnclosedParenthesis, 7..8),
        ("sin(x", E::UnclosedParenthesis, 3..4),
        ("x + y)", E::UnmatchedParenthesis, 5..6),
        ("x = y = z", E::SecondEquals, 6..7),
        ("x == y", E::ExpectedOperand(text("\"=\"")), 3..4),
        ("x # y", E::UnexpectedCharacter('#'), 2..3),
        ("x \u{2212} y", E::UnexpectedCharacter('\u{2212}'), 2..5),
        ("1.2.3 + x", E::BadNumber(text("1.2.3")), 0..5),
        ("x + 1e999", E::BadNumber(text("1e999")), 4..9),
        ("x + .", E::BadNumber(text(".")), 4..5),
        (
            "x + y + x3",
            E::MixedVariables {
                found: text("x3"),
                earlier: text("x"),
            },
            8..10,
        ),
        (
            "x17 = 1",
            E::VariableBeyondDimension {
                name: text("x17"),
                dimension: 16,
            },
            0..3,
        ),
        (
            "x99999999999999999999",
            E::VariableBeyondDimension {
                name: text("x99999999999999999999"),
                dimension: 16,
            },
            0..21,
        ),
        (" 1 = 2 ", E::NoVariable, 1..6),
        ("x - x", E::NoVariable, 0..5),
    ];
    for (source, kind, span) in cases {
        let error = error(source);
        assert_eq!(
            (error.kind(), error.span()),
            (&kind, Some(span)),
            "{source}"
        );
        assert_eq!(error.equation(), Some(0));
    }
}

#[test]
fn errors_depend_on_the_dimension_and_on_earlier_equations() {
    let error = Formula::parse(&["x1 + x2", "x3 + y"], None).unwrap_err();
    assert_eq!((error.equation(), error.span()), (Some(1), Some(5..6)));
    assert!(matches!(error.kind(), ErrorKind::MixedVariables { .. }));
    for (text, dimension, span) in [("x + z", 2, 4..5), ("x1 + x3", 2, 5..7), ("x + y", 4, 0..1)] {
        let error = Formula::parse(&[text], Some(dimension)).unwrap_err();
        assert!(matches!(
            error.kind(),
            ErrorKind::VariableBeyondDimension { .. }
        ));
        assert_eq!(error.span(), Some(span));
    }
}

#[test]
fn display_points_at_the_place() {
    let lines = |text: &str| {
        error(text)
            .to_string()
            .lines()
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let unknown = lines("x + foo*y");
    assert!(
        unknown[0]
            .starts_with("unknown name \"foo\" at byte 4 (known: x y z, x1 to x16, pi e sqrt")
    );
    assert_eq!(unknown[1..], ["  x + foo*y", "      ^^^"]);
    assert_eq!(
        lines("x \u{2212} y\n= 1"),
        [
            "unexpected character '\u{2212}' at byte 2 (write \"-\")",
            "  x \u{2212} y = 1",
            "    ^"
        ]
    );
    assert_eq!(lines("x +")[1..], ["  x +", "     ^"]);
    let long = lines(&format!("{}x y{}", "1 + ".repeat(50), " + 1".repeat(50)));
    assert_eq!(long[1].len(), 2 + 3 + 50 + 50 + 3);
    assert_eq!(long[2], format!("{}^^^", " ".repeat(55)));
    assert_eq!(&long[1][55..58], "x y");
}

#[test]
fn limits() {
    let nested = |depth: usize| format!("{}x{}", "(".repeat(depth), ")".repeat(depth));
    assert!(Formula::parse(&[&nested(MAXIMUM_DEPTH - 1)], None).is_ok());
    for text in [
        nested(MAXIMUM_DEPTH),
        nested(20_000),
        "-".repeat(60_000) + "x",
        "x^".repeat(30_000) + "x",
        "sin(".repeat(10_000),
    ] {
        assert_eq!(error(&text).kind(), &ErrorKind::TooDeep);
    }
    let error_at_depth = error(&nested(20_000));
    assert_eq!(
        error_at_depth.span(),
        Some(MAXIMUM_DEPTH..MAXIMUM_DEPTH + 1)
    );

    let sum = |count: usize| vec!["x"; count].join("+");
    assert!(Formula::parse(&[&sum(MAXIMUM_LENGTH / 2)], None).is_ok());
    let too_long = error(&sum(MAXIMUM_LENGTH));
    assert_eq!(too_long.kind(), &ErrorKind::TooLong(2 * MAXIMUM_LENGTH - 1));
    assert_eq!(too_long.span(), Some(0..2 * MAXIMUM_LENGTH - 1));

    let factors: Vec<String> = (0..6000)
        .map(|n| format!("(x{}+{n})", n % 16 + 1))
        .collect();
    let product = factors.join("*");
    let too_large = error(&product);
    assert_eq!(too_large.kind(), &ErrorKind::TooLarge);
    assert_eq!(too_large.span().map(|span| &product[span]), Some("*"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,60}") {
        check(&text)?;
    }

    #[test]
    fn near_formulas_are_read_or_refused(
        pieces in prop::collection::vec(prop::sample::select(vec![
            "x", "y", "z", "x1", "x12", "2", "0", "1.5", "e", "pi", "sin", "log", "atan2", "min",
            "(", ")", "(", ")", ",", "+", "-", "*", "/", "^", "**", "=", " ", "1e3", "sqrt(", "\u{e9}",
        ]), 0..25)
    ) {
        check(&pieces.concat())?;
    }
}

/// Parsing and evaluating never panic, and an error lies within the text.
fn check(text: &str) -> Result<(), TestCaseError> {
    match Formula::parse(&[text], Some(3)) {
        Ok(formula) => {
            let (mut values, mut gradients) = ([0.0], [Vector::<3>::zeros()]);
            formula.gradients(&Vector::<3>::zeros(), &mut values, &mut gradients);
        }
        Err(error) => {
            let span = error.span().ok_or_else(|| TestCaseError::fail("no span"))?;
            prop_assert!(text.get(span).is_some());
            prop_assert!(error.to_string().lines().count() == 3);
        }
    }
    Ok(())
}
