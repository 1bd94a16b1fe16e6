//! Tangent frames with the second fundamental form in any dimension, and the straight steps that
//! they determine.
//!
//! Tangent coordinates and matrices on them are padded to D with zeros.

use crate::surface::Geometry;
use crate::surface::crease::is_unexplained;
use crate::{Matrix, Vector};

/// A point of a surface with its tangent space and its second fundamental form.
#[derive(Clone, Debug)]
pub(crate) struct Frame<const D: usize> {
    pub point: Vector<D>,
    /// The tangents in columns: the first k columns are orthonormal, the others zero.
    pub tangents: Matrix<D>,
    /// The second fundamental form: II(e_i, e_j) for i <= j, row by row.
    second: Vec<Vector<D>>,
    /// The intrinsic dimension k.
    dimension: usize,
}

/// The coordinates of the tangent with an index.
pub(crate) fn axis<const D: usize>(tangent: usize) -> Vector<D> {
    let mut axis = Vector::zeros();
    axis[tangent] = 1.0;
    axis
}

impl<const D: usize> Frame<D> {
    /// Makes the frame from the geometry at a point of the surface.
    pub fn new(point: Vector<D>, geometry: &Geometry<D>) -> Self {
        let mut tangents = Matrix::<D>::zeros();
        for j in 0..geometry.intrinsic_dimension() {
            tangents.set_column(j, &geometry.tangent(j));
        }
        Self::of_tangents(point, tangents, geometry)
    }

    /// Makes the frame with given tangents, which are nearly orthonormal and tangential.
    pub fn of_tangents(point: Vector<D>, tangents: Matrix<D>, geometry: &Geometry<D>) -> Self {
        let mut frame = Self {
            point,
            tangents,
            second: Vec::new(),
            dimension: geometry.intrinsic_dimension(),
        };
        frame.take_second_form(geometry);
        frame
    }

    /// Takes the second fundamental form of the tangents from a geometry, by polarisation.
    pub fn take_second_form(&mut self, geometry: &Geometry<D>) {
        let k = self.dimension;
        let squares: [Vector<D>; D] = std::array::from_fn(|i| {
            if i < k {
                geometry.normal_curvature(&self.tangents.column(i).into_owned())
            } else {
                Vector::zeros()
            }
        });
        self.second.clear();
        for i in 0..k {
            self.second.push(squares[i]);
            for j in i + 1..k {
                let both =
                    geometry.normal_curvature(&(self.tangents.column(i) + self.tangents.column(j)));
                self.second.push((both - squares[i] - squares[j]) * 0.5);
            }
        }
    }

    /// The frame turned so that its first tangent is a given unit vector in the coordinates of this
    /// frame.
    pub fn turned(&self, first: &Vector<D>) -> Self {
        let mut turn = Matrix::<D>::zeros();
        turn.set_column(0, first);
        // The axis nearest to the first tangent is left out, as it may depend on the others.
        let others = (0..self.dimension).filter(|i| *i != first.iamax());
        for (count, other) in (1..).zip(others) {
            let mut next: Vector<D> = axis(other);
            for j in 0..count {
                let known = turn.column(j).into_owned();
                next -= known * known.dot(&next);
            }
            turn.set_column(count, &next.normalize());
        }
        let mut turned = Self {
            tangents: self.tangents * turn,
            ..self.clone()
        };
        turned.second.clear();
        for i in 0..self.dimension {
            let second_form = self.second_form_along(&turn.column(i).into_owned());
            for j in i..self.dimension {
                turned.second.push(second_form * turn.column(j));
            }
        }
        turned
    }

    /// Puts a frame that was found with this geometry near the surface onto the surface, and makes
    /// its tangents orthonormal; the first one keeps its direction. `None` where the surface is
    /// farther than `farthest`.
    pub fn settle(&mut self, geometry: &Geometry<D>, farthest: f64) -> Option<()> {
        let off = geometry.pseudo_inverse(&geometry.values);
        if off.norm() > farthest || !off.norm().is_finite() {
            return None;
        }
        self.point -= off;
        for j in 0..self.dimension {
            let mut tangent = geometry.project(&self.tangents.column(j).into_owned());
            for i in 0..j {
                let known = self.tangents.column(i).into_owned();
                tangent -= known * known.dot(&tangent);
            }
            self.tangents.set_column(j, &tangent.try_normalize(1e-6)?);
        }
        self.take_second_form(geometry);
        Some(())
    }

