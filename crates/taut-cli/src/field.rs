//! `taut field`.

mod answer;
mod cost;
mod isolines;

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use taut::kind::{Kind, Place};
use taut::{End, coordinate};
use taut_core::error::Error;
use taut_core::field::{self, Cost, Field, Fields};
use taut_io::{Content, Format, PointTable, write_table};

use crate::exit::{Exit, Failure};
use crate::located::Places;
use crate::output::{tell, write_columns};
use crate::outputs::Files;
use crate::picture::{self, Levels};
use crate::progress::Progress;
use crate::ready::{self, Question, Ready};
use crate::sites;
use crate::source::{Source, Sources, SurfaceFlags};
use crate::surface::FlatSamples;
use crate::values::{count, positive, tolerance};
use answer::{FieldAnswer, FieldFacts};
use cost::CostFlags;
use isolines::{IsolineFacts, IsolineFlags, Line};

pub const EXAMPLES: &str = "\
Examples:
  taut field scan.ply --source 12 -o distances.ply --picture field.png
  taut field scan.las --class 2 --sources wells.txt -o ground.las
  taut field torus.npy --source 0 -o distances.npy --isolines lines.vtp
  taut field scan.ply --source 12 --nearest 100 --json
  taut field scan.ply --curve seam.xyz -o off_seam.ply
  taut field ground.las --class 2 --source 0 --slope hiking --no-go lake.txt --picture walks.png
  taut field --shape torus:1,0.4 --source 1.4,0,0 --at points.xyz

Each distance comes with an estimate of its error, which includes what the surface adds, and with
the number of its nearest source (the first is 0). A point that no source reaches is infinitely far.
Without -o, --picture, --isolines and --json the values go to standard output, one line for each
point.";

#[derive(Debug, Args)]
pub struct Flags {
    #[command(flatten)]
    pub surface: SurfaceFlags,
    /// A point to measure from: a row of the file (the first is 0), or coordinates; repeat the flag
    /// for several points
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    #[arg(required_unless_present_any = ["sources", "curve"], conflicts_with = "sources")]
    pub source: Vec<End>,
    /// A file of points to measure from: a cloud, or a text file (.txt) with a row or coordinates
    /// on each line, which the distance that the source starts with may follow
    #[arg(long, value_name = "FILE")]
    pub sources: Option<PathBuf>,
    /// A file of the vertices of a curve to measure from, as for --sources but without start
    /// values. Each vertex is joined to the next by the shortest path, and the curve is closed if
    /// the last vertex repeats the first
    #[arg(long, value_name = "FILE", conflicts_with_all = ["source", "sources", "start"])]
    pub curve: Option<PathBuf>,
    /// The distance that a source starts with; repeat the flag, once for each source [default: 0]
    #[arg(long, value_name = "V", allow_hyphen_values = true, value_parser = coordinate)]
    pub start: Vec<f64>,
    /// A file of points to find distances at, in any format that --sources takes [default: all
    /// points of the cloud]
    #[arg(long, value_name = "FILE")]
    pub at: Option<PathBuf>,
    /// Largest relative error of the geodesics that carry the distances
    #[arg(long = "tol", value_name = "T", default_value = "1e-6", value_parser = tolerance)]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Look no farther than this; points that are farther count as not reached
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = positive)]
    pub max_distance: Option<f64>,
    /// Find only the K points nearest to the sources; all others count as not reached
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    pub nearest: Option<usize>,
    #[command(flatten)]
    pub cost: CostFlags,
    #[command(flatten)]
    pub isolines: IsolineFlags,
    /// Write one JSON object that describes the field
    #[arg(long)]
    pub json: bool,
    /// Write the points with their distance, error and source: .csv .ply .vtp .las .laz, or .npy
    /// (distances alone)
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw the surface coloured by the distance, with isolines
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

impl Flags {
    fn sources(&self) -> Sources {
        Sources::new(&self.source, self.sources.as_ref().or(self.curve.as_ref()))
    }
}

/// Finds the distances and writes what was asked for.
pub fn run(flags: &Flags, progress: &Progress) -> Result<Exit, Failure> {
    let mut source = flags.surface.source()?;
    flags.cost.check(&mut source)?;
    check_files(flags, &source)?;
    let found = ready::visit(&source, Distances(flags), progress).map_err(cost::refusal)?;
    found.write(flags, &source, progress)?;
    Ok(match found.answer.unknown() {
        0 => Exit::Success,
        _ => Exit::Unknown,
    })
}

/// Looks at the files that are read and written.
fn check_files(flags: &Flags, source: &Source) -> Result<(), Failure> {
    let at = flags.at.as_deref();
    let content = Content::Table {
        original: at.or_else(|| source.points()),
        columns: FieldAnswer::COLUMNS + usize::from(at.is_some()),
    };
    let listed = flags.sources.as_deref().or(flags.curve.as_deref());
    let dimension = source.dimension();
    let files = Files::of(source)
        .reads("--sources or --curve", listed)
        .reads("--at", at);
    let files = flags.cost.files(files);
    let files = files.writes("--output", flags.output.as_deref(), content, dimension);
    let files = flags.isolines.files(files, dimension);
    files.writes_picture(flags.picture.as_deref()).check()
}

