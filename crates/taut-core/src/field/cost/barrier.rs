//! Barriers: polygons, seen from above, that nothing passes through.

use crate::Vector;

/// A polygon seen along the third axis. It is closed, not necessarily convex, and has any number of
/// corners.
///
/// Its edges are found by the slabs (horizontal strips) that they reach, so that a step looks at
/// few of them.
#[derive(Clone, Debug)]
pub(crate) struct Barrier {
    corners: Vec<[f64; 2]>,
    /// The least coordinates of the corners.
    low: [f64; 2],
    /// The largest coordinates of the corners.
    high: [f64; 2],
    /// For each slab between `low` and `high`, the edges that reach it, each named by the corner at
    /// its end.
    slabs: Vec<Vec<u32>>,
}

impl Barrier {
    /// Makes a polygon from its corners, which are moved by minus `centre`. About O(n log n) for
    /// edges of similar lengths.
    pub fn new<const D: usize>(corners: &[[f64; 2]], centre: &Vector<D>) -> Self {
        let at = |axis: usize| centre.get(axis).copied().unwrap_or(0.0);
        let moved = corners.iter().map(|c| [c[0] - at(0), c[1] - at(1)]);
        let corners: Vec<[f64; 2]> = moved.collect();
        let bound = |axis: usize, start: f64, of: fn(f64, f64) -> f64| {
            corners.iter().map(|c| c[axis]).fold(start, of)
        };
        let low = [0, 1].map(|axis| bound(axis, f64::INFINITY, f64::min));
        let high = [0, 1].map(|axis| bound(axis, f64::NEG_INFINITY, f64::max));
        let mut barrier = Self {
            slabs: vec![Vec::new(); corners.len().max(1)],
            corners,
            low,
            high,
        };
        for i in 0..barrier.corners.len() {
            let [a, b] = barrier.edge(i as u32);
            for slab in barrier.reached(a[1].min(b[1]), a[1].max(b[1])) {
                barrier.slabs[slab].push(i as u32);
            }
        }
        barrier
    }

    /// The edge that ends at a corner.
    fn edge(&self, corner: u32) -> [[f64; 2]; 2] {
        let (i, count) = (corner as usize, self.corners.len());
        [self.corners[(i + count - 1) % count], self.corners[i]]
    }

    /// The slabs between two levels.
    fn reached(&self, from: f64, to: f64) -> std::ops::RangeInclusive<usize> {
        let height = self.high[1] - self.low[1];
        let last = self.slabs.len() - 1;
        let slab = |level: f64| {
            let share = (level - self.low[1]) / height;
            // In a polygon without height the share is not a number, and all edges are in the first
            // slab.
            ((share * self.slabs.len() as f64) as usize).min(last)
        };
        slab(from)..=slab(to)
    }

    /// Whether a place, seen from above, lies within the polygon.
    fn holds_place(&self, [x, y]: [f64; 2]) -> bool {
        let beside = |axis: usize, v: f64| v < self.low[axis] || v > self.high[axis];
        if beside(0, x) || beside(1, y) {
            return false;
        }
        let slab = *self.reached(y, y).start();
        let mut inside = false;
        for corner in &self.slabs[slab] {
            let [[ax, ay], [bx, by]] = self.edge(*corner);
            if (ay > y) != (by > y) && x < ax + (y - ay) * (bx - ax) / (by - ay) {
                inside = !inside;
            }
        }
        inside
    }

    /// Whether a point lies within the polygon.
    pub fn holds<const D: usize>(&self, x: &Vector<D>) -> bool {
        self.holds_place(above(x))
    }

    /// Whether a straight step passes through the polygon.
    pub fn stops<const D: usize>(&self, from: &Vector<D>, to: &Vector<D>) -> bool {
        let (a, b) = (above(from), above(to));
        let beside = |axis: usize| {
            a[axis].max(b[axis]) < self.low[axis] || a[axis].min(b[axis]) > self.high[axis]
        };
        if beside(0) || beside(1) {
            return false;
        }
        let step = [b[0] - a[0], b[1] - a[1]];
        // These are the places where the step meets the lines of the edges. What lies between two
        // successive places is within or outside the polygon as a whole.
        let mut places = vec![0.0, 1.0];
        let (low, high) = (a[1].min(b[1]), a[1].max(b[1]));
        for corner in self.reached(low, high).flat_map(|slab| &self.slabs[slab]) {
            let [c, d] = self.edge(*corner);
            let sides = [c, d].map(|e| cross(step, [e[0] - a[0], e[1] - a[1]]));
            let edge = [d[0] - c[0], d[1] - c[1]];
            let turn = cross(step, edge);
            if sides[0] * sides[1] > 0.0 || turn == 0.0 {
                continue;
            }
            let t = cross([c[0] - a[0], c[1] - a[1]], edge) / turn;
            if t > 0.0 && t < 1.0 {
                places.push(t);
            }
        }
        places.sort_unstable_by(f64::total_cmp);
        places.windows(2).any(|pair| {
            let t = 0.5 * (pair[0] + pair[1]);
            self.holds_place([a[0] + t * step[0], a[1] + t * step[1]])
        })
    }

