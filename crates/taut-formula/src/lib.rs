//! Formulas as programs with exact first and second derivatives, for implicit surfaces.
//!
//! A [`Formula`] is read from the text of one or several equations and answers, through
//! [`Equations`], with values, gradients and Hessians that are exact to rounding: the derivatives
//! are expressions too, found when the text is read, not differences.
//!
//! ```
//! use taut_core::surface::implicit::Equations;
//! use taut_core::{Matrix, Vector};
//! use taut_formula::Formula;
//!
//! let torus = Formula::parse(&["(sqrt(x^2 + y^2) - 1)^2 + z^2 = 0.16"], None)?;
//! let (mut value, mut gradient, mut hessian) = ([0.0], [Vector::zeros()], [Matrix::zeros()]);
//! let point = Vector::<3>::new(2.0, 0.0, 0.0);
//! torus.hessians(&point, &mut value, &mut gradient, &mut hessian);
//! assert_eq!(value[0], 0.84);
//! assert_eq!(gradient[0], Vector::<3>::new(2.0, 0.0, 0.0));
//! assert_eq!(hessian[0], Matrix::<3>::from_diagonal(&Vector::<3>::new(2.0, 1.0, 2.0)));
//! # Ok::<(), taut_formula::FormulaError>(())
//! ```
//!
//! # Language
//!
//! | | |
//! |---|---|
//! | equations | `left = right`, or an expression, which is then equal to 0 |
//! | variables | `x`, `y`, `z`, or `x1` to `x16`; not both in one system |
//! | numbers | `2`, `.5`, `1.5e-3`, and the constants `pi` and `e` |
//! | operators, loosest first | `+` `-`; `*` `/`; signs; `^` or `**`, from the right: `-x^2` is `-(x^2)` |
//! | functions | `sqrt exp log ln sin cos tan asin acos atan atan2(y, x) sinh cosh tanh abs sign min max pow(a, b)` |
//!
//! `log` and `ln` are the natural logarithm; angles are in radians; `min` and `max` take two
//! arguments or more.
//!
//! Powers with a constant exponent that is a multiple of 1/2 up to 32 are products and square
//! roots, so `x^3` is smooth at 0 and for negative `x`; other constant exponents need a base of
//! at least 0 and variable ones a positive base.
//!
//! Where a function has a kink its derivative is that of one piece: `abs` has derivative 0 at 0,
//! `sign` has derivative 0 everywhere, and where arguments of `min` or `max` are equal the first
//! of them is differentiated.
//!
//! Outside the domain of a function values and derivatives are NaN or infinite; no evaluation
//! panics.

mod error;
mod function;
mod graph;
mod jet;
mod lexer;
mod names;
mod operation;
mod parse;
mod tape;

use taut_core::surface::implicit::Equations;
use taut_core::{Matrix, Vector};

pub use crate::error::{ErrorKind, FormulaError};
use crate::graph::{Graph, Id};
use crate::jet::Jet;
use crate::parse::System;
use crate::tape::{Slot, Tape};

/// The largest dimension of a [`Formula`].
pub const MAXIMUM_DIMENSION: usize = 16;
/// The most bytes of one equation.
pub const MAXIMUM_LENGTH: usize = 1 << 16;
/// The deepest nesting of parentheses, calls, signs and powers.
pub const MAXIMUM_DEPTH: usize = 200;
/// The most scalar operations, constants and variables that the equations of one formula and
/// all their derivatives may have.
pub const MAXIMUM_INSTRUCTIONS: usize = 1 << 19;

/// One or several equations F(x) = 0 in R^d with their derivatives.
///
/// Implements [`Equations<D>`] for every D; calling it with a D other than
/// [`dimension`](Self::dimension) panics.
///
/// An evaluation costs about a nanosecond for each distinct scalar operation, so derivatives
/// that vanish, are constant or occur twice cost nothing; it allocates only when a thread meets
/// a longer program than ever before.
#[derive(Debug, Clone)]
pub struct Formula {
    dimension: usize,
    equation_count: usize,
    gradients: Program,
    hessians: Program,
}

/// A tape and where its results go.
#[derive(Debug, Clone)]
struct Program {
    tape: Tape,
    values: Vec<Slot>,
    gradients: Vec<Entry>,
    hessians: Vec<Entry>,
}

/// One number of a result.
#[derive(Debug, Clone, Copy)]
struct Entry {
    equation: u32,
    row: u8,
    column: u8,
    slot: Slot,
}

