//! Thresholds in the pages on the method.
//!
//! A page ends with the heading [`HEADING`] and a table whose rows begin with the name of a
//! constant, the file that defines it, and its value, each as code. Above the table the text names
//! every such constant, as in `` `DETOUR` = 1.1 ``, and no other.

use std::collections::BTreeMap;
use std::io;

use crate::{files, none, prose, root};

const HEADING: &str = "## Thresholds";
/// Pages about no algorithm.
const WITHOUT: [&str; 1] = ["sources.md"];

/// A row of a table of thresholds.
#[derive(Debug, PartialEq)]
struct Row {
    line: usize,
    name: String,
    file: String,
    value: String,
}

/// What a page says about thresholds.
struct Page {
    rows: Vec<Row>,
    /// The constants that the text names: the line, the name, and the value if there is one.
    named: Vec<(usize, String, Option<String>)>,
    mistakes: Vec<String>,
}

impl Page {
    fn read(name: &str, text: &str) -> Self {
        let (mut rows, mut mistakes) = (Vec::new(), Vec::new());
        let (mut above, mut starts) = (String::new(), Vec::new());
        let mut in_table = false;
        for (line, content) in prose(text) {
            in_table |= content == HEADING;
            if in_table && content.starts_with("| `") {
                match row(line, content) {
                    Some(row) => rows.push(row),
                    None => mistakes.push(format!(
                        "{name}:{line}: expected a constant, its file and its value, each as code"
                    )),
                }
            } else if !in_table {
                starts.push((above.len(), line));
                above.push_str(content);
                above.push('\n');
            }
        }
        let line = |place: usize| {
            let next = starts.partition_point(|(start, _)| *start <= place);
            next.checked_sub(1).map_or(1, |last| starts[last].1)
        };
        let named = named(&above).into_iter();
        let named = named.map(|(place, name, value)| (line(place), name, value));
        Self {
            rows,
            named: named.collect(),
            mistakes,
        }
    }

    /// What is wrong with the page, where `source` gives the text of a file of ours.
    fn mistakes(mut self, page: &str, source: impl Fn(&str) -> Option<String>) -> Vec<String> {
        let mut mistakes = std::mem::take(&mut self.mistakes);
        if self.rows.is_empty() && !WITHOUT.contains(&page) {
            mistakes.push(format!(
                "{page}: found no threshold, expected a table below {HEADING}"
            ));
        }
        for row in &self.rows {
            let of_row = |what: String| format!("{page}:{}: {what}", row.line);
            let Row { name, file, .. } = row;
            match source(file).map(|text| constants(&text)) {
                None => mistakes.push(of_row(format!("there is no file {file}"))),
                Some(constants) => match constants.get(name) {
                    None => mistakes.push(of_row(format!("{file} has no constant {name}"))),
                    Some(value) if !same(value, &row.value) => mistakes.push(of_row(format!(
                        "found {name} = {}, expected {value} as in {file}",
                        row.value
                    ))),
                    Some(_) => {}
                },
            }
            if !self.named.iter().any(|(_, named, _)| named == name) {
                mistakes.push(of_row(format!(
                    "{name} is in the table but not in the text"
                )));
            }
        }
        for (line, name, value) in &self.named {
            let mut rows = self.rows.iter().filter(|row| row.name == *name).peekable();
            if rows.peek().is_none() {
                mistakes.push(format!("{page}:{line}: {name} is not in the table"));
            } else if let Some(value) = value
                && !rows.any(|row| same(&row.value, value))
            {
                mistakes.push(format!(
                    "{page}:{line}: {name} = {value} is not the value in the table"
                ));
            }
        }
        mistakes
    }
}

/// The first three cells of a row, which hold code.
fn row(line: usize, content: &str) -> Option<Row> {
    let mut cells = content.split('|').skip(1);
    let mut code = || {
        let cell = cells.next()?.trim();
        Some(cell.strip_prefix('`')?.strip_suffix('`')?.to_owned())
    };
    Some(Row {
        line,
        name: code()?,
        file: code()?,
        value: code()?,
    })
}

/// The constants named in a text: the place, the name, and the number behind it if there is one.
fn named(text: &str) -> Vec<(usize, String, Option<String>)> {
    let mut found = Vec::new();
    let mut place = 0;
    let mut parts = text.split('`').peekable();
    let mut is_code = false;
    while let Some(part) = parts.next() {
        if is_code && is_constant(part) {
            let rest = parts.peek().copied().unwrap_or_default();
            let value = rest.trim_start().strip_prefix("= ");
            let value = value.and_then(|value| value.split_whitespace().next());
            let value =
                value.map(|value| value.trim_end_matches([',', '.', ';', ':', ')']).to_owned());
            found.push((place, part.to_owned(), value));
        }
        place += part.len() + 1;
        is_code = !is_code;
    }
    found
}

fn is_constant(code: &str) -> bool {
    let in_name = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
    code.len() > 2
        && code.starts_with(|c: char| c.is_ascii_uppercase())
        && code.chars().all(in_name)
}

/// A declaration without the word that says who sees it.
fn visible(declaration: &str) -> &str {
    let Some(rest) = declaration.strip_prefix("pub") else {
        return declaration;
    };
    let to_some = rest.strip_prefix('(').and_then(|rest| rest.split_once(')'));
    to_some.map_or(rest, |(_, rest)| rest).trim_start()
}