    /// Whether the triangle of three points holds a part of the polygon, although none of the
    /// triangle's sides passes through the polygon.
    pub fn is_within<const D: usize>(&self, triangle: [&Vector<D>; 3]) -> bool {
        let [a, b, c] = triangle.map(above);
        let Some(x) = self.corners.first() else {
            return false;
        };
        let side = |p: [f64; 2], q: [f64; 2]| {
            cross([q[0] - p[0], q[1] - p[1]], [x[0] - p[0], x[1] - p[1]])
        };
        let sides = [side(a, b), side(b, c), side(c, a)];
        sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
    }
}

/// A point as it is seen along the third axis.
fn above<const D: usize>(x: &Vector<D>) -> [f64; 2] {
    [0, 1].map(|axis| x.get(axis).copied().unwrap_or(0.0))
}

/// The cross product of two vectors in the plane.
fn cross(u: [f64; 2], v: [f64; 2]) -> f64 {
    u[0] * v[1] - u[1] * v[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64) -> Vector<3> {
        Vector::<3>::new(x, y, 7.0)
    }

    fn stops(barrier: &Barrier, [a, b, c, d]: [f64; 4]) -> bool {
        let (one, other) = (point(a, b), point(c, d));
        let found = barrier.stops(&one, &other);
        assert_eq!(found, barrier.stops(&other, &one));
        found
    }

    #[test]
    fn polygons_need_not_be_convex() {
        let notched = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        let barrier = Barrier::new(&notched.map(|[x, y]| [x + 1e6, y - 5.0]), &point(1e6, -5.0));
        assert!(barrier.holds(&point(0.5, 2.0)) && barrier.holds(&point(3.5, 2.0)));
        for outside in [[2.0, 2.0], [-1.0, 1.0], [5.0, 1.0], [2.0, -1.0]] {
            assert!(
                !barrier.holds(&point(outside[0], outside[1])),
                "{outside:?}"
            );
        }
        // These steps go through one arm, both arms, and the foot of the notch; then within the
        // notch, and past a corner.
        for through in [
            [-1.0, 3.0, 2.0, 3.0],
            [-1.0, 3.0, 5.0, 3.0],
            [2.0, 2.0, 2.0, -1.0],
        ] {
            assert!(stops(&barrier, through), "{through:?}");
        }
        for free in [
            [1.5, 3.5, 2.5, 3.5],
            [2.0, 1.0, 2.0, 5.0],
            [-1.0, 3.0, 1.0, 5.1],
        ] {
            assert!(!stops(&barrier, free), "{free:?}");
        }
    }

    #[test]
    fn strips_stop_however_thin() {
        for width in [1e-12, 1e-3, 1.0] {
            let corners = [[-9.0, 0.0], [9.0, 0.0], [9.0, width], [-9.0, width]];
            let barrier = Barrier::new(&corners, &Vector::<3>::zeros());
            assert!(stops(&barrier, [0.1, -2.0, 0.3, 2.0]));
            assert!(!stops(&barrier, [0.1, -2.0, 0.3, -1e-9]));
            assert!(!stops(&barrier, [9.5, -2.0, 9.5, 2.0]));
        }
    }

    #[test]
    fn of_many_corners_few_are_looked_at() {
        let corner = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / 5000.0;
            [angle.cos(), angle.sin()]
        };
        let corners: Vec<[f64; 2]> = (0..5000).map(corner).collect();
        let barrier = Barrier::new(&corners, &Vector::<3>::zeros());
        let edges: usize = barrier.slabs.iter().map(Vec::len).sum();
        assert!(edges < 30_000, "{edges}");
        assert!(stops(&barrier, [0.999, -0.2, 0.999, 0.2]));
        assert!(!stops(&barrier, [1.001, -0.2, 1.001, 0.2]));
        assert!(barrier.is_within([&point(-9.0, -9.0), &point(9.0, -9.0), &point(0.0, 9.0)]));
        assert!(!barrier.is_within([&point(2.0, -9.0), &point(9.0, -9.0), &point(9.0, 9.0)]));
    }
}
