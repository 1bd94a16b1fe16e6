//! `taut field`.

mod answer;
mod cost;
mod isolines;
mod write;

use std::path::Path;

use taut::End;
use taut::kind::{Kind, Place};
use taut::size::coordinates;
use taut_core::Vector;
use taut_core::error::Error;
use taut_core::field::{Cost, Field, Fields, Sources};
use taut_core::surface::Surface;
use taut_io::Content;

use crate::exit::{Exit, Failure};
use crate::outputs::Files;
use crate::picture::Levels;
use crate::progress::Progress;
use crate::ready::{self, Places, Question, Ready};
use crate::settings::{FieldSettings, Rates, Source as From};
use crate::surface::{FlatSamples, Samples, flat_samples};
use answer::{Answer, Found};
use isolines::Line;

/// Finds the distances and writes what was asked for.
pub fn run(settings: &FieldSettings, progress: &Progress) -> Result<Exit, Failure> {
    if settings.cost.is_some() && !matches!(settings.source, From::Cloud(_)) {
        let message = "--cost, --no-go and --slope: found a surface without points of its own, expected a cloud; leave them out";
        return Err(Failure::Usage(message.to_owned()));
    }
    files(settings).check()?;
    let question = Distances { settings, progress };
    let found = ready::ask(&settings.source, &settings.sources, &question, progress)
        .map_err(cost::refusal)?;
    write::write(settings, &found, progress)?;
    Ok(match found.answer.unknown() {
        0 => Exit::Success,
        _ => Exit::Unknown,
    })
}

/// The files that are read and written.
fn files(settings: &FieldSettings) -> Files<'_> {
    let at = settings.at.as_deref();
    let content = Content::Table {
        original: at.or_else(|| settings.source.points()),
        columns: if at.is_some() { 4 } else { 3 },
    };
    let dimension = settings.source.dimension();
    let mut files = Files::of(&settings.source)
        .reads_sources("--sources or --curve", &settings.sources)
        .reads("--at", at);
    if let Some(cost) = &settings.cost {
        if let Rates::File(file) = &cost.rates {
            files = files.reads("--cost", Some(file));
        }
        for file in &cost.no_go {
            files = files.reads("--no-go", Some(file));
        }
    }
    let isolines = settings.isolines.as_ref().map(|asked| asked.file.as_path());
    files
        .writes("--output", settings.output.as_deref(), content, dimension)
        .writes("--isolines", isolines, Content::Paths, dimension)
        .writes_picture(settings.picture.as_deref())
}

/// The distances that were asked for.
struct Distances<'a> {
    settings: &'a FieldSettings,
    progress: &'a Progress,
}

impl Question for Distances<'_> {
    type Answer = Found;

    fn file(&self) -> Option<&Path> {
        self.settings.at.as_deref()
    }

    fn answer<const D: usize>(&self, ready: &Ready<'_, D>) -> Result<Found, Failure> {
        let Self { settings, progress } = *self;
        let cost = match (&settings.cost, ready.points) {
            (Some(cost), Some(points)) => Some(cost::of_rows(cost, points)?),
            _ => None,
        };
        let asked = Asked {
            settings,
            ready,
            cost,
            progress,
        };
        asked.found()
    }
}

/// A surface with what is asked of it.
struct Asked<'a, const D: usize> {
    settings: &'a FieldSettings,
    ready: &'a Ready<'a, D>,
    cost: Option<Cost>,
    progress: &'a Progress,
}

