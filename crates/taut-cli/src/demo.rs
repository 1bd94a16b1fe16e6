//! `taut demo`: paths on a sheet rolled up seven times, against the exact answer.

use std::f64::consts::TAU;
use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use taut::End;
use taut_io::PointSet;

use crate::answer::{Answer, FoundPath};
use crate::exit::{Exit, Failure};
use crate::numbers::{exponential, rounded};
use crate::outputs::Files;
use crate::pairs::{Ends, Request};
use crate::picture;
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::source::CloudSurface;
use crate::surface::FlatSamples;
use crate::values::seed;

#[derive(Debug, Args)]
pub struct Flags {
    /// Where to put the picture
    #[arg(long, value_name = "FILE.png", default_value = "taut-demo.png")]
    pub picture: PathBuf,
    /// The seed of the random points of the sheet
    #[arg(long, value_name = "S", default_value = "1", value_parser = seed)]
    #[arg(allow_negative_numbers = true)]
    pub seed: u64,
}

/// Radius of the roll at its inner end.
const INNER_RADIUS: f64 = 0.3;
/// Distance between layers along a radius.
const GAP: f64 = 0.065;
const TURNS: f64 = 7.0;
/// Side of the cells of the grid that hold one point each.
const STEP: f64 = 0.02;
/// Ends of the paths shown: shares of the length and of the width of the sheet.
const SHOWN: [[[f64; 2]; 2]; 2] = [[[0.86, 0.1], [0.99, 0.75]], [[0.98, 0.05], [0.02, 0.9]]];

/// Makes the roll, finds the paths, and writes them beside the exact distances.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let picture = Some(flags.picture.as_path());
    Files::default().writes_picture(picture).check()?;
    progress.step("rolling up a sheet");
    let roll = Roll::new(flags.seed);
    let found = roll.found(progress)?;
    let exit = found.answers.iter().map(Answer::exit).max();
    let answers = found.answers.into_iter();
    let paths: Vec<FoundPath> = answers.map(|answer| answer.path).collect();
    progress.step("drawing");
    picture::draw(&flags.picture, &found.samples, &paths)?;
    progress.clear();
    write(flags, roll.points.rows(), &paths, &roll.exact)?;
    Ok(exit.unwrap_or(Exit::Success))
}

/// The rolled-up sheet with the pairs shown on it.
struct Roll {
    points: PointSet,
    /// Rows of the points: every two are a pair.
    ends: Vec<End>,
    /// Distance of each pair on the sheet unrolled.
    exact: Vec<f64>,
}

impl Roll {
    fn new(seed: u64) -> Self {
        let sheet = jittered_sheet(seed);
        let rows = SHOWN.map(|ends| ends.map(|share| nearest_row(&sheet, share)));
        let exact = rows.map(|[from, to]| unrolled_distance(sheet[from], sheet[to]));
        Self {
            points: PointSet {
                dimension: 3,
                coordinates: sheet.iter().flat_map(|place| rolled_up(*place)).collect(),
                ..PointSet::default()
            },
            ends: rows.as_flattened().iter().copied().map(End::Row).collect(),
            exact: exact.to_vec(),
        }
    }

    fn found(&self, progress: &Progress) -> Result<FoundPaths, Failure> {
        let model = CloudSurface::default();
        ready::visit_points(
            "the roll",
            &self.points,
            &model,
            Shown(&self.ends),
            progress,
        )
    }
}

/// The paths between every two ends that follow each other, with points of the surface.
struct Shown<'a>(&'a [End]);

struct FoundPaths {
    answers: Vec<Answer>,
    samples: FlatSamples,
}

impl Question for Shown<'_> {
    type Answer = FoundPaths;

    fn seeds(&self, _: usize, _: &Progress) -> Result<Vec<End>, Failure> {
        Ok(self.0.to_vec())
    }

    fn answer<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<FoundPaths, Failure> {
        progress.step("paths");
        let ends = Ends::new(ready, self.0);
        let pairs = (0..self.0.len()).step_by(2);
        let answer = |end| ends.answer([end, end + 1], &Request::default());
        Ok(FoundPaths {
            answers: pairs.map(answer).collect(),
            samples: ready.samples(),
        })
    }
}

