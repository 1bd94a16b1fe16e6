//! Numbers as text, with no more digits than are known.

/// Two digits, as suits an error.
pub fn exponential(value: Option<f64>) -> String {
    match value {
        None => "unknown".to_owned(),
        Some(0.0) => "0".to_owned(),
        Some(value) => format!("{value:.1e}"),
    }
}

/// A value to the second digit of its error.
pub fn rounded(value: f64, error: f64) -> String {
    if error.is_nan() || error <= 0.0 {
        return value.to_string();
    }
    let place = error.log10().floor() as i32 - 1;
    if place > 0 {
        let unit = 10_f64.powi(place);
        return ((value / unit).round() * unit).to_string();
    }
    // An f64 has 17 digits at most.
    let before = value.abs().log10().floor().max(0.0) as usize + 1;
    let decimals = place.unsigned_abs() as usize;
    format!("{value:.*}", decimals.min(17_usize.saturating_sub(before)))
}

/// Two digits, for estimates.
pub fn significant(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        rounded(value, value.abs())
    } else {
        format!("{value:.1e}")
    }
}

/// The value in the middle and the largest; `None` where there are none.
pub fn median_and_most(values: impl Iterator<Item = f64>) -> [Option<f64>; 2] {
    let mut values: Vec<f64> = values.collect();
    let most = values.iter().copied().max_by(f64::total_cmp);
    let middle = values.len() / 2;
    let median = most.map(|_| *values.select_nth_unstable_by(middle, f64::total_cmp).1);
    [median, most]
}

/// The largest of the values that are numbers, none of which is below 0.
pub fn largest(values: &[f64]) -> f64 {
    let known = values.iter().copied().filter(|value| !value.is_nan());
    known.fold(0.0, f64::max)
}

/// Moves below this share of the coordinates are rounding.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// How far rounding moves a point.
pub fn rounding(point: &[f64]) -> f64 {
    ROUNDING * point.iter().fold(0.0_f64, |size, v| size.max(v.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_stop_where_the_error_begins() {
        assert_eq!(rounded(2.0 / 3.0, 2.1e-4), "0.66667");
        assert_eq!(rounded(123.456, 20.0), "123");
        assert_eq!(rounded(98_765.4, 2100.0), "98800");
        assert_eq!(rounded(0.5, 0.0), "0.5");
        assert_eq!(rounded(1e6 / 3.0, 1e-30), "333333.33333333331");
    }

    #[test]
    fn estimates_have_two_digits() {
        for (value, shown) in [
            (0.0, "0"),
            (0.012_345, "0.012"),
            (2.0 / 3.0, "0.67"),
            (9.876, "9.9"),
            (54_321.0, "54000"),
            (-1.234e-7, "-1.2e-7"),
            (7.89e12, "7.9e12"),
        ] {
            assert_eq!(significant(value), shown);
        }
    }
}
