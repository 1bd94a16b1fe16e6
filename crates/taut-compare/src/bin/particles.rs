//! Particles on surfaces, measured: `cargo run --release -p taut-compare --features measure --bin
//! particles [-- CASE ...]`.
//!
//! Cases: guesses (Algorithm 1 before correction, 50 sources), roll (figure 7), genus2 (289
//! sources, all pairs), spaces (S^3 and Clifford's torus in R^4, 20 sources), growth (time by
//! number), density (rank correlation with curvature).

use std::time::Instant;

use taut_compare::surface::Torus;
use taut_compare::{closed_form, generate, shooting};
use taut_core::Vector;
use taut_core::correction;
use taut_core::geodesics::Geodesics;
use taut_core::guess::particles::{Network, Region, Settings, Spread, sample};
use taut_core::surface::implicit::ImplicitSurface;
use taut_core::surface::shapes::Shape;
use taut_core::surface::{Geometry, Node, Surface};
use taut_formula::Formula;

type Failure = Box<dyn std::error::Error>;

/// The boundary of a thickened lemniscate x^2 (1 - x^2) = y^2: genus 2.
const GENUS_2: &str = "(x^2*(1-x^2)-y^2)^2+z^2=0.01";

fn surface<const D: usize>(
    equations: &[&str],
    size: f64,
) -> Result<ImplicitSurface<D, Formula>, Failure> {
    Ok(ImplicitSurface::new(
        Formula::parse(equations, Some(D))?,
        size,
    ))
}

fn nodes<const D: usize>(points: &[[f64; D]]) -> Vec<Node<D, ()>> {
    let node = |point: &[f64; D]| Node {
        point: Vector::from(*point),
        place: (),
    };
    points.iter().map(node).collect()
}

/// Truth of all pairs (i, j), i < j, in the order of `Geodesics::all_pairs`.
fn all_truths<const D: usize>(
    points: &[[f64; D]],
    distance: impl Fn(&[f64; D], &[f64; D]) -> f64,
) -> Vec<f64> {
    (0..points.len())
        .flat_map(|j| (0..j).map(move |i| (i, j)))
        .map(|(i, j)| distance(&points[i], &points[j]))
        .collect()
}

fn all_shot(surface: &impl taut_compare::surface::Surface, points: &[[f64; 3]]) -> Vec<f64> {
    let pairs: Vec<_> = (0..points.len())
        .flat_map(|j| (0..j).map(move |i| (points[i], points[j])))
        .collect();
    let lengths = shooting::distances(surface, &pairs);
    lengths.into_iter().map(|d| d.unwrap_or(f64::NAN)).collect()
}

/// Algorithm 1, its guesses and its corrected paths against the truth.
fn connect<const D: usize, S: Surface<D, Place = ()>>(
    name: &str,
    surface: S,
    points: &[[f64; D]],
    truths: &[f64],
    count: usize,
    settings: &Settings<D>,
) -> Result<Geodesics<D, Network<D, S>>, Failure> {
    let sources = nodes(points);
    let start = Instant::now();
    let geodesics = Geodesics::of_particles(surface, &sources, count, settings)?;
    let seconds = start.elapsed().as_secs_f64();
    let network = geodesics.surface();
    let joined = network.classes().iter().all(|class| *class == 0);
    println!(
        "{name}: {} sources, {} particles after {} steps in {seconds:.2} s, connected: {joined}",
        points.len(),
        network.particles().count(),
        network.steps(),
    );
    if truths.is_empty() {
        correct(&geodesics, &sources, truths);
        return Ok(geodesics);
    }
    let start = Instant::now();
    let mut ratios = Vec::new();
    let mut truth = truths.iter();
    for j in 0..sources.len() {
        for i in 0..j {
            let guess = geodesics
                .guess(&sources[i], &sources[j])
                .map_or(f64::INFINITY, |g| g.length);
            ratios.push(guess / truth.next().copied().unwrap_or(f64::NAN));
        }
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "  guess / truth: least 1{:+.1e}, median {:.4}, 90 % {:.4}, most {:.4} ({:.2} s one thread, measured along the surface)",
        ratios[0] - 1.0,
        ratios[ratios.len() / 2],
        ratios[ratios.len() * 9 / 10],
        ratios[ratios.len() - 1],
        start.elapsed().as_secs_f64()
    );
    correct(&geodesics, &sources, truths);
    Ok(geodesics)
}

