//! Named surfaces with closed-form equations, for examples, tests and teaching.

mod equations;

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

use thiserror::Error;

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

/// The name, the parameters and a description of every shape that [`Shape::parse`] knows.
pub const KNOWN: [(&str, &str, &str); 9] = [
    (
        "sphere",
        "RADIUS[,DIMENSION]",
        "sphere in R^DIMENSION (3 if left out)",
    ),
    (
        "torus",
        "MAJOR,MINOR",
        "tube of radius MINOR about a circle of radius MAJOR > MINOR",
    ),
    ("ellipsoid", "A,B[,C...]", "semi-axes, one a dimension"),
    ("cylinder", "RADIUS", "round the z axis"),
    (
        "cone",
        "HALF_ANGLE",
        "round the z axis, angle in radians below pi/2",
    ),
    ("plane", "", "z = 0"),
    (
        "flat-torus",
        "R1,R2",
        "product of two circles in R^4 (Clifford's for R1 = R2)",
    ),
    (
        "rotations",
        "",
        "SO(3), row-major 3 x 3 matrices as points of R^9",
    ),
    (
        "roll",
        "INNER_RADIUS,GAP,TURNS",
        "sheet rolled up along a spiral",
    ),
];

/// The largest dimension of a sphere or ellipsoid.
pub const MOST_DIMENSIONS: usize = 16;

/// Why a text names no shape.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ShapeError {
    /// There is no shape of this name.
    #[error("no shape is called `{name}`; write one of {}", known())]
    Unknown {
        /// The name given.
        name: String,
    },
    /// A parameter is not a number.
    #[error("parameter {position} of `{usage}` is `{found}`, expected a number like 0.4")]
    NotANumber {
        /// How the shape is written.
        usage: String,
        /// The position of the parameter, counted from 1.
        position: usize,
        /// The text of the parameter.
        found: String,
    },
    /// There are too many or too few parameters.
    #[error("`{usage}` was given {found} parameters")]
    WrongCount {
        /// How the shape is written.
        usage: String,
        /// The number of parameters given.
        found: usize,
    },
    /// A parameter is outside its range.
    #[error("parameter {position} of `{usage}` is {found}, expected {expected}")]
    OutOfRange {
        /// How the shape is written.
        usage: String,
        /// The position of the parameter, counted from 1.
        position: usize,
        /// The value of the parameter.
        found: f64,
        /// The values allowed.
        expected: &'static str,
    },
}

fn known() -> String {
    KNOWN
        .map(|(name, parameters, _)| usage(name, parameters))
        .join(", ")
}

fn usage(name: &str, parameters: &str) -> String {
    match parameters {
        "" => name.to_owned(),
        _ => format!("{name}:{parameters}"),
    }
}

const POSITIVE: &str = "a finite number above 0";

