//! How paths are pulled taut: the flags that say it.

use clap::{Args, ValueEnum};
use taut_core::correction;

use crate::values::{count, tolerance};

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

/// How paths are pulled taut.
#[derive(Debug, Args)]
pub struct CorrectionFlags {
    /// Largest relative error of a length
    #[arg(long = "tol", value_name = "T", default_value = "1e-6", value_parser = tolerance)]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: f64,
    /// How paths are pulled taut
    #[arg(long, value_name = "SCHEME", value_enum, default_value_t)]
    pub correction: Correction,
    /// Largest number of nodes that a path may have
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    #[arg(default_value_t = correction::Settings::default().most_nodes)]
    pub most_nodes: usize,
}

impl CorrectionFlags {
    pub fn settings(&self) -> correction::Settings {
        correction::Settings {
            tolerance: self.tolerance,
            most_nodes: self.most_nodes,
            scheme: self.correction.into(),
            ..correction::Settings::default()
        }
    }
}
