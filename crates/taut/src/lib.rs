//! Geodesics on point clouds and implicit surfaces, pulled taut to a tolerance.

pub mod cloud;
pub mod correction;
pub mod error;
pub mod geodesics;
pub mod guess;
pub mod result;
mod spatial;
pub mod surface;

/// A point or vector of R^D.
pub type Vector<const D: usize> = nalgebra::SVector<f64, D>;
/// A D x D matrix.
pub type Matrix<const D: usize> = nalgebra::SMatrix<f64, D, D>;
