//! What a way costs: the flags that say it, and the files that they name.

use std::path::{Path, PathBuf};

use clap::Args;
use taut_core::field::{Cost, Slope};
use taut_io::{PointSet, ReadError, read_numbers};

use crate::exit::Failure;
use crate::outputs::Files;
use crate::source::Source;
use crate::values::slope;

/// What ways cost, where that is not their length.
#[derive(Debug, Args)]
pub struct CostFlags {
    /// The cost per length at each point: a number above 0, or inf where nothing passes. Give a
    /// text file with one cost on each line, in the order of the points, or the name of a column of
    /// SURFACE's own file, such as intensity (in ply, las and laz, and in csv, xyz and txt with
    /// names in the first line). Distances are then costs
    #[arg(long, value_name = "FILE|COLUMN")]
    pub cost: Option<PathBuf>,
    /// A polygon, seen along z, that nothing passes: a text file with x and y of a corner on each
    /// line; repeat the flag for several polygons
    #[arg(long, value_name = "FILE.txt")]
    pub no_go: Vec<PathBuf>,
    /// What slopes multiply the cost by, with z pointing up: hiking (Tobler's time of walking), or
    /// UP,DOWN for 1 + UP times the grade uphill and 1 + DOWN times the grade downhill
    #[arg(long, value_name = "LAW", value_parser = slope)]
    pub slope: Option<Slope>,
}

impl CostFlags {
    fn is_given(&self) -> bool {
        self.cost.is_some() || !self.no_go.is_empty() || self.slope.is_some()
    }

    /// The file of costs, where none is in a column of the cloud's own file.
    fn file(&self) -> Option<&Path> {
        self.cost.as_deref().filter(|file| file.exists())
    }

    /// Has the column of costs read with the points of a cloud. Only a cloud has costs.
    pub fn check(&self, source: &mut Source) -> Result<(), Failure> {
        match source {
            _ if !self.is_given() => Ok(()),
            Source::Cloud(cloud) => {
                let column = self.cost.as_ref().filter(|_| self.file().is_none());
                cloud.options.column = column.map(|name| name.to_string_lossy().into_owned());
                Ok(())
            }
            Source::Model(_) | Source::Equations(_) => {
                let message = "--cost, --no-go and --slope: found a surface without points of its own, expected a cloud; leave them out";
                Err(Failure::Usage(message.to_owned()))
            }
        }
    }

    /// Adds the files that are read.
    pub fn files<'a>(&'a self, files: Files<'a>) -> Files<'a> {
        let polygons = self.no_go.iter();
        polygons.fold(files.reads("--cost", self.file()), |files, file| {
            files.reads("--no-go", Some(file))
        })
    }

    /// The cost at each row of a cloud; `None` where ways cost their length.
    pub fn of_rows(&self, points: &PointSet) -> Result<Option<Cost>, Failure> {
        if !self.is_given() {
            return Ok(None);
        }
        let at_rows = match (self.file(), &points.column) {
            (Some(file), _) => rates(file, points)?,
            (None, Some(column)) => column.clone(),
            (None, None) => Vec::new(),
        };
        let barriers = self.no_go.iter().map(|file| polygon(file));
        Ok(Some(Cost {
            at_rows,
            slope: self.slope.unwrap_or_default(),
            barriers: barriers.collect::<Result<_, _>>()?,
        }))
    }
}

/// Says what a name of a column could have meant where the cloud's file has none of that name.
pub fn refusal(failure: Failure) -> Failure {
    match failure {
        Failure::Read(ReadError::NoColumn {
            file,
            column,
            found,
        }) => Failure::Usage(format!(
            "--cost {column}: found no such file, and {found} in {}; name a file of costs, or a column beside the coordinates",
            file.display()
        )),
        other => other,
    }
}

/// That a polygon changes nothing.
pub fn without_effect(file: &Path) -> String {
    format!(
        "--no-go {}: no point lies in the polygon, and no way between neighbouring points crosses it; it changes nothing (are its corners in the coordinates of the points?)",
        file.display()
    )
}

/// One number for each row of the file of points, of which some may have been left out.
fn rates(file: &Path, points: &PointSet) -> Result<Vec<f64>, Failure> {
    let numbers = read_numbers(file)?;
    let wrong = |found: String, expected: &str| {
        Failure::Usage(format!(
            "--cost {}: found {found}, expected {expected}",
            file.display()
        ))
    };
    if numbers.columns != 1 {
        let found = format!("{} columns", numbers.columns);
        return Err(wrong(found, "one cost on each line"));
    }
    let found = format!("{} costs", numbers.values.len());
    match &points.rows_kept {
        None if numbers.values.len() == points.rows() => Ok(numbers.values),
        None => Err(wrong(
            found,
            &format!("{}, one for each point", points.rows()),
        )),
        Some(kept) => kept
            .iter()
            .map(|row| numbers.values.get(*row).copied())
            .collect::<Option<_>>()
            .ok_or_else(|| wrong(found, "one for each row of the file of points")),
    }
}

/// The corners of a polygon seen from above: the first two numbers of each line.
fn polygon(file: &Path) -> Result<Vec<[f64; 2]>, Failure> {
    let numbers = read_numbers(file)?;
    let corners = numbers.values.chunks(numbers.columns);
    if numbers.columns < 2 || corners.len() < 3 {
        return Err(Failure::Usage(format!(
            "--no-go {}: found {} lines of {} numbers, expected at least 3 corners of a polygon, x and y on each line",
            file.display(),
            corners.len(),
            numbers.columns
        )));
    }
    Ok(corners.map(|corner| [corner[0], corner[1]]).collect())
}
