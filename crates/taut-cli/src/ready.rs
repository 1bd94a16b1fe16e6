//! The one road from settings to a surface: here its dimension and its kind become types.

use taut::End;
use taut::equations::Implicit;
use taut_core::geodesics::Geodesics;
use taut_core::guess::Guide;
use taut_core::surface::atlas::Atlas;
use taut_core::surface::mls::MovingLeastSquares;
use taut_io::PointSet;

use crate::clouds;
use crate::equations;
use crate::exit::Failure;
use crate::models::{self, FileModel};
use crate::progress::Progress;
use crate::settings::{Model, Source};
use crate::surface::{FlatSamples, Show, flat_samples, too_many};
use crate::values::Reconstruction;

/// A surface made ready.
pub struct Ready<'a, const D: usize, S: Guide<D>> {
    pub name: &'a str,
    pub geodesics: Geodesics<D, S>,
    /// Coordinates of a point.
    pub dimension: usize,
    /// The file's points, where the surface was put through any.
    pub points: Option<&'a PointSet>,
}

/// A surface of charts, through points or of a model.
pub type Charts<'a, const D: usize> = Ready<'a, D, Atlas<D>>;
/// A surface of moving least squares.
pub type Mls<'a> = Ready<'a, 3, MovingLeastSquares<3>>;

/// What is done with a surface, kind by kind.
pub trait Visit: Sized {
    /// What comes of it, free of the surface's types.
    type Answer;

    fn charts<const D: usize>(
        self,
        ready: &Charts<'_, D>,
        progress: &Progress,
    ) -> Result<Self::Answer, Failure>;

    /// What is done says which part of the surface it needs, and how.
    fn equations<const D: usize>(
        self,
        law: &Implicit,
        progress: &Progress,
    ) -> Result<Self::Answer, Failure>;

    /// `_make` puts the surface through its points.
    fn mls<'a>(
        self,
        _make: impl FnOnce() -> Result<Mls<'a>, Failure>,
        _progress: &Progress,
    ) -> Result<Self::Answer, Failure> {
        Err(paths_alone())
    }
}

/// What is asked in the same way of every kind of surface.
pub trait Question: Sized {
    /// What is found, free of the surface's types.
    type Answer;

    /// Points on the part of an equation's surface that is meant.
    fn seeds(&self, dimension: usize, progress: &Progress) -> Result<Vec<End>, Failure>;

    fn answer<const D: usize, S: Show<D>>(
        self,
        ready: &Ready<'_, D, S>,
        progress: &Progress,
    ) -> Result<Self::Answer, Failure>;

    /// As [`Visit::mls`]: questions about paths have an answer there.
    fn answer_mls<'a>(
        self,
        _make: impl FnOnce() -> Result<Mls<'a>, Failure>,
        _progress: &Progress,
    ) -> Result<Self::Answer, Failure> {
        Err(paths_alone())
    }
}

fn paths_alone() -> Failure {
    let message = "--surface mls: only taut path works on this surface; leave it out";
    Failure::Usage(message.to_owned())
}

impl<Q: Question> Visit for Q {
    type Answer = Q::Answer;

    fn charts<const D: usize>(
        self,
        ready: &Charts<'_, D>,
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

    fn mls<'a>(
        self,
        make: impl FnOnce() -> Result<Mls<'a>, Failure>,
        progress: &Progress,
    ) -> Result<Q::Answer, Failure> {
        self.answer_mls(make, progress)
    }
}

/// What a surface is made of, as it was read.
enum Opened<'a> {
    /// Points, and what errors call them.
    Points(&'a str, &'a PointSet, &'a Model),
    Model(&'a FileModel),
    Law(&'a Implicit),
}

/// Makes the surface of the settings, and visits it.
pub fn visit<V: Visit>(
    source: &Source,
    visitor: V,
    progress: &Progress,
) -> Result<V::Answer, Failure> {
    match source {
        Source::Cloud(cloud) => {
            let points = clouds::read(cloud, progress)?;
            let name = cloud.file.display().to_string();
            visit_points(&name, &points, &cloud.model, visitor, progress)
        }
        Source::Model(file) => {
            let model = models::read(file, progress)?;
            let dimension = model.dimension();
            sized(dimension, Opened::Model(&model), visitor, progress)
        }
        Source::Equations(law) => sized(law.dimension, Opened::Law(law), visitor, progress),
    }
}

/// Puts a surface through points that errors call by a name, and visits it.
pub fn visit_points<V: Visit>(
    name: &str,
    points: &PointSet,
    model: &Model,
    visitor: V,
    progress: &Progress,
) -> Result<V::Answer, Failure> {
    match model.reconstruction {
        Reconstruction::Atlas => {
            let opened = Opened::Points(name, points, model);
            sized(points.dimension, opened, visitor, progress)
        }
        Reconstruction::Mls => visitor.mls(|| mls(name, points, model, progress), progress),
    }
}

/// The one place where the dimension of space becomes a type.
fn sized<V: Visit>(
    dimension: usize,
    opened: Opened<'_>,
    visitor: V,
    progress: &Progress,
) -> Result<V::Answer, Failure> {
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
        Opened::Model(model) => (model.name(), model.atlas::<D>()?, model.dimension(), None),
        Opened::Law(law) => return visitor.equations::<D>(law, progress),
    };
    let ready = Ready {
        name,
        geodesics: Geodesics::of_atlas(atlas),
        dimension,
        points,
    };
    visitor.charts(&ready, progress)
}

fn mls<'a>(
    name: &'a str,
    points: &'a PointSet,
    model: &Model,
    progress: &Progress,
) -> Result<Mls<'a>, Failure> {
    if !(2..=3).contains(&points.dimension) {
        return Err(Failure::Usage(format!(
            "--surface mls: found points of {} coordinates, expected 2 or 3; leave it out",
            points.dimension
        )));
    }
    let atlas = clouds::atlas::<3>(name, points, model, progress)?;
    clouds::note_changes(name, &atlas, progress);
    Ok(Ready {
        name,
        geodesics: Geodesics::of_mls(atlas, None)
            .map_err(|error| Failure::Usage(format!("{name}: {error}")))?,
        dimension: points.dimension,
        points: Some(points),
    })
}

impl<const D: usize> Charts<'_, D> {
    /// Notes what was done to points before a surface was put through them.
    pub fn note_changes(&self, progress: &Progress) {
        if self.points.is_some() {
            clouds::note_changes(self.name, self.geodesics.surface(), progress);
        }
    }
}

impl<const D: usize, S: Show<D>> Ready<'_, D, S> {
    /// The file's rows that the points come from, where some were left out.
    pub fn rows_kept(&self) -> Option<&[usize]> {
        self.points?.rows_kept.as_deref()
    }

    /// Points of the surface for a picture.
    pub fn samples(&self) -> FlatSamples {
        let surface = self.geodesics.surface();
        flat_samples(&surface.samples(), &surface.centre(), self.dimension)
    }

    pub fn refused(&self, error: taut_core::error::Error) -> Failure {
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
