//! Where a table is written, block by block.

use std::fs;
use std::path::{Path, PathBuf};

use taut_io::MatrixFile;

use crate::answer::FoundPath;
use crate::exit::Failure;
use crate::matrix::files::{Output, failed};
use crate::matrix::fill::Entry;
use crate::matrix::journal::{Done, refused};
use crate::matrix::paths::PathFiles;
use crate::matrix::plan::{Block, Plan};
use crate::matrix::sparse::{self, Triplets};
use crate::matrix::tally::{self, Tally};
use crate::settings::MatrixSettings;

/// The unfinished results of a run.
pub struct Store<'a> {
    plan: &'a Plan,
    dimension: usize,
    table: Table,
    paths: Option<PathFiles>,
}

enum Table {
    Dense {
        lengths: Dense,
        errors: Option<Dense>,
    },
    /// Entries in the order in which they are found.
    Sparse(Triplets),
}

/// A matrix and its name.
struct Dense {
    path: PathBuf,
    matrix: MatrixFile,
}

impl<'a> Store<'a> {
    /// Opens the parts of a run of which some blocks may be done; `dimension` is the number of coordinates of a
    /// point.
    pub fn open(
        settings: &MatrixSettings,
        plan: &'a Plan,
        dimension: usize,
        done: &[Done],
    ) -> Result<Self, Failure> {
        let part = |whole: &Path| Output::new(whole).part;
        let table = if plan.radius.is_some() {
            let end = done.last().map_or(0, |done| done.end);
            Table::Sparse(Triplets::open(&part(&settings.output), end)?)
        } else {
            let dense = |whole: &Path| Dense::open(part(whole), plan.shape(), done.is_empty());
            Table::Dense {
                lengths: dense(&settings.output)?,
                errors: settings.errors.as_deref().map(dense).transpose()?,
            }
        };
        let paths = settings.paths.as_ref().map(|paths| {
            let folder = part(&paths.folder);
            PathFiles::open(&folder, &paths.format, done.is_empty())
        });
        Ok(Self {
            plan,
            dimension,
            table,
            paths: paths.transpose()?,
        })
    }

    /// Writes a block to the disk.
    pub fn write(&mut self, block: &Block, entries: &[Entry]) -> Result<Done, Failure> {
        if let Some(paths) = &mut self.paths {
            paths.write(block, self.dimension, entries)?;
        }
        let end = match &mut self.table {
            Table::Dense { lengths, errors } => {
                lengths.write(self.plan, block, entries, tally::length)?;
                if let Some(errors) = errors {
                    errors.write(self.plan, block, entries, tally::error)?;
                }
                0
            }
            Table::Sparse(triplets) => triplets.append(entries)?,
        };
        let mut tally = Tally::default();
        for entry in entries {
            tally.add(&entry.path);
        }
        Ok(Done {
            block: block.index,
            end,
            tally,
        })
    }
}

impl Dense {
    fn open(path: PathBuf, shape: [usize; 2], fresh: bool) -> Result<Self, Failure> {
        let matrix = if fresh {
            MatrixFile::create(&path, shape).map_err(|error| failed(&path, error))?
        } else {
            MatrixFile::open(&path, shape).map_err(|error| refused(&path, &error.to_string()))?
        };
        Ok(Self { path, matrix })
    }

    fn write(
        &mut self,
        plan: &Plan,
        block: &Block,
        entries: &[Entry],
        value: fn(&FoundPath) -> f64,
    ) -> Result<(), Failure> {
        let (rows, columns) = (&block.rows, &block.columns);
        let is_mirrored = plan.is_symmetric() && rows != columns;
        let mut values = vec![0.0; rows.len() * columns.len()];
        for Entry { pair: [i, j], path } in entries {
            let value = value(path);
            values[(i - rows.start) * columns.len() + j - columns.start] = value;
            if plan.is_symmetric() && !is_mirrored {
                values[(j - rows.start) * columns.len() + i - columns.start] = value;
            }
        }
        let mut write = || -> std::io::Result<()> {
            for (i, row) in rows.clone().zip(values.chunks(columns.len())) {
                self.matrix.write(i, columns.start, row)?;
            }
            for (at, j) in columns.clone().enumerate().filter(|_| is_mirrored) {
                let column = values.iter().skip(at).step_by(columns.len());
                let column: Vec<f64> = column.copied().collect();
                self.matrix.write(j, rows.start, &column)?;
            }
            self.matrix.sync()
        };
        write().map_err(|error| failed(&self.path, error))
    }
}

/// Puts the complete results in their places.
pub fn complete(settings: &MatrixSettings, plan: &Plan, done: &[Done]) -> Result<(), Failure> {
    let output = Output::new(&settings.output);
    let errors = settings.errors.as_deref().map(Output::new);
    if plan.radius.is_some() {
        let end = done.last().map_or(0, |done| done.end);
        sparse::complete(plan, &output, errors.as_ref(), end)?;
    } else {
        output.complete()?;
        if let Some(errors) = errors {
            errors.complete()?;
        }
    }
    if let Some(paths) = &settings.paths {
        let folder = Output::new(&paths.folder);
        if folder.part.exists() && folder.whole.exists() {
            // An empty folder of that name was allowed.
            fs::remove_dir(&folder.whole).map_err(|error| failed(&folder.whole, error))?;
        }
        folder.complete()?;
    }
    Ok(())
}
