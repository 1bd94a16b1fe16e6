//! Whether modules use only what docs/ARCHITECTURE.md lets them use, and no files use each other in
//! a circle.

mod declared;
mod uses;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use declared::{Declared, Section};
use uses::Sources;

/// Where arrows are declared, from the root of the repository.
const DECLARED: &str = "docs/ARCHITECTURE.md";

/// A module or a crate uses something else.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrow {
    pub from: String,
    pub to: String,
}

/// Compares the arrows of the repository with those declared.
pub fn run() -> ExitCode {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    match faults(&root) {
        Ok(faults) if faults.is_empty() => {
            println!("PASSED: all arrows are declared in {DECLARED}");
            ExitCode::SUCCESS
        }
        Ok(faults) => {
            for fault in &faults {
                println!("{fault}");
            }
            println!(
                "FAILED: {} arrows; change the code, or {DECLARED} where the design is to change",
                faults.len()
            );
            ExitCode::FAILURE
        }
        Err(reason) => {
            println!("FAILED: {reason}");
            ExitCode::FAILURE
        }
    }
}

/// What is wrong with the arrows, in sentences.
fn faults(root: &Path) -> Result<Vec<String>, String> {
    let declared = Declared::parse(&read(&root.join(DECLARED))?)?;
    let mut faults = Vec::new();
    for section in &declared.sections {
        let found = match &section.of_crate {
            None => between_crates(root)?,
            Some(name) => {
                let sources = sources(&root.join("crates").join(name))?;
                let gone = section.modules().filter(|module| !sources.has(module));
                faults.extend(gone.map(|module| {
                    format!("{name}: {DECLARED} lists {module}, which is not there; take it away")
                }));
                let found = sources.arrows();
                let circles = circles(&found).into_iter();
                let circles = circles.filter(|_| section.without_circles);
                faults.extend(circles.map(|circle| {
                    format!("{name}: these files use each other in a circle: {circle}")
                }));
                found
            }
        };
        faults.extend(undeclared(section, &found));
    }
    Ok(faults)
}

/// The arrows of a section that it does not declare, and declared ones that nothing needs.
fn undeclared(section: &Section, found: &BTreeSet<Arrow>) -> Vec<String> {
    let name = section.of_crate.as_deref().unwrap_or("the workspace");
    let mut needed = BTreeSet::new();
    let mut faults = Vec::new();
    for arrow in found {
        match section.permits(arrow) {
            Some(line) => {
                needed.insert(line);
            }
            None => faults.push(format!(
                "{name}: {} uses {}, which no arrow in {DECLARED} lets it",
                arrow.from, arrow.to
            )),
        }
    }
    let idle = section
        .arrows
        .iter()
        .filter(|arrow| !needed.contains(arrow));
    faults.extend(idle.map(|arrow| {
        format!(
            "{name}: the arrow {} -> {} in {DECLARED} is not needed; take it away",
            arrow.from, arrow.to
        )
    }));
    faults
}

/// Sets of files each of which uses all others, directly or through more of them; files of one
/// module's tests do not count.
fn circles(arrows: &BTreeSet<Arrow>) -> Vec<String> {
    let files: BTreeSet<&str> = arrows
        .iter()
        .flat_map(|arrow| [&*arrow.from, &*arrow.to])
        .collect();
    let reached: BTreeMap<&str, BTreeSet<&str>> = files
        .iter()
        .map(|file| (*file, reached_from(file, arrows)))
        .collect();
    let circle = |file: &&str| -> Vec<&str> {
        let others = reached[*file].iter();
        others
            .copied()
            .filter(|other| reached[other].contains(*file))
            .collect()
    };
    let all: BTreeSet<Vec<&str>> = files.iter().map(circle).collect();
    let longer = all.into_iter().filter(|circle| !circle.is_empty());
    longer.map(|circle| circle.join(", ")).collect()
}

fn reached_from<'a>(file: &str, arrows: &'a BTreeSet<Arrow>) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut waiting = vec![file];
    while let Some(from) = waiting.pop() {
        let next = arrows.iter().filter(|arrow| arrow.from == from);
        for arrow in next {
            if reached.insert(&*arrow.to) {
                waiting.push(&arrow.to);
            }
        }
    }
    reached
}

/// The packages of ours that packages of ours are built from.
fn between_crates(root: &Path) -> Result<BTreeSet<Arrow>, String> {
    let mut manifests = vec![root.join("python/Cargo.toml"), root.join("fuzz/Cargo.toml")];
    for folder in entries(&root.join("crates"))? {
        manifests.push(folder.join("Cargo.toml"));
    }
    let mut arrows = BTreeSet::new();
    for manifest in manifests {
        let text = read(&manifest)?;
        let folder = manifest.parent().and_then(Path::file_name);
        let from = folder.unwrap_or_default().to_string_lossy().into_owned();
        let to = uses::dependencies(&text).into_iter();
        arrows.extend(to.map(|to| Arrow {
            from: from.clone(),
            to,
        }));
    }
    Ok(arrows)
}

