//! Text to tokens.

use std::ops::Range;

use crate::error::ErrorKind;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TokenKind {
    Number(f64),
    Name,
    Plus,
    Minus,
    Star,
    Slash,
    /// `^` or `**`.
    Power,
    Open,
    Close,
    Comma,
    Equals,
    End,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Token {
    pub(crate) kind: TokenKind,
    /// Bytes of the source.
    pub(crate) span: Range<usize>,
}

impl Token {
    /// The token, or the end, for an error text.
    pub(crate) fn describe(&self, source: &str) -> String {
        match self.kind {
            TokenKind::End => "the end".into(),
            _ => format!("{:?}", &source[self.span.clone()]),
        }
    }
}

/// The token at or after byte `start`; an error comes with the bytes at fault.
pub(crate) fn token(source: &str, start: usize) -> Result<Token, (ErrorKind, Range<usize>)> {
    let rest = source[start..].trim_start();
    let start = source.len() - rest.len();
    let Some(first) = rest.chars().next() else {
        let span = start..start;
        return Ok(Token {
            kind: TokenKind::End,
            span,
        });
    };
    let (kind, length) = match first {
        '+' => (TokenKind::Plus, 1),
        '-' => (TokenKind::Minus, 1),
        '*' if rest.starts_with("**") => (TokenKind::Power, 2),
        '*' => (TokenKind::Star, 1),
        '/' => (TokenKind::Slash, 1),
        '^' => (TokenKind::Power, 1),
        '(' => (TokenKind::Open, 1),
        ')' => (TokenKind::Close, 1),
        ',' => (TokenKind::Comma, 1),
        '=' => (TokenKind::Equals, 1),
        '0'..='9' | '.' => {
            let text = &rest[..number_length(rest)];
            let number = text.parse().ok().filter(|number: &f64| number.is_finite());
            let span = start..start + text.len();
            let number = number.ok_or_else(|| (ErrorKind::BadNumber(text.to_owned()), span))?;
            (TokenKind::Number(number), text.len())
        }
        _ if is_name(first) => (
            TokenKind::Name,
            rest.find(|c| !is_name(c)).unwrap_or(rest.len()),
        ),
        _ => {
            let span = start..start + first.len_utf8();
            return Err((ErrorKind::UnexpectedCharacter(first), span));
        }
    };
    let span = start..start + length;
    Ok(Token { kind, span })
}

fn is_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The bytes of digits, points and, where digits follow it, an exponent.
fn number_length(text: &str) -> usize {
    let digits = |from: usize| {
        let rest = &text[from..];
        rest.find(|c: char| !c.is_ascii_digit())
            .unwrap_or(rest.len())
    };
    let mantissa = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    if !text[mantissa..].starts_with(['e', 'E']) {
        return mantissa;
    }
    let sign = usize::from(text[mantissa + 1..].starts_with(['+', '-']));
    match digits(mantissa + 1 + sign) {
        0 => mantissa,
        exponent => mantissa + 1 + sign + exponent,
    }
}
