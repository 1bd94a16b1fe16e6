//! Lengths and their errors: the osculating arc (19)-(21), the spectral tail, and what errors of
//! the surface's height do.

use crate::correction::curve::Curve;
use crate::correction::nodes::Profile;

/// Factor by which the modes of a resolved element fall from one to the next, at least.
const FALL: f64 = 0.2;

/// Relative error of each element's energy, estimated from its last Legendre modes.
///
/// The velocity of an element of degree p has the modes 0..p-1, and the modes of a smooth path fall
/// geometrically, so the first mode left out is smaller than the last one kept. The error of each
/// element is given as a share of the whole energy. Where the modes of an element do not fall
/// geometrically yet, as beside the tip of a cone, those left out may be larger than the last ones;
/// the estimate is then `slow` times as large.
pub(crate) fn tails<const D: usize, P: Copy>(
    curve: &Curve<D, P>,
    energy: f64,
    slow: f64,
) -> Vec<f64> {
    let reference = curve.element();
    let count = curve.degree + 1;
    curve
        .spans
        .iter()
        .enumerate()
        .map(|(e, span)| {
            let velocities = curve.velocities(e);
            let mode_energy = |mode: usize| {
                let row = &reference.legendre[mode * count..(mode + 1) * count];
                let mut coefficient = velocities[0] * row[0];
                for q in 1..count {
                    coefficient += velocities[q] * row[q];
                }
                coefficient.norm_squared() * 2.0 / (2 * mode + 1) as f64 / span
            };
            let last = mode_energy(curve.degree - 1);
            let before = mode_energy(curve.degree - 2);
            // Even and odd modes may alternate in size, so the second last one counts too where it
            // is much larger.
            let tail = last.max(before * 0.05) / energy;
            let first = (1..curve.degree - 2).map(mode_energy).fold(0.0, f64::max);
            let falls = last.max(before) <= first * FALL.powi(curve.degree as i32 - 2);
            if falls { tail } else { slow * tail }
        })
        .collect()
}

/// The length of the arc of curvature `curvature` over a chord, (19): (2 / kappa) asin(kappa sigma
/// / 2).
pub(crate) fn arc(chord: f64, curvature: f64) -> f64 {
    let half = 0.5 * curvature * chord;
    if half < 1e-4 {
        chord * (1.0 + half * half / 6.0)
    } else {
        chord * half.min(1.0).asin() / half
    }
}

/// The length of a polyline by the arcs over its chords, (20), with the curvature of the surface
/// along each chord.
pub(crate) fn arcs(profile: &Profile) -> f64 {
    let pairs = profile.lengths.iter().zip(&profile.turnings);
    pairs
        .map(|(chord, turning)| arc(*chord, turning / chord))
        .sum()
}

/// How much longer a taut string becomes when it is pushed aside by `depth` at a place whose
/// distances from its two ends are given.
pub(crate) fn detour([before, behind]: [f64; 2], depth: f64) -> f64 {
    before.hypot(depth) + behind.hypot(depth) - before - behind
}

/// What errors of the surface's height do to a path's length.
///
/// Moving a stretch of length s along its normal by delta changes the length by kappa delta s to
/// first order, where kappa is the normal curvature along the path. Heights are independent from
/// chart to chart, so these changes add in quadrature. Ripples of the height error and of a chart's
/// radius lengthen the path by half their squared slope.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct HeightErrors {
    first_order_variance: f64,
    second_order: f64,
}

/// Number of standard errors in the estimate, chosen so that 99 % of lengths on clean clouds are
/// covered.
const STANDARD_ERRORS: f64 = 5.0;
/// Slope of a ripple, in units of height error over chart radius.
pub(crate) const RIPPLE: f64 = 3.0;

impl HeightErrors {
    /// Adds a stretch of a path with the path's normal curvature, the surface's height error and
    /// the chart's radius there.
    pub fn add(&mut self, stretch: f64, curvature: f64, height_error: f64, radius: f64) {
        if radius > 0.0 {
            let shift = curvature * height_error;
            self.first_order_variance += shift * shift * stretch * radius.max(stretch);
            self.second_order += 0.5 * (RIPPLE * height_error / radius).powi(2) * stretch;
        }
    }

    /// Adds a stretch along a rim (the boundary of the surface) with the path's geodesic curvature
    /// there. Where the data ends is known to about a quarter of a chart's radius, which is a
    /// spacing.
    pub fn add_rim(&mut self, stretch: f64, geodesic_curvature: f64, radius: f64) {
        self.second_order += stretch * (geodesic_curvature * 0.25 * radius).min(1.0);
    }

    /// Estimated absolute error of the length, in the input's units.
    pub fn length_error(&self) -> f64 {
        STANDARD_ERRORS * self.first_order_variance.sqrt() + self.second_order
    }
}

#[cfg(test)]
mod tests {
    use super::arc;

    #[test]
    fn arc_of_a_circle() {
        for angle in [1e-6, 1e-3, 0.5, 3.0] {
            let radius = 2.5;
            let chord = 2.0 * radius * f64::sin(angle / 2.0);
            assert!((arc(chord, 1.0 / radius) / (radius * angle) - 1.0).abs() < 1e-12);
        }
    }
}
