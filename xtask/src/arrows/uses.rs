//! What modules and packages use, as far as paths in their texts tell.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::arrows::Arrow;

/// The modules of a package, a file each; those of tests are left out.
pub struct Sources {
    /// The paths that each module's text names, from the root of the package.
    paths: BTreeMap<String, BTreeSet<String>>,
}

impl Sources {
    /// Of texts by their paths below the folder of sources.
    pub fn new(files: &BTreeMap<PathBuf, String>) -> Self {
        let parsed: BTreeMap<String, Parsed> = files
            .iter()
            .map(|(file, text)| (module_of(file), Parsed::new(text)))
            .collect();
        let tests: Vec<String> = parsed
            .iter()
            .flat_map(|(module, parsed)| parsed.tests.iter().map(|name| join(module, name)))
            .collect();
        let is_test = |module: &str| {
            let inside = |test: &String| {
                let rest = module.strip_prefix(test.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
            };
            tests.iter().any(inside)
        };
        let kept = parsed
            .into_iter()
            .filter(|(module, _)| !module.is_empty() && !is_test(module));
        Self {
            paths: kept
                .map(|(module, parsed)| {
                    let paths = parsed.paths(&module);
                    (module, paths)
                })
                .collect(),
        }
    }

    pub fn has(&self, module: &str) -> bool {
        self.paths.contains_key(module)
    }

    /// Which file uses which other.
    pub fn arrows(&self) -> BTreeSet<Arrow> {
        let arrow = |from: &str, path: &str| {
            let to = self.file_of(path)?;
            (from != to).then(|| Arrow {
                from: from.to_owned(),
                to: to.to_owned(),
            })
        };
        let of_module = |(from, paths): (&String, &BTreeSet<String>)| {
            let arrows = paths.iter().filter_map(|path| arrow(from, path));
            arrows.collect::<Vec<_>>()
        };
        self.paths.iter().flat_map(of_module).collect()
    }

    /// The file that holds what a path names.
    fn file_of(&self, path: &str) -> Option<&str> {
        let mut path = path;
        loop {
            if let Some((file, _)) = self.paths.get_key_value(path) {
                return Some(file);
            }
            path = path.rsplit_once("::")?.0;
        }
    }
}

/// The module that a file holds; nothing for the root.
fn module_of(file: &Path) -> String {
    let without = file.with_extension("");
    let names: Vec<_> = without.iter().map(|name| name.to_string_lossy()).collect();
    let names: Vec<&str> = names
        .iter()
        .map(AsRef::as_ref)
        .filter(|name| !["mod", "lib", "main"].contains(name))
        .collect();
    names.join("::")
}

fn join(module: &str, name: &str) -> String {
    if module.is_empty() {
        name.to_owned()
    } else {
        format!("{module}::{name}")
    }
}

/// The words and signs of a text without what is compiled for tests alone.
struct Parsed {
    tokens: Vec<String>,
    /// Modules in files of their own.
    children: BTreeSet<String>,
    /// Those of them that are tests.
    tests: Vec<String>,
}

impl Parsed {
    fn new(text: &str) -> Self {
        let all = tokens(text);
        let mut parsed = Self {
            tokens: Vec::new(),
            children: BTreeSet::new(),
            tests: Vec::new(),
        };
        let mut at = 0;
        while at < all.len() {
            let rest = &all[at..];
            if starts(rest, &["#", "[", "cfg", "(", "test", ")", "]"]) {
                let item = &rest[7..];
                if let [keyword, name, end, ..] = item
                    && (keyword, end) == (&"mod".to_owned(), &";".to_owned())
                {
                    parsed.tests.push(name.clone());
                }
                at += 7 + length_of_item(item);
                continue;
            }
            if let [keyword, name, end, ..] = rest
                && (keyword, end) == (&"mod".to_owned(), &";".to_owned())
            {
                parsed.children.insert(name.clone());
            }
            parsed.tokens.push(all[at].clone());
            at += 1;
        }
        parsed
    }

    /// The paths from the root of the package that the text of a module names.
    fn paths(&self, module: &str) -> BTreeSet<String> {
        let mut paths = BTreeSet::new();
        let mut at = 0;
        while at < self.tokens.len() {
            let is_inner = at > 0 && self.tokens[at - 1] == "::";
            let start = match self.tokens[at].as_str() {
                _ if is_inner || !starts(&self.tokens[at + 1..], &["::"]) => None,
                "crate" => Some(String::new()),
                "self" => Some(module.to_owned()),
                "super" => Some(parent(module)),
                name if self.children.contains(name) => Some(join(module, name)),
                _ => None,
            };
            at += 1;
            if let Some(start) = start {
                at = self.branch(at, start, &mut paths);
            }
        }
        paths
    }

    /// Adds the paths that go on from a place where one ends; answers where they are read.
    fn branch(&self, mut at: usize, mut path: String, paths: &mut BTreeSet<String>) -> usize {
        while starts(&self.tokens[at..], &["::"]) {
            at += 1;
            match self.tokens.get(at).map(String::as_str) {
                Some("{") => return self.branches(at + 1, &path, paths),
                Some("super") => path = parent(&path),
                Some("self") => {}
                Some(name) if is_word(name) => path = join(&path, name),
                _ => break,
            }
            at += 1;
        }
        paths.insert(path);
        at
    }

