//! Truth for tests and benchmarks: geodesic distances that share no code and no formulation with
//! the solvers they judge, and the seeded points to measure on.
//!
//! - [`generate`]: points on shapes, noise, outliers;
//! - [`cases`]: clouds of many kinds with the distances from any of their points, to ask for honesty on;
//! - [`closed_form`]: distances that a formula gives;
//! - [`revolution`]: nearly round ellipsoids of revolution by Karney's series;
//! - [`cost`]: least costs in the plane that a formula gives;
//! - [`direction`]: errors of logarithms and of parallel transport against known geodesics;
//! - [`outline`]: shortest ways in the plane with a polygonal edge, by the visibility graph;
//! - [`shooting`]: every geodesic between two points of a torus or a triaxial ellipsoid, by the geodesic equation.

pub mod cases;
pub mod closed_form;
pub mod cost;
pub mod direction;
pub mod generate;
mod gragg;
pub mod outline;
pub mod revolution;
pub mod shooting;
pub mod surface;
