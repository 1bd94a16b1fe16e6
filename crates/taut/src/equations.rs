//! Surfaces F(x) = 0: written equations and named shapes, and where to look for them.

use std::fmt;
use std::str::FromStr;

use taut_core::geodesics::Geodesics;
use taut_core::guess::sampling::Sampled;
use taut_core::surface::implicit::{Equations, ImplicitSurface};
use taut_core::surface::shapes::Shape;
use taut_core::surface::{Geometry, Surface};
use taut_core::{Matrix, Vector};
use taut_formula::Formula;

use crate::Error;
use crate::end::coordinate;
use crate::size::padded;

/// F, as the user wrote it.
#[derive(Clone, Debug)]
pub enum Law {
    /// Equations, which hold all at once.
    Texts(Vec<String>),
    /// A shape that the engine knows by name.
    Shape(Shape),
}

impl fmt::Display for Law {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Texts(texts) => formatter.write_str(&texts.join("; ")),
            Self::Shape(shape) => shape.fmt(formatter),
        }
    }
}

/// A box: the lowest and the highest coordinate on each axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// The lowest coordinates.
    pub low: Vec<f64>,
    /// The highest coordinates.
    pub high: Vec<f64>,
}

impl FromStr for Bounds {
    type Err = String;

    /// Reads ranges such as `-2:2`, with commas between them.
    fn from_str(text: &str) -> Result<Self, String> {
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for range in text.split(',') {
            let (from, to) = range
                .split_once(':')
                .ok_or_else(|| format!("found {range:?}, expected lo:hi for each axis"))?;
            let (from, to) = (coordinate(from)?, coordinate(to)?);
            if from >= to {
                return Err(format!("found {range:?}, expected lo below hi"));
            }
            low.push(from);
            high.push(to);
        }
        Ok(Self { low, high })
    }
}

impl Bounds {
    /// The distance between the two corners.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let sides = self.low.iter().zip(&self.high);
        sides
            .map(|(low, high)| (high - low).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// Whether a point lies inside.
    #[must_use]
    pub fn holds(&self, point: &[f64]) -> bool {
        let ranges = self.low.iter().zip(&self.high);
        ranges
            .zip(point)
            .all(|((low, high), value)| low <= value && value <= high)
    }
}

/// Equations of either kind, for as many variables as the engine's vectors have.
pub enum System {
    /// Read from a text.
    Formula(Box<Formula>),
    /// Known by name.
    Shape(Shape),
}

impl<const D: usize> Equations<D> for System {
    fn count(&self) -> usize {
        match self {
            Self::Formula(formula) => Equations::<D>::count(&**formula),
            Self::Shape(shape) => Equations::<D>::count(shape),
        }
    }

    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]) {
        match self {
            Self::Formula(formula) => formula.gradients(x, values, gradients),
            Self::Shape(shape) => shape.gradients(x, values, gradients),
        }
    }

    fn hessians(
        &self,
        x: &Vector<D>,
        values: &mut [f64],
        gradients: &mut [Vector<D>],
        hessians: &mut [Matrix<D>],
    ) {
        match self {
            Self::Formula(formula) => formula.hessians(x, values, gradients, hessians),
            Self::Shape(shape) => shape.hessians(x, values, gradients, hessians),
        }
    }
}

/// A law, the space that it speaks of, and the part of it that is meant.
#[derive(Clone, Debug)]
pub struct Implicit {
    /// F.
    pub law: Law,
    /// The number of coordinates of a point.
    pub dimension: usize,
    /// The box that is meant; `None` for all of the surface.
    pub bounds: Option<Bounds>,
}

/// The box of a shape is widened by this share of its size, so that the surface lies inside.
const SLACK: f64 = 0.01;
/// Half the side of the box where a surface is looked for first when nothing says where it is.
const SEARCHED: f64 = 2.0;
/// The box is made larger by this factor while no point of the surface is found in it.
const WIDER: f64 = 4.0;
/// How many times the box is made larger at most.
const MOST_WIDENINGS: i32 = 10;
/// Points of the box from which a surface is looked for.
const TRIES: usize = 64;

impl Implicit {
    /// The equations for vectors of size D: surplus variables are 0.
    ///
    /// # Errors
    /// [`Error::Formula`] where a text cannot be read.
    pub fn system<const D: usize>(&self) -> Result<System, Error> {
        match &self.law {
            Law::Shape(shape) => Ok(System::Shape(shape.clone())),
            Law::Texts(texts) => {
                let surplus = (self.dimension + 1..=D).map(|index| format!("x{index} = 0"));
                let texts: Vec<String> = texts.iter().cloned().chain(surplus).collect();
                let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
                let formula = Formula::parse(&texts, Some(D))?;
                Ok(System::Formula(Box::new(formula)))
            }
        }
    }

    /// The box to sample: the one given, or that of a shape if it holds all of some points.
    #[must_use]
    pub fn region(&self, points: &[&[f64]]) -> Option<Bounds> {
        let Law::Shape(shape) = &self.law else {
            return self.bounds.clone();
        };
        let slack = SLACK * shape.size();
        let (low, high) = shape.region();
        let region = Bounds {
            low: low.iter().map(|v| v - slack).collect(),
            high: high.iter().map(|v| v + slack).collect(),
        };
        let closed = shape.bounds().is_some();
        (closed || points.iter().all(|point| region.holds(point))).then_some(region)
    }

