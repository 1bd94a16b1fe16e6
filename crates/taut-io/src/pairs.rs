//! Pairs of ends of paths, as text.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::error::{Fault, ReadError, quoted};
use crate::numbers::table;
use crate::text::{Lines, Separator};

/// Pairs of ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Pairs {
    /// From and to, as rows of the point file, the first is 0.
    Indices(Vec<[usize; 2]>),
    /// From and to, as coordinates.
    Coordinates {
        /// Number of coordinates of a point, at least 2.
        dimension: usize,
        /// Row-major, pairs x (2 `dimension`): the first point's coordinates, then the second's, in
        /// the file's units.
        values: Vec<f64>,
    },
}

/// Reads pairs from a text file: two columns of row numbers, or 2d columns of coordinates.
///
/// White space, commas or semicolons separate the columns, `#` and `//` start comments, blank lines
/// are skipped.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, holds no pair, or a line is not like the first.
pub fn read_pairs(path: &Path) -> Result<Pairs, ReadError> {
    let file = File::open(path).map_err(|source| Fault::Io(source).in_file(path))?;
    parse(BufReader::new(file)).map_err(|fault| fault.in_file(path))
}

/// Reads pairs as [`read_pairs`] does, from any source; `name` stands for the file in errors.
///
/// ```
/// use taut_io::{Pairs, read_pairs_from};
/// let pairs = read_pairs_from("# from to\n0 12\n3 7\n".as_bytes(), "standard input")?;
/// assert_eq!(pairs, Pairs::Indices(vec![[0, 12], [3, 7]]));
/// # Ok::<(), taut_io::ReadError>(())
/// ```
///
/// # Errors
/// As [`read_pairs`].
pub fn read_pairs_from(source: impl BufRead, name: &str) -> Result<Pairs, ReadError> {
    parse(source).map_err(|fault| fault.in_file(Path::new(name)))
}

fn parse(source: impl BufRead) -> Result<Pairs, Fault> {
    let mut lines = Lines::new(source);
    let first = lines.next()?.map(|(line, row)| (line, row.to_owned()));
    let Some((line, first)) = first else {
        return match lines.read() {
            0 => Err(Fault::Empty),
            read => Err(wrong(read, "no pair".to_owned(), "at least one")),
        };
    };
    match Separator::of(&first).fields(&first).count() {
        2 => parse_indices((line, &first), &mut lines),
        columns if columns >= 4 && columns % 2 == 0 => Ok(Pairs::Coordinates {
            dimension: columns / 2,
            values: table((line, &first), &mut lines, REMEDY, f64::is_finite)?,
        }),
        columns => Err(wrong(
            line,
            format!("{columns} columns"),
            "2 row numbers, or an even number of coordinates",
        )),
    }
}

fn wrong(line: usize, found: String, expected: &str) -> Fault {
    Fault::line(line, found, expected, REMEDY)
}

const REMEDY: &str =
    "write two row numbers (the first row is 0) or two points' coordinates on a line";

fn parse_indices<R: BufRead>(
    (first_line, first): (usize, &str),
    lines: &mut Lines<R>,
) -> Result<Pairs, Fault> {
    let separator = Separator::of(first);
    let mut pairs = vec![pair(separator, first_line, first)?];
    while let Some((line, row)) = lines.next()? {
        pairs.push(pair(separator, line, row)?);
    }
    Ok(Pairs::Indices(pairs))
}

fn pair(separator: Separator, line: usize, row: &str) -> Result<[usize; 2], Fault> {
    let mut pair = [0; 2];
    let mut columns = 0;
    for field in separator.fields(row) {
        if let Some(index) = pair.get_mut(columns) {
            *index = field
                .parse()
                .map_err(|_| wrong(line, quoted(field), "a row number: 0, 1, 2, ..."))?;
        }
        columns += 1;
    }
    if columns == 2 {
        return Ok(pair);
    }
    let expected = "2 row numbers as in the lines before";
    Err(wrong(line, format!("{columns} columns"), expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line_of(text: &str) -> Option<crate::Place> {
        match read_pairs_from(text.as_bytes(), "pairs") {
            Err(ReadError::Malformed { place, .. }) => Some(place),
            _ => None,
        }
    }

    #[test]
    fn coordinates_have_an_even_number_of_columns() {
        let pairs = read_pairs_from("\n0, 0, 1, 1.5\n# c\n1,2,3,4\n".as_bytes(), "pairs").unwrap();
        let values = vec![0.0, 0.0, 1.0, 1.5, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(
            pairs,
            Pairs::Coordinates {
                dimension: 2,
                values
            }
        );
    }

    #[test]
    fn errors_name_the_line() {
        for (text, line) in [
            ("0 1\n2 3 4\n", 2),
            ("0 1\n\n2 -3\n", 3),
            ("0 1.5\n", 1),
            ("1 2 3\n", 1),
            ("1 2 3 4\n1 2 3 nan\n", 2),
            ("1 2 3 4\n1 2 3\n", 2),
            ("# nothing\n", 1),
        ] {
            assert_eq!(line_of(text), Some(crate::Place::Line(line)), "{text:?}");
        }
        assert!(matches!(
            read_pairs_from(&b""[..], "pairs"),
            Err(ReadError::Empty { .. })
        ));
    }
}
