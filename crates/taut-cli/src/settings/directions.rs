//! What `taut log` and `taut exp` were asked to do, checked.

use std::path::PathBuf;

use taut::End;
use taut_core::field;

use crate::exit::Failure;
use crate::flags::{ExpFlags, LogFlags};
use crate::settings::source::{Source, Sources};

/// What `taut log` was asked to do.
pub struct LogSettings {
    pub source: Source,
    pub sources: Sources,
    /// Points that vectors lead to, instead of those of the surface.
    pub at: Option<PathBuf>,
    pub transport: bool,
    pub field: field::Settings,
    pub json: bool,
    pub output: Option<PathBuf>,
}

/// Where geodesics go.
pub enum Aim {
    One(Vec<f64>),
    /// A file of vectors.
    File(PathBuf),
}

/// What `taut exp` was asked to do.
pub struct ExpSettings {
    pub source: Source,
    pub start: End,
    pub aim: Aim,
    /// How far, where not as far as the vectors are long.
    pub length: Option<f64>,
    pub field: field::Settings,
    pub json: bool,
    pub output: Option<PathBuf>,
    pub picture: Option<PathBuf>,
}

fn accurate(tolerance: f64) -> field::Settings {
    field::Settings {
        tolerance,
        ..field::Settings::default()
    }
}

impl TryFrom<LogFlags> for LogSettings {
    type Error = Failure;

    fn try_from(flags: LogFlags) -> Result<Self, Failure> {
        Ok(Self {
            source: flags.surface.try_into()?,
            sources: Sources::new(flags.source, None),
            at: flags.at,
            transport: flags.transport,
            field: accurate(flags.tolerance),
            json: flags.json,
            output: flags.output,
        })
    }
}

impl TryFrom<ExpFlags> for ExpSettings {
    type Error = Failure;

    fn try_from(flags: ExpFlags) -> Result<Self, Failure> {
        Ok(Self {
            source: flags.surface.try_into()?,
            start: flags.source,
            aim: flags.vectors.map_or(Aim::One(flags.direction), Aim::File),
            length: flags.length,
            field: accurate(flags.tolerance),
            json: flags.json,
            output: flags.output,
            picture: flags.picture,
        })
    }
}
