//! `taut sample`.

mod either;
mod farthest;
mod flags;

use std::io::Write;

use serde::Serialize;
use taut::equations::{Implicit, Law, extent};
use taut::size::{flat, padded};
use taut_core::Vector;
use taut_core::guess::particles::{self, Quality, Region, Sampling};
use taut_core::surface::atlas::{Atlas, ChartIndex};
use taut_core::surface::implicit::{Equations, ImplicitSurface};
use taut_core::surface::{Geometry, Node, Surface};
use taut_io::Content;

use crate::equations;
use crate::exit::{Exit, Failure};
use crate::numbers::significant;
use crate::output::{line, tell};
use crate::outputs::Files;
use crate::picture;
use crate::progress::Progress;
use crate::ready::{self, Ready, Visit};
use crate::sites;
use crate::surface::{FlatSamples, corners};
use either::Either;
pub use flags::{EXAMPLES, Flags};

/// Points spread over a surface, their dimension forgotten.
struct Sampled {
    surface: String,
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
struct SampleFacts {
    surface: String,
    points: usize,
    nearest: f64,
    spread: f64,
    density_follows_curvature: f64,
}

/// Samples the surface and writes what was asked for.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let source = flags.surface.source()?;
    let output = flags.output.as_deref();
    Files::of(&source)
        .reads("--sources", flags.sources.as_deref())
        .writes("--output", output, Content::Points, source.dimension())
        .writes_picture(flags.picture.as_deref())
        .check()?;
    if flags.farthest {
        return farthest::run(flags, &source, progress);
    }
    let sampled = ready::visit(&source, Spread(flags), progress)?;
    write_files(flags, &sampled, progress)?;
    progress.clear();
    tell(&sampled.facts(), flags.json, |out, facts| write(out, facts))?;
    Ok(Exit::Success)
}

impl Sampled {
    fn facts(&self) -> SampleFacts {
        SampleFacts {
            surface: self.surface.clone(),
            points: self.spacings.len(),
            nearest: self.quality.nearest,
            spread: self.quality.spread,
            density_follows_curvature: self.quality.density_follows_curvature,
        }
    }
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

/// Lets particles spread.
struct Spread<'a>(&'a Flags);

impl Visit for Spread<'_> {
    type Answer = Sampled;

    fn charts<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<Sampled, Failure> {
        let Self(flags) = self;
        ready.note_changes(progress);
        let ends =
            sites::ends_of_sources("--sources", &flags.sources(), ready.dimension, progress)?;
        let given = ends.iter().map(|end| Ok(ready.locate(end)?.0.into_kind()));
        let given: Vec<_> = given.collect::<Result<_, Failure>>()?;
        progress.step("particles");
        let atlas = ready.atlas()?;
        let (low, high) = corners(&atlas.cloud().points);
        let start = Start {
            name: ready.name,
            surface: Either::Charts(atlas),
            centre: atlas.cloud().centre,
            dimension: ready.dimension,
            fixed: !given.is_empty(),
            sources: match given[..] {
                [] => one_of_each(ready, atlas, flags.count, progress),
                _ => given,
            },
            size: (high - low).norm(),
            region: None,
        };
        start.spread(flags)
    }

    /// Particles need no graph: the surface is not sampled for one.
    fn equations<const D: usize>(
        self,
        law: &Implicit,
        progress: &Progress,
    ) -> Result<Sampled, Failure> {
        let Self(flags) = self;
        let ends = sites::ends_of_sources("--sources", &flags.sources(), law.dimension, progress)?;
        let refused = |error| equations::refused(law, "--bounds or --source", error);
        let searched = law.searched::<D>().map_err(refused)?;
        if let (Law::Texts(_), None, []) = (&law.law, &law.bounds, &ends[..]) {
            progress.note(&format!(
                "{}: without --bounds the points start between {:?} and {:?}; if the surface goes on without end, they cover some part of it",
                law.law, searched.low, searched.high
            ));
        }
        let given = equations::points_of(&ends, law.dimension)?;
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
        start.spread(flags)
    }
}

/// A node of each component that is large enough for a point.
fn one_of_each<const D: usize>(
    ready: &Ready<'_, D>,
    atlas: &Atlas<D>,
    count: usize,
    progress: &Progress,
) -> Vec<Node<D, ChartIndex>> {
    let nodes = atlas.nodes();
    let sizes = ready.geodesics.component_sizes();
    let large = sizes.iter().filter(|size| **size * count >= nodes.len());
    let large = large.count();
    if large < sizes.len() {
        progress.note(&format!(
            "{}: {} of {} pieces are too small for a point and get none",
            ready.name,
            sizes.len() - large,
            sizes.len()
        ));
    }
    let first = |component: u32| {
        let mut of_each = ready.geodesics.components().iter();
        of_each
            .position(|c| *c == component)
            .map(|chart| nodes[chart])
    };
    (0..large as u32).filter_map(first).collect()
}

impl<const D: usize> Start<'_, D> {
    fn spread(&self, flags: &Flags) -> Result<Sampled, Failure> {
        let of_particles = particles::Settings {
            region: self.region,
            spread: match flags.uniform {
                true => particles::Spread::Even,
                false => particles::Spread::Curvature,
            },
            seed: flags.seed,
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
            flags.count,
            &of_particles,
        )
        .map_err(|error| Failure::Surface {
            surface: self.name.to_owned(),
            error,
        })?;
        let points: Vec<Vector<D>> = nodes.iter().map(|node| node.point).collect();
        Ok(Sampled {
            surface: self.name.to_owned(),
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

fn write_files(flags: &Flags, sampled: &Sampled, progress: &Progress) -> Result<(), Failure> {
    if let Some(file) = &flags.output {
        progress.step("writing the points");
        let normals = sampled.is_hypersurface.then_some(&sampled.normals[..]);
        taut_io::write_points(file, sampled.dimension, &sampled.points, normals)?;
    }
    if let Some(file) = &flags.picture {
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

fn write(out: &mut impl Write, facts: &SampleFacts) -> std::io::Result<()> {
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

#[cfg(test)]
mod tests {
    use clap::Parser;
    use taut_io::PointSet;

    use super::*;
    use crate::source::CloudSurface;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        flags: Flags,
    }

    #[test]
    fn sources_are_rows_of_the_file() {
        let point = |i: usize| {
            let z = 1.0 - (2 * i + 1) as f64 / 500.0;
            let (sin, cos) = (2.399963 * i as f64).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            [radius * cos, radius * sin, z]
        };
        let points = PointSet {
            dimension: 3,
            coordinates: (0..500).flat_map(point).collect(),
            rows_kept: Some((1000..1500).collect()),
            ..PointSet::default()
        };
        let sampled = |row: &str| {
            let words = ["sample", "points.las", "-n", "6", "--source", row];
            let line = Line::try_parse_from(words).expect("flags");
            let (model, progress) = (CloudSurface::default(), Progress::new(true));
            ready::visit_points("points", &points, &model, Spread(&line.flags), &progress)
        };
        let found = sampled("1200").expect("a row that was read");
        let misses = found.points.iter().zip(point(200));
        assert!(
            misses
                .into_iter()
                .all(|(found, given)| (found - given).abs() < 1e-3)
        );
        assert!(sampled("200").is_err());
    }
}
