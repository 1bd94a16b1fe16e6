//! XYZ, TXT and CSV: rows of numbers.
//!
//! White space, commas or semicolons separate the fields (the first row decides), `#` and `//`
//! start comments. The first row may name the columns: x, y, z or two of them (or x1 .. xd) are
//! then the coordinates and nx, ny, nz (or n1 .. nd) the normals; other columns are ignored, be
//! they numbers or not. A note names those ignored unless x, y and z are there. Without such names
//! every column is a coordinate, but for XYZ and TXT with six columns, whose last three are normals
//! where they are unit vectors and are ignored where not.

use std::io::BufRead;

use crate::error::{Fault, quoted};
use crate::point_set::PointSet;
use crate::text::{Lines, Separator, number};

/// How rows without names are understood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Style {
    /// XYZ and TXT: positions in space, normals behind them.
    Positions,
    /// CSV: every column a coordinate.
    Columns,
}

/// What becomes of one column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Coordinate(usize),
    Normal(usize),
    Ignored,
}

struct Layout {
    roles: Vec<Role>,
    dimension: usize,
    has_normals: bool,
    /// The column asked for.
    column: Option<usize>,
    /// The normals are a guess from the number of columns.
    guessed: bool,
    /// The coordinates are named x, y and z.
    has_space: bool,
}

pub(super) fn read(
    source: impl BufRead,
    style: Style,
    column: Option<&str>,
) -> Result<PointSet, Fault> {
    let mut lines = Lines::new(source);
    let first = lines.next()?.map(|(line, row)| (line, row.to_owned()));
    let Some((first_line, first)) = first else {
        return match lines.read() {
            0 => Err(Fault::Empty),
            _ => Ok(PointSet::default()),
        };
    };
    let separator = Separator::of(&first);
    let fields: Vec<&str> = separator.fields(&first).collect();
    let is_name =
        |field: &&str| field.starts_with(char::is_alphabetic) && field.parse::<f64>().is_err();
    let is_header = fields.iter().all(is_name);
    let layout = if is_header {
        Layout::of_names(&fields, column)
    } else {
        Layout::of_count(fields.len(), style)
    };
    if let Some(column) = column.filter(|_| layout.column.is_none()) {
        let names = fields.iter().zip(&layout.roles);
        let others = names.filter(|(_, role)| is_header && **role == Role::Ignored);
        return Err(Fault::no_column(column, others.map(|(name, _)| *name)));
    }
    if layout.dimension < 2 {
        return Err(Fault::line(
            first_line,
            quoted(&first),
            "at least 2 columns of coordinates",
            "put the coordinates of a point on one line, separated by white space or commas",
        ));
    }
    let mut rows = Rows::new(&layout, separator, first_line);
    if !is_header {
        rows.add(first_line, &first)?;
    }
    while let Some((line, row)) = lines.next()? {
        rows.add(line, row)?;
    }
    let mut points = rows.points();
    layout.settle_guess(&mut points);
    if is_header {
        layout.note_ignored(&fields, &mut points);
    }
    Ok(points)
}

/// Rows as they come.
struct Rows<'a> {
    layout: &'a Layout,
    separator: Separator,
    first_line: usize,
    coordinates: Vec<f64>,
    normals: Vec<f64>,
    column: Vec<f64>,
    position: Vec<f64>,
    normal: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn new(layout: &'a Layout, separator: Separator, first_line: usize) -> Self {
        Self {
            layout,
            separator,
            first_line,
            coordinates: Vec::new(),
            normals: Vec::new(),
            column: Vec::new(),
            position: vec![0.0; layout.dimension],
            normal: vec![0.0; layout.dimension],
        }
    }

    fn add(&mut self, line: usize, row: &str) -> Result<(), Fault> {
        let layout = self.layout;
        let mut columns = 0;
        for field in self.separator.fields(row) {
            match layout.roles.get(columns) {
                Some(Role::Coordinate(axis)) => self.position[*axis] = number(field, line)?,
                Some(Role::Normal(axis)) => self.normal[*axis] = number(field, line)?,
                Some(Role::Ignored) | None => {}
            }
            if Some(columns) == layout.column {
                self.column.push(number(field, line)?);
            }
            columns += 1;
        }
        if columns != layout.roles.len() {
            return Err(Fault::line(
                line,
                format!("{columns} columns"),
                format!("{} as in line {}", layout.roles.len(), self.first_line),
                "complete or remove the line",
            ));
        }
        self.coordinates.extend_from_slice(&self.position);
        if layout.has_normals {
            self.normals.extend_from_slice(&self.normal);
        }
        Ok(())
    }

    fn points(self) -> PointSet {
        let layout = self.layout;
        PointSet {
            dimension: layout.dimension,
            coordinates: self.coordinates,
            normals: layout.has_normals.then_some(self.normals),
            column: layout.column.map(|_| self.column),
            ..PointSet::default()
        }
    }
}

