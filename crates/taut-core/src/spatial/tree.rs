//! A balanced k-d tree in leaf order, split at the median of the widest principal axis, so that the
//! leaves turn with the points.
//!
//! Source: Friedman, Bentley, Finkel (1977); the incremental distance of Arya and Mount (1993).

use std::ops::Range;

use crate::spatial::principal;
use crate::{Matrix, Vector};

/// Most points of a leaf; where there are several leaves, each holds at least half of this number.
pub(crate) const LEAF_POINTS: usize = 16;

/// Number of candidates, as a multiple of those wanted, at which they are sorted out.
const SPARE_CANDIDATES: usize = 2;
/// Relative rounding of coordinates along the axes: a point as near as the limit must not be
/// missed.
const AXIS_ROUNDING: f64 = 1e-9;

/// A split of a part of the tree: the axis, and the coordinate along it at which the halves meet.
#[derive(Clone, Copy, Debug, Default)]
struct Split {
    axis: u32,
    value: f64,
}

/// Points in leaf order with the splits above them.
#[derive(Clone, Debug)]
pub(crate) struct Tree<const D: usize> {
    /// The points in leaf order.
    pub points: Vec<Vector<D>>,
    /// For each point in leaf order, its index in the input.
    pub order: Vec<u32>,
    /// The directions that the tree is split along, by rows.
    axes: Matrix<D>,
    splits: Vec<Split>,
    levels: u32,
}

/// A neighbour: squared distance and index in leaf order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Neighbour {
    pub squared: f64,
    pub index: u32,
}

impl<const D: usize> Tree<D> {
    /// Builds the tree in O(n log n), in parallel; the result is the same for any number of
    /// threads.
    pub fn new(points: &[Vector<D>]) -> Self {
        let mut levels = 0;
        while points.len() >> levels > LEAF_POINTS || (points.len() - 1) >> levels >= LEAF_POINTS {
            levels += 1;
        }
        let axes = principal::axes(points);
        let mut entries: Vec<(Vector<D>, u32)> = points.iter().map(|p| axes * p).zip(0..).collect();
        let mut splits = vec![Split::default(); 1 << levels];
        build(&mut entries, &mut splits, 1, levels);
        let order: Vec<u32> = entries.iter().map(|entry| entry.1).collect();
        Self {
            points: order.iter().map(|i| points[*i as usize]).collect(),
            order,
            axes,
            splits,
            levels,
        }
    }

    /// The ranges of the leaves, in order.
    pub fn leaves(&self) -> Vec<Range<usize>> {
        let mut starts = vec![0, self.points.len()];
        for _ in 0..self.levels {
            let halves = starts
                .windows(2)
                .flat_map(|pair| [pair[0], (pair[0] + pair[1]) / 2]);
            starts = halves.chain([self.points.len()]).collect();
        }
        starts.windows(2).map(|pair| pair[0]..pair[1]).collect()
    }

    /// Finds the `count` points nearest to `x` (fewer if the tree holds fewer), nearest first; ties
    /// are ordered by index.
    pub fn nearest(&self, x: &Vector<D>, count: usize, found: &mut Vec<Neighbour>) {
        found.clear();
        let mut search = Search {
            tree: self,
            x,
            along: self.axes * x,
            count,
            limit: f64::INFINITY,
            found,
        };
        search.descend(1, 0, 0..self.points.len(), 0.0, &mut Vector::zeros());
        search.keep_nearest();
        found.sort_unstable_by_key(Neighbour::order);
    }
}

/// Splits the entries under a node at the median of their widest axis, down to the leaves.
fn build<const D: usize>(
    entries: &mut [(Vector<D>, u32)],
    splits: &mut [Split],
    node: usize,
    levels: u32,
) {
    if levels == 0 {
        return;
    }
    let (mut low, mut high) = (entries[0].0, entries[0].0);
    for (point, _) in entries.iter() {
        low = low.inf(point);
        high = high.sup(point);
    }
    let axis = (high - low).imax();
    let middle = entries.len() / 2;
    entries.select_nth_unstable_by(middle, |a, b| {
        a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1))
    });
    // Splits of a subtree lie scattered in heap order, so the halves fill their own lists, which
    // are then merged.
    splits[node] = Split {
        axis: axis as u32,
        value: entries[middle].0[axis],
    };
    let (left, right) = entries.split_at_mut(middle);
    if left.len() > 8192 {
        let mut other = splits.to_vec();
        rayon::join(
            || build(left, splits, 2 * node, levels - 1),
            || build(right, &mut other, 2 * node + 1, levels - 1),
        );
        merge(splits, &other, 2 * node + 1);
    } else {
        build(left, splits, 2 * node, levels - 1);
        build(right, splits, 2 * node + 1, levels - 1);
    }
}

