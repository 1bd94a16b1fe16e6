//! Do paths and fields on clouds err by no more than they claim? `cargo run --release -p
//! taut-compare --features measure --bin honesty [-- --half set|held] [--points 5000,20000]
//! [--seeds 1,2] [NAME ...]`
//!
//! Each case of [`taut_compare::cases`], of each size and seed, is asked for the field of some of
//! its points, all points at least 8 spacings away being judged up to a number, and for paths to
//! some of them. A line a case and size: mean and largest relative error, the share of errors
//! within their claims, the largest error over its claim, of fields and of paths; for fields also
//! how many pairs of near points differ by more than the way between them. Cases and seeds belong
//! to two halves, one to set thresholds on and one held out.

use std::error::Error;

use rayon::prelude::*;
use taut_compare::cases::{Case, Kind, NAMES};
use taut_compare::generate;
use taut_core::cloud::Cloud;
use taut_core::correction;
use taut_core::field::{Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

/// Fields of each cloud, points judged of each, and paths of each.
const SOURCES: usize = 3;
const TARGETS: usize = 400;
const PATHS: usize = 30;
/// A jump is more than the way between two points by so many spacings.
const SLACK: f64 = 0.01;
/// Errors, in distances, that are rounding.
const ROUNDING: f64 = 1e-12;

/// Errors of answers with their claims.
#[derive(Default)]
struct Judged {
    count: usize,
    sum: f64,
    most: f64,
    covered: usize,
    over: f64,
    /// Answers that say that they are not converged, or not reached.
    refused: usize,
}

impl Judged {
    fn add(&mut self, answer: f64, claim: f64, truth: f64) {
        let error = if answer == truth {
            0.0
        } else {
            (answer - truth).abs()
        };
        let relative = if error == 0.0 {
            0.0
        } else {
            error / truth.min(answer)
        };
        self.count += 1;
        self.sum += relative;
        self.most = self.most.max(relative);
        let claim = claim + ROUNDING * truth.min(1e300);
        self.covered += usize::from(error <= claim);
        self.over = self.over.max(error / claim);
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.most = self.most.max(other.most);
        self.covered += other.covered;
        self.over = self.over.max(other.over);
        self.refused += other.refused;
    }

    fn line(&self) -> String {
        let count = self.count.max(1) as f64;
        format!(
            "{:8} {:9.2e} {:9.2e} {:7.4} {:8.2} {:7}",
            self.count,
            self.sum / count,
            self.most,
            self.covered as f64 / count,
            self.over,
            self.refused
        )
    }
}

struct Options {
    half: Option<bool>,
    points: Vec<usize>,
    seeds: Vec<u64>,
    names: Vec<String>,
}

fn options() -> Result<Options, Box<dyn Error>> {
    let mut options = Options {
        half: None,
        points: vec![5000, 20_000],
        seeds: vec![1, 2],
        names: Vec::new(),
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or("a value is missing");
        match argument.as_str() {
            "--half" => options.half = Some(value()? == "held"),
            "--points" => {
                options.points = value()?
                    .split(',')
                    .map(str::parse)
                    .collect::<Result<_, _>>()?;
            }
            "--seeds" => {
                options.seeds = value()?
                    .split(',')
                    .map(str::parse)
                    .collect::<Result<_, _>>()?;
            }
            _ => options.names.push(argument),
        }
    }
    Ok(options)
}

/// Fields, paths and jumps of a case.
fn judge(case: &Case, seed: u64) -> Result<(Judged, Judged, usize), Box<dyn Error>> {
    let cloud = Cloud::<3>::new(case.points.as_flattened(), 3)?;
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2)?);
    let fields = Fields::of_cloud(&geodesics)?;
    let (mut of_fields, mut of_paths, mut torn) = (Judged::default(), Judged::default(), 0);
    let sources = generate::pairs(case.rows, SOURCES, seed + 7);
    for (index, [source, _]) in sources.into_iter().enumerate() {
        let node = geodesics.surface().node_of_row(source)?;
        let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default())?;
        let values = fields.at_points(&field);
        let distances: Vec<f64> = values.iter().map(|value| value.distance).collect();
        torn += case.jumps(&distances, SLACK);
        let distances = case.distances(source);
        let mut rows = generate::pairs(case.rows, TARGETS, seed + 11 + index as u64);
        rows.retain(|row| row[0] != source);
        let truth: Vec<Option<f64>> = rows.par_iter().map(|row| distances(row[0])).collect();
        let known = rows
            .iter()
            .zip(truth)
            .filter_map(|(row, truth)| Some((row[0], truth?)));
        let far: Vec<(usize, f64)> = known.filter(|t| t.1 >= case.near()).collect();
        for (row, truth) in &far {
            let value = &values[*row];
            if value.distance.is_infinite() && truth.is_finite() {
                of_fields.refused += 1;
                continue;
            }
            of_fields.add(value.distance, value.error, *truth);
        }
        for (row, truth) in far.iter().take(PATHS / SOURCES) {
            let end = geodesics.surface().node_of_row(*row)?;
            let path = geodesics.path(&node, &end, &correction::Settings::default());
            if path.converged() {
                of_paths.add(path.length, path.length_error + path.surface_error, *truth);
            } else if truth.is_finite() {
                of_paths.refused += 1;
            }
        }
    }
    Ok((of_fields, of_paths, torn))
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = options()?;
    println!(
        "{:12} {:>7}  fields: count, mean, largest, covered, over claim, refused; jumps | paths: the same",
        "case", "points"
    );
    let mut totals: Vec<(Kind, Judged, Judged)> = Vec::new();
    for (index, (name, kind)) in NAMES.into_iter().enumerate() {
        if !options.names.is_empty() && !options.names.iter().any(|n| n == name) {
            continue;
        }
        for points in &options.points {
            let (mut fields, mut paths, mut torn) = (Judged::default(), Judged::default(), 0);
            for seed in &options.seeds {
                let held = (index as u64 + seed).is_multiple_of(2);
                if options.half.is_some_and(|half| half != held) {
                    continue;
                }
                let case = Case::new(name, *points, *seed).ok_or("no such case")?;
                let (more, others, jumps) = judge(&case, *seed)?;
                fields.merge(&more);
                paths.merge(&others);
                torn += jumps;
            }
            println!(
                "{name:12} {points:7} {} {torn:5} | {}",
                fields.line(),
                paths.line()
            );
            match totals.iter_mut().find(|total| total.0 == kind) {
                Some(total) => {
                    total.1.merge(&fields);
                    total.2.merge(&paths);
                }
                None => totals.push((kind, fields, paths)),
            }
        }
    }
    for (kind, fields, paths) in totals {
        println!(
            "{:20} {}       | {}",
            format!("{kind:?}"),
            fields.line(),
            paths.line()
        );
    }
    Ok(())
}