impl Layout {
    fn of_names(names: &[&str], column: Option<&str>) -> Self {
        let find = |name: &str| {
            names
                .iter()
                .position(|found| found.eq_ignore_ascii_case(name))
        };
        let column = column.and_then(find);
        let numbered = |letter: &str| {
            (1..=names.len())
                .map_while(|axis| find(&format!("{letter}{axis}")))
                .collect::<Vec<_>>()
        };
        let named = |names: [&str; 3]| names.into_iter().filter_map(find).collect::<Vec<_>>();
        let letters = named(["x", "y", "z"]);
        let axes = numbered("x");
        let has_space = letters.len() == 3;
        let (positions, normals) = if has_space || axes.len() < 2 && letters.len() == 2 {
            let normal = |axis: &usize| find(&format!("n{}", names[*axis]));
            (letters.clone(), letters.iter().filter_map(normal).collect())
        } else if axes.len() >= 2 {
            (axes, numbered("n"))
        } else {
            let others = (0..names.len()).filter(|i| Some(*i) != column);
            (others.collect(), Vec::new())
        };
        let mut roles = vec![Role::Ignored; names.len()];
        for (axis, column) in positions.iter().enumerate() {
            roles[*column] = Role::Coordinate(axis);
        }
        let has_normals = normals.len() == positions.len();
        if has_normals {
            for (axis, column) in normals.iter().enumerate() {
                roles[*column] = Role::Normal(axis);
            }
        }
        Self {
            dimension: positions.len(),
            roles,
            has_normals,
            column,
            guessed: false,
            has_space,
        }
    }

    fn of_count(columns: usize, style: Style) -> Self {
        let guessed = style == Style::Positions && columns == 6;
        let dimension = if guessed { 3 } else { columns };
        let role = |column| match column {
            _ if column < dimension => Role::Coordinate(column),
            _ => Role::Normal(column - dimension),
        };
        Self {
            roles: (0..columns).map(role).collect(),
            dimension,
            has_normals: guessed,
            column: None,
            guessed,
            has_space: false,
        }
    }

    /// Names the columns that are left out, where they may have been meant for coordinates: not
    /// where x, y and z are named, which are all of space.
    fn note_ignored(&self, names: &[&str], points: &mut PointSet) {
        let is_left_out = |i: &usize| self.roles[*i] == Role::Ignored && Some(*i) != self.column;
        let left_out = (0..names.len()).filter(is_left_out);
        let left_out: Vec<&str> = left_out.map(|i| names[i]).collect();
        if self.has_space || left_out.is_empty() {
            return;
        }
        let read = (0..names.len()).filter(|i| matches!(self.roles[*i], Role::Coordinate(_)));
        let read: Vec<&str> = read.map(|i| names[i]).collect();
        points.notes.push(format!(
            "columns ignored: {}; the coordinates are {}, and names x, y, z (or x1, x2, ...) in the first line choose others",
            left_out.join(", "),
            read.join(", ")
        ));
    }

