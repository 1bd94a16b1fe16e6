//! Named surfaces with closed-form equations, for examples, tests and teaching. Whatever is known
//! of a single shape stands in this file.

mod jet;
mod text;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::{Matrix, Vector};
use jet::{Jet, Polar, unit};
pub use text::ShapeError;

/// A named surface. Lengths are in any one unit, angles in radians.
///
/// ```
/// use taut_core::surface::shapes::Shape;
/// let torus = Shape::parse("torus:1,0.4")?;
/// assert_eq!((torus.dimension(), torus.intrinsic_dimension()), (3, 2));
/// assert_eq!(torus.to_string(), "torus:1,0.4");
/// # Ok::<(), taut_core::surface::shapes::ShapeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// The sphere |x| = radius in R^dimension, by the equation (|x|^2 - radius^2) / (2 radius) = 0.
    Sphere {
        /// Radius of the sphere.
        radius: f64,
        /// Dimension of the space, 2 or more.
        dimension: usize,
    },
    /// A tube about a circle round the z axis, by the equation
    /// ((sqrt(x^2 + y^2) - major)^2 + z^2 - minor^2) / (2 minor) = 0.
    ///
    /// Of the usual forms this one is chosen over the quartic because its gradient has length 1 on
    /// the whole surface and its values do not cancel for thin tubes. The price is that it is not
    /// smooth on the z axis, which no torus with minor < major meets.
    Torus {
        /// Radius of the circle.
        major: f64,
        /// Radius of the tube, less than `major`.
        minor: f64,
    },
    /// The ellipsoid sum (x_i / a_i)^2 = 1 in as many dimensions as there are semi-axes, 2 or more.
    Ellipsoid {
        /// Semi-axes a_i.
        semi_axes: Vec<f64>,
    },
    /// The cylinder x^2 + y^2 = radius^2 in R^3, without ends.
    Cylinder {
        /// Radius of the cylinder.
        radius: f64,
    },
    /// The cone sqrt(x^2 + y^2) = z tan(half_angle), z >= 0 (one nappe). It is singular at its
    /// apex, the origin.
    Cone {
        /// Angle between the axis and the surface, between 0 and pi / 2.
        half_angle: f64,
    },
    /// The plane z = 0 in R^3.
    Plane,
    /// The product of circles x^2 + y^2 = r_1^2, z^2 + w^2 = r_2^2 in R^4, which is locally
    /// isometric to the plane (Clifford's torus where both radii are equal).
    FlatTorus {
        /// Radii r_1 and r_2.
        radii: [f64; 2],
    },
    /// The rotation matrices of R^3 as points of R^9 (row-major), by the 6 products of columns of
    /// R'R = I.
    ///
    /// The zeros are all orthogonal matrices, in two components. Rotations are the component with
    /// determinant 1, which a path never leaves, and of which [`Shape::seeds`] gives a point.
    /// Lengths are sqrt(2) times angles of rotation.
    Rotations,
    /// The paper's roll: a sheet along the spiral of Archimedes rho = inner_radius + gap theta / (2
    /// pi), parallel to the z axis. It is isometric to the plane.
    ///
    /// The equation is rho - inner_radius - gap theta / (2 pi) = 0, with theta on the branch whose
    /// layer is nearest along the radius. It is smooth except halfway between layers and on the
    /// axis. The surface has no ends: the sheet goes on past `turns`, inwards to the axis, and
    /// along z. `turns` and the width 1 in z only bound [`Shape::region`]. A straight segment of
    /// the unrolled sheet never leaves its rectangle, so shortest paths are the same.
    Roll {
        /// Radius at theta = 0.
        inner_radius: f64,
        /// Distance between layers along a radius.
        gap: f64,
        /// Number of turns.
        turns: f64,
    },
}

/// How a shape is written.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Its name.
    pub name: &'static str,
    /// The names of its parameters, with commas between them.
    pub parameters: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Texts that [`Shape::parse`] reads.
    pub examples: &'static [&'static str],
}

