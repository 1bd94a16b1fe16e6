//! Draws a few shapes with paths: `cargo run --release -p taut-draw --example gallery -- FOLDER`.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::time::Instant;

use taut_draw::{Camera, Scene, Style, render};

type Point = [f64; 3];

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args_os()
        .nth(1)
        .map_or_else(std::env::temp_dir, PathBuf::from);
    roll(&folder)?;
    torus(&folder)?;
    sphere(&folder.join("sphere.png"), 20_000)?;
    sphere(&folder.join("million.png"), 1_000_000)?;
    plane_curve(&folder)
}

/// The places of `count` numbers in the unit square, evenly spread (the R2 sequence).
fn unit_square(count: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..count).map(|i| {
        let i = f64::from(i) + 0.5;
        (
            (i * 0.754_877_666_246_693).fract(),
            (i * 0.569_840_290_998_053_3).fract(),
        )
    })
}

fn draw(mut scene: Scene, caption: &str, file: &Path) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    scene.caption = Some(caption.to_owned());
    let camera = Camera::automatic(&scene, [0.0, 0.0, 1.0], 1600, 1200)?;
    let chosen = start.elapsed();
    let image = render(&scene, &camera, &Style::default())?;
    let drawn = start.elapsed();
    std::fs::write(file, image.to_png_bytes()?)?;
    let points = scene.points.len();
    let (rendering, writing) = (drawn - chosen, start.elapsed() - drawn);
    println!(
        "{}: {points} points, camera {chosen:.2?}, picture {rendering:.2?}, file {writing:.2?}",
        file.display()
    );
    Ok(())
}

/// A sheet rolled up five times, and a path from its inner to its outer end.
fn roll(folder: &Path) -> Result<(), Box<dyn Error>> {
    let turns = 5.0;
    let sheet = |u: f64, v: f64| {
        let angle = TAU * turns * u;
        let radius = 0.3 + 0.09 * turns * u;
        [radius * angle.cos(), radius * angle.sin(), v]
    };
    let mut scene = Scene::new(unit_square(60_000).map(|(u, v)| sheet(u, v)).collect())?;
    let line = (0..=600).map(|i| f64::from(i) / 600.0);
    scene.add_path(line.map(|t| sheet(0.1 + 0.9 * t, 0.1 + 0.8 * t)).collect());
    draw(scene, "a roll of five layers", &folder.join("roll.png"))
}

fn torus(folder: &Path) -> Result<(), Box<dyn Error>> {
    let surface = |a: f64, b: f64| -> Point {
        let across = 1.0 + 0.4 * b.cos();
        [across * a.cos(), across * a.sin(), 0.4 * b.sin()]
    };
    let mut scene = Scene::new(
        unit_square(40_000)
            .map(|(u, v)| surface(TAU * u, TAU * v))
            .collect(),
    )?;
    for winding in 0..3 {
        let line = (0..=300).map(|i| f64::from(i) / 300.0);
        let start = f64::from(winding) * 1.3;
        scene.add_path(line.map(|t| surface(start + 2.0 * t, 5.5 * t)).collect());
    }
    draw(
        scene,
        "three windings on a torus",
        &folder.join("torus.png"),
    )
}

fn sphere(file: &Path, count: u32) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let surface = |u: f64, height: f64| -> Point {
        let across = (1.0 - height * height).max(0.0).sqrt();
        [across * (TAU * u).cos(), across * (TAU * u).sin(), height]
    };
    let points = unit_square(count).map(|(u, v)| surface(u, 2.0 * v - 1.0));
    let mut scene = Scene::new(points.collect())?;
    println!(
        "normals and spacing of {count} points: {:.2?}",
        start.elapsed()
    );
    let line = (0..=200).map(|i| f64::from(i) / 200.0);
    scene.add_path(line.clone().map(|t| surface(0.55 * t, 0.3)).collect());
    scene.add_path(line.map(|t| surface(0.1, 1.6 * t - 0.7)).collect());
    scene.unit = Some("m".to_owned());
    draw(scene, "length 3.297 ± 2·10⁻⁷ m", file)
}

fn plane_curve(folder: &Path) -> Result<(), Box<dyn Error>> {
    let ellipse = |t: f64| [2.0 * t.cos(), t.sin(), 0.0];
    let mut scene = Scene::new(
        (0..400)
            .map(|i| ellipse(TAU * f64::from(i) / 400.0))
            .collect(),
    )?;
    scene.add_path((0..=100).map(|i| ellipse(0.02 * f64::from(i))).collect());
    draw(scene, "an ellipse in the plane", &folder.join("plane.png"))
}
