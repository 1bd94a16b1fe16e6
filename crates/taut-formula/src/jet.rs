//! Values with first and second derivatives, as nodes of a graph.
//!
//! Forward differentiation, done once when a formula is read: each entry of each derivative is
//! an expression, entries that vanish are absent, and what the graph folds or shares costs
//! nothing at evaluation.

use crate::graph::{Graph, Id};
use crate::operation::Operation;

/// A value, its gradient and the upper triangle of its Hessian; absent entries are 0.
#[derive(Debug, Clone)]
pub(crate) struct Jet {
    pub(crate) value: Id,
    pub(crate) gradient: Sparse<u8>,
    /// Keys are (row, column) with row <= column.
    pub(crate) hessian: Sparse<(u8, u8)>,
}

/// Entries other than 0, in the order of their keys.
type Sparse<K> = Vec<(K, Id)>;

/// The derivatives of a function of one argument.
pub(crate) struct Derivatives {
    pub(crate) value: Id,
    pub(crate) first: Id,
    pub(crate) second: Id,
}

/// The derivatives of a function of two arguments, a and b.
pub(crate) struct Derivatives2 {
    pub(crate) value: Id,
    pub(crate) a: Id,
    pub(crate) b: Id,
    pub(crate) aa: Id,
    pub(crate) ab: Id,
    pub(crate) bb: Id,
}

impl Jet {
    pub(crate) fn constant(value: Id) -> Self {
        let (gradient, hessian) = (Vec::new(), Vec::new());
        Self {
            value,
            gradient,
            hessian,
        }
    }

    pub(crate) fn variable(graph: &mut Graph, index: u8) -> Self {
        let one = graph.constant(1.0);
        Self {
            value: graph.variable(index),
            gradient: vec![(index, one)],
            hessian: Vec::new(),
        }
    }

    pub(crate) fn negate(&self, graph: &mut Graph) -> Self {
        Self {
            value: graph.negate(self.value),
            gradient: map(graph, &self.gradient, |graph, a| graph.negate(a)),
            hessian: map(graph, &self.hessian, |graph, a| graph.negate(a)),
        }
    }

    pub(crate) fn add(&self, other: &Self, graph: &mut Graph) -> Self {
        Self {
            value: graph.add(self.value, other.value),
            gradient: merge(graph, &self.gradient, &other.gradient, Graph::add),
            hessian: merge(graph, &self.hessian, &other.hessian, Graph::add),
        }
    }

    pub(crate) fn subtract(&self, other: &Self, graph: &mut Graph) -> Self {
        Self {
            value: graph.subtract(self.value, other.value),
            gradient: merge(graph, &self.gradient, &other.gradient, Graph::subtract),
            hessian: merge(graph, &self.hessian, &other.hessian, Graph::subtract),
        }
    }

    pub(crate) fn multiply(&self, other: &Self, graph: &mut Graph) -> Self {
        if self.value == other.value {
            return self.power(2.0, graph);
        }
        let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
        let derivatives = Derivatives2 {
            value: graph.multiply(self.value, other.value),
            a: other.value,
            b: self.value,
            aa: zero,
            ab: one,
            bb: zero,
        };
        self.chain2(other, &derivatives, graph)
    }

    /// With q = a/b: Dq = (Da - q Db)/b and D2q = (D2a - Dq Db - Db Dq - q D2b)/b.
    pub(crate) fn divide(&self, other: &Self, graph: &mut Graph) -> Self {
        let value = graph.divide(self.value, other.value);
        let inverse = graph.reciprocal(other.value);
        let by_inverse = |graph: &mut Graph, a| graph.multiply(a, inverse);
        let by_value = |graph: &mut Graph, a| graph.multiply(a, value);

        let moved = map(graph, &other.gradient, by_value);
        let difference = merge(graph, &self.gradient, &moved, Graph::subtract);
        let gradient = map(graph, &difference, by_inverse);

        let moved = map(graph, &other.hessian, by_value);
        let difference = merge(graph, &self.hessian, &moved, Graph::subtract);
        let cross = symmetric_product(graph, &gradient, &other.gradient);
        let difference = merge(graph, &difference, &cross, Graph::subtract);
        let hessian = map(graph, &difference, by_inverse);
        Self {
            value,
            gradient,
            hessian,
        }
    }

