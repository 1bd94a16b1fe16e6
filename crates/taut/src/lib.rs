//! Geodesics on point clouds and implicit surfaces, pulled taut to a tolerance.

pub mod correction;
pub mod result;
pub mod surface;

/// A point or vector of R^D.
pub type Vector<const D: usize> = nalgebra::SVector<f64, D>;
/// A D x D matrix.
pub type Matrix<const D: usize> = nalgebra::SMatrix<f64, D, D>;
