//! Isolines: the flags that ask for them, the lines found, their dimension forgotten, and what is
//! told of them.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use taut::End;
use taut::kind::Kind;
use taut::size::flat;
use taut_core::error::Error;
use taut_core::field::{Field, Fields, Isoline};
use taut_core::surface::Surface;
use taut_core::{Vector, parallel};
use taut_io::{Content, Polyline, write_polylines};

use crate::exit::Failure;
use crate::numbers::exponential;
use crate::output::line;
use crate::outputs::Files;
use crate::picture::Levels;
use crate::progress::Progress;
use crate::ready::Ready;
use crate::values::positive;

#[derive(Debug, Args)]
pub struct IsolineFlags {
    /// Write the isolines, which are polylines on the surface, with their levels: .ply .obj .csv
    /// .json .vtk .vtp
    #[arg(long, value_name = "FILE")]
    pub isolines: Option<PathBuf>,
    /// The distances of the isolines, such as 0.5,1,1.5 [default: round numbers, for about 16
    /// levels]
    #[arg(
        long,
        value_name = "V,..",
        allow_hyphen_values = true,
        value_delimiter = ',',
        requires = "isolines"
    )]
    #[arg(value_parser = positive)]
    pub levels: Vec<f64>,
}

impl IsolineFlags {
    pub fn is_given(&self) -> bool {
        self.isolines.is_some()
    }

    /// Adds the file that is written.
    pub fn files<'a>(&'a self, files: Files<'a>, dimension: Option<usize>) -> Files<'a> {
        let file = self.isolines.as_deref();
        files.writes("--isolines", file, Content::Paths, dimension)
    }

    /// The lines of a field, at `levels` where none are given.
    pub fn find<const D: usize>(
        &self,
        ready: &Ready<'_, D>,
        fields: &Fields<'_, D, Kind<D>>,
        field: &Field<D>,
        levels: &Levels,
    ) -> Result<Vec<Line>, Error> {
        let found = match &self.levels[..] {
            [] => fields.isolines(field, &levels.rounds())?,
            asked => fields.isolines(field, asked)?,
        };
        let surface = ready.geodesics.surface();
        let error = |point: &Vector<D>| {
            let end = End::Point((point + surface.origin()).as_slice().to_vec());
            let located = surface.locate(&end).ok()?;
            Some(fields.at(field, &located.0).error)
        };
        let centre = surface.origin();
        let line = |i: usize| Line::new(&found[i], &centre, ready.dimension, &error);
        Ok(parallel::map(found.len(), line))
    }

    /// Writes the file asked for; what is told of the lines.
    pub fn write(
        &self,
        lines: Option<&[Line]>,
        progress: &Progress,
    ) -> Result<Option<IsolineFacts>, Failure> {
        let (Some(file), Some(lines)) = (&self.isolines, lines) else {
            return Ok(None);
        };
        progress.step("writing the isolines");
        let polylines: Vec<Polyline<'_>> = lines.iter().map(Line::polyline).collect();
        write_polylines(file, &polylines)?;
        Ok(Some(IsolineFacts::of(lines)))
    }
}

/// A connected piece of an isoline, in the coordinates and units of the input.
pub struct Line {
    pub level: f64,
    /// Its first vertex is repeated at its end.
    pub closed: bool,
    /// By how much the distance at a vertex misses the level at most, as the field has it.
    pub miss: f64,
    /// The largest estimated error of the field at a vertex; `None` where it is not known at any.
    pub error: Option<f64>,
    dimension: usize,
    points: Vec<f64>,
    arc_length: Vec<f64>,
}

impl Line {
    fn new<const D: usize>(
        line: &Isoline<D>,
        centre: &Vector<D>,
        dimension: usize,
        error: &impl Fn(&Vector<D>) -> Option<f64>,
    ) -> Self {
        Self {
            error: line.points.iter().filter_map(error).reduce(f64::max),
            level: line.level,
            closed: line.closed,
            miss: line.miss,
            dimension,
            points: flat(&line.points, centre, dimension),
            arc_length: lengths(&line.points),
        }
    }

    fn polyline(&self) -> Polyline<'_> {
        Polyline {
            dimension: self.dimension,
            points: &self.points,
            normals: None,
            arc_length: &self.arc_length,
            level: Some(self.level),
        }
    }
}

/// The length of the polyline up to each vertex.
fn lengths<const D: usize>(points: &[Vector<D>]) -> Vec<f64> {
    let steps = points.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    let sums = steps.scan(0.0, |sum, step| {
        *sum += step;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// What is told of isolines.
#[derive(Serialize)]
pub struct IsolineFacts {
    pub lines: usize,
    /// Of these.
    pub closed: usize,
    /// By how much the field at a vertex misses its line's level at most.
    pub missed_most: f64,
    /// The largest estimated error of the field at a vertex. The true distance may miss the level by
    /// this as well.
    pub error_most: Option<f64>,
}

impl IsolineFacts {
    fn of(lines: &[Line]) -> Self {
        Self {
            lines: lines.len(),
            closed: lines.iter().filter(|line| line.closed).count(),
            missed_most: lines.iter().map(|line| line.miss).fold(0.0, f64::max),
            error_most: lines.iter().filter_map(|line| line.error).reduce(f64::max),
        }
    }

    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        // The distance that the field errs by is the line's error too.
        let off = exponential(self.error_most.map(|error| error + self.missed_most));
        let told = match self.lines {
            0 => "none".to_owned(),
            lines => format!(
                "{lines}, {} of them closed, off their level by an estimated {off} at most",
                self.closed
            ),
        };
        line(out, "isolines", &told)
    }
}
