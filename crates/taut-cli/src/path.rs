//! `taut path`.

use std::io::{BufWriter, Write};
use std::path::Path;

use taut::End;
use taut_core::parallel;
use taut_io::{Content, Pairs, Polyline, write_polylines};

use crate::answer::{Answer, FoundPath};
use crate::exit::{Exit, Failure};
use crate::output::{self, Style};
use crate::outputs::Files;
use crate::pairs::{self, Request};
use crate::picture;
use crate::progress::Progress;
use crate::ready::{self, Mls, Question, Ready};
use crate::settings::{Ends, PathSettings};
use crate::surface::{FlatSamples, Show};

/// Pairs answered before their results are written.
const CHUNK: usize = 256;

/// Finds the paths and writes what was asked for.
pub fn run(settings: &PathSettings, progress: &Progress) -> Result<Exit, Failure> {
    let list = match &settings.ends {
        Ends::File(file) => Some(file.as_path()),
        Ends::One(_) | Ends::StandardInput => None,
    };
    let output = settings.output.as_deref();
    Files::of(&settings.source)
        .reads("--pairs", list)
        .writes(
            "--output",
            output,
            Content::Paths,
            settings.source.dimension(),
        )
        .writes_picture(settings.picture.as_deref())
        .check()?;
    let pairs = read_pairs(&settings.ends)?;
    let count = pairs.len();
    if output.is_some_and(holds_one) && (count > 1 || settings.alternatives > 0) {
        return Err(Failure::Usage(
            "--output: found the extension .npy for several paths, but such a file holds one path; write .csv or .json"
                .to_owned(),
        ));
    }
    let ends = pairs.into_iter().flatten().collect();
    let question = Paths { settings, ends };
    ready::visit(&settings.source, question, progress)
}

/// The paths between every two ends that follow each other.
struct Paths<'a> {
    settings: &'a PathSettings,
    ends: Vec<End>,
}

impl Question for Paths<'_> {
    type Answer = Exit;

    fn seeds(&self, _: usize, _: &Progress) -> Result<Vec<End>, Failure> {
        Ok(self.ends.clone())
    }

    fn answer<const D: usize, S: Show<D>>(
        self,
        ready: &Ready<'_, D, S>,
        progress: &Progress,
    ) -> Result<Exit, Failure> {
        let Self { settings, ends } = self;
        let dimension = ready.dimension;
        if let Some(file) = &settings.output {
            taut_io::check_output(file, Content::Paths, Some(dimension))?;
        }
        let request = Request {
            correction: settings.correction,
            alternatives: settings.alternatives,
        };
        let located = pairs::Ends::new(ready, &ends);
        let find = |pair: usize| located.answer([2 * pair, 2 * pair + 1], &request);
        let samples = || ready.samples();
        answer_all(
            settings,
            dimension,
            ends.len() / 2,
            &find,
            &samples,
            progress,
        )
    }

    fn answer_mls<'a>(
        self,
        make: impl FnOnce() -> Result<Mls<'a>, Failure>,
        progress: &Progress,
    ) -> Result<Exit, Failure> {
        self.answer(&make()?, progress)
    }
}

