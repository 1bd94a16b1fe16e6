//! `taut sample`.

use std::io::Write;

use serde::Serialize;
use taut::End;
use taut::equations::{Implicit, Law, extent};
use taut::kind::locate_on;
use taut::size::{flat, padded};
use taut_core::Vector;
use taut_core::geodesics::Geodesics;
use taut_core::guess::particles::{self, Quality, Region, Sampling};
use taut_core::surface::atlas::{Atlas, ChartIndex};
use taut_core::surface::implicit::{Equations, ImplicitSurface};
use taut_core::surface::{Geometry, Node, Surface};
use taut_io::{Content, PointSet};

use crate::clouds;
use crate::either::Either;
use crate::equations;
use crate::exit::{Exit, Failure};
use crate::farthest;
use crate::models::{self, FileModel};
use crate::numbers::significant;
use crate::output::{line, tell};
use crate::outputs::Files;
use crate::picture;
use crate::progress::Progress;
use crate::settings::{Model, SampleSettings, Source};
use crate::sites;
use crate::surface::{FlatSamples, corners, with_size};

/// Points spread over a surface, their dimension forgotten.
struct Sampled {
    dimension: usize,
    points: Vec<f64>,
    normals: Vec<f64>,
    spacings: Vec<f64>,
    /// Whether there is one normal at a point.
    is_hypersurface: bool,
    quality: Quality,
}

/// What is told of them. Lengths are in the units of the input.
#[derive(Serialize)]
struct Facts {
    surface: String,
    points: usize,
    nearest: f64,
    spread: f64,
    density_follows_curvature: f64,
}

/// Samples the surface and writes what was asked for.
pub fn run(settings: &SampleSettings, progress: &Progress) -> Result<Exit, Failure> {
    let dimension = settings.source.dimension();
    Files::of(&settings.source)
        .reads_sources("--sources", &settings.sources)
        .writes(
            "--output",
            settings.output.as_deref(),
            Content::Points,
            dimension,
        )
        .writes_picture(settings.picture.as_deref())
        .check()?;
    match &settings.source {
        Source::Cloud(cloud) if settings.farthest => farthest::run(settings, cloud, progress),
        _ if settings.farthest => Err(Failure::Usage(
            "--farthest: found a surface without points of its own, expected a cloud; leave it out"
                .to_owned(),
        )),
        _ => spread(settings, progress),
    }
}

fn spread(settings: &SampleSettings, progress: &Progress) -> Result<Exit, Failure> {
    let ends =
        |dimension| sites::ends_of_sources("--sources", &settings.sources, dimension, progress);
    let (name, sampled) = match &settings.source {
        Source::Equations(law) => {
            let sources = ends(law.dimension)?;
            let sampled = with_size!(
                law.dimension,
                of_equations(settings, law, &sources, progress)
            )?;
            (law.law.to_string(), sampled)
        }
        Source::Cloud(cloud) => {
            clouds::refuse_mls(&cloud.model)?;
            let points = clouds::read(cloud, progress)?;
            let sources = ends(points.dimension)?;
            let name = cloud.file.display().to_string();
            let sampled = with_size!(
                points.dimension,
                of_cloud(settings, &name, &points, &cloud.model, &sources, progress)
            )?;
            (name, sampled)
        }
        Source::Model(file) => {
            let model = models::read(file, progress)?;
            let sources = ends(model.dimension())?;
            let name = file.display().to_string();
            let sampled = with_size!(
                model.dimension(),
                of_model(settings, &name, &model, &sources, progress)
            )?;
            (name, sampled)
        }
    };
    write_files(settings, &sampled, progress)?;
    progress.clear();
    let facts = Facts {
        surface: name,
        points: sampled.spacings.len(),
        nearest: sampled.quality.nearest,
        spread: sampled.quality.spread,
        density_follows_curvature: sampled.quality.density_follows_curvature,
    };
    tell(&facts, settings.json, |out, facts| write(out, facts))?;
    Ok(Exit::Success)
}