    /// Keeps guessed normals only if they are unit vectors (or zero: unknown), and tells of what
    /// was guessed.
    fn settle_guess(&self, points: &mut PointSet) {
        if !self.guessed {
            if self.dimension > 3 && self.roles.len() == self.dimension {
                points.notes.push(format!(
                    "every one of the {} columns is read as a coordinate; name the columns in a first line (x, y, z, ...) if some are not",
                    self.dimension
                ));
            }
            return;
        }
        const UNIT_LENGTH: std::ops::RangeInclusive<f64> = 0.9..=1.1;
        let is_normal = |vector: &[f64]| {
            let length = vector.iter().map(|value| value * value).sum::<f64>().sqrt();
            length == 0.0 || UNIT_LENGTH.contains(&length) || !length.is_finite()
        };
        let normals = points.normals.take().unwrap_or_default();
        if normals.chunks_exact(3).all(is_normal) {
            points.normals = Some(normals);
        } else {
            let note = "columns 4 to 6 ignored: they are not unit vectors, so not normals";
            points.notes.push(note.to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(text: &str, style: Style) -> PointSet {
        read(text.as_bytes(), style, None).unwrap()
    }

    #[test]
    fn six_columns_are_normals_only_if_unit() {
        let normals = points("0 0 0 0 0 1\n1 0 0 0 1 0\n", Style::Positions);
        assert_eq!(normals.dimension, 3);
        assert_eq!(normals.normals, Some(vec![0.0, 0.0, 1.0, 0.0, 1.0, 0.0]));
        let colours = points("0 0 0 255 0 1\n", Style::Positions);
        assert_eq!((colours.normals, colours.notes.len()), (None, 1));
        assert_eq!(points("0,0,0,255,0,1\n", Style::Columns).dimension, 6);
    }

    #[test]
    fn names_choose_columns() {
        let csv = points("label;\"Z\";y;x\na;3;2;1\nb;6;5;4\n", Style::Columns);
        assert_eq!(csv.coordinates, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let five = points("x1 x2 x3 x4 x5\n1 2 3 4 5\n", Style::Positions);
        assert_eq!(five.dimension, 5);
    }

    #[test]
    fn columns_beside_named_coordinates_are_left_out_and_named() {
        for (names, coordinates) in [
            ("x,y,cost", "x, y"),
            ("Y,cost,X", "Y, X"),
            ("cost,x,z", "x, z"),
            ("x1,x2,cost", "x1, x2"),
            ("x1,x2,x4", "x1, x2"),
        ] {
            let csv = points(&format!("{names}\n1,2,3\n4,5,6\n"), Style::Columns);
            assert_eq!(csv.dimension, 2, "{names}");
            let [note] = &csv.notes[..] else {
                panic!("{names}: {:?}", csv.notes)
            };
            let left_out = names.split(',').find(|name| !coordinates.contains(name));
            let expected = format!("columns ignored: {};", left_out.unwrap());
            assert!(note.starts_with(&expected), "{note}");
            assert!(
                note.contains(&format!("coordinates are {coordinates},")),
                "{note}"
            );
        }
        let asked = read(&b"x,y,cost\n1,2,3\n"[..], Style::Columns, Some("cost")).unwrap();
        assert_eq!(asked.coordinates, [1.0, 2.0]);
        assert_eq!((asked.column, asked.notes.len()), (Some(vec![3.0]), 0));
        let swapped = points("y,x\n1,2\n", Style::Columns);
        assert_eq!(
            (swapped.coordinates, swapped.notes.len()),
            (vec![2.0, 1.0], 0)
        );
        let flat = points("x,y,nx,ny\n1,2,0,1\n", Style::Columns);
        assert_eq!(flat.coordinates, [1.0, 2.0]);
        assert_eq!((flat.normals, flat.notes.len()), (Some(vec![0.0, 1.0]), 0));
        let whole = points("x,y,z,cost\n1,2,3,4\n", Style::Columns);
        assert_eq!((whole.dimension, whole.notes.len()), (3, 0));
    }

    #[test]
    fn decimal_commas_are_refused() {
        let fault = read(&b"1,5;2,5;3,5\n"[..], Style::Positions, None).unwrap_err();
        assert!(matches!(fault, Fault::Malformed { .. }));
    }
}
