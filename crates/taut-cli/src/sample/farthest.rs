//! `taut sample --farthest`.

use std::io;

use serde::Serialize;
use taut::End;
use taut::equations::Implicit;
use taut::kind::Kind;
use taut::size::flat;
use taut_core::field;

use crate::exit::{Exit, Failure};
use crate::located::refused;
use crate::numbers::rounded;
use crate::output::{line, tell};
use crate::picture;
use crate::progress::Progress;
use crate::ready::{self, Ready, Visit};
use crate::sample::flags::Flags;
use crate::sites;
use crate::source::Source;
use crate::surface::FlatSamples;

/// What is told of points far from each other. Lengths are in the units of the input.
#[derive(Serialize)]
struct FarthestFacts {
    surface: String,
    /// Rows of the file, in the order in which they were found.
    rows: Vec<usize>,
    /// Every point lies within this distance of one of them; `None` where some piece has none.
    cover: Option<f64>,
    /// Largest estimated error of the distances that it was found from.
    error: f64,
    #[serde(skip)]
    points: FlatSamples,
}

/// Finds points of a cloud far from each other and writes what was asked for.
pub fn run(flags: &Flags, source: &Source, progress: &Progress) -> Result<Exit, Failure> {
    let facts = ready::visit(source, Farthest(flags), progress)?;
    if let Some(file) = &flags.output {
        progress.step("writing the points");
        taut_io::write_points(file, facts.points.dimension, &facts.points.points, None)?;
    }
    if let Some(file) = &flags.picture {
        progress.step("drawing");
        picture::draw(file, &facts.points, &[])?;
    }
    progress.clear();
    tell(&facts, flags.json, write)?;
    Ok(Exit::Success)
}

struct Farthest<'a>(&'a Flags);

impl Visit for Farthest<'_> {
    type Answer = FarthestFacts;

    fn charts<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<FarthestFacts, Failure> {
        let Self(flags) = self;
        if ready.points.is_none() {
            return Err(no_cloud());
        }
        ready.note_changes(progress);
        let atlas = ready.atlas()?;
        let refused = |error| ready.refused(error);
        let ends =
            sites::ends_of_sources("--sources", &flags.sources(), ready.dimension, progress)?;
        let first: Vec<usize> = ends
            .iter()
            .map(|end| point(ready, end))
            .collect::<Result<_, _>>()?;
        let fields = Kind::fields(&ready.geodesics, None).map_err(refused)?;
        progress.step("distances");
        progress.count_to(flags.count);
        let found = fields
            .farthest(&first, flags.count, &field::Settings::default(), |_| {
                progress.done(1);
            })
            .map_err(refused)?;
        let cloud = atlas.cloud();
        let kept: Vec<_> = found.points.iter().map(|i| cloud.points[*i]).collect();
        let row_of_file = |i: &usize| {
            let read = cloud.rows[*i] as usize;
            ready.rows_kept().map_or(read, |kept| kept[read])
        };
        Ok(FarthestFacts {
            surface: ready.name.to_owned(),
            rows: found.points.iter().map(row_of_file).collect(),
            cover: Some(found.cover).filter(|cover| cover.is_finite()),
            error: found.error,
            points: FlatSamples {
                dimension: ready.dimension,
                points: flat(&kept, &cloud.centre, ready.dimension),
                discs: None,
            },
        })
    }

    fn equations<const D: usize>(
        self,
        _: &Implicit,
        _: &Progress,
    ) -> Result<FarthestFacts, Failure> {
        Err(no_cloud())
    }
}

fn no_cloud() -> Failure {
    let message =
        "--farthest: found a surface without points of its own, expected a cloud; leave it out";
    Failure::Usage(message.to_owned())
}

/// The point of the cloud that an end names.
fn point<const D: usize>(ready: &Ready<'_, D>, end: &End) -> Result<usize, Failure> {
    let End::Row(row) = end else {
        let reason = "found coordinates, expected a row of the file, because --farthest keeps points of the file";
        return Err(refused(end, reason));
    };
    let read = match ready.rows_kept() {
        Some(kept) => kept.binary_search(row).ok(),
        None => Some(*row),
    };
    let points = &ready.atlas()?.cloud().point_of_row;
    let point = read.and_then(|row| points.get(row).copied().flatten());
    let point = point.ok_or_else(|| refused(end, "the row is not among the points of the surface"));
    Ok(point? as usize)
}

fn write(out: &mut io::StdoutLock<'_>, facts: &FarthestFacts) -> io::Result<()> {
    line(out, "surface", &facts.surface)?;
    line(out, "points", &facts.rows.len().to_string())?;
    let cover = facts.cover.map_or_else(
        || "none, because a piece of the surface has no such point".to_owned(),
        |cover| {
            format!(
                "every point lies within {} ± {:.1e} of one of them",
                rounded(cover, facts.error),
                facts.error
            )
        },
    );
    line(out, "cover", &cover)?;
    let rows: Vec<String> = facts.rows.iter().map(usize::to_string).collect();
    line(out, "rows", &rows.join(" "))
}
