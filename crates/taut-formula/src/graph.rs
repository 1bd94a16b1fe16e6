//! Scalar operations as a graph in which equal expressions are one node.

use std::collections::HashMap;

use crate::operation::Operation;

/// A node of a [`Graph`]; operands always have smaller numbers than their users.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Id(pub(crate) u32);

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    /// The bits of an f64.
    Constant(u64),
    /// A coordinate, counted from 0.
    Variable(u8),
    /// An operation; operands that it does not have repeat the first.
    Apply(Operation, [Id; 3]),
}

/// A growing graph. Constants are folded and neutral elements removed as nodes are asked for.
///
/// Simplifications change no finite value except by rounding: signs and constant factors are
/// moved only where their product is exact, and 0 * a is 0 whatever a.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    nodes: Vec<Node>,
    ids: HashMap<Node, Id>,
}

impl Graph {
    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    pub(crate) fn constant_value(&self, id: Id) -> Option<f64> {
        match self.nodes[id.0 as usize] {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    pub(crate) fn constant(&mut self, value: f64) -> Id {
        self.intern(Node::Constant(value.to_bits()))
    }

    pub(crate) fn variable(&mut self, index: u8) -> Id {
        self.intern(Node::Variable(index))
    }

    pub(crate) fn unary(&mut self, operation: Operation, a: Id) -> Id {
        self.apply(operation, [a, a, a])
    }

    pub(crate) fn binary(&mut self, operation: Operation, a: Id, b: Id) -> Id {
        self.apply(operation, [a, b, a])
    }

    /// `yes` where `condition` is not 0, else `no`.
    pub(crate) fn select(&mut self, condition: Id, yes: Id, no: Id) -> Id {
        if yes == no {
            return yes;
        }
        self.apply(Operation::Select, [condition, yes, no])
    }

    pub(crate) fn negate(&mut self, a: Id) -> Id {
        match self.nodes[a.0 as usize] {
            Node::Apply(Operation::Negate, [inner, ..]) => inner,
            Node::Apply(Operation::Subtract, [left, right, _]) => self.subtract(right, left),
            _ => self.unary(Operation::Negate, a),
        }
    }

    pub(crate) fn add(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0.0) {
            return b;
        }
        if self.is(b, 0.0) {
            return a;
        }
        match (self.negated(a), self.negated(b)) {
            (_, Some(b)) => self.subtract(a, b),
            (Some(a), None) => self.subtract(b, a),
            (None, None) => self.binary(Operation::Add, a.min(b), a.max(b)),
        }
    }

    pub(crate) fn subtract(&mut self, a: Id, b: Id) -> Id {
        if a == b {
            return self.constant(0.0);
        }
        if self.is(a, 0.0) {
            return self.negate(b);
        }
        if self.is(b, 0.0) {
            return a;
        }
        match self.negated(b) {
            Some(b) => self.add(a, b),
            None => self.binary(Operation::Subtract, a, b),
        }
    }

    pub(crate) fn multiply(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0.0) || self.is(b, 0.0) {
            return self.constant(0.0);
        }
        if self.is(a, 1.0) {
            return b;
        }
        if self.is(b, 1.0) {
            return a;
        }
        let ((factor_a, rest_a), (factor_b, rest_b)) = (self.factored(a), self.factored(b));
        let factor = factor_a * factor_b;
        let exact = factor_a.mul_add(factor_b, -factor) == 0.0;
        let both_scaled = factor_a != 1.0 && factor_b != 1.0;
        if exact && factor.is_normal() && (both_scaled || factor == -1.0) {
            let product = match (rest_a, rest_b) {
                (Some(a), Some(b)) => self.multiply(a, b),
                (Some(rest), None) | (None, Some(rest)) => rest,
                (None, None) => self.constant(1.0),
            };
            return self.scale(factor, product);
        }
        self.binary(Operation::Multiply, a.min(b), a.max(b))
    }

    pub(crate) fn divide(&mut self, a: Id, b: Id) -> Id {
        if self.is(b, 1.0) {
            return a;
        }
        if self.is(a, 0.0) {
            return a;
        }
        self.binary(Operation::Divide, a, b)
    }

    /// 1 / a.
    pub(crate) fn reciprocal(&mut self, a: Id) -> Id {
        let one = self.constant(1.0);
        self.divide(one, a)
    }

    /// factor * a.
    pub(crate) fn scale(&mut self, factor: f64, a: Id) -> Id {
        if factor == -1.0 {
            return self.negate(a);
        }
        let factor = self.constant(factor);
        self.multiply(factor, a)
    }

    /// a * b + c * d.
    pub(crate) fn dot(&mut self, (a, b): (Id, Id), (c, d): (Id, Id)) -> Id {
        let first = self.multiply(a, b);
        let second = self.multiply(c, d);
        self.add(first, second)
    }

    pub(crate) fn is(&self, id: Id, value: f64) -> bool {
        self.constant_value(id) == Some(value)
    }

    fn negated(&self, id: Id) -> Option<Id> {
        match self.nodes[id.0 as usize] {
            Node::Apply(Operation::Negate, [inner, ..]) => Some(inner),
            _ => None,
        }
    }

    /// A constant factor and what it multiplies; nothing, for a constant.
    fn factored(&self, id: Id) -> (f64, Option<Id>) {
        match self.nodes[id.0 as usize] {
            Node::Constant(bits) => (f64::from_bits(bits), None),
            Node::Apply(Operation::Negate, [inner, ..]) => (-1.0, Some(inner)),
            Node::Apply(Operation::Multiply, [a, b, _]) => {
                match (self.constant_value(a), self.constant_value(b)) {
                    (Some(factor), _) => (factor, Some(b)),
                    (_, Some(factor)) => (factor, Some(a)),
                    _ => (1.0, Some(id)),
                }
            }
            _ => (1.0, Some(id)),
        }
    }

    fn apply(&mut self, operation: Operation, operands: [Id; 3]) -> Id {
        match operands.map(|operand| self.constant_value(operand)) {
            [Some(a), Some(b), Some(c)] => self.constant(operation.apply(a, b, c)),
            _ => self.intern(Node::Apply(operation, operands)),
        }
    }

    fn intern(&mut self, node: Node) -> Id {
        let Self { nodes, ids } = self;
        *ids.entry(node).or_insert_with(|| {
            nodes.push(node);
            Id(nodes.len() as u32 - 1)
        })
    }
}
