//! The shapes' values, gradients and Hessians.

use std::f64::consts::TAU;

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
        self.codimension() + D - self.dimension()
    }

    fn gradients(&self, x: &Vector<D>, values: &mut [f64], gradients: &mut [Vector<D>]) {
        self.evaluate(
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
        self.evaluate(
            x,
            Jet {
                values,
                gradients,
                hessians: Some(hessians),
            },
        );
    }
}

impl Shape {
    fn evaluate<const D: usize>(&self, x: &Vector<D>, mut jet: Jet<'_, D>) {
        match self {
            Self::Sphere { radius, dimension } => {
                let weight = 1.0 / radius;
                jet.quadric(0, x, 0..*dimension, |_| weight, *radius);
            }
            Self::Torus { major, minor } => torus(x, *major, *minor, &mut jet),
            Self::Ellipsoid { semi_axes } => {
                let weight = |i: usize| 1.0 / (semi_axes[i] * semi_axes[i]);
                jet.quadric(0, x, 0..semi_axes.len(), weight, 1.0);
            }
            Self::Cylinder { radius } => jet.quadric(0, x, 0..2, |_| 1.0 / radius, *radius),
            Self::Cone { half_angle } => {
                let (sin, cos) = half_angle.sin_cos();
                let at = Polar::of(x);
                let mut gradient = at.radial * cos;
                gradient[2] = -sin;
                jet.set(0, at.radius * cos - x[2] * sin, gradient, || {
                    at.around * at.around.transpose() * (cos / at.radius)
                });
            }
            Self::Plane => jet.set(0, x[2], unit(2), Matrix::zeros),
            Self::FlatTorus { radii: [a, b] } => {
                jet.quadric(0, x, 0..2, |_| 1.0 / a, *a);
                jet.quadric(1, x, 2..4, |_| 1.0 / b, *b);
            }
            Self::Rotations => rotations(x, &mut jet),
            Self::Roll {
                inner_radius, gap, ..
            } => roll(x, *inner_radius, *gap, &mut jet),
        }
        for i in self.dimension()..D {
            let equation = self.codimension() + i - self.dimension();
            jet.set(equation, x[i], unit(i), Matrix::zeros);
        }
    }
}

/// Where values and derivatives of the equations go.
struct Jet<'a, const D: usize> {
    values: &'a mut [f64],
    gradients: &'a mut [Vector<D>],
    hessians: Option<&'a mut [Matrix<D>]>,
}

