//! What a way costs, from the files that say so.

use std::path::Path;

use taut_core::field::Cost;
use taut_io::{PointSet, ReadError, read_numbers};

use crate::exit::Failure;
use crate::settings::{CostSettings, Rates};

/// Says what a name of a column could have meant where the cloud's file has none of that name.
pub fn refusal(failure: Failure) -> Failure {
    match failure {
        Failure::Read(ReadError::NoColumn {
            file,
            column,
            found,
        }) => Failure::Usage(format!(
            "--cost {column}: found no such file, and {found} in {}; name a file of costs, or a column beside the coordinates",
            file.display()
        )),
        other => other,
    }
}

/// The cost at each row of a cloud.
pub fn of_rows(settings: &CostSettings, points: &PointSet) -> Result<Cost, Failure> {
    let at_rows = match (&settings.rates, &points.column) {
        (Rates::File(file), _) => rates(file, points)?,
        (Rates::Column(_), Some(column)) => column.clone(),
        _ => Vec::new(),
    };
    let barriers = settings.no_go.iter().map(|file| polygon(file));
    Ok(Cost {
        at_rows,
        slope: settings.slope,
        barriers: barriers.collect::<Result<_, _>>()?,
    })
}

/// That a polygon changes nothing.
pub fn without_effect(file: &Path) -> String {
    format!(
        "--no-go {}: no point lies in the polygon, and no way between neighbouring points crosses it; it changes nothing (are its corners in the coordinates of the points?)",
        file.display()
    )
}

/// One number for each row of the file of points, of which some may have been left out.
fn rates(file: &Path, points: &PointSet) -> Result<Vec<f64>, Failure> {
    let numbers = read_numbers(file)?;
    let wrong = |found: String, expected: &str| {
        Failure::Usage(format!(
            "--cost {}: found {found}, expected {expected}",
            file.display()
        ))
    };
    if numbers.columns != 1 {
        let found = format!("{} columns", numbers.columns);
        return Err(wrong(found, "one cost on each line"));
    }
    let found = format!("{} costs", numbers.values.len());
    match &points.rows_kept {
        None if numbers.values.len() == points.rows() => Ok(numbers.values),
        None => Err(wrong(
            found,
            &format!("{}, one for each point", points.rows()),
        )),
        Some(kept) => kept
            .iter()
            .map(|row| numbers.values.get(*row).copied())
            .collect::<Option<_>>()
            .ok_or_else(|| wrong(found, "one for each row of the file of points")),
    }
}

/// The corners of a polygon seen from above: the first two numbers of each line.
fn polygon(file: &Path) -> Result<Vec<[f64; 2]>, Failure> {
    let numbers = read_numbers(file)?;
    let corners = numbers.values.chunks(numbers.columns);
    if numbers.columns < 2 || corners.len() < 3 {
        return Err(Failure::Usage(format!(
            "--no-go {}: found {} lines of {} numbers, expected at least 3 corners of a polygon, x and y on each line",
            file.display(),
            corners.len(),
            numbers.columns
        )));
    }
    Ok(corners.map(|corner| [corner[0], corner[1]]).collect())
}
