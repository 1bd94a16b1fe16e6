//! Tokens to jets: a Pratt parser.

use std::ops::Range;

use crate::error::{ErrorKind, FormulaError};
use crate::function::{Function, function, power};
use crate::graph::Graph;
use crate::jet::Jet;
use crate::lexer::{Token, TokenKind, token};
use crate::names::{Naming, constant, variable};
use crate::{MAXIMUM_DEPTH, MAXIMUM_DIMENSION, MAXIMUM_INSTRUCTIONS, MAXIMUM_LENGTH};

/// How tightly the operators hold their operands; a sign is looser than the power to its right.
const SUM: u8 = 1;
const PRODUCT: u8 = 2;
const SIGN: u8 = 3;
const POWER: u8 = 4;

/// What the equations of one system share.
#[derive(Debug)]
pub(crate) struct System {
    pub(crate) graph: Graph,
    /// The dimension asked for.
    dimension: Option<usize>,
    /// The naming and the first variable met.
    naming: Option<(Naming, String)>,
    /// 1 + the largest index met.
    indices: usize,
}

impl System {
    pub(crate) fn new(dimension: Option<usize>) -> Self {
        Self {
            graph: Graph::default(),
            dimension,
            naming: None,
            indices: 0,
        }
    }

    /// The dimension asked for, or the one that the variables imply.
    pub(crate) fn resolved_dimension(&self) -> usize {
        match (self.dimension, &self.naming) {
            (Some(dimension), _) => dimension,
            (None, Some((Naming::Letters, _))) => 3,
            (None, _) => self.indices.max(2),
        }
    }

    /// left - right of the equation `source`, the one numbered `equation`.
    pub(crate) fn read(&mut self, equation: usize, source: &str) -> Result<Jet, FormulaError> {
        let place = |(kind, span)| FormulaError::at(kind, equation, source, span);
        if source.len() > MAXIMUM_LENGTH {
            let kind = ErrorKind::TooLong(source.len());
            return Err(place((kind, 0..source.len())));
        }
        let next = token(source, 0).map_err(place)?;
        if next.kind == TokenKind::End {
            return Err(place((ErrorKind::Empty, 0..0)));
        }
        let previous = next.clone();
        let mut parser = Parser {
            system: self,
            source,
            previous,
            next,
            depth: 0,
        };
        parser.equation().map_err(place)
    }
}

/// An error and the bytes of the source at fault.
type Fault = (ErrorKind, Range<usize>);

struct Parser<'a> {
    system: &'a mut System,
    source: &'a str,
    previous: Token,
    next: Token,
    depth: usize,
}

