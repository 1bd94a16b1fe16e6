//! Geodesics on point clouds and implicit surfaces, pulled taut to a tolerance.
//!
//! The way of the data: points or an equation become a [`surface`]; a [`guess`] crosses it; the
//! [`correction`] pulls the guess taut; the [`result`] carries its error estimate and status.
//!
//! ```
//! use taut_core::{Vector, cloud::Cloud, correction::Settings, geodesics::Geodesics,
//! surface::atlas::Atlas};
//!
//! // 2000 points of the unit sphere, on a spiral; any rows of coordinates will do.
//! let rows: Vec<f64> = (0..2000)
//!     .flat_map(|i| {
//!         let z: f64 = 1.0 - (2 * i + 1) as f64 / 2000.0;
//!         let (sin, cos) = (2.399963 * i as f64).sin_cos();
//!         let radius = (1.0 - z * z).sqrt();
//!         [radius * cos, radius * sin, z]
//!     })
//!     .collect();
//! let atlas = Atlas::new(Cloud::<3>::new(&rows, 3)?, 2)?;
//! let geodesics = Geodesics::of_atlas(atlas);
//! let from = geodesics.surface().node_near(&Vector::<3>::new(1.0, 0.0, 0.0))?;
//! let to = geodesics.surface().node_near(&Vector::<3>::new(0.0, 0.0, 1.0))?;
//! let path = geodesics.path(&from, &to, &Settings::default());
//! assert!(path.converged());
//! assert!((path.length - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
//! # Ok::<(), taut_core::error::Error>(())
//! ```

pub mod cloud;
pub mod correction;
pub mod error;
pub mod field;
pub mod geodesics;
pub mod guess;
mod order;
pub mod parallel;
pub mod result;
mod spatial;
pub mod surface;

/// A point or vector of R^D.
pub type Vector<const D: usize> = nalgebra::SVector<f64, D>;
/// A D x D matrix.
pub type Matrix<const D: usize> = nalgebra::SMatrix<f64, D, D>;
