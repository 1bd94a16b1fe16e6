//! Shifts of the Hessian's diagonal, and estimates of what steps leave to be gained.

/// Share of the length that a Newton step leaves, per square of the share by which it changes the
/// length. It is below 1 for most paths, and up to 30 where the ends are nearly conjugate.
const SQUARED: f64 = 64.0;
/// Shift of the first regularised step, per relative error of the length that is allowed.
/// Directions in which the energy's second derivative is below the shift have no curvature to
/// rounding: the ends are conjugate or very nearly so.
const SINGULAR: f64 = 4e3;
/// Bounds of the shift of the first regularised step.
const LEAST_SHIFTS: [f64; 2] = [1e-11, 1e-4];
/// Least shift that follows the first one; the ones after it grow from there.
const FIRST_SHIFT: f64 = 1e-3;
/// Factor by which small shifts grow, up to [`FLOW_SHIFT`].
const SHIFT_GROWTH: f64 = 8.0;
/// Least shift on the scale of the flow: a step with this shift is a step of the curvature flow of
/// the size of its inverse.
const FLOW_SHIFT: f64 = 4.0;
/// How far the energy's expansion is taken to hold, as a share of the length.
const TRUSTED_LENGTH: f64 = 0.1;
/// Longest step of a node that a small shift may make, as a share of the length.
const TRUSTED_STEP: f64 = 0.3;
/// Share of the predicted decrease of the energy that a step with a small shift must bring.
const AS_PREDICTED: f64 = 0.1;
/// Largest gain left within [`TRUSTED_LENGTH`], in tolerances, at which a path whose ends are
/// conjugate counts as taut.
const SINGULAR_LEFT: f64 = 25.0;
/// Largest gain left, as a share of the length, at which a path whose ends are conjugate counts as
/// taut, whatever the tolerance.
const MOST_SINGULAR_LEFT: f64 = 1e-6;

/// What a step that changes the length by the share `change` leaves to be changed. Newton's method
/// squares the change times a factor, which is [`SQUARED`] or what the step before shows if that
/// was one of Newton's too. Where the path meets a rim, the rim's energy is not smooth, and the
/// whole change counts.
pub(super) fn left_by(change: f64, before: Option<f64>, rim: f64) -> f64 {
    if rim > 0.0 {
        return change;
    }
    let shown = before.map_or(0.0, |before| change * (change / before).powi(2));
    shown.max(SQUARED * change * change)
}

/// What a step regularised by `shift`, which would change the length by the share `change`, leaves
/// to be gained within [`TRUSTED_LENGTH`]. In a direction in which the energy has hardly any
/// curvature, the gradient is at most sqrt(2 change shift), and a `negative` curvature is above
/// -shift.
pub(super) fn left_by_regularised(change: f64, shift: f64, negative: bool) -> f64 {
    let curved = if negative {
        0.5 * shift * TRUSTED_LENGTH * TRUSTED_LENGTH
    } else {
        0.0
    };
    change + TRUSTED_LENGTH * (2.0 * change * shift).sqrt() + curved
}

/// The shift to try after one that was of no use, where the step without a shift moves no node by
/// more than the share `moved` of the length. Small shifts hardly change a step that stays where
/// the expansion holds.
pub(super) fn next_shift(shift: f64, least: f64, moved: f64) -> f64 {
    if shift == 0.0 && moved <= TRUSTED_LENGTH {
        FLOW_SHIFT
    } else if shift == 0.0 {
        least
    } else if shift < FLOW_SHIFT {
        (SHIFT_GROWTH * shift).max(FIRST_SHIFT)
    } else {
        4.0 * shift
    }
}

/// The first shift to try.
pub(super) fn least_shift(tolerance: f64) -> f64 {
    (SINGULAR * tolerance).clamp(LEAST_SHIFTS[0], LEAST_SHIFTS[1])
}

/// How much may be left to be gained where the ends are conjugate, as a share of the length.
pub(super) fn most_left(tolerance: f64) -> f64 {
    (SINGULAR_LEFT * tolerance).min(MOST_SINGULAR_LEFT)
}

/// The least decrease of the energy with which a step is taken. For a step with a small shift,
/// which may be long, it is a share of what was predicted; otherwise the next shift does better.
pub(super) fn least_decrease(shift: f64, predicted: f64) -> f64 {
    if shift > 0.0 && shift < FLOW_SHIFT {
        AS_PREDICTED * predicted
    } else {
        0.0
    }
}

/// Whether a step with a shift, which moves no node by more than the share `moved` of the length,
/// is worth trying.
pub(super) fn is_trusted(shift: f64, moved: f64) -> bool {
    shift == 0.0 || shift >= FLOW_SHIFT || moved <= TRUSTED_STEP
}
