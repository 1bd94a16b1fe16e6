//! Gragg's extrapolation of the modified midpoint rule, order 10, adaptive step (Hairer, Nørsett &
//! Wanner, "Solving Ordinary Differential Equations I", section II.9).

use nalgebra::SVector;

/// Position, velocity and Jacobi field of a geodesic; the layout belongs to the surface.
pub type State = SVector<f64, 8>;

/// Extrapolations a step. With 6 to 8 rounding is magnified more, and the result over long
/// geodesics is worse.
const COLUMNS: usize = 5;
/// Bound on the estimated error of a step, relative to 1 + |component|.
const STEP_TOLERANCE: f64 = 2e-15;

/// The state after `length`, from `state`, for y' = `derivative`(y). `step` is the first step to
/// try.
pub fn integrate(
    derivative: impl Fn(&State) -> State,
    mut state: State,
    length: f64,
    step: f64,
) -> State {
    let mut step = step;
    let mut done = 0.0;
    let mut lost = State::zeros();
    while done < length {
        let taken = step.min(length - done);
        let (increment, error) = extrapolate(&derivative, &state, taken);
        let scaled = error
            .zip_map(&state, |e, y| e.abs() / (1.0 + y.abs()))
            .max();
        let accepted = scaled.is_nan() || scaled <= STEP_TOLERANCE || taken < 1e-9 * length;
        if accepted {
            // Compensated: the rounding of each sum is carried to the next.
            let wanted = increment + lost;
            let next = state + wanted;
            lost = wanted - (next - state);
            state = next;
            done = if taken < length - done {
                done + taken
            } else {
                length
            };
        }
        let growth =
            0.9 * (STEP_TOLERANCE / scaled.max(1e-300)).powf(1.0 / (2 * COLUMNS - 1) as f64);
        if taken == step || !accepted {
            step = taken * growth.clamp(0.2, 2.0);
        }
    }
    state
}

/// Increment over `step` and the difference of the last two extrapolations.
fn extrapolate(derivative: &impl Fn(&State) -> State, state: &State, step: f64) -> (State, State) {
    let slope = derivative(state);
    let mut row = [State::zeros(); COLUMNS];
    let mut error = State::zeros();
    for j in 0..COLUMNS {
        let parts = 2 * (j + 1);
        let h = step / parts as f64;
        let (mut before, mut now) = (State::zeros(), slope * h);
        for _ in 1..parts {
            let next = before + derivative(&(state + now)) * (2.0 * h);
            (before, now) = (now, next);
        }
        for k in 0..j {
            let ratio = (j + 1) as f64 / (j - k) as f64;
            let finer = now + (now - row[k]) / (ratio * ratio - 1.0);
            row[k] = now;
            error = finer - now;
            now = finer;
        }
        row[j] = now;
    }
    (row[COLUMNS - 1], error)
}

/// One classical Runge-Kutta step (order 4), for work that needs a few digits only.
pub fn runge_kutta(derivative: impl Fn(&State) -> State, state: &State, step: f64) -> State {
    let a = derivative(state);
    let b = derivative(&(state + a * (0.5 * step)));
    let c = derivative(&(state + b * (0.5 * step)));
    let d = derivative(&(state + c * step));
    state + (a + (b + c) * 2.0 + d) * (step / 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pendulum_of_small_and_large_frequency_returns() {
        let turn = 2.0 * std::f64::consts::PI;
        for frequency in [0.5, 3.0] {
            let derivative = |y: &State| {
                let mut d = State::zeros();
                d[0] = frequency * y[1];
                d[1] = -frequency * y[0];
                d
            };
            let mut start = State::zeros();
            start[0] = 1.0;
            let end = integrate(derivative, start, 4.0 * turn / frequency, 0.1);
            assert!(
                (end - start).norm() < 2e-14,
                "{frequency}: {:e}",
                (end - start).norm()
            );
        }
    }
}
