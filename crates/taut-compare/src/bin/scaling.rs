//! Time and memory of one field as clouds grow: `cargo run --release -p taut-compare --features
//! measure --bin scaling -- [SHAPE] [POINTS ...]`, SHAPE sphere or torus, from 10,000 to 10,000,000
//! points unless said.
//!
//! Each size runs in a process of its own, from a file: seconds of reading, of the surface and its
//! graph, and of the field from one source at all points (the best of three where that is short);
//! the peak of resident memory where the system tells it. At last the exponents of the powers of
//! the number of points that fit the times best.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use taut_compare::generate;
use taut_compare::surface::Torus;
use taut_core::cloud::Cloud;
use taut_core::field::{Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

type Failure = Box<dyn std::error::Error>;

/// What is measured, in columns.
const COLUMNS: [&str; 4] = ["read s", "set-up s", "field s", "in all s"];
/// The argument by which the command calls itself.
const ONE: &str = "--one";
/// Smaller clouds are measured a few times, and the best is taken.
const LARGE: usize = 300_000;

fn points(shape: &str, count: usize) -> Result<Vec<[f64; 3]>, Failure> {
    match shape {
        "sphere" => Ok(generate::sphere::<3>(count, 1.0, 1)),
        "torus" => {
            let torus = Torus {
                major: 1.0,
                minor: 0.4,
            };
            Ok(generate::torus(count, &torus, 1).points)
        }
        other => Err(format!("unknown shape {other}").into()),
    }
}

/// The seconds of each column, of one run.
fn once(file: &Path) -> Result<[f64; 4], Failure> {
    let start = Instant::now();
    let set = taut_io::read(file, &taut_io::ReadOptions::default())?;
    let read = start.elapsed().as_secs_f64();
    let cloud = Cloud::<3>::new(&set.coordinates, 3)?;
    drop(set);
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2)?);
    let ready = start.elapsed().as_secs_f64();
    let fields = Fields::of_cloud(&geodesics)?;
    let node = geodesics.surface().node_of_row(0)?;
    let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default())?;
    let values = fields.at_points(&field);
    let whole = start.elapsed().as_secs_f64();
    if values.iter().any(|value| !value.distance.is_finite()) {
        return Err("points were not reached".into());
    }
    Ok([read, ready - read, whole - ready, whole])
}

/// Measures a file and prints the columns and the peak of memory in MiB, for the process that
/// called this one.
fn measure(file: &Path, count: usize) -> Result<(), Failure> {
    let mut best = once(file)?;
    for _ in 0..if count < LARGE { 4 } else { 0 } {
        let next = once(file)?;
        if next[3] < best[3] {
            best = next;
        }
    }
    let seconds: Vec<String> = best.iter().map(f64::to_string).collect();
    println!(
        "{} {}",
        seconds.join(" "),
        peak_memory().unwrap_or(f64::NAN)
    );
    Ok(())
}

/// The peak of resident memory in MiB, where the system tells it.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}

/// The power of x that y grows with, by least squares in the logarithms.
fn exponent(pairs: &[(f64, f64)]) -> f64 {
    let logarithms: Vec<(f64, f64)> = pairs.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = logarithms.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logarithms.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| logarithms.iter().map(of).sum::<f64>();
    sum(&|p| (p.0 - x) * (p.1 - y)) / sum(&|p| (p.0 - x).powi(2))
}

fn compare(shape: &str, counts: &[usize]) -> Result<(), Failure> {
    println!("| points | {} | peak MiB |", COLUMNS.join(" | "));
    println!("|---|---|---|---|---|---|");
    let file: PathBuf =
        std::env::temp_dir().join(format!("taut-scaling-{}.npy", std::process::id()));
    let mut rows: Vec<(f64, [f64; 4])> = Vec::new();
    for count in counts {
        let written = taut_io::write_points(&file, 3, points(shape, *count)?.as_flattened(), None);
        written?;
        let output = Command::new(std::env::current_exe()?)
            .args([ONE, &file.to_string_lossy(), &count.to_string()])
            .output();
        std::fs::remove_file(&file)?;
        let output = output?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        let numbers: Vec<f64> = String::from_utf8_lossy(&output.stdout)
            .split_whitespace()
            .map(str::parse)
            .collect::<Result<_, _>>()?;
        let [read, ready, field, whole, memory] = numbers[..] else {
            return Err("a process answered too little".into());
        };
        println!("| {count} | {read:.4} | {ready:.3} | {field:.3} | {whole:.3} | {memory:.0} |");
        rows.push((*count as f64, [read, ready, field, whole]));
    }
    if rows.len() > 1 {
        let exponents = (0..COLUMNS.len()).map(|column| {
            let pairs: Vec<(f64, f64)> = rows.iter().map(|row| (row.0, row.1[column])).collect();
            format!("{:.3}", exponent(&pairs))
        });
        let exponents: Vec<String> = exponents.collect();
        println!("| exponent | {} | |", exponents.join(" | "));
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [one, file, count] = &arguments[..]
        && one == ONE
    {
        return measure(Path::new(file), count.parse()?);
    }
    let (shape, counts) = match arguments.split_first() {
        Some((first, rest)) if first.parse::<usize>().is_err() => (first.as_str(), rest),
        _ => ("sphere", &arguments[..]),
    };
    let counts: Vec<usize> = counts.iter().map(|c| c.parse()).collect::<Result<_, _>>()?;
    if counts.is_empty() {
        return compare(shape, &[10_000, 100_000, 1_000_000, 10_000_000]);
    }
    compare(shape, &counts)
}
