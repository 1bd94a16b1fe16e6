//! `taut sample`.

use std::io::Write;

use serde::Serialize;
use taut::Vector;
use taut::guess::particles::{self, Quality, Region, Sampling};
use taut::surface::implicit::{Equations, ImplicitSurface};
use taut::surface::{Geometry, Node, Surface};
use taut_io::ReadOptions;

use crate::answer::{flat, padded};
use crate::equations::{self, SEARCHED};
use crate::exit::{Exit, Failure};
use crate::output::{line, significant};
use crate::picture;
use crate::progress::Progress;
use crate::settings::{Law, SampleSettings, Sources};
use crate::surface::{FlatSamples, with_size};

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
    let sources = points_of(settings, progress)?;
    if let (Law::Texts(_), None, []) = (
        &settings.equations.law,
        &settings.equations.bounds,
        &sources[..],
    ) {
        progress.note(&format!(
            "{}: without --bounds the points start between -{SEARCHED} and {SEARCHED}; of a surface that goes on without end they cover any part",
            settings.equations.law
        ));
    }
    progress.step("particles");
    let sampled = with_size!(settings.equations.dimension, sampled(settings, &sources))?;
    write_files(settings, &sampled, progress)?;
    progress.clear();
    let facts = Facts {
        surface: settings.equations.law.to_string(),
        points: sampled.spacings.len(),
        nearest: sampled.quality.nearest,
        spread: sampled.quality.spread,
        density_follows_curvature: sampled.quality.density_follows_curvature,
    };
    tell(&facts, settings.json)?;
    Ok(Exit::Success)
}

/// The coordinates of the sources given.
fn points_of(settings: &SampleSettings, progress: &Progress) -> Result<Vec<Vec<f64>>, Failure> {
    let points = match &settings.sources {
        Sources::Any => Vec::new(),
        Sources::Points(points) => points.clone(),
        Sources::File(file) => {
            progress.step(format!("reading {}", file.display()));
            let read = taut_io::read(file, &ReadOptions::default())?;
            let rows = read.coordinates.chunks(read.dimension);
            rows.map(<[f64]>::to_vec).collect()
        }
    };
    let expected = settings.equations.dimension;
    match points.iter().find(|point| point.len() != expected) {
        Some(point) => Err(Failure::End {
            end: format!("{point:?}"),
            reason: format!("expected {expected} coordinates, as the equations have variables"),
        }),
        None => Ok(points),
    }
}

fn sampled<const D: usize>(
    settings: &SampleSettings,
    sources: &[Vec<f64>],
) -> Result<Sampled, Failure> {
    let law = &settings.equations;
    let refused = |error| Failure::Surface {
        surface: law.law.to_string(),
        error,
    };
    let given: Vec<&[f64]> = sources.iter().map(Vec::as_slice).collect();
    let region = equations::bounds(law, &given);
    let seeds = match sources {
        [] => equations::seeds(law, &equations::searched(law), "--bounds or --source")?,
        given => given.iter().map(|point| padded(point)).collect(),
    };
    let size = match &region {
        Some(region) => 0.5 * region.diagonal(),
        None if given.is_empty() => SEARCHED,
        None => equations::extent(&given),
    };
    let surface = ImplicitSurface::new(equations::system::<D>(law)?, size);
    let codimension = Equations::<D>::count(surface.equations());
    if codimension >= D {
        return Err(refused(taut::error::Error::NoDimensionLeft {
            equations: codimension,
            dimension: D,
        }));
    }
    let sources = on_surface(&surface, &seeds)?;
    let settings_of_particles = particles::Settings {
        region: region.map(|region| Region {
            low: padded(&region.low),
            high: padded(&region.high),
        }),
        spread: settings.spread,
        seed: settings.seed,
        ..particles::Settings::new(size)
    };
    let fixed = !given.is_empty();
    let Sampling {
        nodes,
        normals,
        spacings,
        quality,
        ..
    } = particles::sample(
        &surface,
        &sources,
        fixed,
        settings.count,
        &settings_of_particles,
    )
    .map_err(refused)?;
    let points: Vec<Vector<D>> = nodes.iter().map(|node| node.point).collect();
    Ok(Sampled {
        dimension: law.dimension,
        points: flat(&points, &Vector::zeros(), law.dimension),
        normals: flat(&normals, &Vector::zeros(), law.dimension),
        spacings,
        is_hypersurface: codimension + law.dimension == D + 1,
        quality,
    })
}

/// The feet of the sources.
fn on_surface<const D: usize, S: Surface<D, Place = ()>>(
    surface: &S,
    points: &[Vector<D>],
) -> Result<Vec<Node<D, ()>>, Failure> {
    let mut scratch = Geometry::new(D - surface.intrinsic_dimension());
    let foot = |point: &Vector<D>| {
        let foot = surface.foot(point, &mut (), &mut scratch);
        foot.map(|point| Node { point, place: () })
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

fn tell(facts: &Facts, json: bool) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    if json {
        let text = serde_json::to_string(facts).map_err(std::io::Error::from)?;
        writeln!(out, "{text}")?;
        return Ok(());
    }
    line(&mut out, "surface", &facts.surface)?;
    line(&mut out, "points", &facts.points.to_string())?;
    line(&mut out, "nearest neighbour", &significant(facts.nearest))?;
    let spread = format!(
        "{} (0 on a lattice, 0.52 at random)",
        significant(facts.spread)
    );
    line(&mut out, "spread", &spread)?;
    let follows = format!("{:.2} (rank correlation)", facts.density_follows_curvature);
    line(&mut out, "density and curvature", &follows)?;
    Ok(())
}
