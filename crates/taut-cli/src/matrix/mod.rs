//! `taut matrix`: the distances of all pairs, in a table that is filled block by block.

mod files;
mod fill;
mod identity;
mod journal;
mod paths;
mod plan;
mod settings;
mod sparse;
mod store;
mod tally;

use std::io::Write;

use serde::Serialize;
use taut::End;
use taut_io::Unfinished;

use crate::exit::{Exit, Failure};
use crate::numbers::exponential;
use crate::output::{line, tell};
use crate::outputs::Files;
use crate::pairs::Ends;
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::sites::ends_of_file;
use fill::{Keep, Work};
use journal::{Done, Journal};
use plan::{Block, Plan};
use settings::Settings;
pub use settings::{EXAMPLES, Flags};
use store::Store;
use tally::Tally;

/// What is told of a table.
#[derive(Serialize)]
struct MatrixFacts {
    surface: String,
    matrix: String,
    rows: usize,
    columns: usize,
    #[serde(flatten)]
    tally: Tally,
}

/// Fills the table and writes what was asked for.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let settings = &Settings::try_from(flags)?;
    check_files(settings)?;
    progress.step("reading the sources");
    let mut ends = ends_of_file(&settings.sources)?;
    let rows = ends.len();
    let columns = match &settings.to {
        Some(file) => {
            let more = ends_of_file(file)?;
            let count = more.len();
            ends.extend(more);
            Some(count)
        }
        None => None,
    };
    let plan = Plan {
        rows,
        columns,
        radius: settings.radius,
    };
    let done = fill(settings, &plan, ends, progress)?;
    progress.clear();
    let tally = done
        .iter()
        .fold(Tally::default(), |sum, done| sum.and(done.tally));
    let [rows, columns] = plan.shape();
    let facts = MatrixFacts {
        surface: settings.source.name(),
        matrix: settings.output.display().to_string(),
        rows,
        columns,
        tally,
    };
    tell(&facts, settings.json, |out, facts| write(out, facts))?;
    Ok(tally.exit())
}

/// The files that are read and written.
fn check_files(settings: &Settings) -> Result<(), Failure> {
    let folder = settings.paths.as_ref().map(|paths| paths.folder.as_path());
    let outputs = files::outputs(settings);
    let journal = files::journal(settings);
    let mut files = Files::of(&settings.source)
        .reads("--sources", Some(&settings.sources))
        .reads("--to", settings.to.as_deref())
        .writes_any("--output", Some(&settings.output))
        .writes_any("--errors", settings.errors.as_deref())
        .writes_any("--paths", folder)
        .writes_any("the journal of --output", Some(&journal));
    for output in &outputs {
        files = files.writes_any("the unfinished part of a result", Some(&output.part));
    }
    files.check()?;
    let single = std::iter::once(&settings.output).chain(&settings.errors);
    for file in single {
        taut_io::check_place(file)?;
    }
    Ok(())
}

/// Does what is left of the table, and puts it in its place; answers all blocks.
fn fill(
    settings: &Settings,
    plan: &Plan,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Vec<Done>, Failure> {
    let identity = identity::of(settings)?;
    if settings.restart {
        files::clear(settings)?;
    }
    let path = files::journal(settings);
    let mut journal = Journal::open(&path, &identity)?;
    // Of a run of which no block is done there is nothing to keep.
    let mut unfinished = Vec::new();
    if journal.done.is_empty() {
        unfinished.push(Unfinished::new(&path));
        if journal.is_fresh {
            files::check_fresh(settings)?;
        }
        let outputs = files::outputs(settings);
        unfinished.extend(outputs.iter().map(|output| Unfinished::new(&output.part)));
    }
    let mut blocks = plan.blocks();
    let count = blocks.len();
    let is_done = go_on(settings, plan, &blocks, &mut journal, progress)?;
    blocks.retain(|block| !is_done[block.index]);
    if !blocks.is_empty() {
        let filling = Filling {
            settings,
            ends,
            count,
            work: Work {
                plan,
                blocks,
                correction: settings.correction,
                progress,
            },
            journal: &mut journal,
            unfinished: &mut unfinished,
        };
        ready::visit_for_paths(&settings.source, filling, progress)?;
    }
    unfinished.drain(..).for_each(Unfinished::keep);
    store::complete(settings, plan, &journal.done)?;
    let done = std::mem::take(&mut journal.done);
    journal.remove()?;
    Ok(done)
}

/// The blocks that are left of a table, and what is told when one is done.
struct Filling<'a> {
    settings: &'a Settings,
    ends: Vec<End>,
    /// Number of all blocks.
    count: usize,
    work: Work<'a>,
    journal: &'a mut Journal,
    unfinished: &'a mut Vec<Unfinished>,
}

