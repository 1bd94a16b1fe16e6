//! Geodesics on point clouds and implicit surfaces, pulled taut to a tolerance that the user names.
//!
//! Everything is asked of a [`Surface`]. Ends are rows of the points given or coordinates; answers
//! are in the coordinates and units of the input, and carry their estimated errors and a status.
//!
//! ```
//! use taut::{FieldOptions, PathOptions, Surface};
//!
//! # let rows: Vec<f64> = (0..2000)
//! #     .flat_map(|i| {
//! #         let z: f64 = 1.0 - (2 * i + 1) as f64 / 2000.0;
//! #         let (sin, cos) = (2.399963 * i as f64).sin_cos();
//! #         let radius = (1.0 - z * z).sqrt();
//! #         [radius * cos, radius * sin, z]
//! #     })
//! #     .collect();
//! // A cloud: `rows` are coordinates of points, three by three.
//! let surface = Surface::from_points(&rows, 3)?;
//! let path = surface.path(17, 1500, &PathOptions::default())?;
//! let field = surface.distances(&[17], &FieldOptions::default())?;
//! assert!(path.converged());
//! assert!((field.distance[1500] - path.length).abs() < 1e-5);
//!
//! // An equation: half way round the tube of a torus.
//! let torus = Surface::from_equation("(sqrt(x^2 + y^2) - 1)^2 + z^2 = 0.16")?;
//! let path = torus.path([1.4, 0.0, 0.0], [0.6, 0.0, 0.0], &PathOptions::to(1e-12))?;
//! assert!((path.length - 0.4 * std::f64::consts::PI).abs() < 1e-11);
//! # Ok::<(), taut::Error>(())
//! ```
//!
//! # By task
//!
//! | task | call | not for |
//! |---|---|---|
//! | a surface through a scan | [`Surface::from_points`] | points with a connection that is to be kept: their faces are not used |
//! | a surface of another dimension, as of a data set in R^10 | [`Surface::from_cloud`] | more than 16 coordinates: project first |
//! | a smooth model within an accuracy | [`Surface::fit`] | creases, which it rounds |
//! | a surface by an equation | [`Surface::from_equation`], [`Surface::from_equations`] | surfaces far from the origin without a box |
//! | a sphere, torus, roll, ... by name | [`Surface::from_shape`] | |
//! | one path | [`Surface::path`] | a proof that it is the shortest, unless [`PathOptions::prove_shortest`] is set |
//! | other ways round a handle or an obstacle | [`Surface::alternatives`] | |
//! | many paths | [`Surface::paths`] | all pairs of many ends: [`Surface::matrix`] shares the searches |
//! | lengths between all of some points | [`Surface::matrix`] | distances to every point: a field is far cheaper |
//! | distances to every point | [`Surface::distances`] | lengths to the tolerance of a path: a field is as accurate as its errors say |
//! | distances from the same sources, anywhere | [`Surface::field`] | |
//! | directions and distances from a source, and its tangents carried along | [`Surface::log`] | rough scans |
//! | tangents at points | [`Surface::tangents`] | |
//! | where a geodesic leads | [`Surface::exp`] | |
//! | is this cloud any good? | [`Surface::check`] | |
//!
//! What the engine itself offers beyond this door (costs, curves as sources, isolines, particles)
//! is in [`taut_core`].

#[cfg(feature = "surface")]
mod answers;
mod end;
mod error;
#[cfg(feature = "surface")]
mod options;
#[cfg(feature = "surface")]
mod ready;
#[cfg(feature = "surface")]
mod surface;

#[doc(hidden)]
pub mod equations;
#[doc(hidden)]
pub mod kind;
#[doc(hidden)]
pub mod size;

#[cfg(feature = "surface")]
pub use crate::answers::{Check, Distances, Logarithms, Matrix, Path, Shot};
pub use crate::end::End;
#[doc(hidden)]
pub use crate::end::coordinate;
pub use crate::error::Error;
#[cfg(feature = "surface")]
pub use crate::options::{CloudOptions, FieldOptions, PathOptions};
#[cfg(feature = "surface")]
pub use crate::ready::Progress;
#[cfg(feature = "surface")]
pub use crate::surface::{Field, Surface};
pub use taut_core::result::Status;
pub use taut_core::surface::atlas::Model;

/// The Rust of the README, compiled and run.
#[cfg(all(doctest, feature = "surface"))]
#[doc = include_str!("../../../README.md")]
struct Readme;
