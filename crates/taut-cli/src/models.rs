//! Fitted models: kept in files, made ready.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use taut::End;
use taut::size::coordinates;
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::{Atlas, Header, Model};
use taut_io::{read_json_lines, write_json_lines};

use crate::exit::Failure;
use crate::facts::{ChartFacts, Facts};
use crate::located::Located;
use crate::prepared::Prepared;
use crate::progress::Progress;
use crate::surface::{corners, with_size};

/// The first line of a model's file; each further line is a chart.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FirstLine {
    format: Name,
    version: u32,
    /// Coordinates of a point; vectors are padded with zeros behind them.
    coordinates: usize,
    /// Number of charts.
    charts: usize,
    #[serde(rename = "atlas")]
    header: Header,
}

/// What a model's file calls itself.
#[derive(Serialize, Deserialize)]
enum Name {
    #[serde(rename = "taut model")]
    Model,
}

/// The version that is written and read.
const VERSION: u32 = 1;
const REMEDY: &str = "write the model again with taut fit";

/// A model as its file holds it.
pub struct FileModel {
    file: PathBuf,
    name: String,
    /// Coordinates of a point.
    dimension: usize,
    model: Model,
}

/// Writes a surface of points of `dimension` coordinates.
pub fn write<const D: usize>(
    file: &Path,
    atlas: &Atlas<D>,
    dimension: usize,
) -> Result<(), Failure> {
    let model = atlas.to_model();
    let first = FirstLine {
        format: Name::Model,
        version: VERSION,
        coordinates: dimension,
        charts: model.charts.len(),
        header: model.header,
    };
    Ok(write_json_lines(file, &first, &model.charts)?)
}

/// Reads a model.
pub fn read(file: &Path, progress: &Progress) -> Result<FileModel, Failure> {
    progress.step(format!("reading {}", file.display()));
    let (first, charts) = read_json_lines::<FirstLine, _>(file, REMEDY)?;
    let name = file.display().to_string();
    let refused = |found: String, expected: String| Failure::Surface {
        surface: name.clone(),
        error: taut_core::error::Error::BadModel {
            chart: None,
            found,
            expected,
        },
    };
    if first.version != VERSION {
        let found = format!("version {}", first.version);
        return Err(refused(found, format!("version {VERSION}")));
    }
    if first.charts != charts.len() {
        let found = format!("{} lines of charts", charts.len());
        return Err(refused(
            found,
            format!("{}, as the first line says", first.charts),
        ));
    }
    if !(1..=first.header.ambient_dimension).contains(&first.coordinates) {
        let found = format!("{} coordinates", first.coordinates);
        return Err(refused(
            found,
            format!("1 to {}", first.header.ambient_dimension),
        ));
    }
    Ok(FileModel {
        file: file.to_owned(),
        name,
        dimension: first.coordinates,
        model: Model {
            header: first.header,
            charts,
        },
    })
}

impl FileModel {
    /// The surface of the model.
    pub fn atlas<const D: usize>(&self) -> Result<Atlas<D>, Failure> {
        Atlas::from_model(&self.model).map_err(|error| Failure::Surface {
            surface: match &error {
                taut_core::error::Error::BadModel { chart, .. } => {
                    format!("{}, line {}", self.name, self.line(*chart))
                }
                _ => self.name.clone(),
            },
            error,
        })
    }

    /// The line of a chart, or of what all share, counted from 1; empty ones count as well.
    fn line(&self, chart: Option<usize>) -> usize {
        let before = chart.map_or(0, |chart| chart + 1);
        let lines = std::fs::File::open(&self.file).map(|file| BufReader::new(file).lines());
        let numbers = lines.into_iter().flatten().zip(1..);
        let filled = numbers.filter(|(line, _)| line.as_ref().is_ok_and(|l| !l.trim().is_empty()));
        filled.map(|line| line.1).nth(before).unwrap_or(before + 1)
    }

    /// Coordinates of a point.
    pub fn dimension(&self) -> usize {
        self.dimension
    }
}

/// Makes a model ready and locates the ends on it.
pub fn prepare(
    file: &Path,
    ends: Vec<End>,
    progress: &Progress,
) -> Result<Box<dyn Prepared>, Failure> {
    let model = read(file, progress)?;
    with_size!(model.dimension, located(&model, ends))
}

fn located<const D: usize>(
    model: &FileModel,
    ends: Vec<End>,
) -> Result<Box<dyn Prepared>, Failure> {
    let geodesics = Geodesics::of_atlas(model.atlas::<D>()?).into_kind();
    Ok(Box::new(Located::new(
        geodesics,
        model.dimension,
        ends,
        None,
    )))
}

/// What a model is like.
pub fn facts(file: &Path, progress: &Progress) -> Result<Facts, Failure> {
    let model = read(file, progress)?;
    with_size!(model.dimension, facts_of(&model))
}

fn facts_of<const D: usize>(model: &FileModel) -> Result<Facts, Failure> {
    let atlas = model.atlas::<D>()?;
    let report = atlas.report();
    let (low, high) = corners(&atlas.cloud().points);
    let centre = atlas.cloud().centre;
    let [low, high] = [low, high].map(|v| coordinates(&(v + centre), model.dimension));
    let components = Geodesics::of_atlas(atlas).component_sizes().to_vec();
    Ok(Facts {
        surface: model.name.clone(),
        coordinates: model.dimension,
        intrinsic_dimension: report.intrinsic_dimension,
        points: None,
        charts: Some(ChartFacts::new(&report)),
        low,
        high,
        components,
        warnings: Vec::new(),
    })
}