/// Answers `count` pairs one after another, and writes what was asked for. `find` answers a pair,
/// `samples` are points of the surface for a picture.
fn answer_all(
    settings: &PathSettings,
    dimension: usize,
    count: usize,
    find: &(dyn Fn(usize) -> Answer + Sync),
    samples: &dyn Fn() -> FlatSamples,
    progress: &Progress,
) -> Result<Exit, Failure> {
    progress.step("paths");
    progress.count_to(count);
    let mut worst = Exit::Success;
    let mut kept = Vec::new();
    let mut outlying = 0;
    let mut report = Report::new(settings, dimension)?;
    for first in (0..count).step_by(CHUNK) {
        let chunk = first..(first + CHUNK).min(count);
        let answers = parallel::map(chunk.len(), |i| {
            let answer = find(chunk.start + i);
            progress.done(1);
            answer
        });
        for answer in answers {
            for (end, reason) in answer.refusals() {
                let end = end.to_string();
                if let Ends::One(_) = settings.ends {
                    let reason = reason.to_owned();
                    return Err(Failure::End { end, reason });
                }
                progress.note(&format!("{end}: {reason}"));
            }
            if let (Ends::File(_) | Ends::StandardInput, false) = (&settings.ends, settings.json) {
                for end in &answer.ends {
                    if let Some(warning) = end.warning() {
                        progress.note(&format!("{} lies {warning}", end.named));
                    }
                }
            }
            let ends = answer.ends.iter().filter_map(|end| end.place.as_ref().ok());
            outlying += ends.filter(|place| place.off.is_some()).count();
            worst = worst.max(answer.exit());
            report.write(&answer)?;
            if settings.output.is_some() || settings.picture.is_some() {
                kept.extend(std::iter::once(answer.path).chain(answer.alternatives));
            }
        }
    }
    if outlying > 0 && report.style == Style::Table {
        progress.note(&format!(
            "{outlying} of {} ends lie farther off the surface than its points do: the answers are for the places that they were moved to (by moved_from and moved_to)",
            2 * count
        ));
    }
    kept.retain(|path| path.length.is_some());
    write_files(settings, dimension, &kept, samples, progress)?;
    progress.clear();
    report.finish()?;
    Ok(worst)
}

/// Whether a file's format has room for one path alone.
fn holds_one(file: &Path) -> bool {
    file.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("npy"))
}

/// Answers on their way to standard output.
struct Report<W: Write> {
    out: W,
    style: Style,
    alternatives: bool,
    dimension: usize,
}

impl Report<BufWriter<std::io::Stdout>> {
    fn new(settings: &PathSettings, dimension: usize) -> Result<Self, Failure> {
        let style = match (&settings.ends, settings.json) {
            (_, true) => Style::Json {
                points: settings.points,
            },
            (Ends::One(_), false) => Style::Summary,
            (Ends::File(_) | Ends::StandardInput, false) => Style::Table,
        };
        let alternatives = settings.alternatives > 0;
        let mut out = BufWriter::new(std::io::stdout());
        output::write_header(&mut out, style, alternatives)?;
        Ok(Self {
            out,
            style,
            alternatives,
            dimension,
        })
    }
}

impl<W: Write> Report<W> {
    fn write(&mut self, answer: &Answer) -> Result<(), Failure> {
        let (style, alternatives) = (self.style, self.alternatives);
        output::write_answer(&mut self.out, style, alternatives, self.dimension, answer)?;
        Ok(())
    }

    fn finish(mut self) -> Result<(), Failure> {
        self.out.flush()?;
        Ok(())
    }
}

fn read_pairs(ends: &Ends) -> Result<Vec<[End; 2]>, Failure> {
    let read = match ends {
        Ends::One(pair) => return Ok(vec![pair.clone()]),
        Ends::File(file) => taut_io::read_pairs(file)?,
        Ends::StandardInput => taut_io::read_pairs_from(std::io::stdin().lock(), "standard input")?,
    };
    Ok(match read {
        Pairs::Indices(rows) => rows.into_iter().map(|pair| pair.map(End::Row)).collect(),
        Pairs::Coordinates { dimension, values } => {
            let pair = |both: &[f64]| {
                let (from, to) = both.split_at(dimension);
                [from, to].map(|point| End::Point(point.to_vec()))
            };
            values.chunks(2 * dimension).map(pair).collect()
        }
    })
}

fn write_files(
    settings: &PathSettings,
    dimension: usize,
    paths: &[FoundPath],
    samples: &dyn Fn() -> FlatSamples,
    progress: &Progress,
) -> Result<(), Failure> {
    if paths.is_empty() {
        return Ok(());
    }
    if let Some(file) = &settings.output {
        progress.step("writing the paths");
        let polylines: Vec<Polyline<'_>> = paths
            .iter()
            .map(|path| Polyline {
                dimension,
                points: &path.points,
                normals: Some(&path.normals),
                arc_length: &path.arc_length,
                level: None,
            })
            .collect();
        write_polylines(file, &polylines)?;
    }
    if let Some(file) = &settings.picture {
        progress.step("drawing");
        picture::draw(file, &samples(), paths)?;
    }
    Ok(())
}