impl Parser<'_> {
    fn equation(&mut self) -> Result<Jet, Fault> {
        let mut result = self.expression(SUM)?;
        if self.next.kind == TokenKind::Equals {
            self.advance()?;
            let right = self.expression(SUM)?;
            result = result.subtract(&right, &mut self.system.graph);
        }
        match self.next.kind {
            TokenKind::End if result.gradient.is_empty() => {
                let text = self.source.trim();
                let start = self.source.len() - self.source.trim_start().len();
                Err((ErrorKind::NoVariable, start..start + text.len()))
            }
            TokenKind::End => Ok(result),
            TokenKind::Close => Err((ErrorKind::UnmatchedParenthesis, self.next.span.clone())),
            TokenKind::Equals => Err((ErrorKind::SecondEquals, self.next.span.clone())),
            _ => Err(self.unexpected()),
        }
    }

    /// An expression whose operators all hold at least as tightly as `tightness`.
    fn expression(&mut self, tightness: u8) -> Result<Jet, Fault> {
        self.depth += 1;
        if self.depth > MAXIMUM_DEPTH {
            return Err((ErrorKind::TooDeep, self.next.span.clone()));
        }
        let mut left = self.operand()?;
        loop {
            let operator = self.next.clone();
            // The operator's tightness, and that asked of its right operand.
            let (own, right) = match operator.kind {
                TokenKind::Plus | TokenKind::Minus => (SUM, PRODUCT),
                TokenKind::Star | TokenKind::Slash => (PRODUCT, SIGN),
                TokenKind::Power => (POWER, SIGN),
                TokenKind::Number(_) | TokenKind::Name | TokenKind::Open => {
                    return Err(self.missing_operator());
                }
                _ => break,
            };
            if own < tightness {
                break;
            }
            self.advance()?;
            let right = self.expression(right)?;
            let graph = &mut self.system.graph;
            left = match operator.kind {
                TokenKind::Plus => left.add(&right, graph),
                TokenKind::Minus => left.subtract(&right, graph),
                TokenKind::Star => left.multiply(&right, graph),
                TokenKind::Slash => left.divide(&right, graph),
                _ => power(&left, &right, graph),
            };
            self.check_size(operator.span)?;
        }
        self.depth -= 1;
        Ok(left)
    }

    /// A number, a name, a call, a parenthesis or a signed expression.
    fn operand(&mut self) -> Result<Jet, Fault> {
        let first = self.next.clone();
        match first.kind {
            TokenKind::Number(value) => {
                self.advance()?;
                Ok(self.constant(value))
            }
            TokenKind::Name => self.name(first),
            TokenKind::Plus => {
                self.advance()?;
                self.expression(SIGN)
            }
            TokenKind::Minus => {
                self.advance()?;
                let inner = self.expression(SIGN)?;
                Ok(inner.negate(&mut self.system.graph))
            }
            TokenKind::Open => {
                self.advance()?;
                let inner = self.expression(SUM)?;
                self.close(first)?;
                Ok(inner)
            }
            _ => {
                let found = first.describe(self.source);
                Err((ErrorKind::ExpectedOperand(found), first.span))
            }
        }
    }

    fn name(&mut self, token: Token) -> Result<Jet, Fault> {
        let name = &self.source[token.span.clone()];
        if let Some(function) = function(name) {
            self.advance()?;
            return self.call(function, token);
        }
        let jet = match (variable(name), constant(name)) {
            (Some((naming, index)), _) => self.variable(naming, index, &token)?,
            (None, Some(value)) => self.constant(value),
            (None, None) => return Err((ErrorKind::UnknownName(name.to_owned()), token.span)),
        };
        self.advance()?;
        Ok(jet)
    }

    fn call(&mut self, function: &'static Function, name: Token) -> Result<Jet, Fault> {
        let open = self.next.clone();
        if open.kind != TokenKind::Open {
            return Err((ErrorKind::MissingArguments(function.name), name.span));
        }
        self.advance()?;
        let mut arguments = Vec::new();
        if self.next.kind != TokenKind::Close {
            arguments.push(self.expression(SUM)?);
            while self.next.kind == TokenKind::Comma {
                self.advance()?;
                arguments.push(self.expression(SUM)?);
            }
        }
        let end = self.next.span.end;
        self.close(open)?;
        let found = arguments.len();
        let wrong_count = || {
            let kind = ErrorKind::ArgumentCount {
                name: function.name,
                expected: function.arity(),
                found,
            };
            (kind, name.span.start..end)
        };
        let graph = &mut self.system.graph;
        let result = function.call(arguments, graph).ok_or_else(wrong_count)?;
        self.check_size(name.span)?;
        Ok(result)
    }

    fn constant(&mut self, value: f64) -> Jet {
        Jet::constant(self.system.graph.constant(value))
    }

    fn variable(&mut self, naming: Naming, index: usize, token: &Token) -> Result<Jet, Fault> {
        let name = &self.source[token.span.clone()];
        let system = &mut *self.system;
        let first = system
            .naming
            .get_or_insert_with(|| (naming, name.to_owned()));
        let (found, earlier) = (name.to_owned(), first.1.clone());
        if first.0 != naming {
            let kind = ErrorKind::MixedVariables { found, earlier };
            return Err((kind, token.span.clone()));
        }
        let dimension = system.dimension.unwrap_or(MAXIMUM_DIMENSION);
        let letters_unfit = naming == Naming::Letters && system.dimension.is_some_and(|d| d > 3);
        if index >= dimension || letters_unfit {
            let kind = ErrorKind::VariableBeyondDimension {
                name: found,
                dimension,
            };
            return Err((kind, token.span.clone()));
        }
        system.indices = system.indices.max(index + 1);
        Ok(Jet::variable(&mut system.graph, index as u8))
    }

    fn advance(&mut self) -> Result<(), Fault> {
        let next = token(self.source, self.next.span.end)?;
        self.previous = std::mem::replace(&mut self.next, next);
        Ok(())
    }

    /// Takes the parenthesis that closes `open`.
    fn close(&mut self, open: Token) -> Result<(), Fault> {
        match self.next.kind {
            TokenKind::Close => self.advance(),
            TokenKind::End => Err((ErrorKind::UnclosedParenthesis, open.span)),
            _ => Err(self.unexpected()),
        }
    }

    fn check_size(&self, span: Range<usize>) -> Result<(), Fault> {
        match self.system.graph.len() > MAXIMUM_INSTRUCTIONS {
            true => Err((ErrorKind::TooLarge, span)),
            false => Ok(()),
        }
    }

    fn unexpected(&self) -> Fault {
        let found = self.next.describe(self.source);
        (ErrorKind::ExpectedOperator(found), self.next.span.clone())
    }

    fn missing_operator(&self) -> Fault {
        let (left, right) = (self.previous.span.clone(), self.next.span.clone());
        let kind = ErrorKind::MissingOperator {
            left: self.source[left.clone()].to_owned(),
            right: self.source[right.clone()].to_owned(),
        };
        (kind, left.start..right.end)
    }
}
