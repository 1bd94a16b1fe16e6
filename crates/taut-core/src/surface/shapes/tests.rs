//! Shapes against differences, and against equations and parametrisations of their own. A new shape
//! is checked by its examples and its seeds even if nothing is added here.

use num_dual::{Dual2SVec64, DualNum};

use super::text::POSITIVE;
use super::*;
use crate::surface::implicit::Equations;

type Dual<const D: usize> = Dual2SVec64<D>;

/// The equations written down anew, for dual numbers; `None` where they are not.
fn oracle<const D: usize>(shape: &Shape, x: &[Dual<D>; D]) -> Option<Vec<Dual<D>>> {
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
        _ => return None,
    };
    equations.extend_from_slice(&x[shape.dimension()..]);
    Some(equations)
}

fn examples() -> impl Iterator<Item = &'static str> {
    KNOWN.iter().flat_map(|known| known.examples).copied()
}

#[test]
fn texts_read_and_written_back() {
    for text in examples() {
        assert_eq!(Shape::parse(text).expect("known").to_string(), text);
    }
    assert_eq!(Shape::parse(" torus: 1 , .4 "), Shape::parse("torus:1,0.4"));
    for (text, message) in [
        ("klein", "roll:INNER_RADIUS,GAP,TURNS"),
        ("torus:1", "given 1 parameters"),
        ("torus:1,x", "parameter 2 of `torus:MAJOR,MINOR` is `x`"),
        ("torus:1,1", "less than the first"),
        ("sphere:-1", POSITIVE),
        ("sphere:inf", POSITIVE),
        ("sphere:1,1e9", "2 to 16"),
        ("sphere:1,2.5", "2 to 16"),
        ("cone:1.6", "less than pi/2"),
        ("plane:1", "given 1 parameters"),
        ("ellipsoid:1", "given 1 parameters"),
    ] {
        let error = Shape::parse(text).expect_err(text).to_string();
        assert!(error.contains(message), "{text}: {error}");
    }
}

fn uniform(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
}

/// Whether near the seeds the derivatives are what differences say.
fn check_differences<const D: usize>(shape: &Shape) {
    let (mut state, step) = (3, 1e-5 * shape.size());
    let count = Equations::<D>::count(shape);
    let at = |x: &Vector<D>| {
        let (mut values, mut gradients) = (vec![7.0; count], vec![Vector::zeros(); count]);
        let mut hessians = vec![Matrix::zeros(); count];
        shape.hessians(x, &mut values, &mut gradients, &mut hessians);
        (values, gradients, hessians)
    };
    for seed in shape.seeds() {
        for _ in 0..20 {
            let near = |i: usize| seed.get(i).copied().unwrap_or(0.0);
            let off = 0.01 * shape.size();
            let x = Vector::<D>::from_fn(|i, _| near(i) + off * uniform(&mut state));
            let (_, gradients, hessians) = at(&x);
            for axis in 0..D {
                let mut ends = [x; 2];
                (ends[0][axis], ends[1][axis]) = (x[axis] - step, x[axis] + step);
                let [(low, below, _), (high, above, _)] = ends.map(|end| at(&end));
                for i in 0..count {
                    let slope = (high[i] - low[i]) / (2.0 * step);
                    let change = (above[i] - below[i]) / (2.0 * step);
                    let scale = 1e-6 * (1.0 + hessians[i].amax());
                    assert!((gradients[i][axis] - slope).abs() < scale, "{shape} {i}");
                    let column = hessians[i].column(axis);
                    assert!((column - change).amax() < 1e2 * scale, "{shape} {i}");
                }
            }
        }
    }
}

fn check_derivatives<const D: usize>(shape: &Shape) {
    check_differences::<D>(shape);
    let mut state = 5;
    let count = Equations::<D>::count(shape);
    assert_eq!(count, D - shape.intrinsic_dimension());
    let mut values = vec![7.0; count];
    let mut gradients = vec![Vector::<D>::repeat(7.0); count];
    let mut hessians = vec![Matrix::<D>::repeat(7.0); count];
    for _ in 0..50 {
        let x = Vector::<D>::from_fn(|_, _| uniform(&mut state) * shape.size());
        let duals: [Dual<D>; D] = std::array::from_fn(|i| Dual::from(x[i]).derivative(i));
        let truth = oracle(shape, &duals).unwrap_or_default();
        shape.hessians(&x, &mut values, &mut gradients, &mut hessians);
        assert!([0, count].contains(&truth.len()), "{shape}");
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
    for text in examples() {
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
    for text in examples() {
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
    assert!(parametrised >= 9);
}