/// Copies the splits of the subtree under `node`.
fn merge(splits: &mut [Split], other: &[Split], node: usize) {
    let (mut first, mut width) = (node, 1);
    while first < splits.len() {
        splits[first..first + width].copy_from_slice(&other[first..first + width]);
        first *= 2;
        width *= 2;
    }
}

/// A search for the points nearest to `x`.
struct Search<'a, const D: usize> {
    tree: &'a Tree<D>,
    x: &'a Vector<D>,
    /// The coordinates of `x` along the tree's axes.
    along: Vector<D>,
    count: usize,
    /// The squared distance beyond which no point is among the nearest.
    limit: f64,
    /// The nearest points so far, and others.
    found: &'a mut Vec<Neighbour>,
}

impl<const D: usize> Search<'_, D> {
    /// Searches the part of the tree under a node, the nearer half first.
    fn descend(
        &mut self,
        node: usize,
        level: u32,
        range: Range<usize>,
        squared: f64,
        offset: &mut Vector<D>,
    ) {
        if level == self.tree.levels {
            self.offer(range);
            return;
        }
        let split = self.tree.splits[node];
        let axis = split.axis as usize;
        let gap = self.along[axis] - split.value;
        let middle = (range.start + range.end) / 2;
        let (near, far) = if gap < 0.0 {
            (
                (2 * node, range.start..middle),
                (2 * node + 1, middle..range.end),
            )
        } else {
            (
                (2 * node + 1, middle..range.end),
                (2 * node, range.start..middle),
            )
        };
        self.descend(near.0, level + 1, near.1, squared, offset);
        let old = offset[axis];
        let farther = squared - old * old + gap * gap;
        if farther <= self.limit * (1.0 + AXIS_ROUNDING) {
            offset[axis] = gap;
            self.descend(far.0, level + 1, far.1, farther, offset);
            offset[axis] = old;
        }
    }

    /// Adds the points of a leaf that may be among the nearest.
    fn offer(&mut self, range: Range<usize>) {
        for (point, index) in self.tree.points[range.clone()].iter().zip(range) {
            let squared = (point - self.x).norm_squared();
            if squared <= self.limit {
                self.found.push(Neighbour {
                    squared,
                    index: index as u32,
                });
            }
        }
        let many = self.limit == f64::INFINITY && self.found.len() >= self.count;
        if many || self.found.len() >= SPARE_CANDIDATES * self.count {
            self.keep_nearest();
        }
    }

    /// Drops all but the nearest points, of which there are then enough to limit the search.
    fn keep_nearest(&mut self) {
        if self.found.len() >= self.count && self.count > 0 {
            let last = self.count - 1;
            let farthest = self
                .found
                .select_nth_unstable_by_key(last, Neighbour::order);
            self.limit = farthest.1.squared;
            self.found.truncate(self.count);
        }
    }
}

impl Neighbour {
    /// The order by distance, which is not negative, and for ties by index.
    fn order(&self) -> (u64, u32) {
        (self.squared.to_bits(), self.index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize) -> Vec<Vector<3>> {
        let mut state = 7u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            // A coarse grid makes many ties.
            ((state >> 40) % 50) as f64 / 50.0
        };
        (0..count)
            .map(|_| Vector::<3>::new(next(), next(), 0.1 * next()))
            .collect()
    }

    #[test]
    fn agrees_with_brute_force_on_a_grid_with_ties() {
        for count in [2, 15, 16, 17, 33, 1000, 20_000] {
            let cloud = points(count);
            let tree = Tree::new(&cloud);
            let mut found = Vec::new();
            for query in cloud.iter().step_by(1 + count / 20) {
                let x = query + Vector::<3>::new(0.003, 0.001, 0.2);
                for wanted in [1, 7, 40] {
                    tree.nearest(&x, wanted, &mut found);
                    let mut all: Vec<Neighbour> = tree
                        .points
                        .iter()
                        .zip(0..)
                        .map(|(p, index)| Neighbour {
                            squared: (p - x).norm_squared(),
                            index,
                        })
                        .collect();
                    all.sort_by(|a, b| a.squared.total_cmp(&b.squared).then(a.index.cmp(&b.index)));
                    all.truncate(wanted);
                    assert_eq!(found, all, "{count} points, {wanted} wanted");
                }
            }
        }
    }

    #[test]
    fn leaves_partition_the_points() {
        for count in [2, 16, 17, 100, 4097] {
            let cloud = points(count);
            let tree = Tree::new(&cloud);
            let leaves = tree.leaves();
            assert_eq!(
                leaves.iter().map(ExactSizeIterator::len).sum::<usize>(),
                count
            );
            assert!(
                leaves
                    .iter()
                    .all(|l| !l.is_empty() && l.len() <= LEAF_POINTS)
            );
            for (point, index) in tree.points.iter().zip(&tree.order) {
                assert_eq!(*point, cloud[*index as usize]);
            }
        }
    }
}
