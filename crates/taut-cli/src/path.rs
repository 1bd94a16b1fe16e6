//! `taut path`.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use taut::End;
use taut_core::{correction, parallel};
use taut_io::{Content, Pairs, Polyline, write_polylines};

use crate::answer::{Answer, FoundPath};
use crate::correction::CorrectionFlags;
use crate::exit::{Exit, Failure};
use crate::output::{self, Style};
use crate::outputs::Files;
use crate::pairs::{self, Request};
use crate::picture;
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::source::SurfaceFlags;
use crate::surface::FlatSamples;
use crate::values::whole;

pub const EXAMPLES: &str = "\
Examples:
  taut path scan.ply --from 12 --to 3400 --json
  taut path scan.ply --from 0.1,0,-2 --to 3400 -o path.vtk --picture path.png
  taut path --implicit 'x1^2 + x2^2 = 1' --implicit 'x3^2 + x4^2 = 1' --from 1,0,1,0 --to 0,1,-1,0
  seq 1 100 | sed 's/^/0 /' | taut path scan.xyz --pairs - | sort -g -k 3

The length comes with two estimated errors. length_error is the error of the path on the surface
that taut works on. surface_error is what the reconstruction of this surface from points adds to it;
it is 0 for equations.";

#[derive(Debug, Args)]
pub struct Flags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// Where the path starts: a row of the file (the first is 0), or coordinates such as 1,0,-2
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    #[arg(
        required_unless_present = "pairs",
        requires = "to",
        conflicts_with = "pairs"
    )]
    pub from: Option<End>,
    /// Where the path ends
    #[arg(long, value_name = "P", allow_hyphen_values = true, requires = "from")]
    pub to: Option<End>,
    /// Find many paths: each line of this file holds two rows of the point file, or the coordinates
    /// of two points; - reads the lines from standard input
    #[arg(long, value_name = "FILE")]
    pub pairs: Option<PathBuf>,
    #[command(flatten)]
    pub correction: CorrectionFlags,
    /// Also find up to N further paths, such as one round the other side of a hole
    #[arg(long, value_name = "N", default_value = "0", hide_default_value = true)]
    #[arg(value_parser = whole, allow_negative_numbers = true)]
    pub alternatives: usize,
    /// Find out by rays in all directions whether the path is the shortest there is; this takes
    /// some milliseconds for each pair
    #[arg(long)]
    pub prove_shortest: bool,
    /// Write one JSON object for each pair, on a line of its own
    #[arg(long)]
    pub json: bool,
    /// Add the nodes of each path to the JSON object
    #[arg(long, requires = "json")]
    pub points: bool,
    /// Write the paths with their normals and arc length: .ply .obj .csv .json .vtk .vtp .npy
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw the surface with the paths over it
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

/// Which pairs of ends.
enum Ends {
    One([End; 2]),
    /// A file of pairs.
    File(PathBuf),
    StandardInput,
}

impl Flags {
    fn ends(&self) -> Result<Ends, Failure> {
        match (&self.from, &self.to, &self.pairs) {
            (Some(from), Some(to), None) => Ok(Ends::One([from.clone(), to.clone()])),
            (None, None, Some(file)) if file.as_os_str() == "-" => Ok(Ends::StandardInput),
            (None, None, Some(file)) => Ok(Ends::File(file.clone())),
            _ => {
                let message = "expected --from and --to, or --pairs";
                Err(Failure::Usage(message.to_owned()))
            }
        }
    }
}

/// Pairs answered before their results are written.
const CHUNK: usize = 256;

/// Finds the paths and writes what was asked for.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let ends = flags.ends()?;
    let source = flags.surface.source()?;
    let list = match &ends {
        Ends::File(file) => Some(file.as_path()),
        Ends::One(_) | Ends::StandardInput => None,
    };
    let output = flags.output.as_deref();
    Files::of(&source)
        .reads("--pairs", list)
        .writes("--output", output, Content::Paths, source.dimension())
        .writes_picture(flags.picture.as_deref())
        .check()?;
    let pairs = read_pairs(&ends)?;
    let count = pairs.len();
    if output.is_some_and(holds_one) && (count > 1 || flags.alternatives > 0) {
        return Err(Failure::Usage(
            "--output: found the extension .npy for several paths, but such a file holds one path; write .csv or .json"
                .to_owned(),
        ));
    }
    let style = match (&ends, flags.json) {
        (_, true) => Style::Json {
            points: flags.points,
        },
        (Ends::One(_), false) => Style::Summary,
        (Ends::File(_) | Ends::StandardInput, false) => Style::Table,
    };
    let paths = Paths {
        flags,
        style,
        is_one: matches!(ends, Ends::One(_)),
        ends: pairs.into_iter().flatten().collect(),
    };
    ready::visit_for_paths(&source, paths, progress)
}

/// The paths between every two ends that follow each other.
struct Paths<'a> {
    flags: &'a Flags,
    style: Style,
    /// A single pair was asked for.
    is_one: bool,
    ends: Vec<End>,
}

impl Question for Paths<'_> {
    type Answer = Exit;

    fn seeds(&self, _: usize, _: &Progress) -> Result<Vec<End>, Failure> {
        Ok(self.ends.clone())
    }

    fn answer<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<Exit, Failure> {
        if let Some(file) = &self.flags.output {
            taut_io::check_output(file, Content::Paths, Some(ready.dimension))?;
        }
        let request = Request {
            correction: correction::Settings {
                prove_shortest: self.flags.prove_shortest,
                ..self.flags.correction.settings()
            },
            alternatives: self.flags.alternatives,
        };
        let ends = pairs::Ends::new(ready, &self.ends);
        let find = |pair: usize| ends.answer([2 * pair, 2 * pair + 1], &request);
        self.tell(ready.dimension, &find, &|| ready.samples(), progress)
    }
}

impl Paths<'_> {
    /// Writes what was asked for. `find` answers a pair, and `samples` are points of the surface for
    /// a picture.
    fn tell(
        &self,
        dimension: usize,
        find: &(dyn Fn(usize) -> Answer + Sync),
        samples: &dyn Fn() -> FlatSamples,
        progress: &Progress,
    ) -> Result<Exit, Failure> {
        let flags = self.flags;
        let count = self.ends.len() / 2;
        progress.step("paths");
        progress.count_to(count);
        let mut worst = Exit::Success;
        let mut kept = Vec::new();
        let mut outlying = 0;
        let mut report = Report::new(self.style, flags.alternatives > 0, dimension)?;
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
                    if self.is_one {
                        let reason = reason.to_owned();
                        return Err(Failure::End { end, reason });
                    }
                    progress.note(&format!("{end}: {reason}"));
                }
                if self.style == Style::Table {
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
                if flags.output.is_some() || flags.picture.is_some() {
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
        write_files(flags, dimension, &kept, samples, progress)?;
        progress.clear();
        report.finish()?;
        Ok(worst)
    }
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
    fn new(style: Style, alternatives: bool, dimension: usize) -> Result<Self, Failure> {
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
    flags: &Flags,
    dimension: usize,
    paths: &[FoundPath],
    samples: &dyn Fn() -> FlatSamples,
    progress: &Progress,
) -> Result<(), Failure> {
    if paths.is_empty() {
        return Ok(());
    }
    if let Some(file) = &flags.output {
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
    if let Some(file) = &flags.picture {
        progress.step("drawing");
        picture::draw(file, &samples(), paths)?;
    }
    Ok(())
}