impl<const D: usize> Asked<'_, D> {
    /// The field at the points of the file asked for, else at the surface's `own`, where it has any.
    fn found(&self) -> Result<Found, Failure> {
        let (settings, ready) = (self.settings, self.ready);
        let (points, vertices, sources_moved) = if settings.is_curve {
            let (vertices, moved) = ready.vertices(&settings.sources, self.progress)?;
            (Vec::new(), Some(vertices), moved)
        } else {
            let found = ready.sources(&settings.sources, &settings.starts, self.progress)?;
            (found.0, None, found.1)
        };
        let places = settings.at.as_ref();
        let places = places.map(|file| ready.places(file, self.progress));
        let places = places.transpose()?;
        let refused = |error| ready.refused(error);
        self.progress.step("distances");
        let fields = Kind::fields(ready.geodesics, self.cost.as_ref()).map_err(refused)?;
        let curve = vertices.map(|vertices| fields.curve(&vertices));
        let curve = curve.transpose().map_err(refused)?;
        let sources = curve
            .as_ref()
            .map_or_else(|| Sources::from(&points), Sources::from);
        let field = self.field(&fields, sources, places.as_ref());
        let field = field.map_err(refused)?;
        let kept = |mut answer: Answer| {
            if let Some(count) = self.settings.nearest {
                answer.keep_nearest(count);
            }
            answer
        };
        let own = self.own(&fields, &field);
        // The nearest of other points are not the nearest of the surface's own.
        let own = if places.is_none() { own.map(kept) } else { own };
        let needs_levels = self.settings.picture.is_some() || self.settings.isolines.is_some();
        let drawn = needs_levels.then(|| self.drawn(&fields, &field, own.as_ref()));
        let isolines = match (&self.settings.isolines, &drawn) {
            (Some(asked), Some((_, levels))) => {
                self.progress.step("isolines");
                let found = isolines::find(asked, levels, &fields, &field);
                let found = found.map_err(refused)?;
                let surface = self.ready.geodesics.surface();
                let error = |point: &Vector<D>| {
                    let end = End::Point(coordinates(&(point + surface.origin()), D));
                    let located = surface.locate(&end).ok()?;
                    Some(fields.at(&field, &located.0).error)
                };
                Some(Line::flattened(
                    &found,
                    &surface.origin(),
                    self.ready.dimension,
                    error,
                ))
            }
            _ => None,
        };
        let mut answer = match places {
            Some(places) => kept(self.at(&fields, &field, places)),
            None => own.ok_or_else(|| ready.without_points())?,
        };
        answer.warnings = self.warnings(&fields);
        Ok(Found {
            answer,
            sources: if settings.is_curve { 1 } else { points.len() },
            sources_moved,
            rows_kept: ready.rows_kept().map(<[usize]>::to_vec),
            drawn,
            isolines,
        })
    }

    /// What speaks against the distances, in sentences.
    fn warnings(&self, fields: &Fields<'_, D, Kind<D>>) -> Vec<String> {
        let mut warnings = self.ready.geodesics.surface().doubts();
        let polygons = self.settings.cost.iter().flat_map(|cost| &cost.no_go);
        let polygons: Vec<_> = polygons.collect();
        for idle in fields.idle_barriers() {
            let warning = cost::without_effect(polygons[idle]);
            self.progress.note(&warning);
            warnings.push(warning);
        }
        warnings
    }

    /// The field at the surface's own points, where it has any.
    fn own(&self, fields: &Fields<'_, D, Kind<D>>, field: &Field<D>) -> Option<Answer> {
        let values = self.ready.geodesics.surface().at_rows(fields, field)?;
        let mut answer = self.empty(self.ready.points?.coordinates.clone(), None);
        for value in &values {
            answer.push(value.as_ref());
        }
        Some(answer)
    }

    fn empty(&self, points: Vec<f64>, moved: Option<Vec<f64>>) -> Answer {
        Answer::new(self.ready.name, self.ready.dimension, points, moved)
    }

    /// The field, as far as it was asked for.
    fn field(
        &self,
        fields: &Fields<'_, D, Kind<D>>,
        sources: Sources<'_, D, Place<D>>,
        places: Option<&Places<D>>,
    ) -> Result<Field<D>, Error> {
        let settings = &self.settings.field;
        match (self.settings.nearest, places) {
            (None, _) => fields.from(sources, settings),
            (Some(count), None) => fields.nearest(sources, count, settings),
            (Some(count), Some(places)) => {
                let located = places.located.iter().flatten();
                let nodes: Vec<_> = located.map(|(node, _)| *node).collect();
                fields.nearest_of(sources, &nodes, count, settings)
            }
        }
    }

    fn at(&self, fields: &Fields<'_, D, Kind<D>>, field: &Field<D>, places: Places<D>) -> Answer {
        let moved = places.moved();
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
        fields: &Fields<'_, D, Kind<D>>,
        field: &Field<D>,
        own: Option<&Answer>,
    ) -> (FlatSamples, Levels) {
        if let Some(own) = own {
            let samples = FlatSamples {
                dimension: self.ready.dimension,
                points: own.points.clone(),
                discs: None,
            };
            return (samples, own.levels());
        }
        let surface = self.ready.geodesics.surface();
        let samples = flat_samples(
            &Samples::of(surface),
            &surface.origin(),
            self.ready.dimension,
        );
        let mut answer = self.empty(Vec::new(), None);
        for point in samples.points.chunks(self.ready.dimension) {
            let found = self.ready.locate(&End::Point(point.to_vec())).ok();
            let value = found.map(|(node, _)| fields.at(field, &node));
            answer.push(value.as_ref());
        }
        (samples, answer.levels())
    }
}