/// Every shape that [`Shape::parse`] knows.
pub const KNOWN: &[Known] = &[
    Known {
        name: "sphere",
        parameters: "RADIUS[,DIMENSION]",
        description: "sphere in R^DIMENSION (3 if left out)",
        examples: &["sphere:1.3", "sphere:0.7,5"],
    },
    Known {
        name: "torus",
        parameters: "MAJOR,MINOR",
        description: "tube of radius MINOR about a circle of radius MAJOR > MINOR",
        examples: &["torus:1,0.4"],
    },
    Known {
        name: "ellipsoid",
        parameters: "A,B[,C...]",
        description: "semi-axes, one a dimension",
        examples: &["ellipsoid:3,2,1", "ellipsoid:3,2,1,0.5,4"],
    },
    Known {
        name: "cylinder",
        parameters: "RADIUS",
        description: "round the z axis",
        examples: &["cylinder:0.8"],
    },
    Known {
        name: "cone",
        parameters: "HALF_ANGLE",
        description: "round the z axis, angle in radians below pi/2",
        examples: &["cone:0.4"],
    },
    Known {
        name: "plane",
        parameters: "",
        description: "z = 0",
        examples: &["plane"],
    },
    Known {
        name: "flat-torus",
        parameters: "R1,R2",
        description: "product of two circles in R^4 (Clifford's for R1 = R2)",
        examples: &["flat-torus:1,0.6"],
    },
    Known {
        name: "rotations",
        parameters: "",
        description: "SO(3), row-major 3 x 3 matrices as points of R^9",
        examples: &["rotations"],
    },
    Known {
        name: "roll",
        parameters: "INNER_RADIUS,GAP,TURNS",
        description: "sheet rolled up along a spiral",
        examples: &["roll:0.3,0.065,7"],
    },
];

/// The largest dimension of a sphere or ellipsoid.
pub const MOST_DIMENSIONS: usize = 16;

impl Shape {
    /// The shape of a known name with parameters above 0; `None` where there are too many or too
    /// few of them.
    fn with_parameters(name: &str, parameters: &[f64]) -> Option<Self> {
        Some(match (name, parameters) {
            ("sphere", &[radius]) => Self::Sphere {
                radius,
                dimension: 3,
            },
            // A dimension that is no whole number is refused below.
            ("sphere", &[radius, dimension]) => Self::Sphere {
                radius,
                dimension: dimension as usize,
            },
            ("torus", &[major, minor]) => Self::Torus { major, minor },
            ("ellipsoid", axes) if (2..=MOST_DIMENSIONS).contains(&axes.len()) => Self::Ellipsoid {
                semi_axes: axes.to_vec(),
            },
            ("cylinder", &[radius]) => Self::Cylinder { radius },
            ("cone", &[half_angle]) => Self::Cone { half_angle },
            ("plane", []) => Self::Plane,
            ("flat-torus", &[first, second]) => Self::FlatTorus {
                radii: [first, second],
            },
            ("rotations", []) => Self::Rotations,
            ("roll", &[inner_radius, gap, turns]) => Self::Roll {
                inner_radius,
                gap,
                turns,
            },
            _ => return None,
        })
    }

    /// The position of a parameter above 0 that is too large all the same, from 0, and what is
    /// expected of it.
    fn unfit(&self, parameters: &[f64]) -> Option<(usize, &'static str)> {
        match self {
            Self::Sphere { .. } => {
                let dimension = parameters.get(1)?;
                let most = MOST_DIMENSIONS as f64;
                let fits = dimension.fract() == 0.0 && (2.0..=most).contains(dimension);
                (!fits).then_some((1, "a whole number from 2 to 16"))
            }
            Self::Torus { major, minor } => {
                (minor >= major).then_some((1, "less than the first parameter"))
            }
            Self::Cone { half_angle } => {
                (*half_angle >= FRAC_PI_2).then_some((0, "less than pi/2"))
            }
            _ => None,
        }
    }

    /// The name and the parameters that the shape is written with.
    fn parts(&self) -> (&'static str, Vec<f64>) {
        match self {
            Self::Sphere {
                radius,
                dimension: 3,
            } => ("sphere", vec![*radius]),
            Self::Sphere { radius, dimension } => ("sphere", vec![*radius, *dimension as f64]),
            Self::Torus { major, minor } => ("torus", vec![*major, *minor]),
            Self::Ellipsoid { semi_axes } => ("ellipsoid", semi_axes.clone()),
            Self::Cylinder { radius } => ("cylinder", vec![*radius]),
            Self::Cone { half_angle } => ("cone", vec![*half_angle]),
            Self::Plane => ("plane", Vec::new()),
            Self::FlatTorus { radii } => ("flat-torus", radii.to_vec()),
            Self::Rotations => ("rotations", Vec::new()),
            Self::Roll {
                inner_radius,
                gap,
                turns,
            } => ("roll", vec![*inner_radius, *gap, *turns]),
        }
    }

