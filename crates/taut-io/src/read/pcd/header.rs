//! The header of a PCD file.

use crate::error::{Fault, quoted};
use crate::text::{LONGEST_LINE, too_long};

/// The kind of a field's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Float4,
    Float8,
    Signed(usize),
    Unsigned(usize),
}

impl Kind {
    pub(super) fn size(self) -> usize {
        match self {
            Kind::Float4 => 4,
            Kind::Float8 => 8,
            Kind::Signed(size) | Kind::Unsigned(size) => size,
        }
    }

    /// The number at the start of `bytes`; `None` where there are too few.
    pub(super) fn decode(self, bytes: &[u8]) -> Option<f64> {
        let bytes = bytes.get(..self.size())?;
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        let unsigned = u64::from_le_bytes(wide);
        Some(match self {
            Kind::Float4 => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
            Kind::Float8 => f64::from_bits(unsigned),
            Kind::Unsigned(_) => unsigned as f64,
            Kind::Signed(size) => {
                let unused = 64 - 8 * size as u32;
                ((unsigned << unused) as i64 >> unused) as f64
            }
        })
    }
}

/// Numbers of one name, `count` for each point.
#[derive(Debug)]
pub(super) struct Field {
    name: String,
    pub(super) kind: Kind,
    pub(super) count: usize,
    /// Bytes before it in a point's record.
    pub(super) offset: usize,
    /// Numbers before it in a point's row of text.
    pub(super) column: usize,
}

/// How the points are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Data {
    Ascii,
    Binary,
    BinaryCompressed,
}

/// The header's meaning.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    pub(super) positions: [usize; 3],
    pub(super) points: usize,
    pub(super) data: Data,
    /// Bytes of a point.
    pub(super) record: usize,
    /// Numbers in a point's row of text.
    pub(super) columns: usize,
    /// Bytes and lines before the first point.
    pub(super) body_offset: usize,
    pub(super) lines: usize,
}

/// A line of the header: its number, its key, the words behind.
struct Entry<'a> {
    line: usize,
    key: &'a str,
    words: Vec<&'a str>,
}

/// The header's lines as they stand in the file.
struct Raw<'a> {
    entries: Vec<Entry<'a>>,
    body_offset: usize,
    lines: usize,
}

impl<'a> Raw<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, Fault> {
        let mut entries = Vec::new();
        let mut body_offset = 0;
        for (index, line) in bytes.split_inclusive(|byte| *byte == b'\n').enumerate() {
            if line.len() > LONGEST_LINE {
                return Err(too_long(index + 1));
            }
            body_offset += line.len();
            let text = std::str::from_utf8(line).map_err(|_| {
                wrong(
                    index + 1,
                    quoted(&String::from_utf8_lossy(line)),
                    "a line of a PCD header",
                )
            })?;
            let mut words = text
                .split('#')
                .next()
                .unwrap_or_default()
                .split_ascii_whitespace();
            let Some(key) = words.next() else { continue };
            entries.push(Entry {
                line: index + 1,
                key,
                words: words.collect(),
            });
            if key == "DATA" {
                let lines = index + 1;
                return Ok(Self {
                    entries,
                    body_offset,
                    lines,
                });
            }
        }
        let lines = bytes.split(|byte| *byte == b'\n').count();
        Err(wrong(
            lines,
            "the end of the file".to_owned(),
            "a line DATA at the end of the header",
        ))
    }

    fn entry(&self, key: &'static str) -> Result<&Entry<'a>, Fault> {
        let expected = format!("a line {key} in the header");
        let missing = || wrong(self.lines, "the header's end".to_owned(), &expected);
        self.entries
            .iter()
            .find(|entry| entry.key == key)
            .ok_or_else(missing)
    }

    /// One value for each field.
    fn for_each_field<T>(
        &self,
        key: &'static str,
        fields: usize,
        expected: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<Vec<T>, Fault> {
        let entry = self.entry(key)?;
        if entry.words.len() != fields {
            let found = format!("{} entries in {key}", entry.words.len());
            return Err(wrong(
                entry.line,
                found,
                &format!("{fields}, one for each of FIELDS"),
            ));
        }
        let value =
            |word: &&str| parse(word).ok_or_else(|| wrong(entry.line, quoted(word), expected));
        entry.words.iter().map(value).collect()
    }

    fn number(&self, key: &'static str) -> Result<usize, Fault> {
        let entry = self.entry(key)?;
        match entry.words.as_slice() {
            [word] => word.parse().ok(),
            _ => None,
        }
        .ok_or_else(|| {
            wrong(
                entry.line,
                quoted(&entry.words.join(" ")),
                &format!("one whole number behind {key}"),
            )
        })
    }
}

fn wrong(line: usize, found: String, expected: &str) -> Fault {
    Fault::line(
        line,
        found,
        expected,
        "correct the header or export the file again",
    )
}

impl Header {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        let raw = Raw::parse(bytes)?;
        let names = raw.entry("FIELDS")?;
        let fields = fields(&raw, &names.words)?;
        let position_of = |name: &str| {
            fields
                .iter()
                .position(|field| field.name == name && field.count == 1)
        };
        let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(position_of) else {
            return Err(wrong(
                names.line,
                format!("the fields {}", names.words.join(" ")),
                "x, y and z among FIELDS",
            ));
        };
        let overflow = |what: &str| {
            wrong(
                names.line,
                format!("{what} of more bytes than can be"),
                "a record that fits",
            )
        };
        let last = &fields[fields.len() - 1];
        let record = last
            .count
            .checked_mul(last.kind.size())
            .and_then(|bytes| bytes.checked_add(last.offset))
            .ok_or_else(|| overflow("points"))?;
        let columns = last
            .column
            .checked_add(last.count)
            .ok_or_else(|| overflow("rows"))?;
        Ok(Self {
            positions: [x, y, z],
            points: point_count(&raw)?,
            data: data(&raw)?,
            record,
            columns,
            body_offset: raw.body_offset,
            lines: raw.lines,
            fields,
        })
    }

    /// The fields of a point's normal, where all three are there.
    pub(super) fn normals(&self) -> Option<[usize; 3]> {
        let position_of = |name: &str| {
            self.fields
                .iter()
                .position(|field| field.name == name && field.count == 1)
        };
        Some([
            position_of("normal_x")?,
            position_of("normal_y")?,
            position_of("normal_z")?,
        ])
    }
}

