//! Tangent and normal frame, and the second fundamental form, from gradients and Hessians.

use crate::{Matrix, Vector};

/// First- and second-order geometry at a point of a surface of codimension m.
///
/// It is built from the gradients and Hessians of m equations F; the buffers are reused between
/// points.
#[derive(Clone, Debug)]
pub struct Geometry<const D: usize> {
    /// An orthonormal basis: columns 0..m span the normal space, columns m..D the tangent space.
    pub basis: Matrix<D>,
    /// Codimension m.
    pub codimension: usize,
    /// Values of the equations.
    pub values: Vec<f64>,
    /// Gradients of the equations, the rows of the Jacobian matrix J.
    pub gradients: Vec<Vector<D>>,
    /// Hessians of the equations.
    pub hessians: Vec<Matrix<D>>,
    /// Upper triangle R of J' = Q R.
    triangle: Matrix<D>,
}

/// The reflection 1 - beta v v'.
#[derive(Clone, Copy)]
struct Reflector<const D: usize> {
    v: Vector<D>,
    beta: f64,
}

impl<const D: usize> Geometry<D> {
    /// An empty geometry for `codimension` equations.
    #[must_use]
    pub fn new(codimension: usize) -> Self {
        Self {
            basis: Matrix::identity(),
            codimension,
            values: vec![0.0; codimension],
            gradients: vec![Vector::zeros(); codimension],
            hessians: vec![Matrix::zeros(); codimension],
            triangle: Matrix::zeros(),
        }
    }

    /// The j-th unit tangent vector, j < k.
    #[must_use]
    pub fn tangent(&self, j: usize) -> Vector<D> {
        self.basis.column(self.codimension + j).into_owned()
    }

    /// The j-th unit normal vector, j < m.
    #[must_use]
    pub fn normal(&self, j: usize) -> Vector<D> {
        self.basis.column(j).into_owned()
    }

    /// The intrinsic dimension k.
    #[must_use]
    pub fn intrinsic_dimension(&self) -> usize {
        D - self.codimension
    }

    /// The orthogonal projection of `v` onto the tangent space.
    #[must_use]
    pub fn project(&self, v: &Vector<D>) -> Vector<D> {
        let mut tangential = *v;
        for j in 0..self.codimension {
            let n = self.basis.column(j);
            tangential -= n * n.dot(v);
        }
        tangential
    }

    /// Householder QR of J', which fills [`basis`](Self::basis). `false` where the gradients are
    /// not independent (relative to the longest, to 1e-12) or not finite.
    pub fn factor(&mut self) -> bool {
        if self.codimension == 1 {
            return self.factor_one();
        }
        let Some(reflectors) = self.triangularise() else {
            return false;
        };
        let m = self.codimension;
        self.basis = Matrix::identity();
        for (j, Reflector { v, beta }) in reflectors[..m].iter().enumerate().rev() {
            let row = if j + 1 == m {
                v.transpose()
            } else {
                v.transpose() * self.basis
            };
            self.basis -= v * (row * *beta);
        }
        // Normals point along the gradients: R's diagonal is made positive.
        for j in 0..m {
            if self.triangle[(j, j)] < 0.0 {
                self.basis.column_mut(j).neg_mut();
                for i in j..m {
                    self.triangle[(j, i)] = -self.triangle[(j, i)];
                }
            }
        }
        true
    }

    /// Computes [`factor`](Self::factor) for one equation, by a single reflection.
    fn factor_one(&mut self) -> bool {
        let mut v = self.gradients[0];
        let squared = v.norm_squared();
        if !(squared > 0.0 && squared.is_finite()) {
            return false;
        }
        let diagonal = -squared.sqrt().copysign(v[0]);
        v[0] -= diagonal;
        // Here |v|^2 = 2 diagonal (diagonal - gradient_0).
        let beta = -1.0 / (diagonal * v[0]);
        self.basis = Matrix::identity() - v * (v.transpose() * beta);
        if diagonal < 0.0 {
            self.basis.column_mut(0).neg_mut();
        }
        self.triangle[(0, 0)] = diagonal.abs();
        true
    }

    /// The step J^+ F of (12) back to the surface, from [`values`](Self::values) and
    /// [`gradients`](Self::gradients) alone; `None` where [`factor`](Self::factor) would fail.
    pub(crate) fn step_off(&mut self) -> Option<Vector<D>> {
        if let ([value], [gradient]) = (&self.values[..], &self.gradients[..]) {
            let squared = gradient.norm_squared();
            let regular = squared > 0.0 && squared.is_finite();
            return regular.then(|| gradient * (value / squared));
        }
        let reflectors = self.triangularise()?;
        let mut x = Vector::<D>::zeros();
        x.as_mut_slice()[..self.codimension]
            .copy_from_slice(&self.substitute(&self.values)[..self.codimension]);
        for Reflector { v, beta } in reflectors[..self.codimension].iter().rev() {
            x -= v * (beta * v.dot(&x));
        }
        Some(x)
    }