impl Formula {
    /// Reads a system of equations.
    ///
    /// # Arguments
    /// - `equations`: one text each, see the [language](crate#language).
    /// - `dimension`: that of the space, 2 to [`MAXIMUM_DIMENSION`]; by default 3 for x, y, z
    ///   and the highest index, but at least 2, for x1, x2, ...
    ///
    /// # Errors
    /// Where the dimension or a text is wrong, with the bytes at fault.
    ///
    /// ```
    /// let error = taut_formula::Formula::parse(&["x^2 + 2y = 1"], None).unwrap_err();
    /// assert_eq!(error.span(), Some(6..8));
    /// assert_eq!(
    ///     error.to_string(),
    ///     "missing operator between \"2\" and \"y\" at byte 6 (for a product write \"2*y\")\
    ///      \n  x^2 + 2y = 1\
    ///      \n        ^^"
    /// );
    /// ```
    ///
    /// # Complexity
    /// Time and memory at most proportional to d^2 times the operations in the texts.
    pub fn parse(equations: &[&str], dimension: Option<usize>) -> Result<Self, FormulaError> {
        if equations.is_empty() {
            return Err(FormulaError::new(ErrorKind::NoEquations));
        }
        if let Some(dimension) = dimension.filter(|d| !(2..=MAXIMUM_DIMENSION).contains(d)) {
            return Err(FormulaError::new(ErrorKind::Dimension(dimension)));
        }
        let mut system = System::new(dimension);
        let mut jets = Vec::new();
        for (equation, text) in equations.iter().enumerate() {
            jets.push(system.read(equation, text)?);
        }
        let dimension = system.resolved_dimension();
        Ok(Self {
            dimension,
            equation_count: jets.len(),
            gradients: Program::new(&system.graph, dimension, &jets, false),
            hessians: Program::new(&system.graph, dimension, &jets, true),
        })
    }

    /// The dimension d of the space.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The number of equations.
    pub fn equation_count(&self) -> usize {
        self.equation_count
    }

    /// The scalar operations of one evaluation with gradients alone, and with Hessians.
    pub fn operation_counts(&self) -> (usize, usize) {
        (self.gradients.tape.len(), self.hessians.tape.len())
    }
}

impl<const D: usize> Equations<D> for Formula {
    fn count(&self) -> usize {
        self.equation_count
    }

    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]) {
        self.gradients.tape.evaluate(x.as_slice(), |slots| {
            self.gradients.write_gradients(slots, values, gradients);
        });
    }

    fn hessians(
        &self,
        x: &Vector<D>,
        values: &mut [f64],
        gradients: &mut [Vector<D>],
        hessians: &mut [Matrix<D>],
    ) {
        self.hessians.tape.evaluate(x.as_slice(), |slots| {
            self.hessians.write_gradients(slots, values, gradients);
            self.hessians.write_hessians(slots, hessians);
        });
    }
}

impl Program {
    fn new(graph: &Graph, dimension: usize, jets: &[Jet], with_hessians: bool) -> Self {
        let mut roots: Vec<Id> = jets.iter().map(|jet| jet.value).collect();
        let (mut gradients, mut hessians) = (Vec::new(), Vec::new());
        let slot = Slot::MAX;
        for (equation, jet) in (0..).zip(jets) {
            for &(row, id) in &jet.gradient {
                roots.push(id);
                gradients.push(Entry {
                    equation,
                    row,
                    column: 0,
                    slot,
                });
            }
        }
        for (equation, jet) in (0..).zip(jets).filter(|_| with_hessians) {
            for &((row, column), id) in &jet.hessian {
                roots.push(id);
                hessians.push(Entry {
                    equation,
                    row,
                    column,
                    slot,
                });
            }
        }
        let (tape, values) = Tape::new(graph, dimension, &roots);
        let (values, entries) = values.split_at(jets.len());
        for (entry, slot) in gradients.iter_mut().chain(&mut hessians).zip(entries) {
            entry.slot = *slot;
        }
        let values = values.to_vec();
        Self {
            tape,
            values,
            gradients,
            hessians,
        }
    }

    fn write_gradients<const D: usize>(
        &self,
        slots: &[f64],
        values: &mut [f64],
        gradients: &mut [Vector<D>],
    ) {
        for (value, slot) in values.iter_mut().zip(&self.values) {
            *value = slots[*slot as usize];
        }
        gradients.fill(Vector::zeros());
        for entry in &self.gradients {
            gradients[entry.equation as usize][entry.row as usize] = slots[entry.slot as usize];
        }
    }

    fn write_hessians<const D: usize>(&self, slots: &[f64], hessians: &mut [Matrix<D>]) {
        hessians.fill(Matrix::zeros());
        for entry in &self.hessians {
            let (row, column) = (entry.row as usize, entry.column as usize);
            let hessian = &mut hessians[entry.equation as usize];
            hessian[(row, column)] = slots[entry.slot as usize];
            hessian[(column, row)] = slots[entry.slot as usize];
        }
    }
}
