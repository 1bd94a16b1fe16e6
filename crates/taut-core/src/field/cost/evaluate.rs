//! Least costs at places between the points of the net.

use crate::Vector;
use crate::field::Value;
use crate::field::cost::update::{Known, Target, Way, through};
use crate::field::cost::{Marched, Net, Slope};
use crate::field::rays::frame::Frame;
use crate::surface::{Geometry, Node, Surface};

/// Number of points nearest to a place among which the one with the least way there tells the
/// direction of the ways.
const BRANCHES: usize = 6;
/// Least cosine between that direction and the direction of other ways whose points count.
const WAYS_ALIKE: f64 = 0.7;
/// Number of points beside a place that must be reached straight from a source for the place to be
/// reached so too.
const BESIDE_PLACE: usize = 3;

impl<const D: usize> Marched<D> {
    /// The number of points that no way leads to.
    pub fn unreached(&self) -> usize {
        let unreached = |value: &&Value<D>| value.distance.is_infinite();
        self.values.iter().filter(unreached).count()
    }

    /// The value at a place near some points of the net, from the nearest point to which a straight
    /// step is open.
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

    /// The value at a node of the surface, where costs are lengths. Like the value at a point of
    /// the net, it is found by the least way through the segments round the nearest point or
    /// straight from a source. `None` where no way leads there.
    pub fn by_segments<S: Surface<D>>(
        &self,
        net: &Net<D>,
        surface: &S,
        node: &Node<D, S::Place>,
        near: &[u32],
    ) -> Option<Value<D>> {
        let mut geometry = Geometry::new(D - surface.intrinsic_dimension());
        let is_known = surface.intrinsic_dimension() == 2
            && surface.cheap_geometry(&node.point, node.place, &mut geometry);
        let frame = is_known.then(|| Frame::new(node.point, &geometry));
        let target = Target {
            point: &node.point,
            rate: 1.0,
            frame: frame.as_ref(),
            slope: Slope::Level,
            is_length: true,
        };
        let beside = near.iter().take(BESIDE_PLACE);
        let error = beside.map(|i| self.values[*i as usize].error);
        let error = error.fold(0.0, f64::max);
        let of_way = |way: Way<D>, source: u32| Value {
            distance: way.cost,
            error,
            source,
            direction: way
                .gradient
                .try_normalize(0.0)
                .unwrap_or_else(Vector::zeros),
        };
        if let Some((way, source)) = self.straight(&target, near) {
            return Some(of_way(way, source));
        }
        let (way, from) = self.through_segments(net, &target, *near.first()?)?;
        Some(of_way(way, self.values[from as usize].source))
    }

    /// The least way straight from a source, where the nearest points are reached so; else `None`.
    fn straight(&self, target: &Target<'_, D>, near: &[u32]) -> Option<(Way<D>, u32)> {
        let beside = near.iter().take(BESIDE_PLACE);
        let origins = beside.map(|i| self.straight[*i as usize]);
        let origins: Vec<u32> = origins.collect::<Option<_>>()?;
        let ways = origins.iter().map(|i| {
            let origin = &self.origins[*i as usize];
            let known = Known {
                point: origin.point,
                frame: None,
                rate: 1.0,
                cost: origin.start,
                gradient: None,
            };
            (through(target, [&known; 2]), origin.source)
        });
        ways.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost))
    }

    /// The least way to a target through the segments of the ring round a point and between the
    /// point and the ring, with the point that it comes from.
    fn through_segments(
        &self,
        net: &Net<D>,
        target: &Target<'_, D>,
        point: u32,
    ) -> Option<(Way<D>, u32)> {
        let reached = |i: u32| self.values[i as usize].distance.is_finite();
        let known = |i: u32| Known {
            point: net.points[i as usize],
            frame: net.frame(i),
            rate: 1.0,
            cost: self.values[i as usize].distance,
            gradient: Some(self.gradients[i as usize]),
        };
        let ring = net.inner.of(point);
        let round = ring.iter().zip(ring.iter().cycle().skip(1));
        let round = round.filter(|(spoke, _)| spoke.joined);
        let round = round.map(|(spoke, next)| [spoke.to, next.to]);
        let segments = round.chain(ring.iter().map(|spoke| [point, spoke.to]));
        let ways = segments.chain([[point; 2]]).filter_map(|ends| {
            if !ends.iter().all(|end| reached(*end)) {
                return None;
            }
            let [a, b] = ends.map(known);
            let way = through(target, [&a, &b]);
            let from = ends[usize::from(way.share > 0.5)];
            Some((way, from))
        });
        ways.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost))
    }

    /// Whether a way leads to a point, and a straight step leads from there to `x`.
    fn is_known(&self, net: &Net<D>, x: &Vector<D>, point: u32, near: &[u32]) -> bool {
        let reached = self.values[point as usize].distance.is_finite();
        reached && net.is_open(x, &net.points[point as usize], near)
    }

    /// The cost at `x` and its gradient as functions that are smooth except where ways from two
    /// sides meet. They are blended from all points near `x` that ways pass in nearly the same
    /// direction as the least way, each with an error of third order in its distance.
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
            other.dot(&ahead) >= WAYS_ALIKE * other.norm() * ahead.norm()
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
