//! What the command was asked to do, checked.

mod directions;
mod field;

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use taut::equations::{Bounds, Implicit, Law};
use taut::{End, coordinate};
use taut_core::correction;
use taut_core::guess::particles::Spread;
use taut_core::surface::shapes::Shape;
use taut_formula::Formula;
use taut_io::ReadOptions;

use crate::exit::Failure;
use crate::flags::{
    CheckFlags, CorrectionFlags, FitFlags, MatrixFlags, PathFlags, PointFlags, SampleFlags,
    SourceFlags, SurfaceFlags,
};
use crate::models;
pub use directions::{Aim, ExpSettings, LogSettings};
pub use field::{CostSettings, FieldSettings, IsolineSettings, Rates, slope};

/// Where the surface comes from.
pub enum Source {
    Cloud(CloudSettings),
    /// The file of a fitted model.
    Model(PathBuf),
    Equations(Implicit),
}

impl Source {
    /// Coordinates of a point, where they are known before anything is read.
    pub fn dimension(&self) -> Option<usize> {
        match self {
            Self::Equations(settings) => Some(settings.dimension),
            Self::Cloud(_) | Self::Model(_) => None,
        }
    }

    /// The file that holds the surface's own points.
    pub fn points(&self) -> Option<&Path> {
        match self {
            Self::Cloud(cloud) => Some(&cloud.file),
            Self::Model(_) | Self::Equations(_) => None,
        }
    }
}

/// A point cloud in a file.
pub struct CloudSettings {
    pub file: PathBuf,
    pub options: ReadOptions,
    pub model: Model,
}

/// What surface to put through points.
#[derive(Clone, Default)]
pub struct Model {
    /// Intrinsic dimension.
    pub dimension: Option<usize>,
    /// Intervals of a grid of cells: none, one for all axes, or one for each.
    pub cells: Vec<f64>,
    pub reconstruction: Reconstruction,
}

/// How a surface is made of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Reconstruction {
    /// Polynomial charts, blended
    #[default]
    Atlas,
    /// The moving least squares planes of Yu, Zhang and Jiao, for comparison
    Mls,
}

/// How a first guess is pulled taut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Correction {
    /// Newton's method on curved elements
    #[default]
    Newton,
    /// The geodesic curvature flow of Yu, Zhang and Jiao on polylines, for comparison
    Flow,
}

impl From<Correction> for correction::Scheme {
    fn from(correction: Correction) -> Self {
        match correction {
            Correction::Newton => Self::Newton,
            Correction::Flow => Self::Flow,
        }
    }
}

impl From<CorrectionFlags> for correction::Settings {
    fn from(flags: CorrectionFlags) -> Self {
        Self {
            tolerance: flags.tolerance,
            most_nodes: flags.most_nodes,
            scheme: flags.correction.into(),
            ..Self::default()
        }
    }
}

impl From<PointFlags> for ReadOptions {
    fn from(flags: PointFlags) -> Self {
        Self {
            format: flags.format,
            classes: flags.classes,
            column: None,
        }
    }
}

/// Reads a length above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    coordinate(text).and_then(|value| {
        let found = format!("found {text:?}, expected a length above 0");
        (value > 0.0).then_some(value).ok_or(found)
    })
}

/// Reads a relative tolerance.
pub fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        Ok(value) if value <= 0.0 => Err(format!(
            "found {text:?}, expected a positive tolerance, such as 1e-6"
        )),
        _ => Err(format!(
            "found {text:?}, expected a relative error between 0 and 1, such as 1e-6"
        )),
    }
}

/// Reads a code of LAS classes.
pub fn class(text: &str) -> Result<u8, String> {
    text.trim().parse().map_err(|_| {
        format!(
            "found {text:?}, expected the number of a class, 0 to 255, such as 2, which is ground"
        )
    })
}

/// Reads a whole number.
pub fn whole(text: &str) -> Result<usize, String> {
    let wrong = |_| format!("found {text:?}, expected a whole number: 0, 1, 2, ..");
    text.trim().parse().map_err(wrong)
}

/// Reads a whole number above 0.
pub fn count(text: &str) -> Result<usize, String> {
    match whole(text) {
        Ok(value) if value > 0 => Ok(value),
        _ => Err(format!("found {text:?}, expected a whole number: 1, 2, ..")),
    }
}

/// Reads what random numbers begin with.
pub fn seed(text: &str) -> Result<u64, String> {
    let wrong = |_| format!("found {text:?}, expected a whole number: 0, 1, 2, ..");
    text.trim().parse().map_err(wrong)
}

/// Which pairs of ends.
pub enum Ends {
    One([End; 2]),
    /// A file of pairs.
    File(PathBuf),
    StandardInput,
}

