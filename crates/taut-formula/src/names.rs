//! The names that a formula may use.

use crate::MAXIMUM_DIMENSION;
use crate::function::FUNCTIONS;

/// Named constants and their values.
const CONSTANTS: [(&str, f64); 2] = [("pi", std::f64::consts::PI), ("e", std::f64::consts::E)];

pub(crate) fn constant(name: &str) -> Option<f64> {
    let (_, value) = CONSTANTS.iter().find(|(known, _)| *known == name)?;
    Some(*value)
}

/// How the variables of a system are named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Naming {
    /// x, y, z.
    Letters,
    /// x1, x2, ...
    Numbers,
}

/// The naming and the index from 0 of a variable, however large, or nothing if `name` is none.
pub(crate) fn variable(name: &str) -> Option<(Naming, usize)> {
    if let Some(index) = ["x", "y", "z"].iter().position(|letter| *letter == name) {
        return Some((Naming::Letters, index));
    }
    let digits = name.strip_prefix('x')?;
    if digits.starts_with('0') || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    Some((Naming::Numbers, digits.parse().unwrap_or(usize::MAX) - 1))
}

/// Every known name, for an error text.
pub(crate) fn known() -> String {
    let functions = FUNCTIONS.iter().map(|function| function.name);
    let constants = CONSTANTS.iter().map(|(name, _)| *name);
    let names: Vec<&str> = constants.chain(functions).collect();
    format!("x y z, x1 to x{MAXIMUM_DIMENSION}, {}", names.join(" "))
}
