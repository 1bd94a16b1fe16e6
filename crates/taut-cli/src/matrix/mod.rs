//! `taut matrix`: the distances of all pairs, in a table that is filled block by block.

mod files;
pub mod fill;
mod identity;
mod journal;
mod paths;
pub mod plan;
mod sparse;
mod store;
mod tally;

use std::io::Write;

use serde::Serialize;

use crate::exit::{Exit, Failure};
use crate::output::{exponential, line, tell};
use crate::progress::Progress;
use crate::settings::{End, MatrixSettings, Source};
use crate::sites::ends_of_file;
use crate::surface;
use fill::Work;
use journal::{Done, Journal};
use plan::Plan;
use store::Store;
use tally::Tally;

/// What is told of a table.
#[derive(Serialize)]
struct Facts {
    surface: String,
    matrix: String,
    rows: usize,
    columns: usize,
    #[serde(flatten)]
    tally: Tally,
}

/// Fills the table and writes what was asked for.
pub fn run(settings: &MatrixSettings, progress: &Progress) -> Result<Exit, Failure> {
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
    let facts = Facts {
        surface: name_of(&settings.source),
        matrix: settings.output.display().to_string(),
        rows,
        columns,
        tally,
    };
    tell(&facts, settings.json, |out, facts| write(out, facts))?;
    Ok(tally.exit())
}

/// Does what is left of the table, and puts it in its place; answers all blocks.
fn fill(
    settings: &MatrixSettings,
    plan: &Plan,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Vec<Done>, Failure> {
    let identity = identity::of(settings)?;
    if settings.restart {
        files::clear(settings)?;
    }
    let path = files::journal(settings);
    let resumed = Journal::resume(&path, &identity)?;
    let mut blocks = plan.blocks();
    let count = blocks.len();
    let mut is_left = vec![true; count];
    for done in resumed.iter().flat_map(|journal| &journal.done) {
        match is_left.get_mut(done.block) {
            Some(left) if *left => *left = false,
            _ => {
                return Err(journal::refused(
                    &path,
                    &format!("block {} is not left", done.block),
                ));
            }
        }
    }
    blocks.retain(|block| is_left[block.index]);
    let mut journal = match resumed {
        Some(journal) if blocks.is_empty() => journal,
        resumed => {
            if resumed.is_none() {
                files::check_fresh(settings)?;
            }
            let prepared = surface::prepare(&settings.source, ends, progress)?;
            prepared.check_ends()?;
            let mut journal = match resumed {
                Some(journal) => {
                    let found = count - blocks.len();
                    progress.note(&format!("{found} of {count} blocks were done before"));
                    journal
                }
                None => Journal::create(&path, &identity)?,
            };
            let mut store = Store::open(settings, plan, prepared.dimension(), &journal.done)?;
            progress.step("pairs");
            let work = Work {
                plan,
                blocks,
                correction: settings.correction,
                progress,
            };
            prepared.fill(&work, &mut |block, entries| {
                let done = store.write(block, &entries)?;
                journal.add(done)
            })?;
            journal
        }
    };
    store::complete(settings, plan, &journal.done)?;
    let done = std::mem::take(&mut journal.done);
    journal.remove()?;
    Ok(done)
}

fn name_of(source: &Source) -> String {
    match source {
        Source::Cloud(cloud) => cloud.file.display().to_string(),
        Source::Model(file) => file.display().to_string(),
        Source::Equations(settings) => settings.law.to_string(),
    }
}

fn write(out: &mut impl Write, facts: &Facts) -> std::io::Result<()> {
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