/// What `taut path` was asked to do.
pub struct PathSettings {
    pub source: Source,
    pub ends: Ends,
    pub correction: correction::Settings,
    /// Further paths besides the shortest, at most.
    pub alternatives: usize,
    pub json: bool,
    pub points: bool,
    pub output: Option<PathBuf>,
    pub picture: Option<PathBuf>,
}

/// What `taut matrix` was asked to do.
pub struct MatrixSettings {
    pub source: Source,
    /// A file of points or rows.
    pub sources: PathBuf,
    pub to: Option<PathBuf>,
    /// Only pairs within this distance.
    pub radius: Option<f64>,
    pub correction: correction::Settings,
    pub output: PathBuf,
    pub errors: Option<PathBuf>,
    pub paths: Option<PathsSettings>,
    /// Whether to begin anew.
    pub restart: bool,
    pub json: bool,
}

/// Where many paths go.
pub struct PathsSettings {
    pub folder: PathBuf,
    /// The extension that names the format.
    pub format: String,
}

/// Formats that hold many paths in a file.
const PATHS_FORMATS: [&str; 6] = ["ply", "obj", "csv", "json", "vtk", "vtp"];

/// What `taut check` was asked to do.
pub struct CheckSettings {
    pub source: Source,
    pub json: bool,
}

/// What `taut fit` was asked to do.
pub struct FitCommandSettings {
    pub cloud: CloudSettings,
    pub accuracy: Option<f64>,
    pub output: PathBuf,
    pub json: bool,
    pub picture: Option<PathBuf>,
}

impl TryFrom<FitFlags> for FitCommandSettings {
    type Error = Failure;

    fn try_from(flags: FitFlags) -> Result<Self, Failure> {
        if flags
            .output
            .extension()
            .is_none_or(|found| found != models::EXTENSION)
        {
            return Err(Failure::Usage(format!(
                "--output: found {}, expected the extension .{}, which marks a model; rename it",
                flags.output.display(),
                models::EXTENSION
            )));
        }
        Ok(Self {
            cloud: CloudSettings {
                file: flags.file,
                model: Model {
                    dimension: flags.points.dimension,
                    ..Model::default()
                },
                options: flags.points.into(),
            },
            accuracy: flags.accuracy,
            output: flags.output,
            json: flags.json,
            picture: flags.picture,
        })
    }
}

/// What `taut sample` was asked to do.
pub struct SampleSettings {
    pub source: Source,
    pub count: usize,
    pub sources: Sources,
    /// Points of the cloud, each the farthest from those before, instead of particles.
    pub farthest: bool,
    pub spread: Spread,
    pub seed: u64,
    pub json: bool,
    pub output: Option<PathBuf>,
    pub picture: Option<PathBuf>,
}

/// Points that particles or distances start from.
pub enum Sources {
    /// Nowhere in particular.
    Any,
    Ends(Vec<End>),
    /// A file of points.
    File(PathBuf),
}

impl Sources {
    fn new(ends: Vec<End>, file: Option<PathBuf>) -> Self {
        match file {
            Some(file) => Self::File(file),
            None if ends.is_empty() => Self::Any,
            None => Self::Ends(ends),
        }
    }
}

impl TryFrom<SampleFlags> for SampleSettings {
    type Error = Failure;

    fn try_from(flags: SampleFlags) -> Result<Self, Failure> {
        Ok(Self {
            source: flags.surface.try_into()?,
            count: flags.count,
            sources: Sources::new(flags.source, flags.sources),
            farthest: flags.farthest,
            spread: if flags.uniform {
                Spread::Even
            } else {
                Spread::Curvature
            },
            seed: flags.seed,
            json: flags.json,
            output: flags.output,
            picture: flags.picture,
        })
    }
}

impl TryFrom<SurfaceFlags> for Source {
    type Error = Failure;

    fn try_from(flags: SurfaceFlags) -> Result<Self, Failure> {
        if let Some(file) = flags.source.file.clone() {
            if file
                .extension()
                .is_some_and(|found| found == models::EXTENSION)
            {
                return of_model(file, &flags);
            }
            return Ok(Self::Cloud(CloudSettings {
                file,
                model: Model {
                    cells: flags.cells,
                    dimension: flags.points.dimension,
                    reconstruction: flags.surface,
                },
                options: flags.points.into(),
            }));
        }
        let SourceFlags {
            implicit, shape, ..
        } = flags.source;
        equations(shape, implicit, flags.bounds).map(Self::Equations)
    }
}