    /// self^exponent for a constant exponent, by products and roots where they are accurate.
    pub(crate) fn power(&self, exponent: f64, graph: &mut Graph) -> Self {
        let value = power(graph, self.value, exponent);
        let first = scaled_power(graph, exponent, self.value, exponent - 1.0);
        let second = exponent * (exponent - 1.0);
        let second = scaled_power(graph, second, self.value, exponent - 2.0);
        let derivatives = Derivatives {
            value,
            first,
            second,
        };
        self.chain(&derivatives, graph)
    }

    /// f(self).
    pub(crate) fn chain(&self, f: &Derivatives, graph: &mut Graph) -> Self {
        let by_first = |graph: &mut Graph, a| graph.multiply(a, f.first);
        let gradient = map(graph, &self.gradient, by_first);
        let linear = map(graph, &self.hessian, by_first);
        let bent = square(graph, f.second, &self.gradient);
        let hessian = merge(graph, &bent, &linear, Graph::add);
        Self {
            value: f.value,
            gradient,
            hessian,
        }
    }

    /// f(self, other).
    pub(crate) fn chain2(&self, other: &Self, f: &Derivatives2, graph: &mut Graph) -> Self {
        let by_a = |graph: &mut Graph, id| graph.multiply(id, f.a);
        let by_b = |graph: &mut Graph, id| graph.multiply(id, f.b);
        let (from_a, from_b) = (
            map(graph, &self.gradient, by_a),
            map(graph, &other.gradient, by_b),
        );
        let gradient = merge(graph, &from_a, &from_b, Graph::add);

        let cross = map(graph, &self.gradient, |graph, id| graph.multiply(id, f.ab));
        let terms = [
            map(graph, &self.hessian, by_a),
            map(graph, &other.hessian, by_b),
            square(graph, f.aa, &self.gradient),
            square(graph, f.bb, &other.gradient),
            symmetric_product(graph, &cross, &other.gradient),
        ];
        let hessian = terms
            .iter()
            .fold(Vec::new(), |sum, term| merge(graph, &sum, term, Graph::add));
        Self {
            value: f.value,
            gradient,
            hessian,
        }
    }

    /// The derivatives of `self` where `condition` is not 0, else those of `other`.
    pub(crate) fn select(&self, other: &Self, value: Id, condition: Id, graph: &mut Graph) -> Self {
        let choose = |graph: &mut Graph, yes, no| graph.select(condition, yes, no);
        Self {
            value,
            gradient: merge(graph, &self.gradient, &other.gradient, choose),
            hessian: merge(graph, &self.hessian, &other.hessian, choose),
        }
    }
}

/// The largest exponent, in halves, that is computed by products.
const PRODUCT_HALVES: f64 = 64.0;

/// base^exponent: products for whole exponents, with a square root for halves.
///
/// Products keep derivatives finite at 0 and are defined for negative bases.
fn power(graph: &mut Graph, base: Id, exponent: f64) -> Id {
    let halves = 2.0 * exponent;
    if graph.constant_value(base).is_some()
        || halves.fract() != 0.0
        || halves.abs() > PRODUCT_HALVES
    {
        let exponent = graph.constant(exponent);
        return graph.binary(Operation::Power, base, exponent);
    }
    if exponent.fract() == 0.0 {
        let base = match exponent < 0.0 {
            true => graph.reciprocal(base),
            false => base,
        };
        return whole_power(graph, base, exponent.abs() as u32);
    }
    let root = graph.unary(Operation::SquareRoot, base);
    if exponent < 0.0 {
        let inverse = graph.reciprocal(root);
        return whole_power(graph, inverse, halves.abs() as u32);
    }
    let whole = whole_power(graph, base, exponent as u32);
    graph.multiply(whole, root)
}

