//! Least costs between the points of the net.

use crate::Vector;
use crate::field::Value;
use crate::field::cost::{Found, Net};

/// Of so many points near a place the one with the least way there tells its direction, and cosine to it of others'.
const BRANCHES: usize = 6;
const ALIKE: f64 = 0.7;

impl<const D: usize> Found<D> {
    /// The number of points that no way leads to.
    pub fn unreached(&self) -> usize {
        let unreached = |value: &&Value<D>| value.distance.is_infinite();
        self.values.iter().filter(unreached).count()
    }

    /// The value at a point near some of the net, from the nearest that is straight on from it.
    pub fn at(&self, net: &Net<D>, x: &Vector<D>, near: &[u32]) -> Value<D> {
        let found = near.iter().find(|i| self.is_known(net, x, **i, near));
        let Some(nearest) = found.map(|i| *i as usize) else {
            return Value::unreached();
        };
        let value = self.values[nearest];
        let step = x - net.points[nearest];
        let change = self.gradients[nearest].dot(&step);
        Value {
            distance: (value.distance + change).max(0.0),
            error: value.error + change.abs() * step.norm() / net.spacing[nearest].max(step.norm()),
            ..value
        }
    }

    fn is_known(&self, net: &Net<D>, x: &Vector<D>, point: u32, near: &[u32]) -> bool {
        let reached = self.values[point as usize].distance.is_finite();
        reached && net.is_open(x, &net.points[point as usize], near)
    }

    /// The cost at `x` and its gradient as smooth functions, but where ways from two sides meet: from all points
    /// near it that ways pass in the direction of the least, each of third order in its distance.
    pub fn smooth(&self, net: &Net<D>, x: &Vector<D>, near: &[u32]) -> Option<(f64, Vector<D>)> {
        let known: Vec<(usize, Vector<D>)> = near
            .iter()
            .filter(|i| self.is_known(net, x, **i, near))
            .map(|i| (*i as usize, x - net.points[*i as usize]))
            .collect();
        let straight = |(i, step): &(usize, Vector<D>)| {
            self.values[*i].distance + self.gradients[*i].dot(step)
        };
        let reach = known.last()?.1.norm();
        let nearest = known.iter().take(BRANCHES);
        let least = nearest.min_by(|a, b| straight(a).total_cmp(&straight(b)))?;
        let ahead = self.gradients[least.0];
        let alike = |i: usize| {
            let other = &self.gradients[i];
            other.dot(&ahead) >= ALIKE * other.norm() * ahead.norm()
        };
        let mut weighed: Vec<(f64, usize, Vector<D>)> = known
            .iter()
            .filter(|(i, _)| alike(*i))
            .map(|(i, step)| {
                let inside = 1.0 - step.norm_squared() / (reach * reach);
                (inside * inside, *i, *step)
            })
            .collect();
        let sum: f64 = weighed.iter().map(|w| w.0).sum();
        if sum.is_nan() || sum <= 0.0 {
            return None;
        }
        weighed.iter_mut().for_each(|w| w.0 /= sum);
        let gradient: Vector<D> = weighed.iter().map(|w| self.gradients[w.1] * w.0).sum();
        let cost = weighed.iter().map(|(weight, i, step)| {
            let mean = (self.gradients[*i] + gradient) * 0.5;
            weight * (self.values[*i].distance + mean.dot(step))
        });
        Some((cost.sum(), gradient))
    }
}
