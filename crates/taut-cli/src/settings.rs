//! What the command was asked to do, checked.

mod directions;
mod field;
mod source;

use std::path::PathBuf;

use taut::End;
use taut_core::correction;
use taut_core::guess::particles::Spread;

use crate::exit::Failure;
use crate::flags::{CheckFlags, CorrectionFlags, FitFlags, MatrixFlags, PathFlags, SampleFlags};
use crate::values::Reconstruction;
pub use directions::{Aim, ExpSettings, LogSettings};
pub use field::{CostSettings, FieldSettings, IsolineSettings, Rates};
pub use source::{CloudSettings, Model, Source, Sources};

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
            .is_none_or(|found| found != source::MODEL_EXTENSION)
        {
            return Err(Failure::Usage(format!(
                "--output: found {}, expected the extension .{}, which marks a model; rename it",
                flags.output.display(),
                source::MODEL_EXTENSION
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
        let mut source = flags.surface.try_into()?;
        // Surfaces of both kinds rest on the charts, and these are what there is to tell of.
        if let Source::Cloud(cloud) = &mut source {
            cloud.model.reconstruction = Reconstruction::Atlas;
        }
        Ok(Self {
            source,
            json: flags.json,
        })
    }
}