fn scaled_power(graph: &mut Graph, factor: f64, base: Id, exponent: f64) -> Id {
    if factor == 0.0 {
        return graph.constant(0.0);
    }
    let power = power(graph, base, exponent);
    graph.scale(factor, power)
}

fn whole_power(graph: &mut Graph, base: Id, exponent: u32) -> Id {
    match exponent {
        0 => graph.constant(1.0),
        1 => base,
        _ if exponent.is_multiple_of(2) => {
            let root = whole_power(graph, base, exponent / 2);
            graph.multiply(root, root)
        }
        _ => {
            let rest = whole_power(graph, base, exponent - 1);
            graph.multiply(rest, base)
        }
    }
}

/// f applied to every entry; f(0) must be 0.
fn map<K: Copy>(
    graph: &mut Graph,
    entries: &[(K, Id)],
    f: impl Fn(&mut Graph, Id) -> Id,
) -> Sparse<K> {
    let mut result = Sparse::with_capacity(entries.len());
    for &(key, id) in entries {
        let id = f(graph, id);
        push(graph, &mut result, key, id);
    }
    result
}

/// f applied to the entries of two, 0 standing for absent ones; f(0, 0) must be 0.
fn merge<K: Copy + Ord>(
    graph: &mut Graph,
    a: &[(K, Id)],
    b: &[(K, Id)],
    f: impl Fn(&mut Graph, Id, Id) -> Id,
) -> Sparse<K> {
    let zero = graph.constant(0.0);
    let mut result = Sparse::with_capacity(a.len().max(b.len()));
    for (key, a, b) in paired(a, b, zero) {
        let id = f(graph, a, b);
        push(graph, &mut result, key, id);
    }
    result
}

/// factor * a a', upper triangle.
fn square(graph: &mut Graph, factor: Id, a: &[(u8, Id)]) -> Sparse<(u8, u8)> {
    let mut result = Sparse::new();
    if graph.is(factor, 0.0) {
        return result;
    }
    for (position, &(row, a_row)) in a.iter().enumerate() {
        let scaled = graph.multiply(factor, a_row);
        for &(column, a_column) in &a[position..] {
            let id = graph.multiply(scaled, a_column);
            push(graph, &mut result, (row, column), id);
        }
    }
    result
}

/// a b' + b a', upper triangle.
fn symmetric_product(graph: &mut Graph, a: &[(u8, Id)], b: &[(u8, Id)]) -> Sparse<(u8, u8)> {
    let mut result = Sparse::new();
    if a.is_empty() || b.is_empty() {
        return result;
    }
    let zero = graph.constant(0.0);
    let both = paired(a, b, zero);
    for (position, &(row, a_row, b_row)) in both.iter().enumerate() {
        for &(column, a_column, b_column) in &both[position..] {
            let id = graph.dot((a_row, b_column), (b_row, a_column));
            push(graph, &mut result, (row, column), id);
        }
    }
    result
}

/// The entries of two side by side, `zero` standing for absent ones.
fn paired<K: Copy + Ord>(a: &[(K, Id)], b: &[(K, Id)], zero: Id) -> Vec<(K, Id, Id)> {
    let mut result = Vec::with_capacity(a.len().max(b.len()));
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    loop {
        let key = match (a.peek(), b.peek()) {
            (Some(&&(key_a, _)), Some(&&(key_b, _))) => key_a.min(key_b),
            (Some(&&(key, _)), None) | (None, Some(&&(key, _))) => key,
            (None, None) => return result,
        };
        let left = a
            .next_if(|entry| entry.0 == key)
            .map_or(zero, |entry| entry.1);
        let right = b
            .next_if(|entry| entry.0 == key)
            .map_or(zero, |entry| entry.1);
        result.push((key, left, right));
    }
}

/// Adds an entry unless it is 0.
fn push<K>(graph: &Graph, entries: &mut Sparse<K>, key: K, id: Id) {
    if !graph.is(id, 0.0) {
        entries.push((key, id));
    }
}
