//! The list of jobs and what is stored of their outputs: a line a job.

use std::collections::BTreeSet;
use std::path::Path;

/// Between the command line of a job and its sums.
const ARROW: &str = " => ";
const COMMAND: &str = "taut ";

/// All lines of the file in their order.
pub struct List(pub Vec<Line>);

pub enum Line {
    /// A comment or an empty line.
    Remark(String),
    Job(Job),
}

/// `NAME: taut ARGUMENTS => OUTPUT SUM, OUTPUT SUM, ..`; the arrow and what is behind it are
/// missing from a new one.
#[derive(Debug, PartialEq)]
pub struct Job {
    pub name: String,
    /// Words with spaces between them: no word holds one.
    pub arguments: String,
    pub sums: Vec<Sum>,
}

/// An output, and what is stored or found of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sum {
    pub output: String,
    pub value: String,
}

impl List {
    pub fn read(file: &Path) -> Result<Self, String> {
        let told = |reason: String| format!("{}: {reason}", file.display());
        let text = std::fs::read_to_string(file).map_err(|error| told(error.to_string()))?;
        let mut names = BTreeSet::new();
        let mut lines = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let wrong = |reason: String| told(format!("line {number}: {reason}"));
            if line.is_empty() || line.starts_with('#') {
                lines.push(Line::Remark(line.to_owned()));
                continue;
            }
            let job = Job::parse(line).map_err(wrong)?;
            if !names.insert(job.name.clone()) {
                let name = job.name;
                return Err(wrong(format!(
                    "found the name {name} a second time, expected one for each job; rename it"
                )));
            }
            lines.push(Line::Job(job));
        }
        Ok(Self(lines))
    }

    pub fn write(&self, file: &Path) -> Result<(), String> {
        let line = |line: &Line| match line {
            Line::Remark(text) => format!("{text}\n"),
            Line::Job(job) => format!("{}\n", job.line()),
        };
        let text: String = self.0.iter().map(line).collect();
        std::fs::write(file, text)
            .map_err(|error| format!("{}: cannot be written: {error}", file.display()))
    }

    pub fn jobs(&mut self) -> impl Iterator<Item = &mut Job> {
        self.0.iter_mut().filter_map(|line| match line {
            Line::Remark(_) => None,
            Line::Job(job) => Some(job),
        })
    }
}

impl Job {
    fn parse(line: &str) -> Result<Self, String> {
        let (work, stored) = line.split_once(ARROW).unwrap_or((line, ""));
        let named = work.split_once(": ");
        let (name, arguments) = named
            .and_then(|(name, command)| Some((name, command.strip_prefix(COMMAND)?)))
            .ok_or_else(|| {
                format!("found {work:?}, expected NAME: taut ARGUMENTS; mend the line")
            })?;
        let sum = |text: &str| {
            let (output, value) = text.rsplit_once(' ').ok_or_else(|| {
                format!("found {text:?}, expected an output and its sum; take away the arrow and what is behind it, and store sums anew")
            })?;
            Ok(Sum::new(output, value))
        };
        let stored = stored.split(", ").filter(|text| !text.is_empty());
        Ok(Self {
            name: name.to_owned(),
            arguments: arguments.to_owned(),
            sums: stored.map(sum).collect::<Result<_, String>>()?,
        })
    }

    fn line(&self) -> String {
        let sum = |sum: &Sum| format!("{} {}", sum.output, sum.value);
        let sums: Vec<String> = self.sums.iter().map(sum).collect();
        let Self {
            name, arguments, ..
        } = self;
        format!("{name}: {COMMAND}{arguments}{ARROW}{}", sums.join(", "))
    }

    /// As it can be typed in a shell.
    pub fn command_line(&self) -> String {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:=/".contains(c);
        let quoted = |word: &str| match word.chars().all(plain) {
            true => word.to_owned(),
            false => format!("'{word}'"),
        };
        let words: Vec<String> = self.arguments.split_whitespace().map(quoted).collect();
        format!("{COMMAND}{}", words.join(" "))
    }

    /// A sentence for each output whose sum is not the one stored.
    pub fn differences(&self, found: &[Sum]) -> Vec<String> {
        if self.sums.is_empty() {
            return vec!["no sums are stored yet".to_owned()];
        }
        let value = |sums: &[Sum], output: &str| {
            let sum = sums.iter().find(|sum| sum.output == output);
            sum.map_or_else(|| "none".to_owned(), |sum| sum.value.clone())
        };
        let new = |sum: &&Sum| self.sums.iter().all(|stored| stored.output != sum.output);
        self.sums
            .iter()
            .chain(found.iter().filter(new))
            .map(|sum| {
                let output = &sum.output;
                (output, value(&self.sums, output), value(found, output))
            })
            .filter(|(_, stored, found)| stored != found)
            .map(|(output, stored, found)| format!("{output}: stored {stored}, found {found}"))
            .collect()
    }
}

impl Sum {
    pub fn new(output: &str, value: &str) -> Self {
        Self {
            output: output.to_owned(),
            value: value.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "ring: taut check --implicit x^2=2 -q => exit 0, stdout 00c0ffee";

    #[test]
    fn a_line_is_written_as_it_was_read() {
        let job = Job::parse(LINE).expect("a job");
        assert_eq!((job.name.as_str(), job.sums.len()), ("ring", 2));
        assert_eq!(job.line(), LINE);
        assert_eq!(job.command_line(), "taut check --implicit 'x^2=2' -q");
        assert!(Job::parse("ring: taut check a.ply").is_ok_and(|job| job.sums.is_empty()));
        for wrong in ["ring", "taut check", "ring: check", "ring: taut check => 0"] {
            assert!(Job::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn outputs_that_changed_came_or_went_differ() {
        let new = Job::parse("a: taut check").expect("a job");
        assert_eq!(new.differences(&[]).len(), 1);
        let job = Job::parse("a: taut check => exit 0, stdout 1, a.ply 2").expect("a job");
        assert!(job.differences(&job.sums).is_empty());
        let found = ["exit 0", "stdout 3", "b.ply 4"].map(|text| {
            let (output, value) = text.split_once(' ').expect("two words");
            Sum::new(output, value)
        });
        let expected = [
            "stdout: stored 1, found 3",
            "a.ply: stored 2, found none",
            "b.ply: stored none, found 4",
        ];
        assert_eq!(job.differences(&found), expected);
    }
}
