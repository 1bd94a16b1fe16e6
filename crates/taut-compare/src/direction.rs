//! Errors of logarithms and of parallel transport against known geodesics in R^3.

use nalgebra::Vector3;
use taut_core::field::Logarithm;

/// A geodesic from a source.
#[derive(Clone, Copy, Debug)]
pub struct Geodesic {
    /// In the surface's units.
    pub length: f64,
    /// Unit tangents at the source and at the end.
    pub tangents: [Vector3<f64>; 2],
    /// Unit normals there.
    pub normals: [Vector3<f64>; 2],
}

impl Geodesic {
    /// The shorter arc of the unit sphere's great circle through two points.
    #[must_use]
    pub fn of_sphere(p: &[f64; 3], q: &[f64; 3]) -> Self {
        let [p, q] = [p, q].map(|x| Vector3::from(*x).normalize());
        let length = (p - q).norm().atan2((p + q).norm()) * 2.0;
        let ahead = (q - p * p.dot(&q)).normalize();
        let (sin, cos) = length.sin_cos();
        Self {
            length,
            tangents: [ahead, ahead * cos - p * sin],
            normals: [p, q],
        }
    }

    /// A tangent vector at the source carried to the end: it keeps its angle to the geodesic.
    fn carried(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let sides = [0, 1].map(|i| self.normals[i].cross(&self.tangents[i]));
        self.tangents[1] * vector.dot(&self.tangents[0]) + sides[1] * vector.dot(&sides[0])
    }
}

/// Error of a logarithm's position over its distance, and of the transport's angle in radians,
/// where there is one.
#[must_use]
pub fn errors(
    found: &Logarithm<3>,
    source: &[Vector3<f64>; 2],
    truth: &Geodesic,
) -> (f64, Option<f64>) {
    let vector = source[0] * found.vector[0] + source[1] * found.vector[1];
    let position = (vector - truth.tangents[0] * truth.length).norm() / truth.length;
    let transport = found.transported.map(|carried| {
        let expected = truth.carried(&source[0]);
        carried[0]
            .cross(&expected)
            .norm()
            .atan2(carried[0].dot(&expected))
    });
    (position, transport)
}
