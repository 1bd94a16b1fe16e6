//! What can be wrong with a formula, and where.

use std::fmt;
use std::ops::Range;

use crate::{MAXIMUM_DEPTH, MAXIMUM_DIMENSION, MAXIMUM_INSTRUCTIONS, MAXIMUM_LENGTH};

/// The characters shown on either side of the place of an error.
const CONTEXT: usize = 50;

/// A formula that could not be read, with the place in its text.
///
/// The text form is one line of message, then, where there is a place, the source and a caret
/// under it.
#[derive(Debug, Clone, PartialEq)]
pub struct FormulaError {
    kind: ErrorKind,
    place: Option<Place>,
}

#[derive(Debug, Clone, PartialEq)]
struct Place {
    equation: usize,
    source: String,
    span: Range<usize>,
}

/// What is wrong with a formula.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// No text was given.
    #[error("no equation given")]
    NoEquations,
    /// The dimension asked for is not supported.
    #[error("dimension {0} is not supported")]
    Dimension(usize),
    /// A text has nothing but white space.
    #[error("empty formula")]
    Empty,
    /// A text is longer than [`MAXIMUM_LENGTH`].
    #[error("formula of {0} bytes is too long")]
    TooLong(usize),
    /// Parentheses, signs or powers are nested deeper than [`MAXIMUM_DEPTH`].
    #[error("nested too deeply")]
    TooDeep,
    /// The derivatives need more than [`MAXIMUM_INSTRUCTIONS`] instructions.
    #[error("derivatives too large")]
    TooLarge,
    /// A character that no formula has.
    #[error("unexpected character {0:?}")]
    UnexpectedCharacter(char),
    /// A number that is malformed or beyond the range of f64.
    #[error("malformed or too large number {0:?}")]
    BadNumber(String),
    /// A name that is no variable, constant or function.
    #[error("unknown name {0:?}")]
    UnknownName(String),
    /// A function's name without its arguments in parentheses.
    #[error("function {0} without arguments")]
    MissingArguments(&'static str),
    /// A function called with too few or too many arguments.
    #[error("function {name} called with {found} arguments instead of {expected}")]
    ArgumentCount {
        /// The function.
        name: &'static str,
        /// The arguments it takes.
        expected: &'static str,
        /// The arguments given.
        found: usize,
    },
    /// Two operands side by side: there is no implicit multiplication.
    #[error("missing operator between {left:?} and {right:?}")]
    MissingOperator {
        /// The token before the gap.
        left: String,
        /// The token after the gap.
        right: String,
    },
    /// Something else where a number, name or parenthesis should be.
    #[error("expected a number, a name or \"(\", found {0}")]
    ExpectedOperand(String),
    /// A token that fits nowhere after a complete expression.
    #[error("expected an operator or the end, found {0}")]
    ExpectedOperator(String),
    /// An opening parenthesis without its partner.
    #[error("unclosed \"(\"")]
    UnclosedParenthesis,
    /// A closing parenthesis without its partner.
    #[error("unmatched \")\"")]
    UnmatchedParenthesis,
    /// A second equals sign in one equation.
    #[error("second \"=\"")]
    SecondEquals,
    /// Both x, y, z and x1, x2, ... in one system.
    #[error("variable {found:?} mixed with {earlier:?}")]
    MixedVariables {
        /// The variable at the place of the error.
        found: String,
        /// The first variable of the system.
        earlier: String,
    },
    /// A variable beyond the dimension.
    #[error("variable {name:?} in dimension {dimension}")]
    VariableBeyondDimension {
        /// The variable.
        name: String,
        /// The dimension asked for, or the largest supported one.
        dimension: usize,
    },
    /// An equation whose derivatives vanish identically: it describes no surface.
    #[error("the equation depends on no variable")]
    NoVariable,
}

