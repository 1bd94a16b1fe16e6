//! Nanoseconds per evaluation of some formulas: `cargo run --release --example speed`.

use std::hint::black_box;
use std::time::Instant;

use taut_core::surface::implicit::Equations;
use taut_core::{Matrix, Vector};
use taut_formula::{Formula, FormulaError};

const POINTS: usize = 1000;
const ROUNDS: usize = 200;

fn main() -> Result<(), FormulaError> {
    println!("ns per evaluation (operations)   gradients          Hessians");
    measure::<3>("sphere", &["x^2 + y^2 + z^2 = 1"])?;
    measure::<3>("torus", &["(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16"])?;
    measure::<3>(
        "heart",
        &["(x^2 + 9/4*y^2 + z^2 - 1)^3 = x^2*z^3 + 9/80*y^2*z^3"],
    )?;
    measure::<3>("gyroid", &["sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)"])?;
    measure::<4>(
        "Clifford torus",
        &["x1^2 + x2^2 = 1/2", "x3^2 + x4^2 = 1/2"],
    )?;
    measure::<9>("SO(3)", &rotations(3))?;
    measure::<16>("SO(4)", &rotations(4))?;
    let dense = "sqrt(x1^2 + x2^2 + x3^2 + x4^2 + x5^2 + x6^2 + x7^2 + x8^2 + x9^2) = 1";
    measure::<9>("norm in R^9", &[dense])?;
    Ok(())
}

fn measure<const D: usize>(name: &str, texts: &[impl AsRef<str>]) -> Result<(), FormulaError> {
    let texts: Vec<&str> = texts.iter().map(AsRef::as_ref).collect();
    let formula = Formula::parse(&texts, Some(D))?;
    let count = formula.equation_count();
    let mut values = vec![0.0; count];
    let mut gradients = vec![Vector::<D>::zeros(); count];
    let mut hessians = vec![Matrix::<D>::zeros(); count];
    let points: Vec<Vector<D>> = (0..POINTS)
        .map(|point| Vector::from_fn(|row, _| ((point * D + row) as f64).sin() + 1.5))
        .collect();
    let first = nanoseconds(&points, |x| {
        formula.gradients(x, &mut values, &mut gradients);
        black_box((&values, &gradients));
    });
    let second = nanoseconds(&points, |x| {
        formula.hessians(x, &mut values, &mut gradients, &mut hessians);
        black_box((&values, &gradients, &hessians));
    });
    let (first_count, second_count) = formula.operation_counts();
    println!("{name:>30} {first:10.1} ({first_count:4}) {second:10.1} ({second_count:4})");
    Ok(())
}

/// The least, over some repetitions, of the mean time of an evaluation.
fn nanoseconds<const D: usize>(points: &[Vector<D>], mut evaluate: impl FnMut(&Vector<D>)) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for point in points {
            evaluate(black_box(point));
        }
        least = least.min(start.elapsed().as_secs_f64() / points.len() as f64);
    }
    least * 1e9
}

/// The orthonormal rows of an n x n matrix.
fn rotations(n: usize) -> Vec<String> {
    let entry = |row: usize, column: usize| format!("x{}", row * n + column + 1);
    let product = |a: usize, b: usize| {
        let terms: Vec<String> = (0..n)
            .map(|column| format!("{}*{}", entry(a, column), entry(b, column)))
            .collect();
        format!("{} = {}", terms.join(" + "), u8::from(a == b))
    };
    (0..n)
        .flat_map(|a| (a..n).map(move |b| (a, b)))
        .map(|(a, b)| product(a, b))
        .collect()
}