/// A model says itself all that could be said of points.
fn of_model(file: PathBuf, flags: &SurfaceFlags) -> Result<Source, Failure> {
    let SurfaceFlags {
        points:
            PointFlags {
                classes,
                format,
                dimension,
            },
        cells,
        surface,
        ..
    } = flags;
    let unasked = classes.is_empty()
        && format.is_none()
        && dimension.is_none()
        && cells.is_empty()
        && *surface == Reconstruction::default();
    if unasked {
        return Ok(Source::Model(file));
    }
    Err(Failure::Usage(format!(
        "{}: a fitted model takes none of --class, --format, --dimension, --cell and --surface; leave them out, or give them to taut fit",
        file.display()
    )))
}

/// The surface of a shape, or else of equations.
fn equations(
    shape: Option<Shape>,
    texts: Vec<String>,
    bounds: Option<Bounds>,
) -> Result<Implicit, Failure> {
    if let Some(shape) = shape {
        return Ok(Implicit {
            dimension: shape.dimension(),
            bounds: None,
            law: Law::Shape(shape),
        });
    }
    let borrowed: Vec<&str> = texts.iter().map(String::as_str).collect();
    let dimension = Formula::parse(&borrowed, None)?.dimension();
    let bounds = bounds.map(|bounds| for_dimension(bounds, dimension));
    Ok(Implicit {
        dimension,
        bounds: bounds.transpose()?,
        law: Law::Texts(texts),
    })
}

/// One range serves all axes; otherwise there must be one each.
fn for_dimension(bounds: Bounds, dimension: usize) -> Result<Bounds, Failure> {
    match bounds.low.len() {
        1 => Ok(Bounds {
            low: vec![bounds.low[0]; dimension],
            high: vec![bounds.high[0]; dimension],
        }),
        found if found == dimension => Ok(bounds),
        found => Err(Failure::Usage(format!(
            "--bounds: found {found} ranges, expected 1, or {dimension}, one for each variable"
        ))),
    }
}

impl TryFrom<PathFlags> for PathSettings {
    type Error = Failure;

    fn try_from(flags: PathFlags) -> Result<Self, Failure> {
        let ends = match (flags.from, flags.to, flags.pairs) {
            (Some(from), Some(to), None) => Ends::One([from, to]),
            (None, None, Some(file)) if file.as_os_str() == "-" => Ends::StandardInput,
            (None, None, Some(file)) => Ends::File(file),
            _ => {
                let message = "expected --from and --to, or --pairs";
                return Err(Failure::Usage(message.to_owned()));
            }
        };
        Ok(Self {
            source: flags.surface.try_into()?,
            ends,
            correction: correction::Settings {
                prove_shortest: flags.prove_shortest,
                ..flags.correction.into()
            },
            alternatives: flags.alternatives,
            json: flags.json,
            points: flags.points,
            output: flags.output,
            picture: flags.picture,
        })
    }
}

impl TryFrom<MatrixFlags> for MatrixSettings {
    type Error = Failure;

    fn try_from(flags: MatrixFlags) -> Result<Self, Failure> {
        let extension = if flags.radius.is_some() { "npz" } else { "npy" };
        for file in std::iter::once(&flags.output).chain(&flags.errors) {
            if file.extension().is_none_or(|found| found != extension) {
                return Err(Failure::Usage(format!(
                    "{}: expected the extension .{extension}, which a matrix {} --radius must have; rename it",
                    file.display(),
                    if flags.radius.is_some() {
                        "with"
                    } else {
                        "without"
                    }
                )));
            }
        }
        let format = flags.paths_format;
        if !PATHS_FORMATS.contains(&format.as_str()) {
            return Err(Failure::Usage(format!(
                "--paths-format: found {format}, expected one of {}",
                PATHS_FORMATS.join(", ")
            )));
        }
        Ok(Self {
            source: flags.surface.try_into()?,
            sources: flags.sources,
            to: flags.to,
            radius: flags.radius,
            correction: flags.correction.into(),
            output: flags.output,
            errors: flags.errors,
            paths: flags.paths.map(|folder| PathsSettings { folder, format }),
            restart: flags.restart,
            json: flags.json,
        })
    }
}

impl TryFrom<CheckFlags> for CheckSettings {
    type Error = Failure;

    fn try_from(flags: CheckFlags) -> Result<Self, Failure> {
        Ok(Self {
            source: flags.surface.try_into()?,
            json: flags.json,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_one_range_or_one_each() {
        let bounds: Bounds = "-2:2".parse().expect("one range");
        let wide = for_dimension(bounds, 3).expect("fits");
        assert_eq!((wide.low, wide.high), (vec![-2.0; 3], vec![2.0; 3]));
        let bounds: Bounds = "-2:2,0:1.5".parse().expect("two ranges");
        assert!(matches!(for_dimension(bounds, 3), Err(Failure::Usage(_))));
    }
}
