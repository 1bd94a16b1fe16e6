//! The scalar operations of a tape.

/// An operation on up to three numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Operation {
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    /// a * b + c, rounded twice.
    MultiplyAdd,
    /// a * b - c, rounded twice.
    MultiplySubtract,
    /// c - a * b, rounded twice.
    SubtractProduct,
    SquareRoot,
    Exponential,
    Logarithm,
    Sine,
    Cosine,
    Tangent,
    ArcSine,
    ArcCosine,
    ArcTangent,
    ArcTangent2,
    HyperbolicSine,
    HyperbolicCosine,
    HyperbolicTangent,
    Power,
    Absolute,
    Sign,
    Minimum,
    Maximum,
    /// 1 where a < b, else 0.
    Less,
    /// b where a is not 0, else c.
    Select,
}

impl Operation {
    /// The result; operands that the operation does not have are ignored.
    #[inline(always)]
    pub(crate) fn apply(self, a: f64, b: f64, c: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Negate => -a,
            Self::MultiplyAdd => a * b + c,
            Self::MultiplySubtract => a * b - c,
            Self::SubtractProduct => c - a * b,
            Self::SquareRoot => a.sqrt(),
            Self::Exponential => a.exp(),
            Self::Logarithm => a.ln(),
            Self::Sine => a.sin(),
            Self::Cosine => a.cos(),
            Self::Tangent => a.tan(),
            Self::ArcSine => a.asin(),
            Self::ArcCosine => a.acos(),
            Self::ArcTangent => a.atan(),
            Self::ArcTangent2 => a.atan2(b),
            Self::HyperbolicSine => a.sinh(),
            Self::HyperbolicCosine => a.cosh(),
            Self::HyperbolicTangent => a.tanh(),
            Self::Power => a.powf(b),
            Self::Absolute => a.abs(),
            Self::Sign => sign(a),
            Self::Minimum => minimum(a, b),
            Self::Maximum => -minimum(-a, -b),
            Self::Less => f64::from(a < b),
            Self::Select if a != 0.0 => b,
            Self::Select => c,
        }
    }
}

/// -1, 0 or 1; NaN of NaN.
fn sign(a: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a.signum() }
}

/// The smaller; NaN where either is NaN, unlike `f64::min`.
fn minimum(a: f64, b: f64) -> f64 {
    if b < a || b.is_nan() { b } else { a }
}