impl ErrorKind {
    fn remedy(&self) -> Option<String> {
        Some(match self {
            Self::NoEquations => "give at least one, such as \"x^2 + y^2 + z^2 = 1\"".into(),
            Self::Dimension(_) => format!("supported: 2 to {MAXIMUM_DIMENSION}"),
            Self::Empty => "write an expression or an equation".into(),
            Self::TooLong(_) => format!("limit: {MAXIMUM_LENGTH} bytes"),
            Self::TooDeep => format!("limit: {MAXIMUM_DEPTH} levels"),
            Self::TooLarge => format!("limit: {MAXIMUM_INSTRUCTIONS} instructions"),
            Self::UnexpectedCharacter(character) => {
                format!("write {:?}", character_remedy(*character)?)
            }
            Self::BadNumber(_) => "numbers look like 2, 0.5 or 1.5e-3".into(),
            Self::UnknownName(_) => format!("known: {}", crate::names::known()),
            Self::MissingArguments(name) => format!("write {name}(...)"),
            Self::MissingOperator { left, right } => {
                format!("for a product write {:?}", format!("{left}*{right}"))
            }
            Self::MixedVariables { .. } => "use either x, y, z or x1, x2, ...".into(),
            Self::VariableBeyondDimension { name, dimension } => match name.as_str() {
                "x" | "y" | "z" if *dimension > 3 => {
                    format!("x, y, z need dimension 2 or 3; write x1 to x{dimension}")
                }
                "z" => "dimension 2 has x and y, or x1 and x2".into(),
                _ => format!("variables are x1 to x{dimension}"),
            },
            Self::SecondEquals => "one equation a text: left = right".into(),
            Self::ArgumentCount { .. }
            | Self::ExpectedOperand(_)
            | Self::ExpectedOperator(_)
            | Self::UnclosedParenthesis
            | Self::UnmatchedParenthesis
            | Self::NoVariable => return None,
        })
    }
}

/// What to write instead of a character that is often pasted or typed by habit.
fn character_remedy(character: char) -> Option<&'static str> {
    Some(match character {
        '\u{2212}' | '\u{2013}' | '\u{2014}' => "-",
        '\u{d7}' | '\u{b7}' | '\u{22c5}' => "*",
        '\u{f7}' => "/",
        '\u{b2}' => "^2",
        '\u{b3}' => "^3",
        '\u{3c0}' => "pi",
        '\u{221a}' => "sqrt(...)",
        '[' | '{' => "(",
        ']' | '}' => ")",
        ';' => ",",
        '|' => "abs(...)",
        _ => return None,
    })
}

impl FormulaError {
    pub(crate) fn new(kind: ErrorKind) -> Self {
        Self { kind, place: None }
    }

    pub(crate) fn at(kind: ErrorKind, equation: usize, source: &str, span: Range<usize>) -> Self {
        let source = source.to_owned();
        let place = Some(Place {
            equation,
            source,
            span,
        });
        Self { kind, place }
    }

    /// What is wrong.
    pub fn kind(&self) -> &ErrorKind {
        &self.kind
    }

    /// The index, from 0, of the text in which it is wrong.
    pub fn equation(&self) -> Option<usize> {
        self.place.as_ref().map(|place| place.equation)
    }

    /// The bytes of the text that are wrong; empty at the end of a text that stops too early.
    pub fn span(&self) -> Option<Range<usize>> {
        self.place.as_ref().map(|place| place.span.clone())
    }
}

impl fmt::Display for FormulaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        if let Some(place) = &self.place {
            write!(f, " at byte {}", place.span.start)?;
        }
        if let Some(remedy) = self.kind.remedy() {
            write!(f, " ({remedy})")?;
        }
        match &self.place {
            Some(place) => place.draw(f),
            None => Ok(()),
        }
    }
}

impl Place {
    /// The source about the span, on one line, and a caret line below it.
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let visible = |c: char| if c.is_control() { ' ' } else { c };
        let (before, rest) = self.source.split_at(self.span.start);
        let before_count = before.chars().count();
        let skipped = before_count.saturating_sub(CONTEXT);
        let (head, indent) = match skipped {
            0 => ("", before_count),
            _ => ("...", CONTEXT + 3),
        };
        let tail = match rest.chars().nth(CONTEXT) {
            Some(_) => "...",
            None => "",
        };
        let shown: String = before.chars().skip(skipped).map(visible).collect();
        let after: String = rest.chars().take(CONTEXT).map(visible).collect();
        let width = self.source[self.span.clone()].chars().count();
        let carets = "^".repeat(width.clamp(1, CONTEXT));
        write!(f, "\n  {head}{shown}{after}{tail}")?;
        write!(f, "\n  {:indent$}{carets}", "")
    }
}

impl std::error::Error for FormulaError {}