    /// The same within braces, up to their end.
    fn branches(&self, mut at: usize, path: &str, paths: &mut BTreeSet<String>) -> usize {
        while let Some(token) = self.tokens.get(at) {
            match token.as_str() {
                "}" => return at + 1,
                "self" => {
                    paths.insert(path.to_owned());
                    at += 1;
                }
                name if is_word(name) => at = self.branch(at + 1, join(path, name), paths),
                _ => at += 1,
            }
        }
        at
    }
}

fn parent(module: &str) -> String {
    let found = module.rsplit_once("::");
    found.map_or_else(String::new, |(parent, _)| parent.to_owned())
}

fn starts(tokens: &[String], with: &[&str]) -> bool {
    tokens.len() >= with.len() && tokens.iter().zip(with).all(|(token, sign)| token == sign)
}

fn is_word(token: &str) -> bool {
    token
        .chars()
        .all(|letter| letter.is_alphanumeric() || letter == '_')
}

/// The number of tokens up to the end of an item: a semicolon or a closing brace.
fn length_of_item(tokens: &[String]) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate() {
        match token.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        let is_end = token == ";" || token == "}";
        if depth == 0 && is_end {
            return at + 1;
        }
    }
    tokens.len()
}

/// Words, and signs one by one except for the double colon; comments and texts are left out.
fn tokens(text: &str) -> Vec<String> {
    let letters: Vec<char> = text.chars().collect();
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < letters.len() {
        let next = letters.get(at + 1).copied();
        match letters[at] {
            '/' if next == Some('/') => at += until(&letters[at..], |rest| rest[0] == '\n'),
            '/' if next == Some('*') => {
                at += until(&letters[at..], |rest| rest.starts_with(&['*', '/'])) + 2
            }
            '"' => at += text_length(&letters[at..]),
            'r' if raw_length(&letters[at..]).is_some() => {
                at += raw_length(&letters[at..]).unwrap_or(1);
            }
            '\'' => at += character_length(&letters[at..]),
            ':' if next == Some(':') => {
                tokens.push("::".to_owned());
                at += 2;
            }
            letter if letter.is_alphanumeric() || letter == '_' => {
                let is_end = |rest: &[char]| !(rest[0].is_alphanumeric() || rest[0] == '_');
                let length = until(&letters[at..], is_end);
                tokens.push(letters[at..at + length].iter().collect());
                at += length;
            }
            letter if letter.is_whitespace() => at += 1,
            sign => {
                tokens.push(sign.to_string());
                at += 1;
            }
        }
    }
    tokens
}

/// How many letters come before the first place where something is met; all where it is not.
fn until(letters: &[char], met: impl Fn(&[char]) -> bool) -> usize {
    let place = (0..letters.len()).find(|at| met(&letters[*at..]));
    place.unwrap_or(letters.len())
}

/// The length of a text in quotation marks.
fn text_length(letters: &[char]) -> usize {
    let mut at = 1;
    while at < letters.len() && letters[at] != '"' {
        at += if letters[at] == '\\' { 2 } else { 1 };
    }
    at + 1
}

/// The length of a raw text, if that is what begins here.
fn raw_length(letters: &[char]) -> Option<usize> {
    let hashes = until(&letters[1..], |rest| rest[0] != '#');
    (letters.get(1 + hashes) == Some(&'"')).then_some(())?;
    let mut end = vec!['"'];
    end.extend(std::iter::repeat_n('#', hashes));
    let inside = &letters[2 + hashes..];
    Some(2 + hashes + until(inside, |rest| rest.starts_with(&end)) + end.len())
}

/// The length of a character, or of the mark before the name of a lifetime.
fn character_length(letters: &[char]) -> usize {
    match letters {
        ['\'', '\\', ..] => 2 + until(&letters[3..], |rest| rest[0] == '\'') + 2,
        ['\'', _, '\'', ..] => 3,
        _ => 1,
    }
}

/// The packages of ours among the dependencies that a manifest names, those for tests left out.
pub fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut is_dependency = false;
    let mut found = BTreeSet::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            is_dependency = line == "[dependencies]";
        }
        let end = |letter: char| !(letter.is_alphanumeric() || letter == '-');
        let name = line.split(end).next().unwrap_or_default();
        if is_dependency && (name == "taut" || name.starts_with("taut-")) {
            found.insert(name.to_owned());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(text: &str) -> Vec<String> {
        Parsed::new(text).paths("here").into_iter().collect()
    }

    #[test]
    fn paths_are_read_from_texts() {
        assert_eq!(
            paths("use crate::a::{self, b::C, d};"),
            ["a", "a::b::C", "a::d"]
        );
        assert_eq!(paths("fn f<'a>(x: &'a crate::a::B) {}"), ["a::B"]);
        assert_eq!(paths("mod child; use child::D;"), ["here::child::D"]);
        assert_eq!(paths("use super::{e, f};"), ["e", "f"]);
        assert_eq!(paths("use other::crate_a::B; crate_b::c();"), [""; 0]);
        let silent =
            "// crate::a\nlet b = \"crate::\\\"b\"; /* crate::c */ let d = '\"'; r#\"crate::e\"#";
        assert_eq!(paths(silent), [""; 0]);
        assert_eq!(paths("let quote = '\\''; crate::f()"), ["f"]);
    }

    #[test]
    fn what_is_for_tests_does_not_count() {
        let text = "#[cfg(test)]\nmod tests;\n#[cfg(test)]\nuse crate::a;\nuse crate::b;";
        assert_eq!(paths(text), ["b"]);
        assert_eq!(Parsed::new(text).tests, ["tests"]);
    }

    #[test]
    fn dependencies_of_ours_are_read() {
        let manifest = "[dependencies]\ntaut-core.workspace = true\nserde = \"1\"\ntaut = { path = \"..\" }\n[dev-dependencies]\ntaut-io = \"1\"\n";
        let found: Vec<_> = dependencies(manifest).into_iter().collect();
        assert_eq!(found, ["taut", "taut-core"]);
    }
}