    /// The box where the surface is looked for: the one given, else the first of boxes ever larger
    /// where it is found.
    ///
    /// # Errors
    /// As [`system`](Self::system).
    pub fn searched<const D: usize>(&self) -> Result<Bounds, Error> {
        if let Some(bounds) = self.region(&[]) {
            return Ok(bounds);
        }
        let about_zero = |side: f64| Bounds {
            low: vec![-side; self.dimension],
            high: vec![side; self.dimension],
        };
        for widening in 0..MOST_WIDENINGS {
            let region = about_zero(SEARCHED * WIDER.powi(widening));
            if !self.feet::<D>(&region)?.is_empty() {
                return Ok(region);
            }
        }
        Ok(about_zero(SEARCHED * WIDER.powi(MOST_WIDENINGS)))
    }

    /// Points of the surface to start from within a box.
    ///
    /// # Errors
    /// [`Error::NotFound`] where there are none, and as [`system`](Self::system).
    pub fn seeds<const D: usize>(&self, region: &Bounds) -> Result<Vec<Vector<D>>, Error> {
        let seeds: Vec<Vector<D>> = match &self.law {
            Law::Shape(shape) => shape.seeds().iter().map(|seed| padded(seed)).collect(),
            Law::Texts(_) => self.feet(region)?,
        };
        if seeds.is_empty() {
            let Bounds { low, high } = region.clone();
            return Err(Error::NotFound { low, high });
        }
        Ok(seeds)
    }

    /// Points of the surface within a box, from tries spread over it.
    fn feet<const D: usize>(&self, region: &Bounds) -> Result<Vec<Vector<D>>, Error> {
        let surface = ImplicitSurface::new(self.system::<D>()?, region.diagonal());
        let mut scratch = Geometry::new(Equations::<D>::count(surface.equations()));
        let (low, high): (Vector<D>, Vector<D>) = (padded(&region.low), padded(&region.high));
        let tries = (0..TRIES)
            .map(|i| low + (high - low).component_mul(&spread::<D>(i).map(|v| 0.5 + 0.5 * v)));
        let feet = tries.filter_map(|start| surface.foot(&start, &mut (), &mut scratch));
        Ok(feet
            .filter(|foot| region.holds(&foot.as_slice()[..self.dimension]))
            .collect())
    }

    /// Samples the surface from `seeds`; the extent of `points` tells the scale where nothing else
    /// does.
    ///
    /// # Errors
    /// The engine's, where no seed lies near the surface or the equations leave no surface.
    pub fn sampled<const D: usize>(
        &self,
        points: &[&[f64]],
        seeds: &[Vector<D>],
    ) -> Result<Geodesics<D, Sampled<D, System>>, Error> {
        let region = self.region(points);
        let size = match &region {
            Some(region) => region.diagonal(),
            None => extent(points),
        };
        let surface = ImplicitSurface::new(self.system::<D>()?, size);
        let corners = region.map(|region| (padded(&region.low), padded(&region.high)));
        Ok(Geodesics::of_implicit(surface, seeds, corners)?)
    }
}

/// A length of the order of the region that points span.
#[must_use]
pub fn extent(points: &[&[f64]]) -> f64 {
    let largest = points
        .iter()
        .copied()
        .flatten()
        .fold(0.0_f64, |m, v| m.max(v.abs()));
    let Some((first, rest)) = points.split_first() else {
        return 1.0;
    };
    let mut span = Bounds {
        low: first.to_vec(),
        high: first.to_vec(),
    };
    for point in rest {
        for (i, value) in point.iter().enumerate() {
            span.low[i] = span.low[i].min(*value);
            span.high[i] = span.high[i].max(*value);
        }
    }
    let candidates = [span.diagonal(), largest, 1.0];
    candidates
        .into_iter()
        .find(|size| *size > 0.0)
        .unwrap_or(1.0)
}

/// The terms of a sequence that fills the cube |x_i| < 1 evenly (Roberts, "The unreasonable
/// effectiveness of quasirandom sequences", 2018).
#[must_use]
pub fn spread<const D: usize>(term: usize) -> Vector<D> {
    let ratio = (0..32).fold(2.0_f64, |g, _| (1.0 + g).powf(1.0 / (D as f64 + 1.0)));
    Vector::from_fn(|i, _| {
        let step = ratio.powi(-(i as i32 + 1));
        2.0 * (0.5 + step * (term as f64 + 1.0)).fract() - 1.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_ranges() {
        let bounds: Bounds = "-2:2,0:1.5".parse().expect("two ranges");
        assert_eq!((bounds.low, bounds.high), (vec![-2.0, 0.0], vec![2.0, 1.5]));
        for wrong in ["", "1", "2:1", "1:1", "a:b", "0:inf"] {
            assert!(wrong.parse::<Bounds>().is_err(), "{wrong:?}");
        }
    }
}
