//! Rows of numbers, as text.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::error::{Fault, ReadError, quoted};
use crate::text::{Lines, Separator, number};

/// A table of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers {
    /// Numbers in a row, at least 1.
    pub columns: usize,
    /// Row-major; infinite where the file says inf, never NaN.
    pub values: Vec<f64>,
}

/// Reads a text file whose lines all hold as many numbers as the first.
///
/// White space, commas or semicolons separate the columns, `#` and `//` start comments, blank lines
/// are skipped.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, holds no number, or a line is not like the first.
pub fn read_numbers(path: &Path) -> Result<Numbers, ReadError> {
    read(path).map_err(|fault| fault.in_file(path))
}

fn read(path: &Path) -> Result<Numbers, Fault> {
    let mut lines = Lines::new(BufReader::new(File::open(path)?));
    let remedy = "write one row of numbers on a line";
    let first = lines.next()?.map(|(line, row)| (line, row.to_owned()));
    let Some((line, first)) = first else {
        return match lines.read() {
            0 => Err(Fault::Empty),
            read => Err(Fault::line(read, "no number", "at least one", remedy)),
        };
    };
    let values = table((line, &first), &mut lines, remedy, |value| !value.is_nan())?;
    let columns = Separator::of(&first).fields(&first).count();
    Ok(Numbers { columns, values })
}

/// The numbers of lines that all have as many columns as the first, which is given.
pub(crate) fn table<R: BufRead>(
    (first_line, first): (usize, &str),
    lines: &mut Lines<R>,
    remedy: &str,
    is_allowed: impl Fn(f64) -> bool,
) -> Result<Vec<f64>, Fault> {
    let separator = Separator::of(first);
    let columns = separator.fields(first).count();
    let mut values = Vec::new();
    let mut add = |line: usize, row: &str| {
        let before = values.len();
        for field in separator.fields(row) {
            let value = number(field, line)?;
            if !is_allowed(value) {
                let expected = "a number that means something here";
                return Err(Fault::line(line, quoted(field), expected, remedy));
            }
            values.push(value);
        }
        let found = values.len() - before;
        if found == columns {
            return Ok(());
        }
        let expected = format!("{columns} as in line {first_line}");
        Err(Fault::line(
            line,
            format!("{found} columns"),
            expected,
            remedy,
        ))
    };
    add(first_line, first)?;
    while let Some((line, row)) = lines.next()? {
        add(line, row)?;
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Place;

    fn of_text(text: &str) -> Result<Numbers, ReadError> {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("numbers.txt");
        std::fs::write(&file, text).expect("a file");
        read_numbers(&file)
    }

    #[test]
    fn lines_are_rows() {
        let found = of_text("# row, start\n3, 0.5\n\n12,1e-3 # last\n").expect("numbers");
        let values = vec![3.0, 0.5, 12.0, 1e-3];
        assert_eq!(found, Numbers { columns: 2, values });
    }

    #[test]
    fn errors_name_the_line() {
        for (text, wrong) in [
            ("1 2\n3\n", 2),
            ("1\nx\n", 2),
            ("1\n\nnan\n", 3),
            ("#\n", 1),
        ] {
            let found = of_text(text);
            assert!(
                matches!(&found, Err(ReadError::Malformed { place, .. }) if *place == Place::Line(wrong)),
                "{text:?}: {found:?}"
            );
        }
        assert!(matches!(of_text(""), Err(ReadError::Empty { .. })));
    }
}
