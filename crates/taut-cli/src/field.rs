//! `taut field`.

mod answer;
mod cost;
mod isolines;
mod write;

use std::path::Path;

use taut::error::Error;
use taut::field::{Cost, Field, Fields, Source};
use taut::geodesics::Geodesics;
use taut::surface::Node;
use taut_io::PointSet;

use crate::answer::coordinates;
use crate::clouds;
use crate::equations;
use crate::exit::{Exit, Failure};
use crate::models;
use crate::picture::Levels;
use crate::progress::Progress;
use crate::settings::{CloudSettings, End, EquationSettings, FieldSettings, Source as From};
use crate::sites::{self, Site};
use crate::surface::{FlatSamples, Locate, flat_samples, locate, with_size};
pub use answer::Answer;
use isolines::Line;

/// A field, its dimension forgotten, with what a picture shows of it.
struct Found {
    answer: Answer,
    sources: usize,
    /// The file's rows that the points come from, where some were left out.
    rows_kept: Option<Vec<usize>>,
    drawn: Option<(FlatSamples, Levels)>,
    isolines: Option<Vec<Line>>,
}

/// Finds the distances and writes what was asked for.
pub fn run(settings: &FieldSettings, progress: &Progress) -> Result<Exit, Failure> {
    if settings.cost.is_some() && !matches!(settings.source, From::Cloud(_)) {
        let message = "--cost, --no-go and --slope: found a surface without points of its own, expected a cloud; leave them out";
        return Err(Failure::Usage(message.to_owned()));
    }
    let found = match &settings.source {
        From::Cloud(cloud) => {
            clouds::refuse_mls(&cloud.model)?;
            let points = clouds::read(cloud, progress).map_err(cost::refusal)?;
            with_size!(
                points.dimension,
                of_cloud(settings, cloud, &points, progress)
            )?
        }
        From::Model(file) => {
            let model = models::read(file, progress)?;
            with_size!(
                model.dimension(),
                of_model(settings, file, &model, progress)
            )?
        }
        From::Equations(law) => with_size!(law.dimension, of_equations(settings, law, progress))?,
    };
    write::write(settings, &found, progress)?;
    Ok(Exit::Success)
}

fn of_cloud<const D: usize>(
    settings: &FieldSettings,
    cloud: &CloudSettings,
    points: &PointSet,
    progress: &Progress,
) -> Result<Found, Failure> {
    let name = cloud.file.display().to_string();
    let atlas = clouds::atlas::<D>(&name, points, &cloud.model, progress)?;
    clouds::note_changes(&name, &atlas, progress);
    let asked = Asked {
        settings,
        name: &name,
        geodesics: &Geodesics::of_atlas(atlas),
        dimension: points.dimension,
        rows_kept: points.rows_kept.as_deref(),
        cost: settings
            .cost
            .as_ref()
            .map(|cost| cost::of_rows(cost, points))
            .transpose()?,
        progress,
    };
    asked.found(|fields, field| {
        let values = fields.at_points(field);
        let mut answer = asked.empty(points.coordinates.clone(), None);
        for point in &asked.geodesics.surface().cloud().point_of_row {
            answer.push(point.map(|point| &values[point as usize]));
        }
        Some(answer)
    })
}

fn of_model<const D: usize>(
    settings: &FieldSettings,
    file: &Path,
    model: &models::FileModel,
    progress: &Progress,
) -> Result<Found, Failure> {
    let asked = Asked {
        settings,
        name: &file.display().to_string(),
        geodesics: &Geodesics::of_atlas(model.atlas::<D>()?),
        dimension: model.dimension(),
        rows_kept: None,
        cost: None,
        progress,
    };
    asked.found(|_, _| None)
}

fn of_equations<const D: usize>(
    settings: &FieldSettings,
    law: &EquationSettings,
    progress: &Progress,
) -> Result<Found, Failure> {
    let sources = sites::of_sources(&settings.sources, law.dimension, progress)?;
    let ends = sources.iter().map(|site| &site.end);
    let asked = Asked {
        settings,
        name: &law.law.to_string(),
        geodesics: &equations::geodesics::<D>(law, ends, progress)?,
        dimension: law.dimension,
        rows_kept: None,
        cost: None,
        progress,
    };
    asked.found(|_, _| None)
}

/// A surface with what is asked of it.
struct Asked<'a, const D: usize, S: Locate<D>> {
    settings: &'a FieldSettings,
    name: &'a str,
    geodesics: &'a Geodesics<D, S>,
    /// Coordinates of a point.
    dimension: usize,
    rows_kept: Option<&'a [usize]>,
    cost: Option<Cost>,
    progress: &'a Progress,
}

/// Points that distances were asked for at, other than the surface's own.
struct Places<const D: usize, P> {
    /// As given, row-major.
    points: Vec<f64>,
    /// Nodes of the surface and how far the points were moved there; `None` for those without a place on it.
    located: Vec<Option<(Node<D, P>, f64)>>,
}