    /// Fills the triangle R of J' = Q R; returns the reflections whose product is Q.
    fn triangularise(&mut self) -> Option<[Reflector<D>; D]> {
        let m = self.codimension;
        let squares = self.gradients.iter().map(|g| g.norm_squared());
        let longest = squares.fold(0.0, f64::max);
        if !(longest > 0.0 && longest.is_finite()) {
            return None;
        }
        let mut reflectors = [Reflector {
            v: Vector::<D>::zeros(),
            beta: 0.0,
        }; D];
        for j in 0..m {
            let mut column = self.gradients[j];
            for Reflector { v, beta } in &reflectors[..j] {
                column -= v * (beta * v.dot(&column));
            }
            let mut v = column;
            v.as_mut_slice()[..j].fill(0.0);
            let squared = v.norm_squared();
            if squared <= 1e-24 * longest {
                return None;
            }
            let diagonal = -squared.sqrt().copysign(v[j]);
            v[j] -= diagonal;
            // Here |v|^2 = 2 diagonal (diagonal - column_j).
            let beta = -1.0 / (diagonal * v[j]);
            reflectors[j] = Reflector { v, beta };
            column[j] = diagonal;
            for i in 0..=j {
                self.triangle[(i, j)] = column[i];
            }
        }
        Some(reflectors)
    }

    /// Solves R' y = r.
    fn substitute(&self, r: &[f64]) -> [f64; D] {
        let mut y = [0.0; D];
        for i in 0..self.codimension {
            let mut sum = r[i];
            for j in 0..i {
                sum -= self.triangle[(j, i)] * y[j];
            }
            y[i] = sum / self.triangle[(i, i)];
        }
        y
    }

    /// The vector J^+ r, which is the shortest x with J x = r; it solves R' y = r, x = Q y.
    #[must_use]
    pub fn pseudo_inverse(&self, r: &[f64]) -> Vector<D> {
        let y = self.substitute(r);
        let mut x = Vector::zeros();
        for i in 0..self.codimension {
            x += self.basis.column(i) * y[i];
        }
        x
    }

    /// The normal curvature vector II(t, t) = -J^+ [t' Hess F_a t]_a along a tangent vector t.
    #[must_use]
    pub fn normal_curvature(&self, t: &Vector<D>) -> Vector<D> {
        let mut second = [0.0; D];
        for (value, hessian) in second.iter_mut().zip(&self.hessians) {
            *value = -(hessian * t).dot(t);
        }
        self.pseudo_inverse(&second[..self.codimension])
    }

    /// The vectors II(e, e), II(e, f) and II(f, f) for the two tangents e and f of a surface of
    /// dimension 2.
    pub(crate) fn second_fundamental_form(&self) -> [Vector<D>; 3] {
        let (e, f) = (self.tangent(0), self.tangent(1));
        let (first, last) = (self.normal_curvature(&e), self.normal_curvature(&f));
        let both = self.normal_curvature(&((e + f) * std::f64::consts::FRAC_1_SQRT_2));
        [first, both - (first + last) * 0.5, last]
    }

    /// A bound on the normal curvatures: the Frobenius norm of the second fundamental form, 1 /
    /// length.
    #[must_use]
    pub fn curvature_bound(&self) -> f64 {
        let mut squares = 0.0;
        for a in 0..self.codimension {
            let form = self.second_form(&self.normal(a));
            for i in self.codimension..D {
                let curved = form * self.basis.column(i);
                for j in self.codimension..D {
                    squares += curved.dot(&self.basis.column(j)).powi(2);
                }
            }
        }
        squares.sqrt()
    }

    /// The symmetric matrix H with <g, II(u, v)> = u' H v for tangent u and v: the Hessians summed
    /// with the multipliers -J^{+T} g.
    #[must_use]
    pub fn second_form(&self, g: &Vector<D>) -> Matrix<D> {
        let m = self.codimension;
        let mut multipliers = [0.0; D];
        let mut sum_of_hessians = Matrix::zeros();
        for i in (0..m).rev() {
            let mut sum = self.basis.column(i).dot(g);
            for j in i + 1..m {
                sum -= self.triangle[(i, j)] * multipliers[j];
            }
            multipliers[i] = sum / self.triangle[(i, i)];
            sum_of_hessians -= self.hessians[i] * multipliers[i];
        }
        sum_of_hessians
    }
}
