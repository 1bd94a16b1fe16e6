//! An atlas as plain numbers, to be kept in a file.
//!
//! The points are not kept: a model's rows are its charts, and the charts' origins stand for the
//! points.

use serde::{Deserialize, Serialize};

use crate::cloud::Cloud;
use crate::error::Error;
use crate::spatial::tree::Tree;
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::checks;
use crate::surface::atlas::polynomial::{HIGHEST_DEGREE, Monomials};
use crate::surface::atlas::rim::{Disc, Rim};
use crate::surface::atlas::supports::Supports;
use crate::surface::atlas::{Atlas, ChartIndex, Lists, build, trust};
use crate::{Matrix, Vector};

/// An atlas in R^d of dimension k, with m = d - k normals. Lengths are in the input's units, and
/// positions relative to `centre`.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// What is the same for all charts.
    pub header: Header,
    /// The charts.
    pub charts: Vec<ModelChart>,
}

/// What is the same for all charts of a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// The dimension d of the vectors in the model.
    pub ambient_dimension: usize,
    /// The dimension k of the surface.
    pub intrinsic_dimension: usize,
    /// The vector that is subtracted from the input's coordinates.
    pub centre: Vec<f64>,
    /// The wavelength of the surface's finest detail; 0 for smooth surfaces.
    pub detail: f64,
}

/// A polynomial height over a tangent plane, as far as it takes part in the blend, and its
/// neighbours and rim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelChart {
    /// A point of the chart's own surface.
    pub origin: Vec<f64>,
    /// d orthonormal vectors: m normals, then k tangents.
    pub frame: Vec<Vec<f64>>,
    /// R of the weight (1 - r^2/R^2)^4 at a distance r from the origin.
    pub radius: f64,
    /// The length by which the tangent coordinates are divided.
    pub scale: f64,
    /// Total degree of the heights.
    pub degree: u8,
    /// For each normal the coefficients of the height's monomials, by ascending degree, and in a
    /// degree by descending powers of the first coordinate, then of the second, and so on.
    pub coefficients: Vec<Vec<f64>>,
    /// Distance between neighbouring points of the cloud.
    pub spacing: f64,
    /// Root mean square of the fit's leave-one-out residuals.
    pub residual: f64,
    /// Estimated standard error of the height.
    pub height_error: f64,
    /// The charts that are blended with this one: itself first, then the others by distance.
    pub neighbours: Vec<ChartIndex>,
    /// For each of `neighbours`, 1 where its normal points to the same side as this chart's, -1
    /// where it does not.
    pub sides: Vec<i8>,
    /// The empty discs where the data ends.
    pub rim: Vec<RimDisc>,
}

/// A disc in the tangent plane that holds no point, at a rim (the boundary of the surface).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RimDisc {
    /// The centre of the disc.
    pub centre: Vec<f64>,
    /// Unit direction from the point that the disc touches to the disc's centre.
    pub outward: Vec<f64>,
    /// The radius of the disc.
    pub radius: f64,
    /// The length of rim that the point which the disc touches stands for.
    pub share: f64,
}

/// Largest difference of the scalar products of a frame's vectors from 0 and 1.
const ORTHONORMAL: f64 = 1e-9;