impl Question for Filling<'_> {
    type Answer = ();

    fn seeds(&self, _: usize, _: &Progress) -> Result<Vec<End>, Failure> {
        Ok(self.ends.clone())
    }

    fn answer<const D: usize>(self, ready: &Ready<'_, D>, _: &Progress) -> Result<(), Failure> {
        let nodes = Ends::new(ready, &self.ends).nodes()?;
        self.fill(ready.dimension, &|work, keep| {
            fill::fill(ready, &nodes, work, keep)
        })
    }
}

impl Filling<'_> {
    /// Writes blocks as `find` hands them over; points have `dimension` coordinates.
    fn fill(
        self,
        dimension: usize,
        find: &dyn Fn(&Work<'_>, Keep<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Self { work, journal, .. } = self;
        if !journal.done.is_empty() {
            let found = self.count - work.blocks.len();
            let note = format!("{found} of {} blocks were done before", self.count);
            work.progress.note(&note);
        }
        let mut store = Store::open(self.settings, work.plan, dimension, &journal.done)?;
        work.progress.step("pairs");
        find(&work, &mut |block, entries| {
            let done = store.write(block, &entries)?;
            journal.add(done)?;
            self.unfinished.drain(..).for_each(Unfinished::keep);
            Ok(())
        })
    }
}

/// Which blocks an earlier run has done, and are still as it left them.
fn go_on(
    settings: &Settings,
    plan: &Plan,
    blocks: &[Block],
    journal: &mut Journal,
    progress: &Progress,
) -> Result<Vec<bool>, Failure> {
    let path = files::journal(settings);
    let mut is_done = vec![false; blocks.len()];
    for done in &journal.done {
        match is_done.get_mut(done.block) {
            Some(is_done) if !*is_done => *is_done = true,
            _ => {
                let reason = format!(
                    "found block {} done twice, or outside the matrix",
                    done.block
                );
                return Err(files::refused(&path, &reason));
            }
        }
    }
    let changed = store::changed(settings, plan, blocks, &journal.done)?;
    for block in &changed {
        is_done[*block] = false;
    }
    journal.forget(&changed)?;
    let lines = journal.damaged;
    if lines > 0 {
        progress.note(&format!(
            "{}: {lines} lines are damaged; what they recorded is computed again",
            path.display()
        ));
    }
    if !changed.is_empty() {
        progress.note(&format!(
            "{}: {} of {} blocks are not as they were written; they are computed again",
            settings.output.display(),
            changed.len(),
            blocks.len()
        ));
    }
    Ok(is_done)
}

fn write(out: &mut impl Write, facts: &MatrixFacts) -> std::io::Result<()> {
    let Tally {
        pairs,
        no_path,
        not_converged,
        unknown,
        largest_error,
    } = facts.tally;
    line(out, "surface", &facts.surface)?;
    line(out, "matrix", &facts.matrix)?;
    line(out, "shape", &format!("{} x {}", facts.rows, facts.columns))?;
    line(out, "pairs", &pairs.to_string())?;
    line(out, "no path", &no_path.to_string())?;
    line(out, "not converged", &not_converged.to_string())?;
    line(out, "error unknown", &unknown.to_string())?;
    let known = (unknown + no_path < pairs || pairs == 0).then_some(largest_error);
    line(out, "largest relative error", &exponential(known))
}