fn write(flags: &Flags, count: usize, paths: &[FoundPath], exact: &[f64]) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "A sheet of {count} points rolled up {TURNS} times, its layers {GAP} apart."
    )?;
    writeln!(
        out,
        "Shortest paths on it, and the straight lines on the sheet unrolled:\n"
    )?;
    writeln!(
        out,
        "{:<14}{:<18}{:<14}{:<16}{:<16}status",
        "length", "exact", "difference", "surface error", "length error"
    )?;
    for (path, exact) in paths.iter().zip(exact) {
        let Some(length) = path.length else {
            writeln!(
                out,
                "{:<14}{exact:<18.12}{:<46}{}",
                "none",
                "",
                path.outcome.word()
            )?;
            continue;
        };
        let error = path.length_error.unwrap_or(0.0) + path.surface_error.unwrap_or(0.0);
        writeln!(
            out,
            "{:<14}{exact:<18.12}{:<14}{:<16}{:<16}{}",
            rounded(length, error),
            format!("{:.1e}", length - exact),
            exponential(path.surface_error),
            exponential(path.length_error),
            path.outcome.word()
        )?;
    }
    writeln!(out, "\nPicture: {}", flags.picture.display())?;
    Ok(())
}

/// Radius of the spiral of Archimedes per radian.
const GROWTH: f64 = GAP / TAU;

/// Arc length of the spiral from where its radius would be 0.
fn arc(radius: f64) -> f64 {
    0.5 * (radius * radius.hypot(GROWTH) / GROWTH + GROWTH * (radius / GROWTH).asinh())
}

/// Length of the sheet; its width is 1.
fn sheet_length() -> f64 {
    arc(INNER_RADIUS + GAP * TURNS) - arc(INNER_RADIUS)
}

/// The place in space of a place on the sheet: arc length along the spiral, and height.
fn rolled_up([along, height]: [f64; 2]) -> [f64; 3] {
    let wanted = along + arc(INNER_RADIUS);
    // Newton's method on a convex function, from above.
    let radius = (0..20).fold((2.0 * GROWTH * wanted).sqrt(), |radius, _| {
        radius - (arc(radius) - wanted) * GROWTH / radius.hypot(GROWTH)
    });
    let (sin, cos) = ((radius - INNER_RADIUS) / GROWTH).sin_cos();
    [radius * cos, radius * sin, height]
}

/// Rolling up changes no length along the sheet.
fn unrolled_distance(from: [f64; 2], to: [f64; 2]) -> f64 {
    (from[0] - to[0]).hypot(from[1] - to[1])
}

/// One point at random in each cell of a grid on the sheet.
fn jittered_sheet(seed: u64) -> Vec<[f64; 2]> {
    let mut random = Pcg64::seed_from_u64(seed);
    let along = (sheet_length() / STEP).round() as u32;
    let across = (1.0 / STEP).round() as u32;
    let cells = (0..along).flat_map(|i| (0..across).map(move |j| (i, j)));
    cells
        .map(|(i, j)| {
            let (a, b) = (random.random::<f64>(), random.random::<f64>());
            let share = (f64::from(i) + a) / f64::from(along);
            [
                sheet_length() * share,
                (f64::from(j) + b) / f64::from(across),
            ]
        })
        .collect()
}

fn nearest_row(sheet: &[[f64; 2]], [along, height]: [f64; 2]) -> usize {
    let place = [along * sheet_length(), height];
    let rows = sheet.iter().map(|other| unrolled_distance(*other, place));
    rows.enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(row, _)| row)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rolling_up_keeps_lengths() {
        let steps = 200_000;
        let at = |i: u32| rolled_up([sheet_length() * f64::from(i) / f64::from(steps), 0.5]);
        let chords = (0..steps).map(|i| {
            let (p, q) = (at(i), at(i + 1));
            (p[0] - q[0]).hypot(p[1] - q[1])
        });
        let length: f64 = chords.sum();
        assert!((length / sheet_length() - 1.0).abs() < 1e-8, "{length}");
    }

    #[test]
    fn the_errors_cover_the_difference() {
        for seed in 1..=4 {
            let roll = Roll::new(seed);
            let found = roll.found(&Progress::new(true)).expect("a surface");
            for (answer, exact) in found.answers.iter().zip(&roll.exact) {
                let path = &answer.path;
                let value = |value: Option<f64>| value.expect("known");
                let difference = (value(path.length) - exact).abs();
                let [surface, correction] = [path.surface_error, path.length_error].map(value);
                assert!(surface > 0.0 && surface < 1e-3 * exact, "{surface:e}");
                assert!(
                    difference <= surface + correction,
                    "seed {seed}: {difference:e} against {surface:e} and {correction:e}"
                );
            }
        }
    }

    #[test]
    fn a_turn_takes_the_roll_one_gap_outwards() {
        let outside = rolled_up([sheet_length(), 0.0]);
        assert!((outside[0] - (INNER_RADIUS + GAP * TURNS)).abs() < 1e-12);
        assert!(outside[1].abs() < 1e-9);
    }
}
