//! Tiny clouds, 3 to 60 points of any kind, through everything: an answer or a refusal, and no
//! answer without a number.

use taut_core::cloud::Cloud;
use taut_core::correction::Settings;
use taut_core::field::{self, Cost, Fields, Slope, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::Node;
use taut_core::surface::atlas::{Atlas, ChartIndex, FitSettings};

use crate::Bytes;

/// Points and how to understand them.
struct Tiny {
    rows: Vec<f64>,
    dimension: usize,
    /// The first byte's other bits.
    choices: u8,
}

impl Tiny {
    fn new(bytes: &[u8]) -> Self {
        let mut bytes = Bytes(bytes);
        let choices = bytes.byte();
        let count = 3 + usize::from(bytes.byte()) % 58;
        let scale = bytes.magnitude();
        let offset = bytes.small();
        let mut rows = Vec::with_capacity(3 * count);
        for _ in 0..count {
            // What is missing is put on a spiral, so that short inputs are clouds as well.
            if bytes.is_empty() {
                let angle = 0.7 * rows.len() as f64;
                rows.extend(
                    [angle.cos() * angle, angle.sin() * angle, 0.1 * angle].map(|v| v * scale),
                );
                continue;
            }
            rows.extend([(); 3].map(|()| match choices % 4 {
                0 => (bytes.small() + offset) * scale,
                1 => bytes.fine() * scale + offset,
                2 => bytes.small() * bytes.magnitude(),
                _ => bytes.any(),
            }));
        }
        Self {
            rows,
            dimension: 1 + usize::from(choices >> 2) % 2,
            choices: choices >> 3,
        }
    }

    fn cloud(&self) -> Option<Cloud<3>> {
        Cloud::new(&self.rows, 3).ok()
    }

    fn geodesics(&self) -> Option<Geodesics<3, Atlas<3>>> {
        let atlas = Atlas::new(self.cloud()?, self.dimension).ok()?;
        assert!(atlas.report().charts > 0);
        Some(Geodesics::of_atlas(atlas))
    }
}

/// The nodes of the first and of the last row that have any.
fn ends(geodesics: &Geodesics<3, Atlas<3>>) -> Option<[Node<3, ChartIndex>; 2]> {
    let surface = geodesics.surface();
    let rows = 0..surface.cloud().point_of_row.len();
    let mut nodes = rows.filter_map(|row| surface.node_of_row(row).ok());
    let first = nodes.next()?;
    Some([first, nodes.next_back().unwrap_or(first)])
}

/// A surface and a path on it, or several.
pub fn atlas(bytes: &[u8]) {
    let tiny = Tiny::new(bytes);
    let Some(geodesics) = tiny.geodesics() else {
        return;
    };
    let Some([from, to]) = ends(&geodesics) else {
        return;
    };
    if !tiny.choices.is_multiple_of(4) {
        check_path(&geodesics, &from, &to);
        return;
    }
    for path in geodesics.alternatives(&from, &to, &Settings::default(), 2) {
        assert!(!path.converged() || path.length.is_finite());
    }
}

/// A surface and a field on it, of distances or of costs.
pub fn field(bytes: &[u8]) {
    let tiny = Tiny::new(bytes);
    let Some(geodesics) = tiny.geodesics() else {
        return;
    };
    let Some([from, _]) = ends(&geodesics) else {
        return;
    };
    let cost = |slope| Cost {
        slope,
        ..Cost::default()
    };
    match tiny.choices % 4 {
        0 => check_field(&geodesics, &from, Some(&cost(Slope::Level))),
        1 => check_field(&geodesics, &from, Some(&cost(Slope::Hiking))),
        _ => check_field(&geodesics, &from, None),
    }
}

/// A fitted surface, kept and read again, with paths on it.
pub fn fit(bytes: &[u8]) {
    let tiny = Tiny::new(bytes);
    let Some(cloud) = tiny.cloud() else {
        return;
    };
    let step = (cloud.points[0] - cloud.points[1]).norm();
    let settings = FitSettings {
        accuracy: match tiny.choices % 3 {
            0 => None,
            1 => Some(0.1 * step),
            _ => Some(1e-6 * step),
        },
        ..FitSettings::default()
    };
    let Ok((atlas, fit)) = Atlas::fit(cloud, tiny.dimension, &settings) else {
        return;
    };
    assert!(fit.residual >= 0.0 && fit.largest_residual >= fit.residual);
    let model = atlas.to_model();
    let again = Atlas::<3>::from_model(&model);
    let again = again.unwrap_or_else(|error| panic!("what was fitted is read again: {error}"));
    let geodesics = Geodesics::of_atlas(again);
    let nodes = geodesics.surface().nodes();
    check_path(&geodesics, &nodes[0], &nodes[nodes.len() - 1]);
}

/// A path has a length that can be one, or says that it has none.
pub fn check_path(
    geodesics: &Geodesics<3, Atlas<3>>,
    from: &Node<3, ChartIndex>,
    to: &Node<3, ChartIndex>,
) {
    let path = geodesics.path(from, to, &Settings::default());
    if !path.converged() {
        return;
    }
    let chord = (to.point - from.point).norm();
    let (length, error) = (path.length, path.length_error);
    assert!(length.is_finite() && error >= 0.0, "{length} +- {error}");
    let error = error + path.surface_error.max(0.0) + 1e-9 * length;
    assert!(
        length >= chord - error,
        "{length} +- {error} for a chord of {chord}"
    );
    let nodes = path.points.len();
    assert!(nodes >= 1 && path.arc_length.len() == nodes && path.normals.len() == nodes);
    assert!(
        path.points
            .iter()
            .all(|point| point.iter().all(|v| v.is_finite()))
    );
    assert!(path.arc_length.is_sorted());
}

/// A field has a distance everywhere, which may be infinite, with an error. Only an outlier may
/// have none, where it has no foot on the surface.
pub fn check_field(
    geodesics: &Geodesics<3, Atlas<3>>,
    from: &Node<3, ChartIndex>,
    cost: Option<&Cost>,
) {
    let fields = match cost {
        Some(cost) => Fields::with_cost(geodesics, cost),
        None => Fields::of_cloud(geodesics),
    };
    let source = [Source {
        node: *from,
        start: 0.0,
    }];
    let Ok(fields) = fields else { return };
    let Ok(field) = fields.from(&source, &field::Settings::default()) else {
        return;
    };
    let surface = geodesics.surface();
    let values = if surface.has_points() {
        fields.at_points(&field)
    } else {
        let nodes = surface.nodes();
        nodes.iter().map(|node| fields.at(&field, node)).collect()
    };
    let has_outliers = surface.report().outliers > 0;
    for value in values {
        let is_known = value.distance >= 0.0 && value.error >= 0.0;
        let is_unknown = value.distance.is_nan() && value.error.is_nan();
        assert!(is_known || is_unknown && has_outliers, "{value:?}");
        assert!(value.direction.iter().all(|v| !v.is_nan()), "{value:?}");
    }
}
