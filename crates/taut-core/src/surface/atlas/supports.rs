//! A tree of boxes round the supports of charts, which finds the charts that may pass nearest to a
//! point, however large they are.

use crate::Vector;
use crate::surface::atlas::ChartIndex;
use crate::surface::atlas::chart::Chart;

/// Most charts of a leaf.
const LEAF_CHARTS: usize = 4;

/// A part of the charts, in a box that holds their supports; the halves of the part follow it.
#[derive(Clone, Debug)]
struct Part<const D: usize> {
    low: Vector<D>,
    high: Vector<D>,
    /// The range of the part's charts in the order.
    range: std::ops::Range<usize>,
    /// The index of the part's second half, while the first comes next; `None` for a leaf.
    second: Option<usize>,
}

impl<const D: usize> Part<D> {
    /// Squared distance of a point from the box; 0 inside.
    fn gap(&self, x: &Vector<D>) -> f64 {
        let beside = (self.low - x).sup(&(x - self.high));
        beside.sup(&Vector::zeros()).norm_squared()
    }
}

/// The supports of an atlas's charts.
#[derive(Clone, Debug)]
pub(super) struct Supports<const D: usize> {
    order: Vec<ChartIndex>,
    parts: Vec<Part<D>>,
}

/// The nearest chart so far: squared distance and index.
type Nearest = (f64, ChartIndex);

impl<const D: usize> Supports<D> {
    /// Makes the tree of the charts' supports. O(n log n).
    pub fn new(charts: &[Chart<D>]) -> Self {
        let mut supports = Self {
            order: (0..charts.len() as ChartIndex).collect(),
            parts: Vec::new(),
        };
        supports.split(charts, 0..charts.len());
        supports
    }

    /// Adds the part of a range of charts, and its halves after it.
    fn split(&mut self, charts: &[Chart<D>], range: std::ops::Range<usize>) {
        let of = |i: &ChartIndex| &charts[*i as usize];
        let held = || self.order[range.clone()].iter().map(of);
        // These are the corners of the box round the origins, each grown by a share of its radius.
        let corners = |share: f64| {
            let none = Vector::<D>::repeat(f64::INFINITY);
            held().fold([none, -none], |[low, high], chart| {
                let reach = Vector::repeat(share * chart.radius);
                [
                    low.inf(&(chart.origin - reach)),
                    high.sup(&(chart.origin + reach)),
                ]
            })
        };
        let [low, high] = corners(1.0);
        let origins = corners(0.0);
        let widths = origins[1] - origins[0];
        let here = self.parts.len();
        self.parts.push(Part {
            low,
            high,
            range: range.clone(),
            second: None,
        });
        if range.len() <= LEAF_CHARTS {
            return;
        }
        let axis = widths.imax();
        let middle = range.len() / 2;
        self.order[range.clone()].select_nth_unstable_by(middle, |a, b| {
            let along = |i: &ChartIndex| charts[*i as usize].origin[axis];
            along(a).total_cmp(&along(b)).then(a.cmp(b))
        });
        self.split(charts, range.start..range.start + middle);
        self.parts[here].second = Some(self.parts.len());
        self.split(charts, range.start + middle..range.end);
    }

    /// The chart to which a point is nearest by `distance`, which gives a squared distance; of
    /// equal ones the first. `distance` is asked only about charts whose support comes near enough.
    /// It is given the least distance so far, and may answer with any larger distance where its own
    /// is larger than that.
    pub fn nearest(
        &self,
        charts: &[Chart<D>],
        x: &Vector<D>,
        mut distance: impl FnMut(ChartIndex, f64) -> f64,
    ) -> ChartIndex {
        let mut best: Nearest = (f64::INFINITY, 0);
        let mut waiting = vec![0];
        while let Some(part) = waiting.pop() {
            let here = &self.parts[part];
            if here.gap(x) > best.0 {
                continue;
            }
            if let Some(second) = here.second {
                let mut halves = [part + 1, second];
                if self.parts[halves[0]].gap(x) < self.parts[halves[1]].gap(x) {
                    halves.reverse();
                }
                waiting.extend(halves);
                continue;
            }
            for chart in &self.order[here.range.clone()] {
                let support = &charts[*chart as usize];
                let gap = ((x - support.origin).norm() - support.radius).max(0.0);
                if gap * gap <= best.0 {
                    let found = (distance(*chart, best.0), *chart);
                    if found.0 < best.0 || (found.0 == best.0 && found.1 < best.1) {
                        best = found;
                    }
                }
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;

    #[test]
    fn the_nearest_is_that_of_all() {
        let mut state = 9_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let charts: Vec<Chart<3>> = (0..300)
            .map(|_| Chart {
                origin: Vector::from([next(), next(), next()]),
                frame: Matrix::identity(),
                radius: 0.3 * next(),
                coefficients: vec![0.0; 3],
                degree: 1,
                scale: 1.0,
                spacing: 1.0,
                residual: 0.0,
                height_error: 0.0,
                trust: 1.0,
                blend_error: 0.0,
                stands_alone: true,
            })
            .collect();
        let supports = Supports::new(&charts);
        for _ in 0..300 {
            let x = Vector::from([next(), next(), next()]);
            // This is a function that is not the distance from the origins, but is not less than
            // the distance from the supports.
            let far = |i: ChartIndex| {
                let chart = &charts[i as usize];
                let off = ((x - chart.origin).norm() - chart.radius).max(0.0) + chart.origin[0];
                off * off
            };
            let all = (0..300).min_by(|a, b| far(*a).total_cmp(&far(*b)));
            assert_eq!(Some(supports.nearest(&charts, &x, |i, _| far(i))), all);
        }
    }
}
