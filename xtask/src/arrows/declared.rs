//! The arrows that are declared: the block of text below the heading of that name.

use std::collections::BTreeMap;

use crate::arrows::Arrow;

const HEADING: &str = "## Arrows";
const FENCE: &str = "```";
/// What ends the heading of a package without circles.
const WITHOUT_CIRCLES: &str = ", without circles";
/// What stands on the left of an arrow that everything may use.
const ANY: &str = "any";

/// What the block declares.
pub struct Declared {
    pub sections: Vec<Section>,
}

/// The arrows between packages, or between the modules of one.
#[derive(Default)]
pub struct Section {
    /// The package; `None` for arrows between packages.
    pub of_crate: Option<String>,
    /// No files of it may use each other in a circle.
    pub without_circles: bool,
    /// Both ends may stand for all modules inside them.
    pub arrows: Vec<Arrow>,
    /// The floor of each module: it may use what is on those with higher numbers.
    floors: BTreeMap<String, usize>,
}

impl Declared {
    pub fn parse(text: &str) -> Result<Self, String> {
        let lines = text.lines().skip_while(|line| *line != HEADING);
        let mut block = lines.skip_while(|line| !line.starts_with(FENCE)).skip(1);
        let mut sections: Vec<Section> = Vec::new();
        let mut floor = 0;
        for line in block.by_ref().take_while(|line| !line.starts_with(FENCE)) {
            let wrong = |expected| format!("found {line:?} among the arrows, expected {expected}");
            if line.trim().is_empty() {
                continue;
            }
            if let Some(heading) = line.strip_suffix(':') {
                let bare = heading.strip_suffix(WITHOUT_CIRCLES);
                let name = bare.unwrap_or(heading).strip_prefix("inside ");
                sections.push(Section {
                    of_crate: name.map(str::to_owned),
                    without_circles: bare.is_some(),
                    ..Section::default()
                });
                continue;
            }
            let section = sections
                .last_mut()
                .ok_or_else(|| wrong("a line that ends with a colon first"))?;
            match line.split_once("->") {
                Some((from, to)) => section.arrows.extend(names(to).map(|to| Arrow {
                    from: from.trim().to_owned(),
                    to,
                })),
                None => section.floors.extend(names(line).map(|name| (name, floor))),
            }
            floor += 1;
        }
        if sections.is_empty() {
            return Err(format!("found no arrows below a heading {HEADING:?}"));
        }
        Ok(Self { sections })
    }
}

/// Names with commas between them.
fn names(list: &str) -> impl Iterator<Item = String> {
    list.split(',').map(|name| name.trim().to_owned())
}

impl Section {
    /// All modules that have a floor.
    pub fn modules(&self) -> impl Iterator<Item = &str> {
        self.floors.keys().map(String::as_str)
    }

    /// The declared arrow that lets another be; an arrow of its own where floors do.
    pub fn permits<'a>(&'a self, arrow: &'a Arrow) -> Option<&'a Arrow> {
        let [from, to] = [&arrow.from, &arrow.to].map(|path| outermost(path));
        let floors = [from, to].map(|name| self.floors.get(name));
        if self.of_crate.is_some() && from == to {
            return Some(arrow);
        }
        if let [Some(upper), Some(lower)] = floors
            && upper < lower
        {
            return Some(arrow);
        }
        let within = |path: &str, whole: &str| {
            let rest = path.strip_prefix(whole);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
        };
        let fits = self.arrows.iter().filter(|declared| {
            (declared.from == ANY || within(&arrow.from, &declared.from))
                && within(&arrow.to, &declared.to)
        });
        fits.max_by_key(|declared| declared.from.len() + declared.to.len())
    }
}

/// The module that a path begins with.
fn outermost(path: &str) -> &str {
    path.split("::").next().unwrap_or(path)
}
