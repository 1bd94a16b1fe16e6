//! A chart: a polynomial height over a tangent plane, valid within a radius.

use crate::surface::atlas::jet::Jet;
use crate::surface::atlas::polynomial::Monomials;
use crate::surface::atlas::scale::NOISY;
use crate::{Matrix, Vector};

/// A local graph of the surface: heights over a tangent plane, one polynomial per normal.
#[derive(Clone, Debug)]
pub(crate) struct Chart<const D: usize> {
    /// Origin of the frame, on the chart's own surface.
    pub origin: Vector<D>,
    /// Orthonormal: columns 0..m normal, m..D tangent.
    pub frame: Matrix<D>,
    /// Radius within which the chart takes part in the blend.
    pub radius: f64,
    /// m polynomials in tangent coordinates divided by [`scale`](Self::scale), heights in input units.
    pub coefficients: Vec<f64>,
    /// Degree of the polynomials.
    pub degree: u8,
    /// Scale of the tangent coordinates.
    pub scale: f64,
    /// Distance between neighbouring points here.
    pub spacing: f64,
    /// Root mean square of the fit's leave-one-out residuals.
    pub residual: f64,
    /// Estimated standard error of the chart's height near its origin.
    pub height_error: f64,
    /// What its weight in the blend is multiplied by.
    pub trust: f64,
    /// Estimated standard error of the blend's height near its origin.
    pub blend_error: f64,
    /// Near its origin it agrees with the blend to what this errs by.
    pub stands_alone: bool,
}

/// Values and gradients of a chart's equations f = <x - o, n> - h(u), all m of them.
#[derive(Clone, Debug)]
pub(crate) struct ChartJet<const D: usize> {
    pub value: [f64; D],
    pub gradient: [Vector<D>; D],
}

impl<const D: usize> ChartJet<D> {
    pub fn new() -> Self {
        Self {
            value: [0.0; D],
            gradient: [Vector::zeros(); D],
        }
    }
}

impl<const D: usize> Chart<D> {
    /// The coordinates of `x` in the frame, and its k tangent coordinates scaled.
    fn coordinates(&self, k: usize, x: &Vector<D>) -> (Vector<D>, [f64; D]) {
        let local = self.frame.tr_mul(&(x - self.origin));
        let inverse = 1.0 / self.scale;
        let mut u = [0.0; D];
        for j in 0..k {
            u[j] = local[D - k + j] * inverse;
        }
        (local, u)
    }

    /// Its points lie on it but for a small share of a spacing.
    pub fn clean(&self) -> bool {
        self.residual <= NOISY * self.spacing
    }

    /// Height above the chart's own surface, per normal: positive along it.
    pub fn offsets(&self, monomials: &Monomials, x: &Vector<D>, out: &mut [f64]) {
        let k = monomials.variables;
        let m = D - k;
        let (local, u) = self.coordinates(k, x);
        let (mut gradient, mut hessian) = ([0.0; D], [[0.0; D]; D]);
        let count = self.coefficients.len() / m;
        for (a, c) in self.coefficients.chunks(count).enumerate() {
            let height = monomials.evaluate(
                c,
                &u[..k],
                &mut gradient[..k],
                &mut hessian.as_flattened_mut()[..k * k],
            );
            out[a] = local[a] - height;
        }
    }

    /// The direction away from the chart's surface at `x`, of the first of its normals.
    pub fn normal(&self, monomials: &Monomials, x: &Vector<D>) -> Vector<D> {
        let mut jet = ChartJet::new();
        self.jet(monomials, x, &mut jet);
        jet.gradient[0]
    }

    /// Secant of the angle between the surface at `x` and the chart's plane, of the steepest normal.
    pub fn steepness(&self, monomials: &Monomials, x: &Vector<D>) -> f64 {
        let k = monomials.variables;
        let (_, u) = self.coordinates(k, x);
        let (mut gradient, mut hessian) = ([0.0; D], [[0.0; D]; D]);
        let count = self.coefficients.len() / (D - k);
        let mut steepest = 0.0_f64;
        for c in self.coefficients.chunks(count) {
            let hessian = &mut hessian.as_flattened_mut()[..k * k];
            monomials.evaluate(c, &u[..k], &mut gradient[..k], hessian);
            let squared: f64 = gradient.iter().map(|g| g * g).sum();
            steepest = steepest.max(squared / (self.scale * self.scale));
        }
        (1.0 + steepest).sqrt()
    }

    /// A bound of the [`steepness`](Self::steepness) over the tangent coordinates that the chart was fitted to.
    pub fn steepest(&self, monomials: &Monomials) -> f64 {
        let count = self.coefficients.len() / (D - monomials.variables);
        let slopes = self.coefficients.chunks(count).map(|c| {
            let degrees = (1..=usize::from(self.degree)).map(|degree| {
                let terms = &c[monomials.count(degree - 1)..monomials.count(degree)];
                degree as f64 * terms.iter().map(|c| c.abs()).sum::<f64>()
            });
            degrees.sum::<f64>() / self.scale
        });
        slopes.fold(1.0, |steepest: f64, slope| steepest.max(slope.hypot(1.0)))
    }

    /// Values and gradients of the m equations at `x`.
    pub fn jet(&self, monomials: &Monomials, x: &Vector<D>, out: &mut ChartJet<D>) {
        match D - monomials.variables {
            1 => self.jet_of(1, monomials, x, out),
            m => self.jet_of(m, monomials, x, out),
        }
    }

    /// [`jet`](Self::jet) of m equations; inlined, so that a known m unrolls its loops.
    #[inline(always)]
    fn jet_of(&self, m: usize, monomials: &Monomials, x: &Vector<D>, out: &mut ChartJet<D>) {
        let offset = x - self.origin;
        for a in 0..m {
            let jet = self.equation::<false>(monomials, m, a, &offset);
            (out.value[a], out.gradient[a]) = (jet.value, jet.gradient);
        }
    }

    /// Value, gradient and, if asked for, Hessian of equation `a` of m at an offset from the origin.
    /// Inlined, so that a known m unrolls its loops.
    #[inline(always)]
    pub fn equation<const HESSIAN: bool>(
        &self,
        monomials: &Monomials,
        m: usize,
        a: usize,
        offset: &Vector<D>,
    ) -> Jet<D, HESSIAN> {
        let k = D - m;
        let inverse = 1.0 / self.scale;
        let mut u = [0.0; D];
        for j in 0..k {
            u[j] = self.frame.column(m + j).dot(offset) * inverse;
        }
        let (mut slopes, mut bends) = ([0.0; D], [[0.0; D]; D]);
        let bends = &mut bends.as_flattened_mut()[..k * k];
        let count = self.coefficients.len() / m;
        let coefficients = &self.coefficients[a * count..(a + 1) * count];
        let height = monomials.evaluate(coefficients, &u[..k], &mut slopes[..k], bends);
        let normal = self.frame.column(a);
        let mut jet = Jet {
            value: normal.dot(offset) - height,
            gradient: normal.into_owned(),
            hessian: Matrix::zeros(),
        };
        for i in 0..k {
            let tangent = self.frame.column(m + i);
            jet.gradient -= tangent * (slopes[i] * inverse);
            let mut bent = Vector::<D>::zeros();
            for j in 0..k {
                bent -= self.frame.column(m + j) * (bends[i * k + j] * inverse * inverse);
            }
            jet.bend(|i, j| tangent[i] * bent[j]);
        }
        jet
    }
}
