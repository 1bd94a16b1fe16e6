//! A particle: a point of the surface, the surface's curvature there, and the way the particle
//! came.

use crate::guess::STEEPEST_CHORD;
use crate::surface::{Geometry, Node, Surface};
use crate::{Matrix, Vector};

/// A particle that floats on a surface.
#[derive(Clone, Debug)]
pub(super) struct Particle<const D: usize, P> {
    pub node: Node<D, P>,
    pub frame: ParticleGeometry<D>,
    /// The source that the particle descends from.
    pub source: u32,
    /// Whether the particle stays where it is, as sources given by the user do.
    pub fixed: bool,
    /// The places where the particle was, from its birthplace on, a share of a spacing apart (step
    /// (d) of the procedure).
    pub trajectory: Vec<Node<D, P>>,
    /// The birthplace: the parent particle, and the number of records that it had by then.
    pub birthplace: (u32, usize),
}

/// First- and second-order geometry at a particle.
#[derive(Clone, Copy, Debug)]
pub(super) struct ParticleGeometry<const D: usize> {
    /// An orthonormal basis: columns 0..m are normal, m..D tangent.
    pub basis: Matrix<D>,
    /// The square of the shape operator, summed over an orthonormal basis of normals. Its
    /// eigenvectors are the principal directions v_j of a hypersurface, its eigenvalues kappa_j^2.
    pub squared_shape: Matrix<D>,
    /// The square root of the trace of `squared_shape`, (sum kappa_j^2)^(1/2), 1 / length.
    pub curvature: f64,
}

impl<const D: usize> ParticleGeometry<D> {
    /// The frame at a node; `None` where the surface has no tangent space.
    pub fn at<S: Surface<D>>(
        surface: &S,
        node: &Node<D, S::Place>,
        scratch: &mut Geometry<D>,
    ) -> Option<Self> {
        if !surface.geometry(&node.point, node.place, scratch) {
            return None;
        }
        let m = scratch.codimension;
        let mut squared_shape = Matrix::zeros();
        for a in 0..m {
            let form = scratch.second_form(&scratch.normal(a));
            let mut shape = Matrix::<D>::zeros();
            for j in m..D {
                let curved = form * scratch.basis.column(j);
                shape += scratch.project(&curved) * scratch.basis.column(j).transpose();
            }
            squared_shape += shape * shape;
        }
        Some(Self {
            basis: scratch.basis,
            squared_shape,
            curvature: squared_shape.trace().max(0.0).sqrt(),
        })
    }

    /// The tangential part of a vector, where `m` is the codimension.
    pub fn project(&self, v: &Vector<D>, m: usize) -> Vector<D> {
        (0..m).fold(*v, |tangential, j| {
            let normal = self.basis.column(j);
            tangential - normal * normal.dot(v)
        })
    }

    /// Whether a chord from here runs along the surface rather than across to another sheet.
    pub fn runs_along(&self, chord: &Vector<D>, m: usize) -> bool {
        let mut across = 0.0;
        for j in 0..m {
            let part: f64 = (0..D).map(|i| self.basis[(i, j)] * chord[i]).sum();
            across += part * part;
        }
        across <= STEEPEST_CHORD * STEEPEST_CHORD * chord.norm_squared()
    }
}