/// The sources of a package, by their paths below its folder `src`.
fn sources(package: &Path) -> Result<Sources, String> {
    let source = package.join("src");
    let mut files = BTreeMap::new();
    let mut folders = vec![source.clone()];
    while let Some(folder) = folders.pop() {
        for path in entries(&folder)? {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|found| found == "rs") {
                let name = path.strip_prefix(&source).unwrap_or(&path);
                files.insert(name.to_owned(), read(&path)?);
            }
        }
    }
    Ok(Sources::new(&files))
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let told = |error: std::io::Error| format!("{}: {error}", folder.display());
    let entries = fs::read_dir(folder).map_err(told)?;
    entries
        .map(|entry| Ok(entry.map_err(told)?.path()))
        .collect()
}

fn read(file: &Path) -> Result<String, String> {
    fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: &str = "
## Arrows

```text
inside made-up:
high -> low::deep
any -> error

inside floors, without circles:
top
left, right
bottom
```
";

    fn made_up(files: &[(&str, &str)]) -> BTreeSet<Arrow> {
        let files = files.iter();
        let files = files.map(|(name, text)| (PathBuf::from(name), (*text).to_owned()));
        Sources::new(&files.collect()).arrows()
    }

    fn faults_of(section: usize, files: &[(&str, &str)]) -> Vec<String> {
        let declared = Declared::parse(RULES).expect("rules");
        undeclared(&declared.sections[section], &made_up(files))
    }

    #[test]
    fn arrows_that_are_not_declared_are_found() {
        let lawful = [
            ("lib.rs", "mod error; mod high; mod low;"),
            ("high.rs", "use crate::low::deep::{self, Deep};"),
            ("low.rs", "pub mod deep; use crate::error::Error;"),
            ("low/deep.rs", ""),
            ("error.rs", ""),
        ];
        assert_eq!(faults_of(0, &lawful), [""; 0]);
        let idle = faults_of(0, &lawful[1..4]);
        assert!(
            idle.len() == 1 && idle[0].contains("any -> error"),
            "{idle:?}"
        );
        let upward = ("low/deep.rs", "fn f() { crate::high::f() }");
        let faults = faults_of(0, &[&lawful[..3], &[upward, lawful[4]]].concat());
        assert!(
            faults.len() == 1 && faults[0].contains("low::deep uses high"),
            "{faults:?}"
        );
        let wider = ("high.rs", "use crate::low::{deep::Deep, Shallow};");
        let faults = faults_of(0, &[&[wider], &lawful[2..]].concat());
        assert!(
            faults.len() == 1 && faults[0].contains("high uses low,"),
            "{faults:?}"
        );
    }

    #[test]
    fn floors_bear_what_is_above_them() {
        let files = |bottom, left| {
            [
                ("top.rs", "use crate::left::A; use crate::bottom::B;"),
                ("left.rs", left),
                ("right.rs", ""),
                ("bottom.rs", bottom),
            ]
        };
        assert_eq!(faults_of(1, &files("", "")), [""; 0]);
        let up = faults_of(1, &files("use crate::top::C;", ""));
        assert!(up[0].contains("bottom uses top"), "{up:?}");
        let beside = faults_of(1, &files("", "use crate::right::D;"));
        assert!(beside[0].contains("left uses right"), "{beside:?}");
        let unknown = faults_of(1, &[("new.rs", "use crate::bottom::B;"), ("bottom.rs", "")]);
        assert!(unknown[0].contains("new uses bottom"), "{unknown:?}");
    }

    #[test]
    fn circles_are_found() {
        let files = |last| {
            [
                ("main.rs", "mod a; mod b; mod c;"),
                ("a.rs", "use crate::b::B;"),
                ("b.rs", "use crate::{c::C, Other};"),
                ("c.rs", last),
            ]
        };
        assert_eq!(circles(&made_up(&files(""))), [""; 0]);
        assert_eq!(circles(&made_up(&files("use crate::a;"))), ["a, b, c"]);
        let in_tests = "#[cfg(test)] mod tests { use crate::a; }";
        assert_eq!(circles(&made_up(&files(in_tests))), [""; 0]);
        let child = [
            ("main.rs", "mod a;"),
            ("a/mod.rs", "mod b; use b::B; pub struct A;"),
            ("a/b.rs", "use super::A;"),
        ];
        assert_eq!(circles(&made_up(&child)), ["a, a::b"]);
    }
}