impl<const D: usize, S: Locate<D>> Asked<'_, D, S> {
    /// The field at the points of the file asked for, else at the surface's `own`, where it has any.
    fn found(
        &self,
        own: impl FnOnce(&Fields<'_, D, S>, &Field<D>) -> Option<Answer>,
    ) -> Result<Found, Failure> {
        let sources = self.sources()?;
        let places = self.places()?;
        let refused = |error| Failure::Surface {
            surface: self.name.to_owned(),
            error,
        };
        self.progress.step("distances");
        let fields = S::fields(self.geodesics, self.cost.as_ref()).map_err(refused)?;
        let field = self
            .field(&fields, &sources, places.as_ref())
            .map_err(refused)?;
        let kept = |mut answer: Answer| {
            if let Some(count) = self.settings.nearest {
                answer.keep_nearest(count);
            }
            answer
        };
        let own = own(&fields, &field);
        // The nearest of other points are not the nearest of the surface's own.
        let own = if places.is_none() { own.map(kept) } else { own };
        let needs_levels = self.settings.picture.is_some() || self.settings.isolines.is_some();
        let drawn = needs_levels.then(|| self.drawn(&fields, &field, own.as_ref()));
        let isolines = match (&self.settings.isolines, &drawn) {
            (Some(asked), Some((_, levels))) => {
                self.progress.step("isolines");
                let found = isolines::find(asked, levels, &fields, &field);
                let found = found.map_err(refused)?;
                Some(Line::flattened(
                    &found,
                    &self.geodesics.surface().centre(),
                    self.dimension,
                ))
            }
            _ => None,
        };
        let answer = match places {
            Some(places) => kept(self.at(&fields, &field, places)),
            None => own.ok_or_else(|| Failure::Usage(format!(
                "{}: found a surface without points of its own, expected points to find distances at; name them with --at FILE (taut sample writes some)",
                self.name
            )))?,
        };
        Ok(Found {
            answer,
            sources: sources.len(),
            rows_kept: self.rows_kept.map(<[usize]>::to_vec),
            drawn,
            isolines,
        })
    }

    fn sources(&self) -> Result<Vec<Source<D, S::Place>>, Failure> {
        let sites = sites::of_sources(&self.settings.sources, self.dimension, self.progress)?;
        let starts = &self.settings.starts;
        if !starts.is_empty() && starts.len() != sites.len() {
            return Err(Failure::Usage(format!(
                "--start: found {} values, expected one for each of {} sources",
                starts.len(),
                sites.len()
            )));
        }
        let source = |(i, site): (usize, &Site)| {
            let (node, _) = self.locate(&site.end)?;
            let start = site.value.or_else(|| starts.get(i).copied());
            Ok(Source {
                node,
                start: start.unwrap_or(0.0),
            })
        };
        sites.iter().enumerate().map(source).collect()
    }

    fn locate(&self, end: &End) -> Result<(Node<D, S::Place>, f64), Failure> {
        let surface = self.geodesics.surface();
        locate(surface, self.dimension, self.rows_kept, end).map_err(|reason| Failure::End {
            end: end.to_string(),
            reason,
        })
    }

    fn empty(&self, points: Vec<f64>, moved: Option<Vec<f64>>) -> Answer {
        Answer::new(self.name, self.dimension, points, moved)
    }

    /// The field, as far as it was asked for.
    fn field(
        &self,
        fields: &Fields<'_, D, S>,
        sources: &[Source<D, S::Place>],
        places: Option<&Places<D, S::Place>>,
    ) -> Result<Field<D>, Error> {
        let settings = &self.settings.field;
        match (self.settings.nearest, places) {
            (None, _) => fields.from(sources, settings),
            (Some(count), None) => S::nearest(fields, sources, count, settings),
            (Some(count), Some(places)) => {
                let located = places.located.iter().flatten();
                let nodes: Vec<_> = located.map(|(node, _)| *node).collect();
                fields.nearest_of(sources, &nodes, count, settings)
            }
        }
    }

    /// Where distances were asked for; a row must have a place on the surface, a point need not.
    fn places(&self) -> Result<Option<Places<D, S::Place>>, Failure> {
        let Some(file) = &self.settings.at else {
            return Ok(None);
        };
        let sites = sites::of_file(file, self.dimension, self.progress)?;
        let centre = self.geodesics.surface().centre();
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
        Ok(Some(Places { points, located }))
    }

    fn at(
        &self,
        fields: &Fields<'_, D, S>,
        field: &Field<D>,
        places: Places<D, S::Place>,
    ) -> Answer {
        let moved = |found: &Option<(_, f64)>| found.as_ref().map_or(f64::NAN, |found| found.1);
        let moved = places.located.iter().map(moved).collect();
        let mut answer = self.empty(places.points, Some(moved));
        for found in places.located {
            let value = found.map(|(node, _)| fields.at(field, &node));
            answer.push(value.as_ref());
        }
        answer
    }

    /// Points of the surface, its own where it has any, with the field at them.
    fn drawn(
        &self,
        fields: &Fields<'_, D, S>,
        field: &Field<D>,
        own: Option<&Answer>,
    ) -> (FlatSamples, Levels) {
        if let Some(own) = own {
            let samples = FlatSamples {
                dimension: self.dimension,
                points: own.points.clone(),
                discs: None,
            };
            return (samples, Levels::of(own));
        }
        let surface = self.geodesics.surface();
        let samples = flat_samples(&surface.samples(), &surface.centre(), self.dimension);
        let mut answer = self.empty(Vec::new(), None);
        for point in samples.points.chunks(self.dimension) {
            let found = self.locate(&End::Point(point.to_vec())).ok();
            let value = found.map(|(node, _)| fields.at(field, &node));
            answer.push(value.as_ref());
        }
        let levels = Levels::of(&answer);
        (samples, levels)
    }
}
