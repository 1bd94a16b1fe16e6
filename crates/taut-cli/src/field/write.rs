//! Fields on standard output, in files and in pictures.

use std::io::{self, Write};

use taut_io::{Column, Format, PointTable, write_table};

use crate::exit::Failure;
use crate::field::answer::{Answer, Facts, Found, IsolineFacts};
use crate::field::isolines;
use crate::numbers::{exponential, significant};
use crate::output::{line, tell, write_columns};
use crate::picture;
use crate::progress::Progress;
use crate::settings::{FieldSettings, Source};

/// Writes the files asked for and tells of the field; without any its values go to standard output.
pub fn write(settings: &FieldSettings, found: &Found, progress: &Progress) -> Result<(), Failure> {
    let mut facts = found.answer.facts(found.sources, settings.nearest);
    facts.sources_moved.clone_from(&found.sources_moved);
    if let Some(file) = &settings.output {
        progress.step("writing the distances");
        let original = match (&settings.source, &settings.at) {
            (_, Some(file)) => Some(file.as_path()),
            (Source::Cloud(cloud), None) => Some(cloud.file.as_path()),
            _ => None,
        };
        let rows = found.rows_kept.as_deref().filter(|_| settings.at.is_none());
        let columns = columns(&found.answer);
        let is_coloured = Format::from_path(file) == Some(Format::Ply);
        let colours = is_coloured.then(|| taut_draw::level_colours(&found.answer.distance));
        let table = PointTable {
            dimension: found.answer.dimension,
            coordinates: &found.answer.points,
            normals: None,
            columns: &columns,
            colours: colours.as_deref(),
        };
        write_table(file, &table, original, rows)?;
    }
    if let (Some(asked), Some(lines)) = (&settings.isolines, &found.isolines) {
        progress.step("writing the isolines");
        isolines::write(&asked.file, lines)?;
        facts.isolines = Some(IsolineFacts::of(lines));
    }
    if let (Some(file), Some((samples, levels))) = (&settings.picture, &found.drawn) {
        progress.step("drawing");
        picture::draw_levels(file, samples, levels)?;
    }
    note(&facts, progress);
    progress.clear();
    let has_files = settings.output.is_some() || settings.picture.is_some();
    if settings.json || has_files || settings.isolines.is_some() {
        return tell(&facts, settings.json, |out, facts| write_facts(out, facts));
    }
    Ok(write_columns(&columns(&found.answer))?)
}

/// The columns of a table: the distance first, which formats of one column hold alone.
fn columns(answer: &Answer) -> Vec<Column<'_>> {
    let known = [
        ("distance", &answer.distance),
        ("error", &answer.error),
        ("source", &answer.source),
    ];
    let moved = answer.moved.as_ref().map(|moved| ("moved", moved));
    let all = known.into_iter().chain(moved);
    all.map(|(name, values)| Column { name, values }).collect()
}

fn note(facts: &Facts, progress: &Progress) {
    let Facts {
        surface,
        points,
        nearest,
        unreached,
        unusable,
        unknown,
        ..
    } = facts;
    if *unreached > 0 {
        let why = nearest.map_or(String::new(), |nearest| {
            format!(", because only the {nearest} nearest were asked for")
        });
        progress.note(&format!(
            "{surface}: {unreached} of {points} points are not reached{why}: their distance is inf"
        ));
    }
    if *unusable > 0 {
        progress.note(&format!(
            "{surface}: {unusable} of {points} points have no place on the surface: their distance is NaN"
        ));
    }
    if *unknown > 0 {
        progress.note(&format!(
            "{surface}: it is unknown whether anything leads to {unknown} of {points} points, because the surface was not sampled all the way: their distance is NaN; name the part that you mean with --bounds"
        ));
    }
}

fn write_facts(out: &mut impl Write, facts: &Facts) -> io::Result<()> {
    line(out, "surface", &facts.surface)?;
    line(out, "points", &facts.points.to_string())?;
    let moved = facts.sources_moved.iter().copied().fold(0.0, f64::max);
    let sources = match moved {
        0.0 => facts.sources.to_string(),
        moved => format!(
            "{} (moved onto the surface by at most {moved:.1e})",
            facts.sources
        ),
    };
    line(out, "sources", &sources)?;
    let farthest = facts
        .farthest
        .map_or("none reached".to_owned(), significant);
    line(out, "farthest", &farthest)?;
    let errors = [facts.error_median, facts.error_most].map(exponential);
    let errors = format!("{} (median), {} at most", errors[0], errors[1]);
    line(out, "estimated error", &errors)?;
    if let Some(nearest) = facts.nearest {
        line(out, "nearest asked for", &nearest.to_string())?;
    }
    line(out, "not reached", &facts.unreached.to_string())?;
    if let Some(IsolineFacts {
        lines,
        closed,
        missed_most,
        error_most,
    }) = &facts.isolines
    {
        // The distance that the field errs by is the line's error too.
        let off = exponential(error_most.map(|error| error + missed_most));
        let told = match lines {
            0 => "none".to_owned(),
            _ => format!(
                "{lines}, {closed} of them closed, off their level by an estimated {off} at most"
            ),
        };
        line(out, "isolines", &told)?;
    }
    if let Some(moved) = facts.moved_most {
        line(out, "moved by at most", &exponential(Some(moved)))?;
        line(out, "off the surface", &facts.unusable.to_string())?;
    }
    if facts.unknown > 0 {
        line(out, "unknown", &facts.unknown.to_string())?;
    }
    Ok(())
}
