//! Escapes from saddles, along the direction in which a path shortens most.

use crate::correction::curve::Curve;
use crate::correction::newton::Solver;
use crate::surface::Surface;

/// Sizes of the moves off a saddle that are tried, as shares of the length.
const ESCAPES: [f64; 8] = [0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3];

impl<const D: usize, P: Copy + Send + Sync + std::fmt::Debug> Solver<D, P> {
    /// Moves the path along the direction in which it shortens most at second order, if the last
    /// Hessian had one, to the side where it becomes shorter. The direction is found by inverse
    /// iteration from a fixed generic start.
    pub fn escape<S: Surface<D, Place = P>>(
        &mut self,
        surface: &S,
        curve: &mut Curve<D, P>,
    ) -> Option<()> {
        let measure = curve.measure(&mut self.pull);
        self.weigh(curve);
        let rim = self.assemble(surface, curve, measure)?;
        // A shift that makes the matrix positive definite leaves the most negative direction as the
        // least eigenvector.
        let mut shift = 4.0;
        while self.factor(shift) != Some(0) {
            shift *= 2.0;
            if shift > 1e12 {
                return None;
            }
        }
        for (i, value) in self.step.iter_mut().enumerate() {
            *value = (1.0 + i as f64).sin();
        }
        let k = surface.intrinsic_dimension();
        for _ in 0..12 {
            for (i, value) in self.step.iter_mut().enumerate() {
                *value *= self.masses[1 + i / k];
            }
            self.band.solve(&mut self.step);
            let largest = self.step.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            for value in &mut self.step {
                *value /= largest;
            }
        }
        let direction = self.step.clone();
        let mut least = measure.energy + rim;
        let mut best = None;
        for size in ESCAPES {
            let before = least;
            for signed in [size, -size] {
                for (target, value) in self.step.iter_mut().zip(&direction) {
                    *target = signed * measure.length * value;
                }
                if let Some((_, energy)) = self.attempt(surface, curve, measure)
                    && energy < least
                {
                    least = energy;
                    best = Some(self.trial.clone());
                }
            }
            // The valley beside the saddle lies farther out than this size.
            if best.is_some() && least == before {
                break;
            }
        }
        curve.nodes = best?;
        Some(())
    }
}
