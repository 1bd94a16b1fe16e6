//! Knots, which are places on rays, and interpolation of the ray between two of them.

use crate::Vector;
use crate::correction::length::HeightErrors;
use crate::field::rays::frame::Frame;

/// A place on a ray, with the frame and the Jacobi field there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knot<const D: usize, P> {
    /// Length of the ray from the source to here, in the input's units.
    pub length: f64,
    /// The frame here. Its first tangent is the ray's; its second lies to the same side all along
    /// the ray.
    pub frame: Frame<D>,
    /// The Jacobi field J and its derivative J' along the ray; a point source has J = 0 and J' = 1.
    pub jacobi: [f64; 2],
    pub place: P,
    /// The nearest node of the graph.
    pub near: u32,
    /// What errors of the surface's height do to the length.
    pub heights: HeightErrors,
}

impl<const D: usize, P> Knot<D, P> {
    /// The knot at the start of a ray that leaves a point with its frame at an angle.
    pub fn leaving(frame: &Frame<D>, angle: f64, place: P, near: u32) -> Self {
        Self {
            length: 0.0,
            frame: frame.turned([angle.cos(), angle.sin()]),
            jacobi: [0.0, 1.0],
            place,
            near,
            heights: HeightErrors::default(),
        }
    }
}

/// The knot at a length between two knots of a ray. The point and J are quintic: the knots know
/// their first two derivatives. Place, nearest node and height errors are the first knot's.
pub(crate) fn between<const D: usize, P: Copy>(
    pair: [&Knot<D, P>; 2],
    length: f64,
) -> Option<Knot<D, P>> {
    let [a, b] = pair;
    let h = b.length - a.length;
    let s = (length - a.length) / h;
    let (value, slope) = hermite(s);
    let mix = |w: &[f64; 6], a: [Vector<D>; 3], b: [Vector<D>; 3]| {
        a[0] * w[0]
            + a[1] * (w[1] * h)
            + a[2] * (w[2] * h * h)
            + b[0] * w[3]
            + b[1] * (w[4] * h)
            + b[2] * (w[5] * h * h)
    };
    let known = |k: &Knot<D, P>| [k.frame.point, k.frame.tangents[0], k.frame.second[0]];
    let point = mix(&value, known(a), known(b));
    let t = (mix(&slope, known(a), known(b)) / h).normalize();
    let side = a.frame.tangents[1] * (1.0 - s) + b.frame.tangents[1] * s;
    let side = (side - t * t.dot(&side)).try_normalize(1e-6)?;
    let second = std::array::from_fn(|i| a.frame.second[i] * (1.0 - s) + b.frame.second[i] * s);
    let spread = |k: &Knot<D, P>| [k.jacobi[0], k.jacobi[1], -k.frame.gauss * k.jacobi[0]];
    let (ja, jb) = (spread(a), spread(b));
    let mix = |w: &[f64; 6]| {
        ja[0] * w[0]
            + ja[1] * w[1] * h
            + ja[2] * w[2] * h * h
            + jb[0] * w[3]
            + jb[1] * w[4] * h
            + jb[2] * w[5] * h * h
    };
    Some(Knot {
        length,
        frame: Frame::of_forms(point, [t, side], second),
        jacobi: [mix(&value), mix(&slope) / h],
        ..*a
    })
}

/// The weights of value, slope and second derivative at 0 and then at 1, in the value of the
/// quintic at s and in its slope.
fn hermite(s: f64) -> ([f64; 6], [f64; 6]) {
    let (s2, s3) = (s * s, s * s * s);
    let (s4, s5) = (s2 * s2, s2 * s3);
    (
        [
            1.0 - 10.0 * s3 + 15.0 * s4 - 6.0 * s5,
            s - 6.0 * s3 + 8.0 * s4 - 3.0 * s5,
            0.5 * s2 - 1.5 * s3 + 1.5 * s4 - 0.5 * s5,
            10.0 * s3 - 15.0 * s4 + 6.0 * s5,
            -4.0 * s3 + 7.0 * s4 - 3.0 * s5,
            0.5 * s3 - s4 + 0.5 * s5,
        ],
        [
            -30.0 * s2 + 60.0 * s3 - 30.0 * s4,
            1.0 - 18.0 * s2 + 32.0 * s3 - 15.0 * s4,
            s - 4.5 * s2 + 6.0 * s3 - 2.5 * s4,
            30.0 * s2 - 60.0 * s3 + 30.0 * s4,
            -12.0 * s2 + 28.0 * s3 - 15.0 * s4,
            1.5 * s2 - 4.0 * s3 + 2.5 * s4,
        ],
    )
}