/// The constants of a source, with their values as they are written.
fn constants(source: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut lines = source.lines();
    while let Some(line) = lines.next() {
        let Some(rest) = visible(line.trim()).strip_prefix("const ") else {
            continue;
        };
        let Some((declared, value)) = rest.split_once(" =") else {
            continue;
        };
        let Some((name, _)) = declared.split_once(':') else {
            continue;
        };
        let mut value = value.trim().to_owned();
        while !value.ends_with(';') {
            let Some(next) = lines.next() else { break };
            value.push_str(next.trim());
        }
        found.insert(name.to_owned(), value.trim_end_matches(';').to_owned());
    }
    found
}

/// Whether two values are the same number, or the same but for blanks and last commas.
fn same(a: &str, b: &str) -> bool {
    let number = |text: &str| text.replace(['_', ','], "").parse::<f64>().ok();
    let bare = |text: &str| {
        let kept: String = text.chars().filter(|c| !c.is_whitespace()).collect();
        kept.replace(",]", "]")
    };
    match (number(a), number(b)) {
        (Some(a), Some(b)) => a == b,
        _ => bare(a) == bare(b),
    }
}

#[test]
fn pages_agree_with_the_code() -> io::Result<()> {
    let folder = root().join("docs/method");
    let mut mistakes = Vec::new();
    for file in files(&folder, &["md"])? {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let page = Page::read(&name, &std::fs::read_to_string(&file)?);
        let source = |name: &str| std::fs::read_to_string(root().join(name)).ok();
        mistakes.extend(page.mistakes(&name, source));
    }
    none(&mistakes);
    Ok(())
}

#[test]
fn every_page_is_in_the_list_of_pages() -> io::Result<()> {
    let list = std::fs::read_to_string(root().join("docs/method.md"))?;
    let mut mistakes = Vec::new();
    for file in files(&root().join("docs/method"), &["md"])? {
        let link = format!(
            "](method/{})",
            file.file_name().unwrap_or_default().to_string_lossy()
        );
        if !list.contains(&link) {
            mistakes.push(format!(
                "docs/method.md: found no link to {}",
                file.display()
            ));
        }
    }
    none(&mistakes);
    Ok(())
}

#[test]
fn a_name_has_one_value() -> io::Result<()> {
    let mut values: BTreeMap<String, (String, String)> = BTreeMap::new();
    let mut mistakes = Vec::new();
    for file in files(&root().join("crates/taut-core/src"), &["rs"])? {
        let text = std::fs::read_to_string(&file)?;
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        for (name, value) in constants(code) {
            let place = file.display().to_string();
            let (first, known) = values
                .entry(name.clone())
                .or_insert((place.clone(), value.clone()));
            if !same(known, &value) {
                mistakes.push(format!(
                    "{name} is {known} in {first} and {value} in {place}"
                ));
            }
        }
    }
    none(&mistakes);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "/// Far.\npub(in crate::field) const FAR: f64 = 1e-3;\n\
                          const SIZES: [f64; 2] = [\n    0.5,\n    1.0,\n];\n    pub const MANY: usize = 16_000;\n";

    /// What is wrong with a page of one table, about `a.rs`.
    fn mistakes(text: &str, rows: &[&str]) -> Vec<String> {
        let page = format!("# Page\n\n{text}\n\n{HEADING}\n\n{}\n", rows.join("\n"));
        let source = |name: &str| (name == "a.rs").then(|| SOURCE.to_owned());
        Page::read("p.md", &page).mistakes("p.md", source)
    }

    #[test]
    fn what_agrees_passes() {
        let rows = [
            "| `FAR` | `a.rs` | `0.001` | far |",
            "| `SIZES` | `a.rs` | `[0.5, 1.0]` | sizes |",
            "| `MANY` | `a.rs` | `16_000` | many |",
        ];
        let text = "It is `FAR` =\n1e-3. There are `SIZES`, and (`MANY` = 16,000).";
        assert_eq!(mistakes(text, &rows), Vec::<String>::new());
    }

    #[test]
    fn a_wrong_value_name_or_file_fails() {
        let text = "It is `FAR`.";
        for row in [
            "| `FAR` | `a.rs` | `0.002` | far |",
            "| `FAR` | `b.rs` | `0.001` | far |",
            "| `FAR` | `a.rs` | 0.001 | far |",
            "| `FAR_OFF` | `a.rs` | `0.001` | far |",
        ] {
            assert!(!mistakes(text, &[row]).is_empty(), "{row}");
        }
    }

    #[test]
    fn text_and_table_name_the_same_constants() {
        let row = "| `FAR` | `a.rs` | `0.001` | far |";
        let expected = ["p.md:3: FAR = 0.002 is not the value in the table"];
        assert_eq!(mistakes("It is `FAR` = 0.002.", &[row]), expected);
        let expected = ["p.md:3: MANY is not in the table"];
        assert_eq!(mistakes("`FAR`, `MANY`", &[row]), expected);
        let expected = ["p.md:7: FAR is in the table but not in the text"];
        assert_eq!(mistakes("Nothing.", &[row]), expected);
    }

    #[test]
    fn a_page_without_thresholds_fails() {
        assert_eq!(mistakes("Nothing.", &[]).len(), 1);
        let source = |_: &str| None;
        let sources = Page::read("sources.md", "# Sources\n");
        assert!(sources.mistakes("sources.md", source).is_empty());
    }
}
