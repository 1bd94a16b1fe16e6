//! The functions of formulas and their derivatives.

use crate::graph::{Graph, Id};
use crate::jet::{Derivatives, Derivatives2, Jet};
use crate::operation::Operation;

/// A function that formulas may call.
pub(crate) struct Function {
    pub(crate) name: &'static str,
    pub(crate) build: Build,
}

/// How a function's jet comes from those of its arguments.
pub(crate) enum Build {
    Unary(fn(&mut Graph, Id) -> Derivatives),
    Binary(fn(&mut Jet, &Jet, &mut Graph)),
    /// Two arguments or more, taken in from the left.
    Many(fn(&mut Jet, &Jet, &mut Graph)),
}

const fn unary(name: &'static str, f: fn(&mut Graph, Id) -> Derivatives) -> Function {
    let build = Build::Unary(f);
    Function { name, build }
}

pub(crate) static FUNCTIONS: [Function; 19] = [
    unary("sqrt", square_root),
    unary("exp", exponential),
    unary("log", logarithm),
    unary("ln", logarithm),
    unary("sin", sine),
    unary("cos", cosine),
    unary("tan", tangent),
    unary("asin", arc_sine),
    unary("acos", arc_cosine),
    unary("atan", arc_tangent),
    Function {
        name: "atan2",
        build: Build::Binary(|y, x, graph| {
            let derivatives = arc_tangent2(graph, y.value, x.value);
            *y = y.chain2(x, &derivatives, graph);
        }),
    },
    unary("sinh", hyperbolic_sine),
    unary("cosh", hyperbolic_cosine),
    unary("tanh", hyperbolic_tangent),
    unary("abs", absolute),
    unary("sign", sign),
    Function {
        name: "min",
        build: Build::Many(|a, b, graph| {
            let condition = graph.binary(Operation::Less, b.value, a.value);
            let value = graph.binary(Operation::Minimum, a.value, b.value);
            *a = b.select(a, value, condition, graph);
        }),
    },
    Function {
        name: "max",
        build: Build::Many(|a, b, graph| {
            let condition = graph.binary(Operation::Less, a.value, b.value);
            let value = graph.binary(Operation::Maximum, a.value, b.value);
            *a = b.select(a, value, condition, graph);
        }),
    },
    Function {
        name: "pow",
        build: Build::Binary(|a, b, graph| *a = power(a, b, graph)),
    },
];

pub(crate) fn function(name: &str) -> Option<&'static Function> {
    FUNCTIONS.iter().find(|function| function.name == name)
}

impl Function {
    /// The number of arguments, in words.
    pub(crate) fn arity(&self) -> &'static str {
        match self.build {
            Build::Unary(_) => "1",
            Build::Binary(_) => "2",
            Build::Many(_) => "2 or more",
        }
    }

    /// The function of `arguments`, or nothing if their number is wrong.
    pub(crate) fn call(&self, arguments: Vec<Jet>, graph: &mut Graph) -> Option<Jet> {
        let count = arguments.len();
        let mut arguments = arguments.into_iter();
        let mut first = arguments.next()?;
        match self.build {
            Build::Unary(f) if count == 1 => {
                let derivatives = f(graph, first.value);
                Some(first.chain(&derivatives, graph))
            }
            Build::Binary(f) | Build::Many(f) if count >= 2 => {
                if count > 2 && matches!(self.build, Build::Binary(_)) {
                    return None;
                }
                for argument in arguments {
                    f(&mut first, &argument, graph);
                }
                Some(first)
            }
            _ => None,
        }
    }
}

/// base^exponent.
///
/// A constant exponent is differentiated as a power and a constant base as an exponential, so
/// that neither needs the logarithm of a negative number; otherwise the base must be positive.
pub(crate) fn power(base: &Jet, exponent: &Jet, graph: &mut Graph) -> Jet {
    if let Some(exponent) = graph.constant_value(exponent.value) {
        return base.power(exponent, graph);
    }
    let (a, b) = (base.value, exponent.value);
    if graph.is(a, std::f64::consts::E) {
        let derivatives = exponential(graph, b);
        return exponent.chain(&derivatives, graph);
    }
    let value = graph.binary(Operation::Power, a, b);
    let logarithm = graph.unary(Operation::Logarithm, a);
    let by_exponent = graph.multiply(value, logarithm);
    let twice_by_exponent = graph.multiply(by_exponent, logarithm);
    if graph.constant_value(a).is_some() {
        let derivatives = Derivatives {
            value,
            first: by_exponent,
            second: twice_by_exponent,
        };
        return exponent.chain(&derivatives, graph);
    }
    let one = graph.constant(1.0);
    let less = graph.subtract(b, one);
    let lower = graph.binary(Operation::Power, a, less);
    let by_base = graph.multiply(b, lower);
    let lowest = {
        let two = graph.constant(2.0);
        let less = graph.subtract(b, two);
        graph.binary(Operation::Power, a, less)
    };
    let falling = graph.multiply(b, less);
    let twice_by_base = graph.multiply(falling, lowest);
    let mixed = graph.dot((b, logarithm), (one, one));
    let mixed = graph.multiply(lower, mixed);
    let derivatives = Derivatives2 {
        value,
        a: by_base,
        b: by_exponent,
        aa: twice_by_base,
        ab: mixed,
        bb: twice_by_exponent,
    };
    base.chain2(exponent, &derivatives, graph)
}

