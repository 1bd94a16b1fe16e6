//! Shifts of the Hessian's diagonal, and what steps leave to be gained.

/// Share of the length that a Newton step leaves, per square of the share that it changes: below 1 for
/// most paths, up to 30 where the ends are nearly conjugate.
const SQUARED: f64 = 64.0;
/// Shift of the first regularised step, per relative error of the length allowed, and its bounds. Directions that bend the
/// energy less than this have no curvature to rounding: the ends are conjugate, or all but so.
const SINGULAR: f64 = 4e3;
const LEAST_SHIFTS: [f64; 2] = [1e-11, 1e-4];
/// Shifts grow by this factor from the first that follows, up to the flow's own scale.
const FIRST_SHIFT: f64 = 1e-3;
const SHIFT_GROWTH: f64 = 8.0;
const FLOW_SHIFT: f64 = 4.0;
/// How far the energy's expansion is taken to hold, in shares of the length, and the longest step by a small shift.
const TRUSTED: f64 = 0.1;
const TRUSTED_STEP: f64 = 0.3;
/// Share of the predicted decrease that a step by a small shift has to bring.
const AS_PREDICTED: f64 = 0.1;
/// A path whose ends are conjugate is taut where within [`TRUSTED`] no more than this many tolerances are left to be gained.
const SINGULAR_LEFT: f64 = 25.0;
const MOST_SINGULAR_LEFT: f64 = 1e-6;

/// What a step that changes the length by the share `change` leaves to be changed: Newton's method
/// squares it times a factor, [`SQUARED`] or what the step before, if that was Newton's too, shows. A
/// rim's energy is not smooth where the path meets it.
pub(super) fn left_by(change: f64, before: Option<f64>, rim: f64) -> f64 {
    if rim > 0.0 {
        return change;
    }
    let shown = before.map_or(0.0, |before| change * (change / before).powi(2));
    shown.max(SQUARED * change * change)
}

/// What a step regularised by `shift`, which would change the length by the share `change`, leaves to be gained within
/// [`TRUSTED`]: in a direction that hardly bends the energy the gradient is at most sqrt(2 change shift), and a curvature that is
/// `negative` at most -shift.
pub(super) fn left_by_regularised(change: f64, shift: f64, negative: bool) -> f64 {
    let bend = if negative {
        0.5 * shift * TRUSTED * TRUSTED
    } else {
        0.0
    };
    change + TRUSTED * (2.0 * change * shift).sqrt() + bend
}

/// The shift to try after one that was of no use, where the step without any moves a node by a share `moved` of the length at
/// most. Small shifts hardly change a step that stays where the expansion holds.
pub(super) fn next_shift(shift: f64, least: f64, moved: f64) -> f64 {
    if shift == 0.0 && moved <= TRUSTED {
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

/// How much may be left to be gained where the ends are conjugate.
pub(super) fn most_left(tolerance: f64) -> f64 {
    (SINGULAR_LEFT * tolerance).min(MOST_SINGULAR_LEFT)
}

/// The least decrease of the energy with which a step is taken: of one by a small shift, which may be long, a share of what was
/// predicted, as else the next shift does better.
pub(super) fn least_decrease(shift: f64, predicted: f64) -> f64 {
    if shift > 0.0 && shift < FLOW_SHIFT {
        AS_PREDICTED * predicted
    } else {
        0.0
    }
}

/// Whether a step by a shift that moves a node by a share of the length at most is worth to be tried.
pub(super) fn is_trusted(shift: f64, moved: f64) -> bool {
    shift == 0.0 || shift >= FLOW_SHIFT || moved <= TRUSTED_STEP
}
