//! Lines, fields and numbers of text formats, parsed from one buffer.

use crate::error::{Fault, quoted};

const NUMBER_REMEDY: &str = "write numbers with a decimal point, such as -1.5e-3";

/// A file's bytes as text, without a byte-order mark.
pub(crate) fn as_text(bytes: &[u8]) -> Result<&str, Fault> {
    const MARK: &[u8] = b"\xef\xbb\xbf";
    let start = if bytes.starts_with(MARK) {
        MARK.len()
    } else {
        0
    };
    text_behind(bytes, start)
}

/// The bytes of a file from `start` on as text.
pub(crate) fn text_behind(file: &[u8], start: usize) -> Result<&str, Fault> {
    let not_text = |offset: usize| {
        Fault::byte(
            (start + offset) as u64,
            "bytes that are not text",
            "UTF-8 or ASCII",
            "save the file as UTF-8, or name its format with --format NAME if it is binary",
        )
    };
    let text =
        std::str::from_utf8(&file[start..]).map_err(|error| not_text(error.valid_up_to()))?;
    match text.find('\0') {
        Some(offset) => Err(not_text(offset)),
        None => Ok(text),
    }
}

/// The lines that carry content, each with its number (the first is 1): `#` starts a comment anywhere, `//` at a line's
/// start; blank lines are left out.
pub(crate) fn content_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().filter_map(|(index, line)| {
        let line = match line.find('#') {
            Some(end) => &line[..end],
            None => line,
        };
        let line = line.trim_ascii();
        (!line.is_empty() && !line.starts_with("//")).then_some((index + 1, line))
    })
}

/// One number of a text file; `nan` and `inf` are numbers here.
pub(crate) fn number(field: &str, line: usize) -> Result<f64, Fault> {
    field
        .parse()
        .map_err(|_| Fault::line(line, quoted(field), "a number", NUMBER_REMEDY))
}

/// The next of a line's fields as a number.
pub(crate) fn next_number<'a>(
    fields: &mut impl Iterator<Item = &'a str>,
    line: usize,
    expected: &str,
) -> Result<f64, Fault> {
    let Some(field) = fields.next() else {
        return Err(Fault::line(
            line,
            "the end of the line",
            expected,
            "complete the line or remove it",
        ));
    };
    number(field, line)
}

/// What stands between the fields of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    White,
    Comma,
    Semicolon,
}

impl Separator {
    /// The separator of the row: semicolons before commas (which may be meant as decimal commas) before white space.
    pub(crate) fn of(row: &str) -> Self {
        if row.contains(';') {
            Separator::Semicolon
        } else if row.contains(',') {
            Separator::Comma
        } else {
            Separator::White
        }
    }

    pub(crate) fn fields(self, row: &str) -> Fields<'_> {
        Fields {
            separator: self,
            rest: Some(row),
        }
    }
}

/// The fields of a row, without the quotes and white space round them. One separator at the row's end is no field.
pub(crate) struct Fields<'a> {
    separator: Separator,
    rest: Option<&'a str>,
}

impl<'a> Iterator for Fields<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let rest = self.rest?.trim_ascii_start();
        if rest.is_empty() {
            self.rest = None;
            return None;
        }
        let end = match self.separator {
            Separator::White => rest.bytes().position(|byte| byte.is_ascii_whitespace()),
            Separator::Comma => rest.bytes().position(|byte| byte == b','),
            Separator::Semicolon => rest.bytes().position(|byte| byte == b';'),
        };
        let field = match end {
            Some(end) => {
                self.rest = Some(&rest[end + 1..]);
                &rest[..end]
            }
            None => {
                self.rest = None;
                rest
            }
        };
        Some(field.trim_ascii_end().trim_matches('"'))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_follow_the_separator() {
        let fields = |row| Separator::of(row).fields(row).collect::<Vec<_>>();
        assert_eq!(fields("1 \t2  3 "), ["1", "2", "3"]);
        assert_eq!(fields("1, 2 ,,\"4\","), ["1", "2", "", "4"]);
        assert_eq!(fields("1,5; 2,5"), ["1,5", "2,5"]);
    }

    #[test]
    fn content_lines_keep_their_numbers() {
        let lines: Vec<_> = content_lines("# a\n\n1 2 # b\r\n// c\n3").collect();
        assert_eq!(lines, [(3, "1 2"), (5, "3")]);
    }

    #[test]
    fn binary_is_not_text() {
        assert!(as_text(b"\xef\xbb\xbf1 2").is_ok_and(|text| text == "1 2"));
        assert!(as_text(b"1 2\0").is_err());
        assert!(as_text(b"\xff\xfe1").is_err());
    }
}