fn square_root(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::SquareRoot, a);
    let inverse = graph.reciprocal(value);
    let square = graph.multiply(inverse, inverse);
    let cube = graph.multiply(square, inverse);
    Derivatives {
        value,
        first: graph.scale(0.5, inverse),
        second: graph.scale(-0.25, cube),
    }
}

fn exponential(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::Exponential, a);
    let (first, second) = (value, value);
    Derivatives {
        value,
        first,
        second,
    }
}

fn logarithm(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::Logarithm, a);
    let first = graph.reciprocal(a);
    let square = graph.multiply(first, first);
    let second = graph.negate(square);
    Derivatives {
        value,
        first,
        second,
    }
}

fn sine(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::Sine, a);
    Derivatives {
        value,
        first: graph.unary(Operation::Cosine, a),
        second: graph.negate(value),
    }
}

fn cosine(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::Cosine, a);
    let sine = graph.unary(Operation::Sine, a);
    Derivatives {
        value,
        first: graph.negate(sine),
        second: graph.negate(value),
    }
}

fn tangent(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::Tangent, a);
    let one = graph.constant(1.0);
    let first = graph.dot((value, value), (one, one));
    let half = graph.multiply(value, first);
    let second = graph.scale(2.0, half);
    Derivatives {
        value,
        first,
        second,
    }
}

/// 1/sqrt((1 - a)(1 + a)) and a/sqrt((1 - a)(1 + a))^3, free of cancellation near +-1.
fn arc_sine(graph: &mut Graph, a: Id) -> Derivatives {
    let one = graph.constant(1.0);
    let (below, above) = (graph.subtract(one, a), graph.add(one, a));
    let square = graph.multiply(below, above);
    let root = graph.unary(Operation::SquareRoot, square);
    let first = graph.reciprocal(root);
    let square = graph.multiply(first, first);
    let cube = graph.multiply(square, first);
    Derivatives {
        value: graph.unary(Operation::ArcSine, a),
        first,
        second: graph.multiply(a, cube),
    }
}

fn arc_cosine(graph: &mut Graph, a: Id) -> Derivatives {
    let opposite = arc_sine(graph, a);
    Derivatives {
        value: graph.unary(Operation::ArcCosine, a),
        first: graph.negate(opposite.first),
        second: graph.negate(opposite.second),
    }
}

fn arc_tangent(graph: &mut Graph, a: Id) -> Derivatives {
    let one = graph.constant(1.0);
    let denominator = graph.dot((a, a), (one, one));
    let first = graph.reciprocal(denominator);
    let half = graph.multiply(a, first);
    let half = graph.multiply(half, first);
    Derivatives {
        value: graph.unary(Operation::ArcTangent, a),
        first,
        second: graph.scale(-2.0, half),
    }
}

/// The angle of the point (x, y), with u = x/r^2 and v = y/r^2: gradient (u, -v) in (y, x),
/// second derivatives -2uv in yy, 2uv in xx and v^2 - u^2 in xy.
fn arc_tangent2(graph: &mut Graph, y: Id, x: Id) -> Derivatives2 {
    let square = graph.dot((x, x), (y, y));
    let (u, v) = (graph.divide(x, square), graph.divide(y, square));
    let half = graph.multiply(u, v);
    let (sum, difference) = (graph.add(v, u), graph.subtract(v, u));
    Derivatives2 {
        value: graph.binary(Operation::ArcTangent2, y, x),
        a: u,
        b: graph.negate(v),
        aa: graph.scale(-2.0, half),
        ab: graph.multiply(sum, difference),
        bb: graph.scale(2.0, half),
    }
}

fn hyperbolic_sine(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::HyperbolicSine, a);
    let first = graph.unary(Operation::HyperbolicCosine, a);
    Derivatives {
        value,
        first,
        second: value,
    }
}

fn hyperbolic_cosine(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::HyperbolicCosine, a);
    let first = graph.unary(Operation::HyperbolicSine, a);
    Derivatives {
        value,
        first,
        second: value,
    }
}

/// 1/cosh^2 rather than 1 - tanh^2, which cancels.
fn hyperbolic_tangent(graph: &mut Graph, a: Id) -> Derivatives {
    let value = graph.unary(Operation::HyperbolicTangent, a);
    let cosine = graph.unary(Operation::HyperbolicCosine, a);
    let inverse = graph.reciprocal(cosine);
    let first = graph.multiply(inverse, inverse);
    let half = graph.multiply(value, first);
    Derivatives {
        value,
        first,
        second: graph.scale(-2.0, half),
    }
}

fn absolute(graph: &mut Graph, a: Id) -> Derivatives {
    Derivatives {
        value: graph.unary(Operation::Absolute, a),
        first: graph.unary(Operation::Sign, a),
        second: graph.constant(0.0),
    }
}

fn sign(graph: &mut Graph, a: Id) -> Derivatives {
    let zero = graph.constant(0.0);
    Derivatives {
        value: graph.unary(Operation::Sign, a),
        first: zero,
        second: zero,
    }
}
