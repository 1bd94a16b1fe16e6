//! What `taut check` tells of a surface.

use serde::Serialize;
use taut_core::surface::atlas::report::Report;

/// What a surface is like. Lengths are in the units of the input.
#[derive(Serialize)]
pub struct SurfaceFacts {
    /// The file, the equations or the shape.
    pub surface: String,
    /// Coordinates of a point.
    pub coordinates: usize,
    /// Dimension of the surface.
    pub intrinsic_dimension: usize,
    #[serde(flatten)]
    pub points: Option<PointFacts>,
    #[serde(flatten)]
    pub charts: Option<ChartFacts>,
    /// Smallest and largest coordinate on each axis.
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    /// Number of points (for equations: of samples) of each connected piece, largest first.
    pub components: Vec<usize>,
    /// What will go wrong, in sentences.
    pub warnings: Vec<String>,
}

/// What the points of a file are like.
#[derive(Serialize)]
pub struct PointFacts {
    /// Rows of the file that were read.
    pub rows: usize,
    /// Distinct finite points.
    pub points: usize,
    pub duplicates: usize,
    pub non_finite: usize,
    /// Left out because they lie too far off.
    pub far: usize,
    pub other_sheet: Option<f64>,
    pub outliers: usize,
    pub points_between_rows: usize,
}

/// What a surface of charts is like, as in [`taut_core::surface::atlas::report::Report`].
#[derive(Serialize)]
pub struct ChartFacts {
    pub charts: usize,
    pub spacing: [f64; 3],
    pub noise: f64,
    pub height_error: f64,
    pub degrees: [usize; 4],
    pub rim_length: f64,
}

impl ChartFacts {
    pub fn new(report: &Report) -> Self {
        Self {
            charts: report.charts,
            spacing: report.spacing,
            noise: report.noise,
            height_error: report.height_error,
            degrees: report.degrees,
            rim_length: report.rim_length,
        }
    }
}