impl Shape {
    /// The shape that is written as a name and its parameters, such as `torus:1,0.4`; [`KNOWN`]
    /// lists them.
    ///
    /// # Errors
    /// [`ShapeError`] for unknown names, parameters that are not numbers, too many or too few of
    /// them, or parameters out of range.
    pub fn parse(text: &str) -> Result<Self, ShapeError> {
        let (name, list) = text.split_once(':').unwrap_or((text, ""));
        let name = name.trim();
        let Some((_, parameters, _)) = KNOWN.iter().find(|known| known.0 == name) else {
            return Err(ShapeError::Unknown {
                name: name.to_owned(),
            });
        };
        let usage = usage(name, parameters);
        let values = numbers(list, &usage)?;
        let shape = match (name, &values[..]) {
            ("sphere", &[radius]) => Self::Sphere {
                radius,
                dimension: 3,
            },
            ("sphere", &[radius, dimension]) => Self::Sphere {
                radius,
                dimension: whole(dimension, &usage)?,
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
            _ => {
                return Err(ShapeError::WrongCount {
                    usage,
                    found: values.len(),
                });
            }
        };
        let outside = |i: usize, expected| {
            Err(ShapeError::OutOfRange {
                usage,
                position: i + 1,
                found: values[i],
                expected,
            })
        };
        if let Some(i) = values.iter().position(|v| !(*v > 0.0 && v.is_finite())) {
            return outside(i, POSITIVE);
        }
        match shape {
            Self::Torus { major, minor } if minor >= major => {
                outside(1, "less than the first parameter")
            }
            Self::Cone { half_angle } if half_angle >= FRAC_PI_2 => outside(0, "less than pi/2"),
            shape => Ok(shape),
        }
    }

    /// The dimension d of the space that the shape lives in.
    #[must_use]
    pub fn dimension(&self) -> usize {
        match self {
            Self::Sphere { dimension, .. } => *dimension,
            Self::Ellipsoid { semi_axes } => semi_axes.len(),
            Self::FlatTorus { .. } => 4,
            Self::Rotations => 9,
            _ => 3,
        }
    }

    /// The dimension k of the surface itself.
    #[must_use]
    pub fn intrinsic_dimension(&self) -> usize {
        self.dimension() - self.codimension()
    }

    fn codimension(&self) -> usize {
        match self {
            Self::FlatTorus { .. } => 2,
            Self::Rotations => 6,
            _ => 1,
        }
    }

    /// A length of the order of the shape's extent: half the longest side of its region.
    #[must_use]
    pub fn size(&self) -> f64 {
        let (low, high) = self.region();
        let sides = low.iter().zip(&high).map(|(low, high)| high - low);
        0.5 * sides.fold(0.0, f64::max)
    }

    /// The corners of the smallest box about the shape; `None` for a shape without end.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let endless = matches!(
            self,
            Self::Cylinder { .. } | Self::Cone { .. } | Self::Plane | Self::Roll { .. }
        );
        (!endless).then(|| self.region())
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
}

fn numbers(list: &str, usage: &str) -> Result<Vec<f64>, ShapeError> {
    if list.trim().is_empty() {
        return Ok(Vec::new());
    }
    let number = |(i, text): (usize, &str)| {
        text.trim().parse().map_err(|_| ShapeError::NotANumber {
            usage: usage.to_owned(),
            position: i + 1,
            found: text.trim().to_owned(),
        })
    };
    list.split(',').enumerate().map(number).collect()
}

fn whole(value: f64, usage: &str) -> Result<usize, ShapeError> {
    if value.fract() == 0.0 && (2.0..=MOST_DIMENSIONS as f64).contains(&value) {
        Ok(value as usize)
    } else {
        Err(ShapeError::OutOfRange {
            usage: usage.to_owned(),
            position: 2,
            found: value,
            expected: "a whole number from 2 to 16",
        })
    }
}

impl fmt::Display for Shape {
    /// Writes the shape as [`Shape::parse`] reads it.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sphere {
                radius,
                dimension: 3,
            } => write!(formatter, "sphere:{radius}"),
            Self::Sphere { radius, dimension } => write!(formatter, "sphere:{radius},{dimension}"),
            Self::Torus { major, minor } => write!(formatter, "torus:{major},{minor}"),
            Self::Ellipsoid { semi_axes } => {
                let axes: Vec<String> = semi_axes.iter().map(f64::to_string).collect();
                write!(formatter, "ellipsoid:{}", axes.join(","))
            }
            Self::Cylinder { radius } => write!(formatter, "cylinder:{radius}"),
            Self::Cone { half_angle } => write!(formatter, "cone:{half_angle}"),
            Self::Plane => formatter.write_str("plane"),
            Self::FlatTorus { radii: [a, b] } => write!(formatter, "flat-torus:{a},{b}"),
            Self::Rotations => formatter.write_str("rotations"),
            Self::Roll {
                inner_radius,
                gap,
                turns,
            } => write!(formatter, "roll:{inner_radius},{gap},{turns}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub const EXAMPLES: [&str; 11] = [
        "sphere:1.3",
        "sphere:0.7,5",
        "torus:1,0.4",
        "ellipsoid:3,2,1",
        "ellipsoid:3,2,1,0.5,4",
        "cylinder:0.8",
        "cone:0.4",
        "plane",
        "flat-torus:1,0.6",
        "rotations",
        "roll:0.3,0.065,7",
    ];

    #[test]
    fn texts_read_and_written_back() {
        for text in EXAMPLES {
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
}