fn correct<const D: usize, S: Surface<D, Place = ()>>(
    geodesics: &Geodesics<D, Network<D, S>>,
    sources: &[Node<D, ()>],
    truths: &[f64],
) {
    let settings = correction::Settings::default();
    let start = Instant::now();
    let paths = geodesics.all_pairs(sources, &settings, |_, path| {
        (path.converged(), path.length, path.length_error)
    });
    let seconds = start.elapsed().as_secs_f64();
    let converged = paths.iter().filter(|path| path.0).count();
    let mut errors: Vec<f64> = paths
        .iter()
        .zip(truths)
        .map(|(path, truth)| (path.1 / truth - 1.0).abs())
        .collect();
    errors.sort_by(f64::total_cmp);
    let within = errors.iter().filter(|e| **e <= settings.tolerance).count();
    println!(
        "  corrected {} pairs in {seconds:.2} s: converged {converged}, within tolerance {within}, largest error {:.1e}",
        paths.len(),
        errors.last().copied().unwrap_or(f64::NAN)
    );
}

fn guesses() -> Result<(), Failure> {
    let points = generate::sphere::<3>(50, 1.0, 21);
    let truths = all_truths(&points, |a, b| closed_form::sphere(1.0, a, b));
    connect(
        "sphere",
        surface(&["x^2+y^2+z^2-1"], 1.0)?,
        &points,
        &truths,
        2000,
        &Settings::new(1.0),
    )?;
    let shape = Torus {
        major: 1.0,
        minor: 0.4,
    };
    let points = generate::torus(50, &shape, 22).points;
    let truths = all_shot(&shape, &points);
    connect(
        "torus",
        surface(&["(sqrt(x^2+y^2)-1)^2+z^2-0.16"], 1.4)?,
        &points,
        &truths,
        2000,
        &Settings::new(1.4),
    )?;
    Ok(())
}

fn genus2() -> Result<(), Failure> {
    let size = 1.0;
    let first = surface::<3>(&[GENUS_2], size)?;
    let mut scratch = Geometry::new(1);
    let point = first
        .foot(&Vector::from([1.05, 0.0, 0.0]), &mut (), &mut scratch)
        .ok_or("no foot")?;
    let even = Settings {
        spread: Spread::Even,
        ..Settings::new(size)
    };
    let sampling = sample(&first, &[Node { point, place: () }], false, 289, &even)?;
    let points: Vec<[f64; 3]> = sampling
        .nodes
        .iter()
        .map(|node| node.point.into())
        .collect();
    connect("genus 2", first, &points, &[], 2000, &Settings::new(size))?;
    Ok(())
}

/// Five sources on the roll, truth by the unrolled plane.
fn roll() -> Result<(), Failure> {
    let sheet = generate::Roll {
        inner_radius: 0.3,
        gap: 0.065,
        turns: 7.0,
    };
    let shape = Shape::parse("roll:0.3,0.065,7")?;
    let places = [
        [0.03, 0.2],
        [0.25, 0.8],
        [0.5, 0.4],
        [0.75, 0.9],
        [0.97, 0.1],
    ]
    .map(|[u, v]| [u * sheet.length(), v]);
    let points = places.map(|place| sheet.point(place));
    let truths = all_truths(&places, closed_form::sheet);
    let (low, high) = shape.region();
    let region = Region {
        low: Vector::from_column_slice(&low),
        high: Vector::from_column_slice(&high),
    };
    let settings = Settings {
        region: Some(region),
        ..Settings::new(shape.size())
    };
    connect(
        "roll",
        ImplicitSurface::new(shape, 1.0),
        &points,
        &truths,
        8000,
        &settings,
    )?;
    Ok(())
}

