//! Vectors and angles in a tangent plane.

use std::f64::consts::{PI, TAU};

/// The length of a vector in tangent coordinates.
pub(crate) fn norm([a, b]: [f64; 2]) -> f64 {
    (a * a + b * b).sqrt()
}

/// The angle from one direction to another, between -pi and pi.
pub(crate) fn turned_by(from: f64, to: f64) -> f64 {
    (to - from + PI).rem_euclid(TAU) - PI
}