impl<const D: usize> Jet<'_, D> {
    fn set(
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
    fn quadric(
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

fn unit<const D: usize>(i: usize) -> Vector<D> {
    let mut unit = Vector::zeros();
    unit[i] = 1.0;
    unit
}

/// Polar coordinates in the x-y plane, with the unit vectors along the radius and round the axis,
/// which are not finite on the axis.
struct Polar<const D: usize> {
    radius: f64,
    radial: Vector<D>,
    around: Vector<D>,
}

impl<const D: usize> Polar<D> {
    fn of(x: &Vector<D>) -> Self {
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

fn torus<const D: usize>(x: &Vector<D>, major: f64, minor: f64, jet: &mut Jet<'_, D>) {
    let at = Polar::of(x);
    let off = at.radius - major;
    let value = 0.5 * (off * off + x[2] * x[2] - minor * minor) / minor;
    let mut gradient = at.radial * (off / minor);
    gradient[2] = x[2] / minor;
    jet.set(0, value, gradient, || {
        let across = at.radial * at.radial.transpose();
        let along = at.around * at.around.transpose();
        let mut hessian = (across + along * (off / at.radius)) / minor;
        hessian[(2, 2)] = 1.0 / minor;
        hessian
    });
}

fn rotations<const D: usize>(x: &Vector<D>, jet: &mut Jet<'_, D>) {
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    for (equation, (i, j)) in pairs.into_iter().enumerate() {
        // A column that meets itself counts by half of its square, so that every gradient has about
        // unit length.
        let share = if i == j { 0.5 } else { 1.0 };
        let mut value = if i == j { -0.5 } else { 0.0 };
        let mut gradient = Vector::zeros();
        for row in (0..9).step_by(3) {
            value += share * x[row + i] * x[row + j];
            gradient[row + i] += share * x[row + j];
            gradient[row + j] += share * x[row + i];
        }
        jet.set(equation, value, gradient, || {
            let mut hessian = Matrix::zeros();
            for row in (0..9).step_by(3) {
                hessian[(row + i, row + j)] += share;
                hessian[(row + j, row + i)] += share;
            }
            hessian
        });
    }
}

fn roll<const D: usize>(x: &Vector<D>, inner_radius: f64, gap: f64, jet: &mut Jet<'_, D>) {
    let at = Polar::of(x);
    let angle = x[1].atan2(x[0]);
    let growth = gap / TAU;
    let turn = ((at.radius - inner_radius) / gap - angle / TAU).round();
    let value = at.radius - (inner_radius + growth * angle + gap * turn);
    let gradient = at.radial - at.around * (growth / at.radius);
    jet.set(0, value, gradient, || {
        let squared = at.radius * at.radius;
        let mixed = at.radial * at.around.transpose();
        at.around * at.around.transpose() / at.radius
            + (mixed + mixed.transpose()) * (growth / squared)
    });
}

#[cfg(test)]
mod tests {
    use num_dual::{Dual2SVec64, DualNum};

    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::surface::shapes::tests::EXAMPLES;

    type Dual<const D: usize> = Dual2SVec64<D>;

    /// The equations written down anew, for dual numbers.
    fn oracle<const D: usize>(shape: &Shape, x: &[Dual<D>; D]) -> Vec<Dual<D>> {
        let sum = |terms: &[Dual<D>]| terms.iter().fold(Dual::from(0.0), |a, b| a + b);
        let radius = || (x[0] * x[0] + x[1] * x[1]).sqrt();
        let mut equations = match shape {
            Shape::Sphere { radius, dimension } => {
                let squares: Vec<_> = x[..*dimension].iter().map(|v| v * v).collect();
                vec![(sum(&squares) - radius * radius) / (2.0 * radius)]
            }
            Shape::Torus { major, minor } => {
                let square = (radius() - *major).powi(2) + x[2].powi(2) - minor * minor;
                vec![square / (2.0 * minor)]
            }
            Shape::Ellipsoid { semi_axes } => {
                let squares: Vec<_> = x
                    .iter()
                    .zip(semi_axes)
                    .map(|(v, a)| (*v / *a).powi(2))
                    .collect();
                vec![(sum(&squares) - 1.0) * 0.5]
            }
            Shape::Cylinder { radius: r } => vec![(radius().powi(2) - r * r) / (2.0 * r)],
            Shape::Cone { half_angle } => {
                vec![radius() * half_angle.cos() - x[2] * half_angle.sin()]
            }
            Shape::Plane => vec![x[2]],
            Shape::FlatTorus { radii } => [0, 1]
                .map(|i| {
                    let r = radii[i];
                    (x[2 * i].powi(2) + x[2 * i + 1].powi(2) - r * r) / (2.0 * r)
                })
                .to_vec(),
            Shape::Rotations => [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
                .map(|(i, j)| {
                    let product = sum(&[0, 3, 6].map(|row| x[row + i] * x[row + j]));
                    if i == j {
                        (product - 1.0) * 0.5
                    } else {
                        product
                    }
                })
                .to_vec(),
            Shape::Roll {
                inner_radius, gap, ..
            } => {
                // Of all layers along the ray, the one nearest in radius is taken.
                let angle = x[1].atan2(x[0]);
                let off = |turn: i32| {
                    radius() - *inner_radius - (angle + f64::from(turn) * TAU) * (gap / TAU)
                };
                (-20..40)
                    .map(off)
                    .min_by(|a, b| a.re.abs().total_cmp(&b.re.abs()))
                    .into_iter()
                    .collect()
            }
        };
        equations.extend_from_slice(&x[shape.dimension()..]);
        equations
    }

    fn uniform(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    }

    fn check_derivatives<const D: usize>(shape: &Shape) {
        let mut state = 5;
        let count = Equations::<D>::count(shape);
        assert_eq!(count, D - shape.intrinsic_dimension());
        let mut values = vec![7.0; count];
        let mut gradients = vec![Vector::<D>::repeat(7.0); count];
        let mut hessians = vec![Matrix::<D>::repeat(7.0); count];
        for _ in 0..50 {
            let x = Vector::<D>::from_fn(|_, _| uniform(&mut state) * shape.size());
            let duals: [Dual<D>; D] = std::array::from_fn(|i| Dual::from(x[i]).derivative(i));
            let truth: Vec<Dual<D>> = oracle(shape, &duals);
            shape.hessians(&x, &mut values, &mut gradients, &mut hessians);
            assert_eq!(truth.len(), count, "{shape}");
            for (i, dual) in truth.into_iter().enumerate() {
                let gradient: Vector<D> = match dual.v1.0 {
                    Some(row) => row.transpose(),
                    None => Vector::zeros(),
                };
                let hessian: Matrix<D> = dual.v2.0.unwrap_or_else(Matrix::zeros);
                let scale = 1e-13 * (1.0 + hessian.amax());
                assert!((values[i] - dual.re).abs() < scale, "{shape} {i}");
                assert!((gradients[i] - gradient).amax() < scale, "{shape} {i}");
                assert!((hessians[i] - hessian).amax() < scale, "{shape} {i}");
            }
            let (again, slopes) = (values.clone(), gradients.clone());
            shape.gradients(&x, &mut values, &mut gradients);
            assert_eq!((again, slopes), (values.clone(), gradients.clone()));
        }
    }

    #[test]
    fn derivatives_agree_with_dual_numbers() {
        for text in EXAMPLES {
            let shape = Shape::parse(text).expect("known");
            match shape.dimension() {
                3 => {
                    check_derivatives::<3>(&shape);
                    check_derivatives::<4>(&shape);
                }
                4 => check_derivatives::<4>(&shape),
                5 => check_derivatives::<6>(&shape),
                _ => check_derivatives::<9>(&shape),
            }
        }
    }

    /// A point of the shape by a parametrisation of its own, from parameters in [-1, 1].
    fn point(shape: &Shape, u: [f64; 3]) -> Option<Vector<9>> {
        let (a, b) = (u[0] * PI, u[1] * PI);
        let list = match shape {
            Shape::Sphere {
                radius,
                dimension: 3,
            } => [a.cos() * b.cos(), a.sin() * b.cos(), b.sin()]
                .map(|v| v * radius)
                .to_vec(),
            Shape::Torus { major, minor } => {
                let width = major + minor * b.cos();
                vec![width * a.cos(), width * a.sin(), minor * b.sin()]
            }
            Shape::Ellipsoid { semi_axes } if semi_axes.len() == 3 => {
                let unit = [a.cos() * b.cos(), a.sin() * b.cos(), b.sin()];
                unit.iter().zip(semi_axes).map(|(v, s)| v * s).collect()
            }
            Shape::Cylinder { radius } => vec![radius * a.cos(), radius * a.sin(), u[1]],
            Shape::Cone { half_angle } => {
                let slant = 1.1 + u[1];
                let (sin, cos) = half_angle.sin_cos();
                vec![slant * sin * a.cos(), slant * sin * a.sin(), slant * cos]
            }
            Shape::Plane => vec![u[0], u[1], 0.0],
            Shape::FlatTorus { radii: [r, s] } => {
                vec![r * a.cos(), r * a.sin(), s * b.cos(), s * b.sin()]
            }
            Shape::Rotations => {
                let rotation = nalgebra::Rotation3::from_euler_angles(a, b, u[2]);
                rotation.matrix().transpose().as_slice().to_vec()
            }
            Shape::Roll {
                inner_radius,
                gap,
                turns,
            } => {
                let angle = (1.0 + u[0]) * PI * turns;
                let radius = inner_radius + gap * angle / TAU;
                vec![radius * angle.cos(), radius * angle.sin(), u[1]]
            }
            _ => return None,
        };
        let mut x = Vector::<9>::zeros();
        x.as_mut_slice()[..list.len()].copy_from_slice(&list);
        Some(x)
    }

    #[test]
    fn parametrised_points_and_seeds_are_zeros() {
        let mut state = 9;
        let mut parametrised = 0;
        for text in EXAMPLES {
            let shape = Shape::parse(text).expect("known");
            let mut values = vec![7.0; Equations::<9>::count(&shape)];
            let mut gradients = vec![Vector::<9>::zeros(); values.len()];
            let mut points: Vec<Vector<9>> = shape
                .seeds()
                .iter()
                .map(|s| Vector::from_fn(|i, _| s.get(i).copied().unwrap_or(0.0)))
                .collect();
            assert!(!points.is_empty());
            for _ in 0..100 {
                let u = std::array::from_fn(|_| uniform(&mut state));
                points.extend(point(&shape, u));
            }
            parametrised += usize::from(points.len() > 100);
            for x in points {
                shape.gradients(&x, &mut values, &mut gradients);
                let worst = values.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                assert!(worst < 1e-14 * (1.0 + shape.size()), "{text}: {worst:e}");
                if let Some((low, high)) = shape.bounds() {
                    for i in 0..low.len() {
                        assert!((low[i] - 1e-12..=high[i] + 1e-12).contains(&x[i]), "{text}");
                    }
                }
            }
        }
        assert_eq!(parametrised, 9);
    }
}