/// The distances that were asked for.
struct Distances<'a>(&'a Flags);

impl Question for Distances<'_> {
    type Answer = FoundField;

    fn seeds(&self, dimension: usize, progress: &Progress) -> Result<Vec<End>, Failure> {
        let mut seeds = sites::places_of(&self.0.sources(), dimension, progress)?;
        if let Some(file) = &self.0.at {
            let places = sites::of_file(file, dimension, progress)?;
            let places = places.into_iter().map(|site| site.end);
            seeds.extend(places.filter(|end| matches!(end, End::Point(_))));
        }
        Ok(seeds)
    }

    fn answer<const D: usize>(
        self,
        ready: &Ready<'_, D>,
        progress: &Progress,
    ) -> Result<FoundField, Failure> {
        let Self(flags) = self;
        let cost = ready.points.map(|points| flags.cost.of_rows(points));
        let asked = Asked {
            flags,
            ready,
            cost: cost.transpose()?.flatten(),
            progress,
        };
        asked.found()
    }
}

/// A field, free of the surface's types.
struct FoundField {
    answer: FieldAnswer,
    sources: usize,
    /// How far each source, or vertex of the curve, was moved onto the surface.
    sources_moved: Vec<f64>,
    /// The file's rows that the points come from, where some were left out.
    rows_kept: Option<Vec<usize>>,
    /// What a picture shows.
    drawn: Option<(FlatSamples, Levels)>,
    isolines: Option<Vec<Line>>,
    /// What speaks against the distances, in sentences.
    warnings: Vec<String>,
}

/// A surface with what is asked of it.
struct Asked<'a, const D: usize> {
    flags: &'a Flags,
    ready: &'a Ready<'a, D>,
    cost: Option<Cost>,
    progress: &'a Progress,
}

