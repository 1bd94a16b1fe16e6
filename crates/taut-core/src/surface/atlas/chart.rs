//! A chart: a polynomial height over a tangent plane, valid within a radius.

use crate::surface::atlas::jet::Jet;
use crate::surface::atlas::polynomial::Monomials;
use crate::surface::atlas::scale::NOISY;
use crate::{Matrix, Vector};

/// A local graph of the surface: heights over a tangent plane, with one polynomial for each normal.
#[derive(Clone, Debug)]
pub(crate) struct Chart<const D: usize> {
    /// Origin of the frame, on the chart's own surface.
    pub origin: Vector<D>,
    /// An orthonormal frame: columns 0..m are normal, m..D tangent.
    pub frame: Matrix<D>,
    /// Radius within which the chart takes part in the blend, in the input's units.
    pub radius: f64,
    /// The coefficients of m polynomials in tangent coordinates that are divided by
    /// [`scale`](Self::scale); heights are in the input's units.
    pub coefficients: Vec<f64>,
    /// Degree of the polynomials.
    pub degree: u8,
    /// Length by which the tangent coordinates are divided, in the input's units.
    pub scale: f64,
    /// Distance between neighbouring points here, in the input's units.
    pub spacing: f64,
    /// Root mean square of the fit's leave-one-out residuals, in the input's units.
    pub residual: f64,
    /// Estimated standard error of the chart's height near its origin, in the input's units.
    pub height_error: f64,
    /// The factor of the chart's weight in the blend, at most 1.
    pub trust: f64,
    /// Estimated standard error of the blend's height near the chart's origin, in the input's
    /// units.
    pub blend_error: f64,
    /// Whether, near its origin, the chart agrees with the blend to what the blend errs by.
    pub stands_alone: bool,
}

/// Values and gradients of the m equations f = <x - o, n> - h(u) of a chart.
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
    /// The coordinates of `x` in the frame, and its k tangent coordinates divided by the scale.
    fn coordinates(&self, k: usize, x: &Vector<D>) -> (Vector<D>, [f64; D]) {
        let local = self.frame.tr_mul(&(x - self.origin));
        let inverse = 1.0 / self.scale;
        let mut u = [0.0; D];
        for j in 0..k {
            u[j] = local[D - k + j] * inverse;
        }
        (local, u)
    }

    /// Whether the chart's points lie on it to within a small share of a spacing.
    pub fn clean(&self) -> bool {
        self.residual <= NOISY * self.spacing
    }

    /// The height of `x` above the chart's own surface along each normal.
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

    /// The gradient of the equation of the chart's first normal at `x`, which points away from the
    /// chart's surface.
    pub fn normal(&self, monomials: &Monomials, x: &Vector<D>) -> Vector<D> {
        let mut jet = ChartJet::new();
        self.jet(monomials, x, &mut jet);
        jet.gradient[0]
    }

    /// Secant of the angle between the surface at `x` and the chart's plane, for the steepest of
    /// the normals.
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

    /// A bound of the [`steepness`](Self::steepness) over the tangent coordinates that the chart
    /// was fitted to.
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

    /// Computes values and gradients of the m equations at `x`.
    pub fn jet(&self, monomials: &Monomials, x: &Vector<D>, out: &mut ChartJet<D>) {
        match D - monomials.variables {
            1 => self.jet_of(1, monomials, x, out),
            m => self.jet_of(m, monomials, x, out),
        }
    }

    /// Computes [`jet`](Self::jet) for m equations; it is inlined, so that a known m unrolls its
    /// loops.
    #[inline(always)]
    fn jet_of(&self, m: usize, monomials: &Monomials, x: &Vector<D>, out: &mut ChartJet<D>) {
        let offset = x - self.origin;
        for a in 0..m {
            let jet = self.equation::<false>(monomials, m, a, &offset);
            (out.value[a], out.gradient[a]) = (jet.value, jet.gradient);
        }
    }

    /// Value, gradient and, if asked for, Hessian of equation `a` of m at an offset from the
    /// origin. It is inlined, so that a known m unrolls its loops.
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
        let (mut slopes, mut seconds) = ([0.0; D], [[0.0; D]; D]);
        let seconds = &mut seconds.as_flattened_mut()[..k * k];
        let count = self.coefficients.len() / m;
        let coefficients = &self.coefficients[a * count..(a + 1) * count];
        let height = monomials.evaluate(coefficients, &u[..k], &mut slopes[..k], seconds);
        let normal = self.frame.column(a);
        let mut jet = Jet {
            value: normal.dot(offset) - height,
            gradient: normal.into_owned(),
            hessian: Matrix::zeros(),
        };
        for i in 0..k {
            let tangent = self.frame.column(m + i);
            jet.gradient -= tangent * (slopes[i] * inverse);
            let mut second = Vector::<D>::zeros();
            for j in 0..k {
                second -= self.frame.column(m + j) * (seconds[i * k + j] * inverse * inverse);
            }
            jet.add_hessian(|i, j| tangent[i] * second[j]);
        }
        jet
    }
}