impl<const D: usize> Atlas<D> {
    /// The atlas without its points.
    #[must_use]
    pub fn to_model(&self) -> Model {
        let coordinates = |x: &Vector<D>| x.as_slice().to_vec();
        let normals = D - self.monomials.variables;
        let disc = |disc: &Disc<D>| RimDisc {
            centre: coordinates(&disc.centre),
            outward: coordinates(&disc.outward),
            radius: disc.radius,
            share: disc.share,
        };
        let chart = |(chart, i): (&Chart<D>, ChartIndex)| {
            let count = chart.coefficients.len() / normals;
            ModelChart {
                origin: coordinates(&chart.origin),
                frame: chart
                    .frame
                    .column_iter()
                    .map(|c| c.as_slice().to_vec())
                    .collect(),
                radius: chart.radius,
                scale: chart.scale,
                degree: chart.degree,
                coefficients: chart
                    .coefficients
                    .chunks(count)
                    .map(<[f64]>::to_vec)
                    .collect(),
                spacing: chart.spacing,
                residual: chart.residual,
                height_error: chart.height_error,
                neighbours: self.neighbours.of(i).to_vec(),
                sides: self.sides[self.neighbours.range(i)].to_vec(),
                rim: self.rim.of(i).iter().map(disc).collect(),
            }
        };
        Model {
            header: Header {
                ambient_dimension: D,
                intrinsic_dimension: self.monomials.variables,
                centre: coordinates(&self.cloud.centre),
                detail: self.detail,
            },
            charts: self.charts.iter().zip(0..).map(chart).collect(),
        }
    }

    /// Makes the atlas of a model, whose charts' origins stand for the points.
    ///
    /// # Errors
    /// [`Error::BadModel`], naming the chart, for a model that is not valid.
    pub fn from_model(model: &Model) -> Result<Self, Error> {
        let header = &model.header;
        expect(None, header.ambient_dimension == D, || {
            (
                format!("ambient_dimension {}", header.ambient_dimension),
                format!("{D}"),
            )
        })?;
        let k = header.intrinsic_dimension;
        expect(None, (1..D).contains(&k), || {
            (
                format!("intrinsic_dimension {k}"),
                format!("1 to {}", D - 1),
            )
        })?;
        expect(
            None,
            header.detail.is_finite() && header.detail >= 0.0,
            || (format!("detail {}", header.detail), "a length".to_owned()),
        )?;
        expect(None, !model.charts.is_empty(), || {
            ("no chart".to_owned(), "at least 1".to_owned())
        })?;
        let centre = vector(None, "centre", &header.centre)?;
        let monomials = Monomials::new(k);
        let mut charts = Vec::with_capacity(model.charts.len());
        let mut discs = Vec::with_capacity(model.charts.len());
        for (i, given) in model.charts.iter().enumerate() {
            let (chart, rim) = (chart(i, given, &monomials)?, rim(i, given)?);
            checks::lengths(i, &chart, D - k)?;
            checks::discs(i, &chart, &rim)?;
            checks::mutual(i, given, &model.charts)?;
            charts.push(chart);
            discs.push(rim);
        }
        for (i, given) in model.charts.iter().enumerate() {
            checks::beside(i, &given.neighbours, &charts)?;
        }
        checks::detail(header.detail, &charts)?;
        let lists = model.charts.iter().map(|c| c.neighbours.iter().copied());
        let origins: Vec<Vector<D>> = charts.iter().map(|chart| chart.origin).collect();
        let (count, neighbours) = (charts.len() as u32, Lists::new(lists));
        // Trust is not kept in a model, as it follows from the charts.
        trust::judge(&mut charts, &neighbours);
        let (uneven, roughness) = (build::uneven(&charts), build::roughness(&charts));
        Ok(Self {
            tree: Tree::new(&origins),
            cloud: Cloud {
                points: origins,
                centre,
                rows: (0..count).collect(),
                point_of_row: (0..count).map(Some).collect(),
                non_finite: 0,
                far: 0,
                duplicates: 0,
            },
            owners: (0..count).collect(),
            neighbours,
            sides: model
                .charts
                .iter()
                .flat_map(|c| &c.sides)
                .copied()
                .collect(),
            supports: Some(Supports::new(&charts)),
            charts,
            monomials,
            rim: Rim::of_lists(&discs),
            outliers: 0,
            has_points: false,
            detail: header.detail,
            uneven,
            roughness,
        })
    }
}

/// Refuses what is not as it must be; `texts` makes the texts of what was found and what was
/// expected.
pub(super) fn expect(
    chart: Option<usize>,
    holds: bool,
    texts: impl FnOnce() -> (String, String),
) -> Result<(), Error> {
    if holds {
        return Ok(());
    }
    let (found, expected) = texts();
    Err(Error::BadModel {
        chart,
        found,
        expected,
    })
}

