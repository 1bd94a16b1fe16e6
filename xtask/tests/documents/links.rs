//! Links from documents to files of ours, and to their headings.

use std::io;
use std::path::Path;

use crate::{files, none, prose, root};

/// The destinations of the links of a document outside of code, with the lines that they are on.
fn links(document: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (number, line) in prose(document) {
        // Every second part is code.
        let text: String = line.split('`').step_by(2).collect();
        for part in text.split("](").skip(1) {
            if let Some((destination, _)) = part.split_once(')') {
                found.push((number, destination.to_owned()));
            }
        }
    }
    found
}

/// The names by which the headings of a document are linked to.
fn anchors(document: &str) -> Vec<String> {
    let headings = prose(document).filter_map(|(_, line)| {
        let text = line.trim_start_matches('#');
        (text.len() < line.len()).then_some(text.strip_prefix(' ')?)
    });
    headings.map(anchor).collect()
}

fn anchor(heading: &str) -> String {
    let kept = heading
        .trim()
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// What is wrong with a link in `file`, if anything.
fn mistake(file: &Path, destination: &str) -> io::Result<Option<String>> {
    if destination.contains("://") || destination.starts_with("mailto:") {
        return Ok(None);
    }
    let (path, heading) = destination.split_once('#').unwrap_or((destination, ""));
    let target = match path {
        "" => file.to_owned(),
        path => file.parent().unwrap_or(file).join(path),
    };
    if !target.exists() {
        return Ok(Some(format!("there is no file {destination}")));
    }
    if heading.is_empty() || target.extension().is_none_or(|extension| extension != "md") {
        return Ok(None);
    }
    let headings = anchors(&std::fs::read_to_string(&target)?);
    let is_there = headings.iter().any(|anchor| anchor == heading);
    Ok((!is_there).then(|| format!("there is no heading {destination}")))
}

#[test]
fn links_lead_to_files_and_headings() -> io::Result<()> {
    let mut mistakes = Vec::new();
    for file in files(&root(), &["md"])? {
        for (line, destination) in links(&std::fs::read_to_string(&file)?) {
            if let Some(mistake) = mistake(&file, &destination)? {
                mistakes.push(format!("{}:{line}: {mistake}", file.display()));
            }
        }
    }
    none(&mistakes);
    Ok(())
}

#[test]
fn sources_name_documents_that_are_there() -> io::Result<()> {
    let mut mistakes = Vec::new();
    for file in files(&root(), &["rs", "toml", "py"])? {
        let text = std::fs::read_to_string(&file)?;
        for (number, line) in (1..).zip(text.lines()) {
            for (place, _) in line.match_indices("docs/") {
                let in_path = |c: char| c.is_ascii_alphanumeric() || "/-_.".contains(c);
                let rest = &line[place..];
                let end = rest.find(|c| !in_path(c)).unwrap_or(rest.len());
                let path = rest[..end].trim_end_matches('.');
                let is_document = path.ends_with(".md") || path.ends_with(".png");
                if is_document && !root().join(path).exists() {
                    mistakes.push(format!("{}:{number}: there is no {path}", file.display()));
                }
            }
        }
    }
    none(&mistakes);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_found_outside_of_code() {
        let document = "[a](b.md#c), `[d](e)` and ![f](g.png)\n```\n[h](i)\n```\n";
        let expected = [(1, "b.md#c".to_owned()), (1, "g.png".to_owned())];
        assert_eq!(links(document), expected);
    }

    #[test]
    fn headings_have_anchors() {
        let document = "# What each `number` promises, so far\n```\n# no heading\n```\n";
        assert_eq!(anchors(document), ["what-each-number-promises-so-far"]);
    }

    #[test]
    fn a_link_to_nothing_fails() -> io::Result<()> {
        let readme = root().join("README.md");
        assert_eq!(mistake(&readme, "docs/ARCHITECTURE.md#arrows")?, None);
        assert!(mistake(&readme, "docs/ARCHITECTURE.md#bows")?.is_some());
        assert!(mistake(&readme, "NOTHING.md")?.is_some());
        Ok(())
    }
}
