//! Lines, fields and numbers of text formats.

use std::io::{BufRead, Read};

use crate::error::{Fault, quoted};

const NUMBER_REMEDY: &str = "write numbers with a decimal point, such as -1.5e-3";

/// The bytes of a file from `start` on as text.
pub(crate) fn text_behind(file: &[u8], start: usize) -> Result<&str, Fault> {
    let at = |offset: usize| not_text((start + offset) as u64);
    let text = std::str::from_utf8(&file[start..]).map_err(|error| at(error.valid_up_to()))?;
    match text.find('\0') {
        Some(offset) => Err(at(offset)),
        None => Ok(text),
    }
}

fn not_text(offset: u64) -> Fault {
    Fault::byte(
        offset,
        "bytes that are not text",
        "UTF-8 or ASCII",
        "save the file as UTF-8, or name its format with --format NAME if it is binary",
    )
}

/// Bytes of the longest line that is read: no row of numbers comes near.
pub(crate) const LONGEST_LINE: usize = 1 << 20;

/// The refusal of a line that is longer.
pub(crate) fn too_long(line: usize) -> Fault {
    Fault::line(
        line,
        format!("more than {LONGEST_LINE} bytes"),
        format!("a line of at most {LONGEST_LINE} bytes"),
        "write each point on a line of its own, or name the format with --format NAME if the file is no text",
    )
}

/// The lines of a text that carry content, one at a time: `#` starts a comment anywhere, `//` at a
/// line's start; blank lines are left out, and so is a byte-order mark.
pub(crate) struct Lines<R> {
    source: R,
    text: String,
    /// Lines read.
    read: usize,
    /// Bytes before the line in hand.
    offset: u64,
}

impl<R: BufRead> Lines<R> {
    pub fn new(source: R) -> Self {
        Self {
            source,
            text: String::new(),
            read: 0,
            offset: 0,
        }
    }

    /// The next line that carries content, with its number, the first is 1.
    pub fn next(&mut self) -> Result<Option<(usize, &str)>, Fault> {
        while self.advance()? {
            if !content(&self.text).is_empty() {
                return Ok(Some((self.read, content(&self.text))));
            }
        }
        Ok(None)
    }

    /// Lines read so far.
    pub fn read(&self) -> usize {
        self.read
    }

    /// Whether there was another line.
    fn advance(&mut self) -> Result<bool, Fault> {
        const MARK: &[u8] = b"\xef\xbb\xbf";
        self.offset += self.text.len() as u64;
        let mut bytes = std::mem::take(&mut self.text).into_bytes();
        bytes.clear();
        let mut source = self.source.by_ref().take(LONGEST_LINE as u64 + 1);
        if source.read_until(b'\n', &mut bytes)? == 0 {
            return Ok(false);
        }
        if bytes.len() > LONGEST_LINE {
            return Err(too_long(self.read + 1));
        }
        if self.read == 0 && bytes.starts_with(MARK) {
            bytes.drain(..MARK.len());
            self.offset = MARK.len() as u64;
        }
        self.read += 1;
        let at = |offset: usize| not_text(self.offset + offset as u64);
        let zero = bytes.iter().position(|byte| *byte == 0);
        let valid = std::str::from_utf8(&bytes).map_or_else(|e| e.valid_up_to(), str::len);
        if let Some(zero) = zero.filter(|zero| *zero < valid) {
            return Err(at(zero));
        }
        self.text = String::from_utf8(bytes).map_err(|_| at(valid))?;
        Ok(true)
    }
}

/// A line without its comment and the white space round it.
fn content(line: &str) -> &str {
    let line = match line.find('#') {
        Some(end) => &line[..end],
        None => line,
    };
    let line = line.trim_ascii();
    if line.starts_with("//") { "" } else { line }
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
    /// The separator of the row: semicolons before commas (which may be meant as decimal commas)
    /// before white space.
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

/// The fields of a row, without the quotes and white space round them. One separator at the row's
/// end is no field.
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

    fn lines(bytes: &[u8]) -> Result<Vec<(usize, String)>, Fault> {
        let mut lines = Lines::new(bytes);
        let mut all = Vec::new();
        while let Some((number, line)) = lines.next()? {
            all.push((number, line.to_owned()));
        }
        Ok(all)
    }

    #[test]
    fn lines_keep_their_numbers() {
        let found = lines(b"# a\n\n1 2 # b\r\n// c\n3").unwrap();
        assert_eq!(found, [(3, "1 2".to_owned()), (5, "3".to_owned())]);
    }

    #[test]
    fn lines_have_a_longest() {
        let mut text = vec![b' '; LONGEST_LINE - 1];
        text.push(b'\n');
        text.extend(b"7\n");
        assert_eq!(lines(&text).unwrap(), [(2, "7".to_owned())]);
        text.insert(0, b' ');
        let Err(Fault::Malformed { place, .. }) = lines(&text) else {
            panic!("accepted");
        };
        assert_eq!(place, crate::Place::Line(1));
    }

    #[test]
    fn binary_is_not_text() {
        assert_eq!(lines(b"\xef\xbb\xbf1 2").unwrap(), [(1, "1 2".to_owned())]);
        for (bytes, at) in [
            (&b"1 2\n\0"[..], 4),
            (b"\xff\xfe1", 0),
            (b"\xef\xbb\xbf1\n2\xff", 6),
        ] {
            let Err(Fault::Malformed { place, .. }) = lines(bytes) else {
                panic!("accepted {bytes:?}");
            };
            assert_eq!(place, crate::Place::Byte(at));
        }
    }
}
