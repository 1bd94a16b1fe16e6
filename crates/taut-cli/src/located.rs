//! The points of a surface that a user names.

use std::path::Path;

use taut::End;
use taut::kind::{Located, Place, locate};
use taut::size::coordinates;
use taut_core::field::Source;
use taut_core::surface::{Node, Surface};

use crate::answer::outlying;
use crate::exit::Failure;
use crate::numbers::{rounding, significant};
use crate::progress::Progress;
use crate::ready::Ready;
use crate::sites::{self, Site};
use crate::source::Sources;

/// Places on the surface, and how far each was moved there.
type Moved<T> = (Vec<T>, Vec<f64>);

/// Points whose moves are told one by one.
const MOST_TOLD: usize = 8;

/// Points other than the surface's own that something was asked for at.
pub struct Places<const D: usize> {
    /// As given, row-major.
    pub points: Vec<f64>,
    /// Nodes of the surface and how far the points were moved there. `None` stands for a point without
    /// a place on it.
    pub located: Vec<Option<Located<D>>>,
}

impl<const D: usize> Places<D> {
    /// How far each point was moved onto the surface; not a number where it has no place there.
    pub fn moved(&self) -> Vec<f64> {
        let moved = |found: &Option<Located<D>>| found.as_ref().map_or(f64::NAN, |found| found.1);
        self.located.iter().map(moved).collect()
    }
}

impl<const D: usize> Ready<'_, D> {
    /// The node of an end, and how far it was moved there, or why it has none. Rows are those of the
    /// file.
    pub fn find(&self, end: &End) -> Result<Located<D>, String> {
        let surface = self.geodesics.surface();
        match (end, self.rows_kept()) {
            (End::Row(row), Some(rows)) => {
                let row = End::Row(row_read(*row, rows)?);
                locate(surface, self.dimension, &row)
            }
            _ => locate(surface, self.dimension, end),
        }
    }

    /// The same, where an end without a node is a failure.
    pub fn locate(&self, end: &End) -> Result<Located<D>, Failure> {
        self.find(end).map_err(|reason| refused(end, reason))
    }

    /// The sources with their start values, and how far they were moved onto the surface. A start
    /// value is the source's own, or else that of `starts`.
    pub fn sources(
        &self,
        sources: &Sources,
        starts: &[f64],
        progress: &Progress,
    ) -> Result<Moved<Source<D, Place<D>>>, Failure> {
        let sites = sites::of_sources(sources, self.dimension, progress)?;
        if !starts.is_empty() && starts.len() != sites.len() {
            return Err(Failure::Usage(format!(
                "--start: found {} values, expected one for each of {} sources",
                starts.len(),
                sites.len()
            )));
        }
        let source = |(i, site): (usize, &Site)| {
            let (node, moved) = self.locate(&site.end)?;
            if let Some(off) = self.geodesics.surface().spacings_off(&node, moved) {
                progress.note(&outlying(&site.end, off));
            }
            let start = site.value.or_else(|| starts.get(i).copied());
            let start = start.unwrap_or(0.0);
            Ok((Source { node, start }, moved))
        };
        let found = sites.iter().enumerate().map(source);
        let found: Vec<_> = found.collect::<Result<_, Failure>>()?;
        let (sources, moved): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let nodes: Vec<_> = sources
            .iter()
            .map(|source: &Source<D, _>| source.node)
            .collect();
        let ends: Vec<&End> = sites.iter().map(|site| &site.end).collect();
        self.tell_moved("source", &ends, &nodes, &moved, progress);
        Ok((sources, moved))
    }

    /// Says how far points were moved onto the surface, and warns where they hardly mean it.
    fn tell_moved(
        &self,
        what: &str,
        ends: &[&End],
        nodes: &[Node<D, Place<D>>],
        moved: &[f64],
        progress: &Progress,
    ) {
        let surface = self.geodesics.surface();
        let is_far = |i: usize| {
            let reach = surface.resolution(nodes[i].place);
            reach > 0.0 && moved[i] > reach
        };
        // Rows of a cloud lie off it by its noise.
        let is_told = |i: &usize| match ends[*i] {
            End::Point(point) => moved[*i] > rounding(point),
            End::Row(_) => is_far(*i),
        };
        let told: Vec<usize> = (0..ends.len()).filter(is_told).collect();
        let doubt = |i: usize| match is_far(i) {
            true => ", farther than a few spacings of the points there: is this the right surface?",
            false => "",
        };
        for i in told.iter().copied().take(MOST_TOLD) {
            progress.note(&format!(
                "{}: {what} {} was moved {} onto the surface{}",
                self.name,
                ends[i],
                significant(moved[i]),
                doubt(i)
            ));
        }
        let farthest = told
            .iter()
            .copied()
            .max_by(|a, b| moved[*a].total_cmp(&moved[*b]));
        if let Some(i) = farthest.filter(|_| told.len() > MOST_TOLD) {
            progress.note(&format!(
                "{}: {} more were moved; the farthest of all {} is {}, which was moved by {}{}",
                self.name,
                told.len() - MOST_TOLD,
                told.len(),
                ends[i],
                significant(moved[i]),
                doubt(i)
            ));
        }
    }

    /// The vertices of a curve, and how far they were moved onto the surface.
    pub fn vertices(
        &self,
        curve: &Sources,
        progress: &Progress,
    ) -> Result<Moved<Node<D, Place<D>>>, Failure> {
        let ends = sites::ends_of_sources("--curve", curve, self.dimension, progress)?;
        let found: Vec<_> = ends
            .iter()
            .map(|end| self.locate(end))
            .collect::<Result<_, _>>()?;
        let (nodes, moved): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let ends: Vec<&End> = ends.iter().collect();
        self.tell_moved("vertex", &ends, &nodes, &moved, progress);
        Ok((nodes, moved))
    }

    /// The points of a file; a row must have a place on the surface, a point need not.
    pub fn places(&self, file: &Path, progress: &Progress) -> Result<Places<D>, Failure> {
        let sites = sites::of_file(file, self.dimension, progress)?;
        let centre = self.geodesics.surface().origin();
        let mut points = Vec::with_capacity(sites.len() * self.dimension);
        let mut located = Vec::with_capacity(sites.len());
        for site in sites {
            let found = self.locate(&site.end);
            match &site.end {
                End::Point(point) => {
                    points.extend_from_slice(point);
                    located.push(found.ok());
                }
                End::Row(_) => {
                    let found = found?;
                    points.extend(coordinates(&(found.0.point + centre), self.dimension));
                    located.push(Some(found));
                }
            }
        }
        Ok(Places { points, located })
    }
}

/// That an end cannot be used.
pub fn refused(end: &End, reason: impl Into<String>) -> Failure {
    Failure::End {
        end: end.to_string(),
        reason: reason.into(),
    }
}

/// The position of a file's row among those that were read.
fn row_read(row: usize, rows_kept: &[usize]) -> Result<usize, String> {
    rows_kept.binary_search(&row).map_err(|_| {
        "the row is not among those read (left out by --class, marked invalid, or past the end)"
            .to_owned()
    })
}