impl<const D: usize> Asked<'_, D> {
    /// The field at the points of the file asked for, else at the surface's `own`, where it has
    /// any.
    fn found(&self) -> Result<FoundField, Failure> {
        let (flags, ready) = (self.flags, self.ready);
        let listed = flags.sources();
        let (points, vertices, sources_moved) = if flags.curve.is_some() {
            let (vertices, moved) = ready.vertices(&listed, self.progress)?;
            (Vec::new(), Some(vertices), moved)
        } else {
            let found = ready.sources(&listed, &flags.start, self.progress)?;
            (found.0, None, found.1)
        };
        let places = flags.at.as_ref();
        let places = places.map(|file| ready.places(file, self.progress));
        let places = places.transpose()?;
        let refused = |error| ready.refused(error);
        self.progress.step("distances");
        let fields = Kind::fields(&ready.geodesics, self.cost.as_ref()).map_err(refused)?;
        let curve = vertices.map(|vertices| fields.curve(&vertices));
        let curve = curve.transpose().map_err(refused)?;
        let sources = curve
            .as_ref()
            .map_or_else(|| field::Sources::from(&points), field::Sources::from);
        let field = self.field(&fields, sources, places.as_ref());
        let field = field.map_err(refused)?;
        let kept = |mut answer: FieldAnswer| {
            if let Some(count) = flags.nearest {
                answer.keep_nearest(count);
            }
            answer
        };
        let own = self.own(&fields, &field);
        // The nearest of other points are not the nearest of the surface's own.
        let own = if places.is_none() { own.map(kept) } else { own };
        let needs_levels = flags.picture.is_some() || flags.isolines.is_given();
        let drawn = needs_levels.then(|| self.drawn(&fields, &field, own.as_ref()));
        let lines = drawn.as_ref().filter(|_| flags.isolines.is_given());
        let lines = lines.map(|(_, levels)| {
            self.progress.step("isolines");
            flags.isolines.find(ready, &fields, &field, levels)
        });
        Ok(FoundField {
            isolines: lines.transpose().map_err(refused)?,
            answer: match places {
                Some(places) => kept(self.at(&fields, &field, places)),
                None => own.ok_or_else(|| ready.without_points())?,
            },
            sources: if flags.curve.is_some() {
                1
            } else {
                points.len()
            },
            sources_moved,
            rows_kept: ready.rows_kept().map(<[usize]>::to_vec),
            drawn,
            warnings: self.warnings(&fields),
        })
    }

    /// What speaks against the distances, in sentences.
    fn warnings(&self, fields: &Fields<'_, D, Kind<D>>) -> Vec<String> {
        let mut warnings = self.ready.geodesics.surface().doubts();
        for idle in fields.idle_barriers() {
            let warning = cost::without_effect(&self.flags.cost.no_go[idle]);
            self.progress.note(&warning);
            warnings.push(warning);
        }
        warnings
    }

    /// The field at the surface's own points, where it has any.
    fn own(&self, fields: &Fields<'_, D, Kind<D>>, field: &Field<D>) -> Option<FieldAnswer> {
        let values = self.ready.geodesics.surface().at_rows(fields, field)?;
        let mut answer = self.empty(self.ready.points?.coordinates.clone(), None);
        for value in &values {
            answer.push(value.as_ref());
        }
        Some(answer)
    }

    fn empty(&self, points: Vec<f64>, moved: Option<Vec<f64>>) -> FieldAnswer {
        FieldAnswer::new(self.ready.name, self.ready.dimension, points, moved)
    }

    /// The field, as far as it was asked for.
    fn field(
        &self,
        fields: &Fields<'_, D, Kind<D>>,
        sources: field::Sources<'_, D, Place<D>>,
        places: Option<&Places<D>>,
    ) -> Result<Field<D>, Error> {
        let settings = &field::Settings {
            tolerance: self.flags.tolerance,
            max_distance: self.flags.max_distance.unwrap_or(f64::INFINITY),
        };
        match (self.flags.nearest, places) {
            (None, _) => fields.from(sources, settings),
            (Some(count), None) => fields.nearest(sources, count, settings),
            (Some(count), Some(places)) => {
                let located = places.located.iter().flatten();
                let nodes: Vec<_> = located.map(|(node, _)| *node).collect();
                fields.nearest_of(sources, &nodes, count, settings)
            }
        }
    }

    fn at(
        &self,
        fields: &Fields<'_, D, Kind<D>>,
        field: &Field<D>,
        places: Places<D>,
    ) -> FieldAnswer {
        let moved = places.moved();
        let mut answer = self.empty(places.points, Some(moved));
        for found in places.located {
            let value = found.map(|(node, _)| fields.at(field, &node));
            answer.push(value.as_ref());
        }
        answer
    }

    /// Points of the surface, its own where it has any, with the field at them.
    fn drawn(
        &self,
        fields: &Fields<'_, D, Kind<D>>,
        field: &Field<D>,
        own: Option<&FieldAnswer>,
    ) -> (FlatSamples, Levels) {
        if let Some(own) = own {
            let samples = FlatSamples {
                dimension: self.ready.dimension,
                points: own.points.clone(),
                discs: None,
            };
            return (samples, own.levels());
        }
        let samples = self.ready.samples();
        let mut answer = self.empty(Vec::new(), None);
        for point in samples.points.chunks(self.ready.dimension) {
            let found = self.ready.locate(&End::Point(point.to_vec())).ok();
            let value = found.map(|(node, _)| fields.at(field, &node));
            answer.push(value.as_ref());
        }
        (samples, answer.levels())
    }
}

impl FoundField {
    /// Writes the files asked for and tells of the field. Where no file is asked for, its values go
    /// to standard output.
    fn write(&self, flags: &Flags, source: &Source, progress: &Progress) -> Result<(), Failure> {
        let Self { answer, .. } = self;
        if let Some(file) = &flags.output {
            progress.step("writing the distances");
            let is_coloured = Format::from_path(file) == Some(Format::Ply);
            let colours = is_coloured.then(|| taut_draw::level_colours(&answer.distance));
            let table = PointTable {
                dimension: answer.dimension,
                coordinates: &answer.points,
                normals: None,
                columns: &answer.columns(),
                colours: colours.as_deref(),
            };
            let at = flags.at.as_deref();
            let rows = self.rows_kept.as_deref().filter(|_| at.is_none());
            write_table(file, &table, at.or_else(|| source.points()), rows)?;
        }
        let isolines = flags.isolines.write(self.isolines.as_deref(), progress)?;
        if let (Some(file), Some((samples, levels))) = (&flags.picture, &self.drawn) {
            progress.step("drawing");
            picture::draw_levels(file, samples, levels)?;
        }
        let mut facts = answer.facts(self.sources, flags.nearest);
        facts.sources_moved.clone_from(&self.sources_moved);
        facts.note(progress);
        progress.clear();
        let has_files = flags.output.is_some() || flags.picture.is_some();
        if !(flags.json || has_files || flags.isolines.is_given()) {
            return Ok(write_columns(&answer.columns())?);
        }
        let told = Told {
            facts,
            isolines,
            warnings: &self.warnings,
        };
        tell(&told, flags.json, |out, told| {
            told.facts.write(out)?;
            told.isolines.iter().try_for_each(|facts| facts.write(out))
        })
    }
}

/// What is told of a field and of what was made of it.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    facts: FieldFacts,
    #[serde(skip_serializing_if = "Option::is_none")]
    isolines: Option<IsolineFacts>,
    /// What speaks against the distances, in sentences.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    warnings: &'a [String],
}