    /// The dimension of the space, and the number of equations.
    fn dimensions(&self) -> [usize; 2] {
        match self {
            Self::Sphere { dimension, .. } => [*dimension, 1],
            Self::Ellipsoid { semi_axes } => [semi_axes.len(), 1],
            Self::FlatTorus { .. } => [4, 2],
            Self::Rotations => [9, 6],
            Self::Torus { .. }
            | Self::Cylinder { .. }
            | Self::Cone { .. }
            | Self::Plane
            | Self::Roll { .. } => [3, 1],
        }
    }

    /// Whether the shape goes on without end.
    fn is_endless(&self) -> bool {
        match self {
            Self::Cylinder { .. } | Self::Cone { .. } | Self::Plane | Self::Roll { .. } => true,
            Self::Sphere { .. }
            | Self::Torus { .. }
            | Self::Ellipsoid { .. }
            | Self::FlatTorus { .. }
            | Self::Rotations => false,
        }
    }

    /// The corners of a box that shows the shape: its bounds, or a piece of a shape without end (a
    /// cylinder twice as long as wide, a cone of slant height 1, the square |x|, |y| <= 1 of the
    /// plane, the turns of a roll of width 1).
    #[must_use]
    pub fn region(&self) -> (Vec<f64>, Vec<f64>) {
        let high = match self {
            Self::Sphere { radius, dimension } => vec![*radius; *dimension],
            Self::Torus { major, minor } => vec![major + minor, major + minor, *minor],
            Self::Ellipsoid { semi_axes } => semi_axes.clone(),
            Self::Cylinder { radius } => vec![*radius, *radius, 2.0 * radius],
            Self::Cone { half_angle } => {
                let (sin, cos) = half_angle.sin_cos();
                return (vec![-sin, -sin, 0.0], vec![sin, sin, cos]);
            }
            Self::Plane => vec![1.0; 3],
            Self::FlatTorus { radii: [a, b] } => vec![*a, *a, *b, *b],
            Self::Rotations => vec![1.0; 9],
            Self::Roll {
                inner_radius,
                gap,
                turns,
            } => {
                let outer = inner_radius + gap * turns;
                return (vec![-outer, -outer, 0.0], vec![outer, outer, 1.0]);
            }
        };
        (high.iter().map(|v| -v).collect(), high)
    }

    /// Points of the surface, one on each component (for rotations: the identity).
    #[must_use]
    pub fn seeds(&self) -> Vec<Vec<f64>> {
        let mut seed = vec![0.0; self.dimension()];
        match self {
            Self::Sphere { radius, .. } | Self::Cylinder { radius } => seed[0] = *radius,
            Self::Torus { major, minor } => seed[0] = major + minor,
            Self::Ellipsoid { semi_axes } => seed[0] = semi_axes[0],
            Self::Cone { half_angle } => (seed[0], seed[2]) = half_angle.sin_cos(),
            Self::Plane => {}
            Self::FlatTorus { radii } => [seed[0], seed[2]] = *radii,
            Self::Rotations => (seed[0], seed[4], seed[8]) = (1.0, 1.0, 1.0),
            Self::Roll {
                inner_radius,
                gap,
                turns,
            } => {
                let (sin, cos) = (PI * turns).sin_cos();
                let radius = inner_radius + 0.5 * gap * turns;
                seed.copy_from_slice(&[radius * cos, radius * sin, 0.5]);
            }
        }
        vec![seed]
    }

    /// The equations with their derivatives at a point, without those of surplus coordinates.
    fn evaluate<const D: usize>(&self, x: &Vector<D>, jet: &mut Jet<'_, D>) {
        match self {
            Self::Sphere { radius, dimension } => {
                let weight = 1.0 / radius;
                jet.quadric(0, x, 0..*dimension, |_| weight, *radius);
            }
            Self::Torus { major, minor } => torus(x, *major, *minor, jet),
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
            Self::Rotations => rotations(x, jet),
            Self::Roll {
                inner_radius, gap, ..
            } => roll(x, *inner_radius, *gap, jet),
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
mod tests;
