//! The change of the front curvature along a front, as the rays to both sides of a ray tell it.

use crate::field::rays::jet::{Heading, Jet};

/// A ray beside another ray.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    /// The angle at the source from the ray to this ray, in radians, positive to the left.
    pub angle: f64,
    /// The Jacobi field J of this ray and its derivative J', at the same length as on the other
    /// ray.
    pub jacobi: [f64; 2],
}

/// Largest derivative of the front curvature along the front, times the square of the spacing.
const MOST_CHANGE: f64 = 0.1;

/// The jet on a ray at a distance with J and J', from the rays to its right and left; `spacing` is
/// the spacing of the graph's nodes.
pub(crate) fn jet(
    distance: f64,
    [spread, slope]: [f64; 2],
    sides: [Option<Side>; 2],
    (angle, range): (f64, Option<[f64; 2]>),
    spacing: f64,
) -> Jet {
    let curvature = slope / spread;
    let fronts = sides.map(|side| {
        let Side { angle, jacobi } = side?;
        Some((angle * spread, jacobi[1] / jacobi[0] - curvature))
    });
    let spreads = sides.map(|side| {
        let Side { angle, jacobi } = side?;
        Some((angle * spread, jacobi[0] - spread))
    });
    let most = MOST_CHANGE / (spacing * spacing);
    let change = derivative(fronts);
    let heading = Heading {
        angle,
        turn: spread.recip(),
        turn_rate: -derivative(spreads) / (spread * spread),
        range,
    };
    let cut = (change.abs() - most).max(0.0);
    Jet {
        curvature_rate: change.clamp(-most, most),
        curvature_rate_error: if range.is_none() {
            cut + uncertainty(fronts, curvature, spacing)
        } else {
            0.0
        },
        width: [heading.even(spacing); 2],
        ..Jet::new(distance, [1.0, 0.0], curvature, heading)
    }
}

/// The derivative at 0 of a function that is 0 there, from its values on two sides. With both
/// values it is the slope of the parabola through them, with one the slope of the line to it, and
/// with none it is 0.
fn derivative(sides: [Option<(f64, f64)>; 2]) -> f64 {
    match sides {
        [Some((a, fa)), Some((b, fb))] => (fa * b / a - fb * a / b) / (b - a),
        [Some((a, fa)), None] | [None, Some((a, fa))] => fa / a,
        [None, None] => 0.0,
    }
}

/// How uncertain the derivative of the front curvature is: by as much as it differs from side to
/// side, and by the whole of it where only one side or none is known.
fn uncertainty(sides: [Option<(f64, f64)>; 2], curvature: f64, spacing: f64) -> f64 {
    match sides {
        [Some((a, fa)), Some((b, fb))] => (fa / a - fb / b).abs(),
        [Some((a, fa)), None] | [None, Some((a, fa))] => (fa / a).abs(),
        [None, None] => curvature.abs() / spacing,
    }
}
