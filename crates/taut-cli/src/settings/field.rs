//! What `taut field` was asked to do, checked.

use std::path::PathBuf;

use taut_core::field;

use crate::exit::Failure;
use crate::flags::FieldFlags;
use crate::settings::source::{Source, Sources};

/// What `taut field` was asked to do.
pub struct FieldSettings {
    pub source: Source,
    pub sources: Sources,
    /// The sources are the vertices of one curve.
    pub is_curve: bool,
    /// Start values of the sources in their order; none where all are 0.
    pub starts: Vec<f64>,
    /// Points to find distances at, instead of those of the surface.
    pub at: Option<PathBuf>,
    pub field: field::Settings,
    /// Only so many points, the nearest to the sources.
    pub nearest: Option<usize>,
    pub isolines: Option<IsolineSettings>,
    /// What ways cost, where that is not their length.
    pub cost: Option<CostSettings>,
    pub json: bool,
    pub output: Option<PathBuf>,
    pub picture: Option<PathBuf>,
}

/// Isolines, and where to.
pub struct IsolineSettings {
    pub file: PathBuf,
    /// Their distances; none where round ones will do.
    pub levels: Vec<f64>,
}

/// Where the costs of a cloud's points stand.
pub enum Rates {
    /// Nowhere: they are 1.
    Level,
    /// In a file of their own.
    File(PathBuf),
    /// In a column of the cloud's own file, which is read with it.
    Column(String),
}

/// What a way costs.
pub struct CostSettings {
    /// The cost per length at each row.
    pub rates: Rates,
    /// Files of polygons that nothing passes, seen from above.
    pub no_go: Vec<PathBuf>,
    pub slope: field::Slope,
}

impl TryFrom<FieldFlags> for FieldSettings {
    type Error = Failure;

    fn try_from(flags: FieldFlags) -> Result<Self, Failure> {
        let has_cost = flags.cost.is_some() || !flags.no_go.is_empty() || flags.slope.is_some();
        let mut source = flags.surface.try_into()?;
        let rates = match flags.cost {
            None => Rates::Level,
            Some(file) if file.exists() => Rates::File(file),
            Some(name) => Rates::Column(name.to_string_lossy().into_owned()),
        };
        if let (Rates::Column(name), Source::Cloud(cloud)) = (&rates, &mut source) {
            cloud.options.column = Some(name.clone());
        }
        Ok(Self {
            source,
            is_curve: flags.curve.is_some(),
            sources: Sources::new(flags.source, flags.sources.or(flags.curve)),
            starts: flags.start,
            at: flags.at,
            field: field::Settings {
                tolerance: flags.tolerance,
                max_distance: flags.max_distance.unwrap_or(f64::INFINITY),
            },
            nearest: flags.nearest,
            isolines: flags.isolines.map(|file| IsolineSettings {
                file,
                levels: flags.levels,
            }),
            cost: has_cost.then(|| CostSettings {
                rates,
                no_go: flags.no_go,
                slope: flags.slope.unwrap_or_default(),
            }),
            json: flags.json,
            output: flags.output,
            picture: flags.picture,
        })
    }
}
