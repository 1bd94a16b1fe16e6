//! The equations of shapes, and where their values, gradients and Hessians go.

use crate::surface::implicit::Equations;
use crate::surface::shapes::Shape;
use crate::{Matrix, Vector};

/// The equations of a shape in D >= [`Shape::dimension`] dimensions: surplus coordinates x_i add
/// the equations x_i = 0.
///
/// # Panics
/// If D is less than the shape's dimension.
impl<const D: usize> Equations<D> for Shape {
    fn count(&self) -> usize {
        let [dimension, equations] = self.dimensions();
        equations + D - dimension
    }

    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]) {
        fill(
            self,
            x,
            Jet {
                values,
                gradients,
                hessians: None,
            },
        );
    }

    fn hessians(
        &self,
        x: &Vector<D>,
        values: &mut [f64],
        gradients: &mut [Vector<D>],
        hessians: &mut [Matrix<D>],
    ) {
        fill(
            self,
            x,
            Jet {
                values,
                gradients,
                hessians: Some(hessians),
            },
        );
    }
}

fn fill<const D: usize>(shape: &Shape, x: &Vector<D>, mut jet: Jet<'_, D>) {
    shape.evaluate(x, &mut jet);
    let [dimension, equations] = shape.dimensions();
    for i in dimension..D {
        jet.set(equations + i - dimension, x[i], unit(i), Matrix::zeros);
    }
}

/// Where values and derivatives of the equations go.
pub(super) struct Jet<'a, const D: usize> {
    values: &'a mut [f64],
    gradients: &'a mut [Vector<D>],
    hessians: Option<&'a mut [Matrix<D>]>,
}

impl<const D: usize> Jet<'_, D> {
    pub fn set(
        &mut self,
        equation: usize,
        value: f64,
        gradient: Vector<D>,
        hessian: impl FnOnce() -> Matrix<D>,
    ) {
        self.values[equation] = value;
        self.gradients[equation] = gradient;
        if let Some(hessians) = &mut self.hessians {
            hessians[equation] = hessian();
        }
    }

    /// Sets an equation to (sum w_i x_i^2 - level) / 2 over some coordinates.
    pub fn quadric(
        &mut self,
        equation: usize,
        x: &Vector<D>,
        coordinates: std::ops::Range<usize>,
        weight: impl Fn(usize) -> f64,
        level: f64,
    ) {
        let mut gradient = Vector::<D>::zeros();
        for i in coordinates.clone() {
            gradient[i] = weight(i) * x[i];
        }
        self.set(equation, 0.5 * (gradient.dot(x) - level), gradient, || {
            let mut hessian = Matrix::zeros();
            for i in coordinates {
                hessian[(i, i)] = weight(i);
            }
            hessian
        });
    }
}

pub(super) fn unit<const D: usize>(i: usize) -> Vector<D> {
    let mut unit = Vector::zeros();
    unit[i] = 1.0;
    unit
}

/// Polar coordinates in the x-y plane, with the unit vectors along the radius and round the axis,
/// which are not finite on the axis.
pub(super) struct Polar<const D: usize> {
    pub radius: f64,
    pub radial: Vector<D>,
    pub around: Vector<D>,
}

impl<const D: usize> Polar<D> {
    pub fn of(x: &Vector<D>) -> Self {
        let radius = x[0].hypot(x[1]);
        let (mut radial, mut around) = (Vector::zeros(), Vector::zeros());
        (radial[0], radial[1]) = (x[0] / radius, x[1] / radius);
        (around[0], around[1]) = (-radial[1], radial[0]);
        Self {
            radius,
            radial,
            around,
        }
    }
}