fn spaces() -> Result<(), Failure> {
    let points = generate::sphere::<4>(20, 1.0, 23);
    let truths = all_truths(&points, |a, b| closed_form::sphere(1.0, a, b));
    connect(
        "S^3",
        surface(&["x1^2+x2^2+x3^2+x4^2-1"], 1.0)?,
        &points,
        &truths,
        4000,
        &Settings::new(1.0),
    )?;
    let radii = [std::f64::consts::FRAC_1_SQRT_2; 2];
    let points = generate::flat_torus(20, radii, 24).points;
    let truths = all_truths(&points, |a, b| closed_form::flat_torus(radii, a, b));
    let equations = ["x1^2+x2^2-0.5", "x3^2+x4^2-0.5"];
    connect(
        "Clifford",
        surface(&equations, 1.0)?,
        &points,
        &truths,
        2000,
        &Settings::new(1.0),
    )?;
    Ok(())
}

fn growth() -> Result<(), Failure> {
    let size = 1.4;
    let torus = surface::<3>(&["(sqrt(x^2+y^2)-1)^2+z^2-0.16"], size)?;
    let point = Vector::from([1.4, 0.0, 0.0]);
    for count in [1_000, 3_000, 10_000, 30_000, 100_000] {
        let start = Instant::now();
        let sampling = sample(
            &torus,
            &[Node { point, place: () }],
            false,
            count,
            &Settings::new(size),
        )?;
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{count} particles: {seconds:.2} s, {:.1} us each, spread {:.3}",
            1e6 * seconds / count as f64,
            sampling.quality.spread
        );
    }
    Ok(())
}

fn density() -> Result<(), Failure> {
    for (name, equation, start, size) in [
        (
            "torus",
            "(sqrt(x^2+y^2)-1)^2+z^2-0.16",
            [1.4, 0.0, 0.0],
            1.4,
        ),
        ("ellipsoid", "x^2/9+y^2/4+z^2-1", [3.0, 0.0, 0.0], 3.0),
        ("genus 2", GENUS_2, [1.05, 0.0, 0.0], 1.0),
    ] {
        let surface = surface::<3>(&[equation], size)?;
        let mut scratch = Geometry::new(1);
        let point = surface
            .foot(&Vector::from(start), &mut (), &mut scratch)
            .ok_or("no foot")?;
        for spread in [Spread::Curvature, Spread::Even] {
            let start = Instant::now();
            let settings = Settings {
                spread,
                ..Settings::new(size)
            };
            let sampling = sample(
                &surface,
                &[Node { point, place: () }],
                false,
                4000,
                &settings,
            )?;
            let off = sampling.nodes.iter().filter_map(|node| {
                Some((surface.foot(&node.point, &mut (), &mut scratch)? - node.point).norm())
            });
            println!(
                "{name} {spread:?}: {:?}, off by {:.0e} of the size, {:.2} s",
                sampling.quality,
                off.fold(0.0, f64::max) / size,
                start.elapsed().as_secs_f64()
            );
        }
    }
    Ok(())
}

fn case(name: &str) -> Result<(), Failure> {
    match name {
        "guesses" => guesses(),
        "genus2" => genus2(),
        "roll" => roll(),
        "spaces" => spaces(),
        "growth" => growth(),
        "density" => density(),
        other => Err(format!("unknown case {other}").into()),
    }
}

fn main() -> Result<(), Failure> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    if names.is_empty() {
        names = ["guesses", "roll", "genus2", "spaces", "growth", "density"]
            .map(String::from)
            .to_vec();
    }
    names.iter().try_for_each(|name| case(name))
}