/// A vector of a model, if it has D finite coordinates.
fn vector<const D: usize>(
    chart: Option<usize>,
    name: &str,
    values: &[f64],
) -> Result<Vector<D>, Error> {
    let finite = values.len() == D && values.iter().all(|v| v.is_finite());
    expect(chart, finite, || {
        (format!("{name} {values:?}"), format!("{D} finite numbers"))
    })?;
    Ok(Vector::from_column_slice(values))
}

/// A length of a model, if it is finite and at least `least`.
fn length(chart: usize, name: &str, value: f64, least: f64) -> Result<f64, Error> {
    expect(Some(chart), value.is_finite() && value >= least, || {
        (format!("{name} {value}"), "a length".to_owned())
    })?;
    Ok(value)
}

/// A chart of a model, if its parts are valid by themselves.
fn chart<const D: usize>(
    i: usize,
    given: &ModelChart,
    monomials: &Monomials,
) -> Result<Chart<D>, Error> {
    let mut frame = Matrix::<D>::zeros();
    expect(Some(i), given.frame.len() == D, || {
        (
            format!("a frame of {} vectors", given.frame.len()),
            format!("{D}"),
        )
    })?;
    for (column, values) in given.frame.iter().enumerate() {
        frame.set_column(column, &vector(Some(i), "frame", values)?);
    }
    let off = (frame.tr_mul(&frame) - Matrix::identity()).amax();
    expect(Some(i), off <= ORTHONORMAL, || {
        (
            format!("a frame off by {off:.1e}"),
            "orthonormal vectors".to_owned(),
        )
    })?;
    let degree = usize::from(given.degree);
    expect(Some(i), (1..=HIGHEST_DEGREE).contains(&degree), || {
        (format!("degree {degree}"), format!("1 to {HIGHEST_DEGREE}"))
    })?;
    let (normals, count) = (D - monomials.variables, monomials.count(degree));
    let shape = given.coefficients.len() == normals
        && given.coefficients.iter().all(|list| list.len() == count);
    expect(Some(i), shape, || {
        let found: Vec<usize> = given.coefficients.iter().map(Vec::len).collect();
        (
            format!("lists of {found:?} coefficients"),
            format!("{normals} of {count} for degree {degree}"),
        )
    })?;
    let coefficients = given.coefficients.concat();
    expect(Some(i), coefficients.iter().all(|c| c.is_finite()), || {
        (
            "a coefficient that is not finite".to_owned(),
            "finite numbers".to_owned(),
        )
    })?;
    Ok(Chart {
        origin: vector(Some(i), "origin", &given.origin)?,
        frame,
        radius: length(i, "radius", given.radius, f64::MIN_POSITIVE)?,
        coefficients,
        degree: given.degree,
        scale: length(i, "scale", given.scale, f64::MIN_POSITIVE)?,
        spacing: length(i, "spacing", given.spacing, f64::MIN_POSITIVE)?,
        residual: length(i, "residual", given.residual, 0.0)?,
        height_error: length(i, "height_error", given.height_error, 0.0)?,
        trust: 1.0,
        blend_error: 0.0,
        stands_alone: true,
    })
}

/// The discs of a chart of a model, if they are valid by themselves.
fn rim<const D: usize>(i: usize, given: &ModelChart) -> Result<Vec<Disc<D>>, Error> {
    let disc = |disc: &RimDisc| {
        Ok(Disc {
            centre: vector(Some(i), "rim centre", &disc.centre)?,
            outward: vector(Some(i), "rim outward", &disc.outward)?,
            radius: length(i, "rim radius", disc.radius, f64::MIN_POSITIVE)?,
            share: length(i, "rim share", disc.share, 0.0)?,
        })
    };
    given.rim.iter().map(disc).collect()
}
