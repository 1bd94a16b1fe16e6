//! The one road from settings to a surface: here its dimension becomes a type.

use taut::End;
use taut::equations::Implicit;
use taut::kind::Kind;
use taut_core::error::Error;
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_core::surface::Surface;
use taut_core::surface::atlas::Atlas;
use taut_io::PointSet;

use crate::clouds;
use crate::equations;
use crate::exit::Failure;
use crate::models::{self, FileModel};
use crate::progress::Progress;
use crate::source::{CloudSurface, Source};
use crate::surface::{FlatSamples, Samples, flat_samples, too_many};
use crate::values::Reconstruction;

/// A surface made ready.
pub struct Ready<'a, const D: usize> {
    pub name: &'a str,
    pub geodesics: Geodesics<D, Kind<D>>,
    /// Coordinates of a point.
    pub dimension: usize,
    /// The file's points, where the surface was put through any.
    pub points: Option<&'a PointSet>,
}

/// What is done with a surface, kind by kind: once it is known which, its dimension is a type.
pub trait Visit: Sized {
    /// What comes of it, free of the surface's types.
    type Answer;

    /// The surface is made of charts.
    fn charts<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<Self::Answer, Failure>;

    /// The surface is that of equations, of which the visitor says what part it needs and how.
    fn equations<const D: usize>(
        self,
        law: &Implicit,
        progress: &Progress,
    ) -> Result<Self::Answer, Failure>;
}

/// What is asked in the same way of every kind of surface. Every question is a [`Visit`].
pub trait Question: Sized {
    /// What is found, free of the surface's types.
    type Answer;

    /// Points on the part of an equation's surface that is meant.
    fn seeds(&self, dimension: usize, progress: &Progress) -> Result<Vec<End>, Failure>;

    fn answer<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<Self::Answer, Failure>;
}

impl<Q: Question> Visit for Q {
    type Answer = Q::Answer;

    fn charts<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<Q::Answer, Failure> {
        ready.note_changes(progress);
        self.answer(ready, progress)
    }

    fn equations<const D: usize>(
        self,
        law: &Implicit,
        progress: &Progress,
    ) -> Result<Q::Answer, Failure> {
        let seeds = self.seeds(law.dimension, progress)?;
        let ready = Ready {
            name: &law.law.to_string(),
            geodesics: equations::geodesics::<D>(law, &seeds, progress)?,
            dimension: law.dimension,
            points: None,
        };
        self.answer(&ready, progress)
    }
}

/// What a surface is made of, as it was read, and what errors call it.
enum Opened<'a> {
    Points(&'a str, &'a PointSet, &'a CloudSurface),
    Model(&'a str, &'a FileModel),
    Law(&'a Implicit),
}

/// Makes the surface of a source, and visits it.
pub fn visit<V: Visit>(
    source: &Source,
    visitor: V,
    progress: &Progress,
) -> Result<V::Answer, Failure> {
    let name = source.name();
    match source {
        Source::Cloud(cloud) if cloud.model.reconstruction == Reconstruction::Mls => {
            let message = "--surface mls: only taut path works on this surface; leave it out";
            Err(Failure::Usage(message.to_owned()))
        }
        Source::Cloud(cloud) => {
            let points = clouds::read(&cloud.file, &cloud.options, progress)?;
            visit_points(&name, &points, &cloud.model, visitor, progress)
        }
        Source::Model(file) => {
            let model = models::read(file, progress)?;
            sized(Opened::Model(&name, &model), visitor, progress)
        }
        Source::Equations(law) => sized(Opened::Law(law), visitor, progress),
    }
}

/// Puts a surface of charts through points that errors call by a name, and visits it.
pub fn visit_points<V: Visit>(
    name: &str,
    points: &PointSet,
    model: &CloudSurface,
    visitor: V,
    progress: &Progress,
) -> Result<V::Answer, Failure> {
    sized(Opened::Points(name, points, model), visitor, progress)
}

/// As [`visit`], but also on surfaces of moving least squares, where paths alone are found.
pub fn visit_for_paths<Q: Question>(
    source: &Source,
    question: Q,
    progress: &Progress,
) -> Result<Q::Answer, Failure> {
    match source {
        Source::Cloud(cloud) if cloud.model.reconstruction == Reconstruction::Mls => {
            let points = clouds::read(&cloud.file, &cloud.options, progress)?;
            let name = source.name();
            let ready = Ready {
                name: &name,
                geodesics: clouds::mls(&name, &points, &cloud.model, progress)?,
                dimension: points.dimension,
                points: Some(&points),
            };
            question.answer(&ready, progress)
        }
        _ => visit(source, question, progress),
    }
}

/// The one place where the dimension of space becomes a type.
fn sized<V: Visit>(
    opened: Opened<'_>,
    visitor: V,
    progress: &Progress,
) -> Result<V::Answer, Failure> {
    let dimension = match opened {
        Opened::Points(_, points, _) => points.dimension,
        Opened::Model(_, model) => model.dimension(),
        Opened::Law(law) => law.dimension,
    };
    taut::by_size!(dimension, too_many, made<V>(opened, visitor, progress))
}

fn made<const D: usize, V: Visit>(
    opened: Opened<'_>,
    visitor: V,
    progress: &Progress,
) -> Result<V::Answer, Failure> {
    let (name, atlas, dimension, points) = match opened {
        Opened::Points(name, points, model) => {
            let atlas = clouds::atlas::<D>(name, points, model, progress)?;
            (name, atlas, points.dimension, Some(points))
        }
        Opened::Model(name, model) => (name, model.atlas::<D>()?, model.dimension(), None),
        Opened::Law(law) => return visitor.equations::<D>(law, progress),
    };
    let ready = Ready {
        name,
        geodesics: Geodesics::of_atlas(atlas).into_kind(),
        dimension,
        points,
    };
    visitor.charts(&ready, progress)
}

impl<const D: usize> Ready<'_, D> {
    /// Notes what was done to points before charts were put through them.
    pub fn note_changes(&self, progress: &Progress) {
        if let (Some(_), Ok(atlas)) = (self.points, self.atlas()) {
            clouds::note_changes(self.name, atlas, progress);
        }
    }

    /// The charts that the surface is made of.
    pub fn atlas(&self) -> Result<&Atlas<D>, Failure> {
        let atlas = self.geodesics.surface().atlas();
        atlas.ok_or_else(|| self.refused(Error::NoCloud))
    }

    /// The file's rows that the points come from, where some were left out.
    pub fn rows_kept(&self) -> Option<&[usize]> {
        self.points?.rows_kept.as_deref()
    }

    /// Points of the surface for a picture.
    pub fn samples(&self) -> FlatSamples {
        let surface = self.geodesics.surface();
        flat_samples(&Samples::of(surface), &surface.origin(), self.dimension)
    }

    pub fn refused(&self, error: Error) -> Failure {
        Failure::Surface {
            surface: self.name.to_owned(),
            error,
        }
    }

    /// That the surface has no points of its own to ask at.
    pub fn without_points(&self) -> Failure {
        Failure::Usage(format!(
            "{}: found a surface without points of its own, expected points to find distances at; name them with --at FILE (taut sample writes some)",
            self.name
        ))
    }
}
