//! Fitting: an implicit surface F = 0 of a cloud, as smooth as an accuracy allows.
//!
//! The atlas of the cloud is covered by charts as large as keep to its points within the accuracy
//! (`cover`), and the charts of a hypersurface are turned to one side (`orient`). The result is an
//! atlas of fewer charts that keeps the rims (the boundary of the surface) of the first one.

use crate::cloud::Cloud;
use crate::error::Error;
use crate::surface::Geometry;
use crate::surface::atlas::Atlas;
use crate::surface::atlas::build::Draft;
use crate::surface::atlas::checks;
use crate::surface::atlas::cover::{Covering, cover};
use crate::surface::atlas::orient::{Orientation, orient, turn};
use crate::surface::atlas::rim::Rim;
use crate::{Vector, parallel};

/// How a surface is fitted.
#[derive(Clone, Copy, Debug, Default)]
pub struct FitSettings<'a> {
    /// Distance from the surface within which the points must lie, in the input's units; a
    /// thousandth of the diagonal of the points' box if `None`. A larger one smooths more and makes
    /// fewer charts.
    pub accuracy: Option<f64>,
    /// Normals, one row for each row of the input with as many coordinates as the points have. Rows
    /// that are zero or not finite say nothing. The lengths of normals do not matter.
    pub normals: Option<&'a [f64]>,
}

/// The result of a fit. Lengths are in the input's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The accuracy asked for.
    pub accuracy: f64,
    /// Root mean square distance of the points from the surface; points without a foot on it are
    /// left out.
    pub residual: f64,
    /// Largest distance of a point from the surface; points without a foot on it are left out.
    pub largest_residual: f64,
    /// The number of points farther from the surface than the accuracy, or without a foot on it:
    /// outliers, and points at creases or in noise that no chart follows.
    pub beyond: usize,
    /// The number of pairs of neighbouring charts whose normals no choice of sides reconciles; 0
    /// where F has two sides.
    pub contradictions: usize,
    /// The number of points whose given normal points to the other side than F's gradient.
    pub normals_against: usize,
}

/// The accuracy where none is asked for, in diagonals of the points' box.
const USUAL_ACCURACY: f64 = 1e-3;

impl<const D: usize> Atlas<D> {
    /// Fits a surface of dimension `intrinsic_dimension` of charts that are as large as keep to the
    /// points within an accuracy. For hypersurfaces the sides are told apart: F is positive on the
    /// side that the given normals point to, or else outside of what a component encloses.
    ///
    /// # Errors
    /// [`Error::BadAccuracy`] for an accuracy that is no positive length, [`Error::BadFit`] where
    /// [`Atlas::from_model`] would not take the charts, and the errors of [`Atlas::new`].
    ///
    /// # Panics
    /// If there are normals, but not a row for each row of the input.
    ///
    /// O(n log n) time, O(n) memory.
    pub fn fit(
        cloud: Cloud<D>,
        intrinsic_dimension: usize,
        settings: &FitSettings<'_>,
    ) -> Result<(Self, Fit), Error> {
        let accuracy = settings
            .accuracy
            .unwrap_or_else(|| USUAL_ACCURACY * diagonal(&cloud));
        if !(accuracy.is_finite() && accuracy > 0.0) {
            return Err(Error::BadAccuracy { found: accuracy });
        }
        let draft = Draft::of_leaves(cloud, intrinsic_dimension)?;
        // The rims are found on the small charts, before larger ones replace these.
        let rim = Rim::new(&draft, &draft.neighbours().0);
        let Covering {
            built,
            linked,
            groups,
        } = cover(&draft, accuracy);
        let mut draft = Draft {
            built,
            linked,
            ..draft
        };
        let (mut contradictions, mut normals_against) = (0, 0);
        if intrinsic_dimension + 1 == D {
            let given = settings.normals.map(|rows| in_tree(&draft, rows));
            let Orientation {
                signs,
                contradictions: links,
                against,
            } = orient(&draft, given.as_deref());
            turn(&mut draft, &signs);
            (contradictions, normals_against) = (links, against);
        }
        let (neighbours, sides) = draft.neighbours();
        let atlas = draft.with_rim(neighbours, sides, rim.grouped(&groups));
        checks::fitted(&atlas)?;
        let residuals = atlas.residuals();
        let known = || residuals.iter().copied().filter(|r| r.is_finite());
        let squares: f64 = known().map(|r| r * r).sum();
        let fit = Fit {
            accuracy,
            residual: (squares / known().count().max(1) as f64).sqrt(),
            largest_residual: known().fold(0.0, f64::max),
            beyond: residuals.iter().filter(|r| **r > accuracy).count(),
            contradictions,
            normals_against,
        };
        Ok((atlas, fit))
    }

    /// The distance of each point of the cloud from its foot; infinite where it has none.
    fn residuals(&self) -> Vec<f64> {
        let points = &self.cloud.points;
        let scratch = || Geometry::new(D - self.monomials.variables);
        parallel::map_with(points.len(), scratch, |scratch, i| {
            match self.pulled(&points[i], self.owners[i], scratch) {
                Some(node) => (node.point - points[i]).norm(),
                None => f64::INFINITY,
            }
        })
    }
}

/// The diagonal of the points' box.
fn diagonal<const D: usize>(cloud: &Cloud<D>) -> f64 {
    let corner = |choose: fn(&Vector<D>, &Vector<D>) -> Vector<D>| {
        let points = cloud.points.iter();
        points.fold(cloud.points[0], |corner, point| choose(&corner, point))
    };
    (corner(Vector::sup) - corner(Vector::inf)).norm()
}

/// The normals that were given by row, by tree index; zero where unknown.
fn in_tree<const D: usize>(draft: &Draft<D>, rows: &[f64]) -> Vec<Vector<D>> {
    let cloud = &draft.cloud;
    let dimension = rows.len() / cloud.point_of_row.len();
    assert_eq!(
        rows.len(),
        dimension * cloud.point_of_row.len(),
        "a normal for each row"
    );
    let normal = |index: &u32| {
        let mut normal = Vector::<D>::zeros();
        if let Some(row) = cloud.rows.get(*index as usize) {
            let given = &rows[*row as usize * dimension..][..dimension];
            if given.iter().all(|v| v.is_finite()) {
                normal.as_mut_slice()[..dimension].copy_from_slice(given);
            }
        }
        normal
    };
    draft.tree.order.iter().map(normal).collect()
}