fn fields(raw: &Raw<'_>, names: &[&str]) -> Result<Vec<Field>, Fault> {
    let sizes = raw.for_each_field("SIZE", names.len(), "1, 2, 4 or 8", |word| {
        word.parse::<usize>().ok()
    })?;
    let types = raw.for_each_field("TYPE", names.len(), "I, U or F", |word| {
        matches!(word, "I" | "U" | "F").then(|| word.to_owned())
    })?;
    let counts = match raw.entry("COUNT") {
        Ok(_) => raw.for_each_field("COUNT", names.len(), "a whole number above 0", |word| {
            word.parse::<usize>().ok().filter(|count| *count > 0)
        })?,
        Err(_) => vec![1; names.len()],
    };
    let line = raw.entry("SIZE")?.line;
    let mut offset = 0_usize;
    let mut column = 0_usize;
    let mut fields = Vec::with_capacity(names.len());
    for (((name, size), kind), count) in names.iter().zip(sizes).zip(types).zip(counts) {
        let kind = match (kind.as_str(), size) {
            ("F", 4) => Kind::Float4,
            ("F", 8) => Kind::Float8,
            ("I", 1 | 2 | 4 | 8) => Kind::Signed(size),
            ("U", 1 | 2 | 4 | 8) => Kind::Unsigned(size),
            _ => {
                return Err(wrong(
                    line,
                    format!("type {kind} of size {size}"),
                    "F of 4 or 8, I or U of 1, 2, 4 or 8",
                ));
            }
        };
        fields.push(Field {
            name: (*name).to_owned(),
            kind,
            count,
            offset,
            column,
        });
        let bytes = count
            .checked_mul(size)
            .and_then(|bytes| offset.checked_add(bytes));
        (offset, column) = bytes.zip(column.checked_add(count)).ok_or_else(|| {
            wrong(
                line,
                format!("{count} numbers in the field {name}"),
                "a record that fits in memory",
            )
        })?;
    }
    Ok(fields)
}

/// POINTS decides where writers disagree with themselves; old files have only WIDTH and HEIGHT.
fn point_count(raw: &Raw<'_>) -> Result<usize, Fault> {
    if raw.entry("POINTS").is_ok() {
        return raw.number("POINTS");
    }
    let (width, height) = (raw.number("WIDTH")?, raw.number("HEIGHT")?);
    width.checked_mul(height).ok_or_else(|| {
        let found = format!("a grid of {width} by {height} points");
        wrong(raw.lines, found, "a grid that fits in memory")
    })
}

fn data(raw: &Raw<'_>) -> Result<Data, Fault> {
    let entry = raw.entry("DATA")?;
    match entry.words.as_slice() {
        ["ascii"] => Ok(Data::Ascii),
        ["binary"] => Ok(Data::Binary),
        ["binary_compressed"] => Ok(Data::BinaryCompressed),
        words => Err(wrong(
            entry.line,
            quoted(&words.join(" ")),
            "ascii, binary or binary_compressed",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::Kind;

    #[test]
    fn integers_keep_their_sign() {
        assert_eq!(Kind::Signed(2).decode(&[0xfe, 0xff]), Some(-2.0));
        assert_eq!(Kind::Unsigned(2).decode(&[0xfe, 0xff]), Some(65534.0));
        assert_eq!(Kind::Signed(8).decode(&[0xff; 8]), Some(-1.0));
        assert_eq!(Kind::Signed(4).decode(&[0xff; 3]), None);
    }
}
