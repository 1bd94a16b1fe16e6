//! The values of flags, and how they are read.

use clap::ValueEnum;
use taut::coordinate;
use taut_core::field;

/// How a surface is made of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Reconstruction {
    /// Polynomial charts, blended
    #[default]
    Atlas,
    /// The moving least squares planes of Yu, Zhang and Jiao, for comparison
    Mls,
}

/// Reads a length above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    coordinate(text).and_then(|value| {
        let found = format!("found {text:?}, expected a length above 0");
        (value > 0.0).then_some(value).ok_or(found)
    })
}

/// Reads a relative tolerance.
pub fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        Ok(value) if value <= 0.0 => Err(format!(
            "found {text:?}, expected a positive tolerance, such as 1e-6"
        )),
        _ => Err(format!(
            "found {text:?}, expected a relative error between 0 and 1, such as 1e-6"
        )),
    }
}

/// Reads a code of LAS classes.
pub fn class(text: &str) -> Result<u8, String> {
    text.trim().parse().map_err(|_| {
        format!(
            "found {text:?}, expected the number of a class, 0 to 255, such as 2, which is ground"
        )
    })
}

/// Reads a whole number.
pub fn whole(text: &str) -> Result<usize, String> {
    let wrong = |_| format!("found {text:?}, expected a whole number: 0, 1, 2, ..");
    text.trim().parse().map_err(wrong)
}

/// Reads a whole number above 0.
pub fn count(text: &str) -> Result<usize, String> {
    match whole(text) {
        Ok(value) if value > 0 => Ok(value),
        _ => Err(format!("found {text:?}, expected a whole number: 1, 2, ..")),
    }
}

/// Reads what random numbers begin with.
pub fn seed(text: &str) -> Result<u64, String> {
    let wrong = |_| format!("found {text:?}, expected a whole number: 0, 1, 2, ..");
    text.trim().parse().map_err(wrong)
}

/// Reads by how much slopes multiply the cost.
pub fn slope(text: &str) -> Result<field::Slope, String> {
    if text == "hiking" {
        return Ok(field::Slope::Hiking);
    }
    let wrong = || format!("found {text:?}, expected hiking, or UP,DOWN such as 4,1");
    let (up, down) = text.split_once(',').ok_or_else(wrong)?;
    let [up, down] = [coordinate(up)?, coordinate(down)?];
    if up < 0.0 || down < 0.0 {
        return Err(wrong());
    }
    Ok(field::Slope::Factors { up, down })
}
