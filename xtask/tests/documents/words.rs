//! The glossary: every name in the code that it tells is in the code.

use std::collections::BTreeSet;
use std::io;

use crate::{files, none, prose, root};

/// The rows of tables with four cells, with the line that each is on.
fn rows(document: &str) -> Vec<(usize, Vec<String>)> {
    let cells = |line: &str| -> Vec<String> {
        let line = line.trim().trim_start_matches('|').trim_end_matches('|');
        line.split(" | ")
            .map(|cell| cell.trim().to_owned())
            .collect()
    };
    let rows = prose(document).filter(|(_, line)| line.starts_with("| "));
    let rows = rows.map(|(number, line)| (number, cells(line)));
    rows.filter(|(_, cells)| cells.len() == 4 && cells[0] != "word")
        .collect()
}

/// The parts of a text between back quotes.
fn code(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// What is wrong with a glossary, where `known` are the words of the code.
fn mistakes(glossary: &str, known: &BTreeSet<String>) -> Vec<String> {
    let mut mistakes = Vec::new();
    let mut words = BTreeSet::new();
    for (line, cells) in rows(glossary) {
        let [word, meaning, _, names] = &cells[..] else {
            continue;
        };
        if !words.insert(word.clone()) {
            mistakes.push(format!("glossary.md:{line}: {word} is there twice"));
        }
        if !meaning.ends_with('.') || meaning.matches(". ").count() > 0 {
            mistakes.push(format!(
                "glossary.md:{line}: the meaning of {word} is not one sentence"
            ));
        }
        if code(names).next().is_none() {
            mistakes.push(format!(
                "glossary.md:{line}: {word} has no name in the code"
            ));
        }
        for name in code(names).filter(|name| !known.contains(*name)) {
            mistakes.push(format!("glossary.md:{line}: the code has no {name}"));
        }
    }
    mistakes
}

#[test]
fn names_are_in_the_code() -> io::Result<()> {
    let mut known = BTreeSet::new();
    for file in files(&root().join("crates"), &["rs"])? {
        let text = std::fs::read_to_string(&file)?;
        let in_word = |c: char| c.is_alphanumeric() || c == '_';
        known.extend(text.split(|c| !in_word(c)).map(str::to_owned));
    }
    let glossary = std::fs::read_to_string(root().join("docs/glossary.md"))?;
    assert!(rows(&glossary).len() > 50, "the glossary has no rows");
    none(&mistakes(&glossary, &known));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mistakes_of(rows: &str) -> usize {
        let known = BTreeSet::from(["Chart".to_owned()]);
        mistakes(
            &format!("| word | meaning | symbol | name |\n|---|---|---|---|\n{rows}"),
            &known,
        )
        .len()
    }

    #[test]
    fn a_row_must_be_whole() {
        assert_eq!(
            mistakes_of("| chart | A chart is a chart. | – | `Chart` |"),
            0
        );
        assert_eq!(
            mistakes_of("| chart | A chart is a chart. | – | `Map` |"),
            1
        );
        assert_eq!(mistakes_of("| chart | A chart is a chart. | – | – |"), 1);
        assert_eq!(
            mistakes_of("| chart | A chart. It is one. | – | `Chart` |"),
            1
        );
        let twice = "| chart | A chart is a chart. | – | `Chart` |\n".repeat(2);
        assert_eq!(mistakes_of(&twice), 1);
    }
}
