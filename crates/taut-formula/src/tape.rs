//! A graph laid out as straight-line code, and its evaluation.

use std::cell::RefCell;

use crate::graph::{Graph, Id, Node};
use crate::operation::Operation;

/// Straight-line code for some nodes of a graph.
///
/// It works on numbered slots: first the coordinates, then the constants, then one for the
/// result of each instruction.
#[derive(Debug, Clone)]
pub(crate) struct Tape {
    dimension: usize,
    constants: Vec<f64>,
    code: Code,
}

/// A slot of a tape.
pub(crate) type Slot = u32;

/// Instructions with slots of the narrowest type that can name them all.
#[derive(Debug, Clone)]
enum Code {
    Short(Vec<Instruction<u8>>),
    Long(Vec<Instruction<Slot>>),
}

#[derive(Debug, Clone, Copy)]
struct Instruction<S> {
    operation: Operation,
    operands: [S; 3],
}

/// The slots that short code can name: all, so that no access needs a check.
const SHORT: usize = 1 << u8::BITS;

thread_local! {
    /// The slots of the short tape that the thread is evaluating.
    static SHORT_SLOTS: RefCell<[f64; SHORT]> = const { RefCell::new([0.0; SHORT]) };
    /// The slots of the long tape that the thread is evaluating.
    static LONG_SLOTS: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

impl Tape {
    /// Code for the nodes `roots`, with their slots; what they do not need is left out.
    pub(crate) fn new(graph: &Graph, dimension: usize, roots: &[Id]) -> (Self, Vec<Slot>) {
        let nodes = fused(graph.nodes(), roots);
        let mut slots = vec![0; nodes.len()];
        let mut constants = Vec::new();
        for (slot, node) in slots.iter_mut().zip(&nodes) {
            match *node {
                Some(Node::Variable(index)) => *slot = Slot::from(index),
                Some(Node::Constant(bits)) => {
                    *slot = (dimension + constants.len()) as Slot;
                    constants.push(f64::from_bits(bits));
                }
                _ => {}
            }
        }
        let first = dimension + constants.len();
        let mut instructions = Vec::new();
        for (index, node) in nodes.iter().enumerate() {
            if let Some(Node::Apply(operation, operands)) = *node {
                slots[index] = (first + instructions.len()) as Slot;
                let operands = operands.map(|operand| slots[operand.0 as usize]);
                instructions.push(Instruction {
                    operation,
                    operands,
                });
            }
        }
        let roots = roots.iter().map(|root| slots[root.0 as usize]).collect();
        let code = match first + instructions.len() <= SHORT {
            true => Code::Short(instructions.iter().map(Instruction::shortened).collect()),
            false => Code::Long(instructions),
        };
        let tape = Self {
            dimension,
            constants,
            code,
        };
        (tape, roots)
    }

    pub(crate) fn len(&self) -> usize {
        match &self.code {
            Code::Short(instructions) => instructions.len(),
            Code::Long(instructions) => instructions.len(),
        }
    }

    /// Runs the tape at `point` and hands the slots to `take`.
    ///
    /// # Panics
    /// If `point` has another dimension than the tape.
    #[inline]
    pub(crate) fn evaluate(&self, point: &[f64], take: impl FnOnce(&[f64])) {
        assert_eq!(point.len(), self.dimension, "dimension of the point");
        match &self.code {
            Code::Short(instructions) => SHORT_SLOTS.with_borrow_mut(|slots| {
                self.run_short(point, instructions, slots);
                take(slots);
            }),
            Code::Long(instructions) => LONG_SLOTS.with_borrow_mut(|slots| {
                let first = self.dimension + self.constants.len();
                let count = first + instructions.len();
                if slots.len() < count {
                    slots.resize(count, 0.0);
                }
                slots[..self.dimension].copy_from_slice(point);
                slots[self.dimension..first].copy_from_slice(&self.constants);
                for (instruction, result) in instructions.iter().zip(first..) {
                    let [a, b, c] = instruction.operands.map(|slot| slots[slot as usize]);
                    slots[result] = instruction.operation.apply(a, b, c);
                }
                take(slots);
            }),
        }
    }

    fn run_short(&self, point: &[f64], code: &[Instruction<u8>], slots: &mut [f64; SHORT]) {
        let given = point.len();
        slots[..given].copy_from_slice(point);
        slots[given..given + self.constants.len()].copy_from_slice(&self.constants);
        let mut next = (given + self.constants.len()) as u8;
        for instruction in code {
            let operand = |i: usize| slots[instruction.operands[i] as usize];
            let result = instruction
                .operation
                .apply(operand(0), operand(1), operand(2));
            slots[next as usize] = result;
            next = next.wrapping_add(1);
        }
    }
}

impl Instruction<Slot> {
    fn shortened(&self) -> Instruction<u8> {
        Instruction {
            operation: self.operation,
            operands: self.operands.map(|slot| slot as u8),
        }
    }
}

/// The nodes that `roots` need, sums taking in the products that only they use.
fn fused(nodes: &[Node], roots: &[Id]) -> Vec<Option<Node>> {
    let users = users(nodes, roots);
    let needed = |(node, &users): (&Node, &u32)| (users > 0).then_some(*node);
    let mut result: Vec<Option<Node>> = nodes.iter().zip(&users).map(needed).collect();
    let product = |id: Id| match nodes[id.0 as usize] {
        Node::Apply(Operation::Multiply, [a, b, _]) if users[id.0 as usize] == 1 => Some((a, b)),
        _ => None,
    };
    for index in 0..nodes.len() {
        let Some(Node::Apply(operation, [left, right, _])) = result[index] else {
            continue;
        };
        let (absorbed, fused, rest) = match operation {
            Operation::Add if left == right => continue,
            Operation::Add if product(right).is_some() => (right, Operation::MultiplyAdd, left),
            Operation::Add => (left, Operation::MultiplyAdd, right),
            Operation::Subtract if product(right).is_some() => {
                (right, Operation::SubtractProduct, left)
            }
            Operation::Subtract => (left, Operation::MultiplySubtract, right),
            _ => continue,
        };
        if let Some((a, b)) = product(absorbed) {
            result[absorbed.0 as usize] = None;
            result[index] = Some(Node::Apply(fused, [a, b, rest]));
        }
    }
    result
}

/// How many needed nodes and roots use each node; 0 where it is not needed.
fn users(nodes: &[Node], roots: &[Id]) -> Vec<u32> {
    let mut users = vec![0; nodes.len()];
    for root in roots {
        users[root.0 as usize] += 1;
    }
    for index in (0..nodes.len()).rev() {
        if let (Node::Apply(_, [a, b, c]), true) = (nodes[index], users[index] > 0) {
            users[a.0 as usize] += 1;
            users[b.0 as usize] += u32::from(b != a);
            users[c.0 as usize] += u32::from(c != a && c != b);
        }
    }
    users
}