/// Particles on a surface, and how its coordinates become the user's.
struct Start<'a, const D: usize> {
    name: &'a str,
    surface: Either<'a, D>,
    centre: Vector<D>,
    /// Coordinates of a point.
    dimension: usize,
    sources: Vec<Node<D, ChartIndex>>,
    /// The sources were given: they stay where they are.
    fixed: bool,
    size: f64,
    region: Option<Region<D>>,
}

fn of_equations<const D: usize>(
    settings: &SampleSettings,
    law: &Implicit,
    sources: &[End],
    progress: &Progress,
) -> Result<Sampled, Failure> {
    let refused = |error| equations::refused(law, "--bounds or --source", error);
    let searched = law.searched::<D>().map_err(refused)?;
    if let (Law::Texts(_), None, []) = (&law.law, &law.bounds, sources) {
        progress.note(&format!(
            "{}: without --bounds the points start between {:?} and {:?}; if the surface goes on without end, they cover some part of it",
            law.law, searched.low, searched.high
        ));
    }
    let given = equations::points_of(sources, law.dimension)?;
    let region = law.region(&given);
    let seeds: Vec<Vector<D>> = match given[..] {
        [] => law.seeds(&searched).map_err(refused)?,
        _ => given.iter().map(|point| padded(point)).collect(),
    };
    let size = match &region {
        Some(region) => 0.5 * region.diagonal(),
        None if given.is_empty() => searched.high.iter().copied().fold(0.0, f64::max),
        None => extent(&given),
    };
    let surface = ImplicitSurface::new(law.system::<D>().map_err(refused)?, size);
    let codimension = Equations::<D>::count(surface.equations());
    if codimension >= D {
        return Err(Failure::Surface {
            surface: law.law.to_string(),
            error: taut_core::error::Error::NoDimensionLeft {
                equations: codimension,
                dimension: D,
            },
        });
    }
    progress.step("particles");
    let surface = Either::Equations(&surface);
    let start = Start {
        name: &law.law.to_string(),
        sources: on_surface(&surface, &seeds)?,
        surface,
        centre: Vector::zeros(),
        dimension: law.dimension,
        fixed: !given.is_empty(),
        size,
        region: region.map(|region| Region {
            low: padded(&region.low),
            high: padded(&region.high),
        }),
    };
    start.spread(settings)
}

fn of_cloud<const D: usize>(
    settings: &SampleSettings,
    name: &str,
    points: &PointSet,
    model: &Model,
    sources: &[End],
    progress: &Progress,
) -> Result<Sampled, Failure> {
    let atlas = clouds::atlas::<D>(name, points, model, progress)?;
    clouds::note_changes(name, &atlas, progress);
    of_atlas(settings, name, atlas, points.dimension, sources, progress)
}

fn of_model<const D: usize>(
    settings: &SampleSettings,
    name: &str,
    model: &FileModel,
    sources: &[End],
    progress: &Progress,
) -> Result<Sampled, Failure> {
    let atlas = model.atlas::<D>()?;
    of_atlas(settings, name, atlas, model.dimension(), sources, progress)
}

fn of_atlas<const D: usize>(
    settings: &SampleSettings,
    name: &str,
    atlas: Atlas<D>,
    dimension: usize,
    sources: &[End],
    progress: &Progress,
) -> Result<Sampled, Failure> {
    progress.step("particles");
    let (low, high) = corners(&atlas.cloud().points);
    let geodesics = Geodesics::of_atlas(atlas);
    let atlas = geodesics.surface();
    let located = |end: &End| match end {
        End::Point(point) if point.len() != dimension => Err(Failure::End {
            end: end.to_string(),
            reason: format!(
                "expected {dimension} coordinates, as many as the points of the surface have"
            ),
        }),
        _ => locate_on(atlas, end)
            .map(|(node, _)| node)
            .map_err(|error| Failure::End {
                end: end.to_string(),
                reason: error.to_string(),
            }),
    };
    let given: Vec<_> = sources.iter().map(located).collect::<Result<_, _>>()?;
    let start = Start {
        name,
        surface: Either::Charts(atlas),
        centre: atlas.cloud().centre,
        dimension,
        fixed: !given.is_empty(),
        sources: match given[..] {
            [] => one_of_each(&geodesics, settings.count, name, progress),
            _ => given,
        },
        size: (high - low).norm(),
        region: None,
    };
    start.spread(settings)
}

