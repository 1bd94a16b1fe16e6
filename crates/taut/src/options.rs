//! What can be asked for beyond the defaults.

use taut_core::{correction, field};

/// How a surface is put through points.
#[derive(Clone, Copy, Debug, Default)]
pub struct CloudOptions {
    /// The dimension of the surface: 2 unless given for points of two or three coordinates, and to
    /// be given for others.
    pub dimension: Option<usize>,
}

/// What a path must reach.
#[derive(Clone, Copy, Debug)]
pub struct PathOptions {
    /// Largest relative error of the length.
    pub tolerance: f64,
    /// Most nodes of a path.
    pub most_nodes: usize,
    /// Whether rays are shot to find out if the shortest path found is the shortest there is, some
    /// milliseconds a path.
    pub prove_shortest: bool,
}

impl Default for PathOptions {
    /// A tolerance of 1e-6 on at most 8192 nodes.
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            most_nodes: correction::Settings::default().most_nodes,
            prove_shortest: false,
        }
    }
}

impl PathOptions {
    /// The defaults with another tolerance.
    #[must_use]
    pub fn to(tolerance: f64) -> Self {
        Self {
            tolerance,
            ..Self::default()
        }
    }

    pub(crate) fn correction(&self) -> correction::Settings {
        correction::Settings {
            tolerance: self.tolerance,
            most_nodes: self.most_nodes,
            prove_shortest: self.prove_shortest,
            ..correction::Settings::default()
        }
    }
}

/// How accurate distances are to be and how far they go.
#[derive(Clone, Copy, Debug)]
pub struct FieldOptions {
    /// Relative error of the rays that carry the distances.
    pub tolerance: f64,
    /// Distances beyond this, in the input's units, are not looked for.
    pub max_distance: f64,
}

impl Default for FieldOptions {
    /// A tolerance of 1e-6, as far as the surface goes.
    fn default() -> Self {
        let field::Settings {
            tolerance,
            max_distance,
        } = field::Settings::default();
        Self {
            tolerance,
            max_distance,
        }
    }
}

impl FieldOptions {
    pub(crate) fn settings(&self) -> field::Settings {
        field::Settings {
            tolerance: self.tolerance,
            max_distance: self.max_distance,
        }
    }
}
