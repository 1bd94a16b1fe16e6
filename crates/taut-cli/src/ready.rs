//! A surface made ready, for paths between ends or for a question about all of it: from settings to
//! a type of its dimension and kind.

use std::path::Path;

use taut::End;
use taut::equations::Implicit;
use taut::kind::{Kind, Place};
use taut::size::coordinates;
use taut_core::field::Source;
use taut_core::geodesics::Geodesics;
use taut_core::surface::{Node, Surface};
use taut_io::PointSet;

use crate::answer::outlying;
use crate::clouds;
use crate::equations;
use crate::exit::Failure;
use crate::located::locate;
use crate::models;
use crate::numbers::{rounding, significant};
use crate::prepared::Prepared;
use crate::progress::Progress;
use crate::settings::{self, CloudSettings, Sources};
use crate::sites::{self, Site};
use crate::surface::with_size;

/// Places on the surface, and how far each was moved there.
type Moved<T> = (Vec<T>, Vec<f64>);

/// A surface made ready.
pub struct Ready<'a, const D: usize> {
    pub name: &'a str,
    pub geodesics: &'a Geodesics<D, Kind<D>>,
    /// Coordinates of a point.
    pub dimension: usize,
    /// The file's points, where the surface was put through any.
    pub points: Option<&'a PointSet>,
}

/// What can be asked of a surface of any kind and dimension.
pub trait Question {
    /// Its dimension forgotten.
    type Answer;

    /// A file of points that are asked about.
    fn file(&self) -> Option<&Path> {
        None
    }

    fn answer<const D: usize>(&self, ready: &Ready<'_, D>) -> Result<Self::Answer, Failure>;
}

/// Makes a surface ready and locates the ends on it.
pub fn prepare(
    source: &settings::Source,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    match source {
        settings::Source::Cloud(settings) => clouds::prepare(settings, ends, progress),
        settings::Source::Model(file) => models::prepare(file, ends, progress),
        settings::Source::Equations(settings) => equations::prepare(settings, ends, progress),
    }
}

/// Makes a surface ready and answers the question; `sources` say which part of an equation's surface is meant.
pub fn ask<Q: Question>(
    source: &settings::Source,
    sources: &Sources,
    question: &Q,
    progress: &Progress,
) -> Result<Q::Answer, Failure> {
    match source {
        settings::Source::Cloud(cloud) => {
            clouds::refuse_mls(&cloud.model)?;
            let points = clouds::read(cloud, progress)?;
            with_size!(
                points.dimension,
                of_cloud<Q>(cloud, &points, question, progress)
            )
        }
        settings::Source::Model(file) => {
            let model = models::read(file, progress)?;
            with_size!(model.dimension(), of_model<Q>(file, &model, question))
        }
        settings::Source::Equations(law) => {
            with_size!(
                law.dimension,
                of_equations<Q>(law, sources, question, progress)
            )
        }
    }
}

fn of_cloud<const D: usize, Q: Question>(
    cloud: &CloudSettings,
    points: &PointSet,
    question: &Q,
    progress: &Progress,
) -> Result<Q::Answer, Failure> {
    let name = cloud.file.display().to_string();
    let atlas = clouds::atlas::<D>(&name, points, &cloud.model, progress)?;
    clouds::note_changes(&name, &atlas, progress);
    question.answer(&Ready {
        name: &name,
        geodesics: &Geodesics::of_atlas(atlas).into_kind(),
        dimension: points.dimension,
        points: Some(points),
    })
}

fn of_model<const D: usize, Q: Question>(
    file: &Path,
    model: &models::FileModel,
    question: &Q,
) -> Result<Q::Answer, Failure> {
    question.answer(&Ready {
        name: &file.display().to_string(),
        geodesics: &Geodesics::of_atlas(model.atlas::<D>()?).into_kind(),
        dimension: model.dimension(),
        points: None,
    })
}

fn of_equations<const D: usize, Q: Question>(
    law: &Implicit,
    sources: &Sources,
    question: &Q,
    progress: &Progress,
) -> Result<Q::Answer, Failure> {
    let mut sites = sites::of_sources(sources, law.dimension, progress)?;
    if let Some(file) = question.file() {
        let all = sites::of_file(file, law.dimension, progress)?;
        sites.extend(
            all.into_iter()
                .filter(|site| matches!(site.end, End::Point(_))),
        );
    }
    let ends = sites.iter().map(|site| &site.end);
    question.answer(&Ready {
        name: &law.law.to_string(),
        geodesics: &equations::geodesics::<D>(law, ends, progress)?,
        dimension: law.dimension,
        points: None,
    })
}

/// Points whose moves are told one by one.
const MOST_TOLD: usize = 8;

/// Points other than the surface's own that something was asked for at.
pub struct Places<const D: usize> {
    /// As given, row-major.
    pub points: Vec<f64>,
    /// Nodes of the surface and how far the points were moved there; `None` for those without a place on it.
    pub located: Vec<Option<(Node<D, Place<D>>, f64)>>,
}

impl<const D: usize> Places<D> {
    /// How far each point was moved onto the surface; not a number where it has no place there.
    pub fn moved(&self) -> Vec<f64> {
        let moved = |found: &Option<(_, f64)>| found.as_ref().map_or(f64::NAN, |found| found.1);
        self.located.iter().map(moved).collect()
    }
}

impl<const D: usize> Ready<'_, D> {
    /// The file's rows that the points come from, where some were left out.
    pub fn rows_kept(&self) -> Option<&[usize]> {
        self.points?.rows_kept.as_deref()
    }

    pub fn refused(&self, error: taut_core::error::Error) -> Failure {
        Failure::Surface {
            surface: self.name.to_owned(),
            error,
        }
    }

    /// The node of an end, and how far it was moved there.
    pub fn locate(&self, end: &End) -> Result<(Node<D, Place<D>>, f64), Failure> {
        let surface = self.geodesics.surface();
        locate(surface, self.dimension, self.rows_kept(), end).map_err(|reason| Failure::End {
            end: end.to_string(),
            reason,
        })
    }

    /// The sources with their start values: their own, else those of `starts`; and how far they were moved onto the
    /// surface.
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

    /// That the surface has no points of its own to ask at.
    pub fn without_points(&self) -> Failure {
        Failure::Usage(format!(
            "{}: found a surface without points of its own, expected points to find distances at; name them with --at FILE (taut sample writes some)",
            self.name
        ))
    }
}