    /// The intrinsic dimension k.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// A bound of the normal curvatures: the Frobenius norm of the second fundamental form.
    pub fn curvature(&self) -> f64 {
        let mut squares = 0.0;
        let mut forms = self.second.iter();
        for i in 0..self.dimension {
            for (j, form) in (i..self.dimension).zip(&mut forms) {
                squares += form.norm_squared() * if i == j { 1.0 } else { 2.0 };
            }
        }
        squares.sqrt()
    }

    /// Whether a crease lies on the way to another frame.
    pub fn is_creased(&self, other: &Self) -> bool {
        let way = (other.point - self.point).norm();
        let turning = (self.curvature() + other.curvature()) * way;
        let off = other.tangents - self.tangents * self.tangents.tr_mul(&other.tangents);
        let mut off = off.column_iter();
        off.any(|column| is_unexplained(column.norm(), turning))
    }

    /// The tangent coordinates of a vector.
    pub fn coordinates(&self, v: &Vector<D>) -> Vector<D> {
        self.tangents.tr_mul(v)
    }

    /// The vector that has these tangent coordinates.
    pub fn vector(&self, v: &Vector<D>) -> Vector<D> {
        self.tangents * v
    }

    /// The matrix whose columns are II(v, e_i).
    pub fn second_form_along(&self, v: &Vector<D>) -> Matrix<D> {
        let mut second_form = Matrix::<D>::zeros();
        let mut forms = self.second.iter();
        for i in 0..self.dimension {
            for (j, form) in (i..self.dimension).zip(&mut forms) {
                second_form.column_mut(i).axpy(v[j], form, 1.0);
                if j > i {
                    second_form.column_mut(j).axpy(v[i], form, 1.0);
                }
            }
        }
        second_form
    }

    /// The symmetric matrix R with u' R w = <R(u, g) g, w> by the equation of Gauss, <II(u, w),
    /// II(g, g)> - <II(u, g), II(w, g)>. It tells how the curvature draws together what runs along
    /// the unit vector g.
    pub fn tidal(&self, g: &Vector<D>) -> Matrix<D> {
        let second_form = self.second_form_along(g);
        let normal = second_form * g;
        let mut tidal = -second_form.tr_mul(&second_form);
        let mut forms = self.second.iter();
        for i in 0..self.dimension {
            for (j, form) in (i..self.dimension).zip(&mut forms) {
                let both = form.dot(&normal);
                tidal[(i, j)] += both;
                if j > i {
                    tidal[(j, i)] += both;
                }
            }
        }
        tidal
    }

    /// The initial velocity of the geodesic that reaches the foot of `x` at time 1, in tangent
    /// coordinates. The formula is that [in two dimensions](crate::field::rays::frame::Frame::log).
    pub fn log(&self, x: &Vector<D>, share: f64) -> Vector<D> {
        let chord = x - self.point;
        let w = self.coordinates(&chord);
        let second_form = self.second_form_along(&w);
        let curved = second_form * w;
        let height = chord - self.vector(&w) - curved * 0.5;
        let steep = second_form.norm_squared();
        w + second_form.tr_mul(&(curved * (1.0 / 6.0 - steep / 40.0) + height * share))
    }

    /// The tangent coordinates at another frame of a vector carried there in parallel along the
    /// geodesic whose initial velocity is `v`; errors are of third order in `v`.
    pub fn transported(&self, to: &Self, v: &Vector<D>, vector: &Vector<D>) -> Vector<D> {
        let second_form = self.second_form_along(v);
        let kept = vector + second_form.tr_mul(&(second_form * vector)) * 0.5;
        to.coordinates(&self.vector(&kept))
    }

    /// The matrix T M T' at another frame, where T is the [parallel transport](Self::transported)
    /// of vectors along `v` and M a matrix here.
    pub fn transported_matrix(&self, to: &Self, v: &Vector<D>, matrix: &Matrix<D>) -> Matrix<D> {
        let second_form = self.second_form_along(v);
        let kept = Matrix::identity() + second_form.tr_mul(&second_form) * 0.5;
        let transport = to.tangents.tr_mul(&(self.tangents * kept));
        transport * matrix * transport.transpose()
    }
}
