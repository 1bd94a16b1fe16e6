//! Where a table is written, block by block.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use taut_io::MatrixFile;

use crate::answer::FoundPath;
use crate::exit::Failure;
use crate::matrix::files::{Output, failed, refused};
use crate::matrix::fill::Entry;
use crate::matrix::journal::{Done, Sums};
use crate::matrix::paths::PathFiles;
use crate::matrix::plan::{Block, Plan};
use crate::matrix::settings::Settings;
use crate::matrix::sparse::{self, Triplets};
use crate::matrix::tally::{self, Tally};

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
    /// Opens the parts of a run of which some blocks may be done; `dimension` is the number of
    /// coordinates of a point.
    pub fn open(
        settings: &Settings,
        plan: &'a Plan,
        dimension: usize,
        done: &[Done],
    ) -> Result<Self, Failure> {
        let part = |whole: &Path| Output::new(whole).part;
        let table = if plan.radius.is_some() {
            let end = done.iter().map(|done| done.end).max().unwrap_or(0);
            Table::Sparse(Triplets::open(&part(&settings.output), end)?)
        } else {
            let dense = |whole: &Path| Dense::open(part(whole), plan.shape(), done.is_empty());
            Table::Dense {
                lengths: dense(&settings.output)?,
                errors: settings.errors.as_deref().map(dense).transpose()?,
            }
        };
        let blocks = plan.blocks();
        let done_blocks: Vec<&Block> = done.iter().map(|done| &blocks[done.block]).collect();
        let paths = settings.paths.as_ref().map(|paths| {
            let folder = part(&paths.folder);
            PathFiles::open(&folder, &paths.format, &done_blocks)
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
        let mut sums = Sums::default();
        if let Some(paths) = &mut self.paths {
            sums.paths_sum = paths.write(block, self.dimension, entries)?;
        }
        let (start, end) = match &mut self.table {
            Table::Dense { lengths, errors } => {
                sums.lengths_sum = lengths.write(self.plan, block, entries, tally::length)?;
                if let Some(errors) = errors {
                    sums.errors_sum = errors.write(self.plan, block, entries, tally::error)?;
                }
                (0, 0)
            }
            Table::Sparse(triplets) => {
                let (start, end, sum) = triplets.append(entries)?;
                sums.lengths_sum = sum;
                (start, end)
            }
        };
        let mut tally = Tally::default();
        for entry in entries {
            tally.add(&entry.path);
        }
        Ok(Done {
            block: block.index,
            start,
            end,
            sums,
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

    /// Writes a block to the disk; its check sum.
    fn write(
        &mut self,
        plan: &Plan,
        block: &Block,
        entries: &[Entry],
        value: fn(&FoundPath) -> f64,
    ) -> Result<u32, Failure> {
        let (rows, columns) = (&block.rows, &block.columns);
        let is_mirrored = is_mirrored(plan, block);
        let mut values = vec![0.0; rows.len() * columns.len()];
        for Entry { pair: [i, j], path } in entries {
            let value = value(path);
            values[(i - rows.start) * columns.len() + j - columns.start] = value;
            if plan.is_symmetric() && !is_mirrored {
                values[(j - rows.start) * columns.len() + i - columns.start] = value;
            }
        }
        let mut sum = crc32fast::Hasher::new();
        let mut write = || -> io::Result<()> {
            let of_row =
                |row: usize| &values[(row - rows.start) * columns.len()..][..columns.len()];
            let mut column = Vec::new();
            for area in areas(plan, block) {
                let values = match area.mirrored {
                    None => of_row(area.row),
                    Some(at) => {
                        column.clear();
                        column.extend(values.iter().skip(at).step_by(columns.len()));
                        &column
                    }
                };
                self.matrix.write(area.row, area.column, values)?;
                add(&mut sum, values);
            }
            self.matrix.sync()
        };
        write().map_err(|error| failed(&self.path, error))?;
        Ok(sum.finalize())
    }

    /// The check sum of a block as it stands in the file.
    fn sum(&mut self, plan: &Plan, block: &Block) -> Result<u32, Failure> {
        let mut sum = crc32fast::Hasher::new();
        for area in areas(plan, block) {
            let values = self.matrix.read(area.row, area.column, area.length);
            let values = values.map_err(|error| failed(&self.path, error))?;
            add(&mut sum, &values);
        }
        Ok(sum.finalize())
    }
}

fn add(sum: &mut crc32fast::Hasher, values: &[f64]) {
    for value in values {
        sum.update(&value.to_le_bytes());
    }
}

/// Whether a block stands in a symmetric table twice.
fn is_mirrored(plan: &Plan, block: &Block) -> bool {
    plan.is_symmetric() && block.rows != block.columns
}

/// A part of a row of the table.
struct Area {
    row: usize,
    column: usize,
    length: usize,
    /// The column of the block that stands in this row.
    mirrored: Option<usize>,
}

/// Where a block stands in the table.
fn areas(plan: &Plan, block: &Block) -> Vec<Area> {
    let (rows, columns) = (&block.rows, &block.columns);
    let row = |row| Area {
        row,
        column: columns.start,
        length: columns.len(),
        mirrored: None,
    };
    let mirrored = |(at, row)| Area {
        row,
        column: rows.start,
        length: rows.len(),
        mirrored: Some(at),
    };
    let mut areas: Vec<Area> = rows.clone().map(row).collect();
    if is_mirrored(plan, block) {
        areas.extend(columns.clone().enumerate().map(mirrored));
    }
    areas
}

/// The blocks of an earlier run whose values are not what it wrote.
pub fn changed(
    settings: &Settings,
    plan: &Plan,
    blocks: &[Block],
    done: &[Done],
) -> Result<Vec<usize>, Failure> {
    if done.is_empty() {
        return Ok(Vec::new());
    }
    let mut now = vec![Sums::default(); done.len()];
    let output = Output::new(&settings.output);
    if plan.radius.is_some() {
        // Once the part is made into compressed rows these have sums of their own.
        let mut file = match File::open(&output.part) {
            Ok(file) => Some(file),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(failed(&output.part, error)),
        };
        for (now, done) in now.iter_mut().zip(done) {
            now.lengths_sum = match &mut file {
                None => done.sums.lengths_sum,
                // What cannot be read is not what was written.
                Some(file) => sparse::of_block(file, done)
                    .map_or(!done.sums.lengths_sum, |bytes| crc32fast::hash(&bytes)),
            };
        }
    } else {
        let mut sum_of = |whole: &Path, place: fn(&mut Sums) -> &mut u32| {
            let output = Output::new(whole);
            let mut dense = Dense::open(output.present().to_path_buf(), plan.shape(), false)?;
            for (now, done) in now.iter_mut().zip(done) {
                *place(now) = dense.sum(plan, &blocks[done.block])?;
            }
            Ok::<(), Failure>(())
        };
        sum_of(&settings.output, |sums| &mut sums.lengths_sum)?;
        if let Some(errors) = &settings.errors {
            sum_of(errors, |sums| &mut sums.errors_sum)?;
        }
    }
    if let Some(paths) = &settings.paths {
        let folder = Output::new(&paths.folder);
        let files = PathFiles::of(folder.present(), &paths.format);
        for (now, done) in now.iter_mut().zip(done) {
            let sum = files.sum(&blocks[done.block]);
            now.paths_sum = sum.map_err(|error| failed(folder.present(), error))?;
        }
    }
    let pairs = done.iter().zip(&now);
    let changed = pairs.filter(|(done, now)| done.sums != **now);
    Ok(changed.map(|(done, _)| done.block).collect())
}

/// Puts the complete results in their places.
pub fn complete(settings: &Settings, plan: &Plan, done: &[Done]) -> Result<(), Failure> {
    let output = Output::new(&settings.output);
    let errors = settings.errors.as_deref().map(Output::new);
    if plan.radius.is_some() {
        sparse::complete(plan, &output, errors.as_ref(), done)?;
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