/// A node of each component that is large enough for a point.
fn one_of_each<const D: usize>(
    geodesics: &Geodesics<D, Atlas<D>>,
    count: usize,
    name: &str,
    progress: &Progress,
) -> Vec<Node<D, ChartIndex>> {
    let nodes = geodesics.surface().nodes();
    let sizes = geodesics.component_sizes();
    let large = sizes.iter().filter(|size| **size * count >= nodes.len());
    let large = large.count();
    if large < sizes.len() {
        progress.note(&format!(
            "{name}: {} of {} pieces are too small for a point and get none",
            sizes.len() - large,
            sizes.len()
        ));
    }
    let first = |component: u32| {
        let mut of_each = geodesics.components().iter();
        of_each
            .position(|c| *c == component)
            .map(|chart| nodes[chart])
    };
    (0..large as u32).filter_map(first).collect()
}

impl<const D: usize> Start<'_, D> {
    fn spread(&self, settings: &SampleSettings) -> Result<Sampled, Failure> {
        let of_particles = particles::Settings {
            region: self.region,
            spread: settings.spread,
            seed: settings.seed,
            ..particles::Settings::new(self.size)
        };
        let Sampling {
            nodes,
            normals,
            spacings,
            quality,
            ..
        } = particles::sample(
            &self.surface,
            &self.sources,
            self.fixed,
            settings.count,
            &of_particles,
        )
        .map_err(|error| Failure::Surface {
            surface: self.name.to_owned(),
            error,
        })?;
        let points: Vec<Vector<D>> = nodes.iter().map(|node| node.point).collect();
        Ok(Sampled {
            dimension: self.dimension,
            points: flat(&points, &self.centre, self.dimension),
            normals: flat(&normals, &Vector::zeros(), self.dimension),
            spacings,
            is_hypersurface: self.surface.intrinsic_dimension() + 1 == self.dimension,
            quality,
        })
    }
}

/// The feet of the sources.
fn on_surface<const D: usize>(
    surface: &Either<'_, D>,
    points: &[Vector<D>],
) -> Result<Vec<Node<D, ChartIndex>>, Failure> {
    let mut scratch = Geometry::new(D - surface.intrinsic_dimension());
    let foot = |point: &Vector<D>| {
        let mut place = 0;
        let foot = surface.foot(point, &mut place, &mut scratch);
        foot.map(|point| Node { point, place })
            .ok_or_else(|| Failure::End {
                end: format!("{:?}", point.as_slice()),
                reason: "the point cannot be pulled back onto the surface".to_owned(),
            })
    };
    points.iter().map(foot).collect()
}

/// Radius of a point in a picture, in spacings.
const DOT: f64 = 0.3;

fn write_files(
    settings: &SampleSettings,
    sampled: &Sampled,
    progress: &Progress,
) -> Result<(), Failure> {
    if let Some(file) = &settings.output {
        progress.step("writing the points");
        let normals = sampled.is_hypersurface.then_some(&sampled.normals[..]);
        taut_io::write_points(file, sampled.dimension, &sampled.points, normals)?;
    }
    if let Some(file) = &settings.picture {
        progress.step("drawing");
        let radii = sampled.spacings.iter().map(|spacing| DOT * spacing);
        let samples = FlatSamples {
            dimension: sampled.dimension,
            points: sampled.points.clone(),
            discs: sampled
                .is_hypersurface
                .then(|| (sampled.normals.clone(), radii.collect())),
        };
        picture::draw(file, &samples, &[])?;
    }
    Ok(())
}

fn write(out: &mut impl Write, facts: &Facts) -> std::io::Result<()> {
    line(out, "surface", &facts.surface)?;
    line(out, "points", &facts.points.to_string())?;
    line(out, "nearest neighbour", &significant(facts.nearest))?;
    let spread = format!(
        "{} (0 on a lattice, 0.52 at random)",
        significant(facts.spread)
    );
    line(out, "spread", &spread)?;
    let follows = format!("{:.2} (rank correlation)", facts.density_follows_curvature);
    line(out, "density and curvature", &follows)?;
    Ok(())
}
