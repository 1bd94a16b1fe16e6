//! Least costs in the plane that a formula gives.

use std::f64::consts::TAU;

type Point = [f64; 2];

fn distance(p: Point, q: Point) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// Cost per length 1 / (1 + rise x): rays are arcs of circles.
pub fn linear_speed(rise: f64, p: Point, q: Point) -> f64 {
    let speeds = (1.0 + rise * p[0]) * (1.0 + rise * q[0]);
    (1.0 + (rise * distance(p, q)).powi(2) / (2.0 * speeds)).acosh() / rise
}

/// Cost per length `costs[0]` for y < 0 and the greater `costs[1]` beyond, from p with y < 0: by
/// Snell's law the least over places of the crossing, a convex function of it.
pub fn refraction(costs: [f64; 2], p: Point, q: Point) -> f64 {
    if q[1] <= 0.0 {
        return costs[0] * distance(p, q);
    }
    let through = |x: f64| costs[0] * distance(p, [x, 0.0]) + costs[1] * distance([x, 0.0], q);
    let (mut low, mut high) = (p[0].min(q[0]), p[0].max(q[0]));
    for _ in 0..200 {
        let third = (high - low) / 3.0;
        if through(low + third) < through(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    through(0.5 * (low + high))
}

/// A norm that need not be convex, given by its value for each unit vector: the cost of zigzags
/// too, by the convex hull of its unit ball.
pub struct Norm {
    corners: Vec<Point>,
}

impl Norm {
    /// By 3600 directions.
    pub fn new(cost: impl Fn(Point) -> f64) -> Self {
        let count = 3600;
        let corner = |i: usize| {
            let (sin, cos) = (TAU * i as f64 / count as f64).sin_cos();
            let length = 1.0 / cost([cos, sin]);
            [cos * length, sin * length]
        };
        let ball: Vec<Point> = (0..count).map(corner).collect();
        let left = |a: Point, b: Point, c: Point| {
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
        };
        // From the corner farthest to the right, which is on the hull, round (Graham's scan; the
        // ball is star-shaped).
        let first = (0..count).max_by(|a, b| ball[*a][0].total_cmp(&ball[*b][0]));
        let first = first.unwrap_or(0);
        let mut corners: Vec<Point> = Vec::new();
        for i in 0..=count {
            let next = ball[(first + i) % count];
            while let [.., a, b] = corners[..] {
                if left(a, b, next) {
                    break;
                }
                corners.pop();
            }
            corners.push(next);
        }
        Self { corners }
    }

    /// The least cost of going along a vector.
    pub fn cost(&self, v: Point) -> f64 {
        let cross = |a: Point, b: Point| a[0] * b[1] - a[1] * b[0];
        let shares = self.corners.windows(2).filter_map(|pair| {
            let area = cross(pair[0], pair[1]);
            let (a, b) = (cross(v, pair[1]) / area, cross(pair[0], v) / area);
            (a >= -1e-12 && b >= -1e-12).then_some(a + b)
        });
        shares.fold(f64::INFINITY, f64::min)
    }
}

/// Walls |y| <= `half` but for a gap between two x: the shortest way from y < -half, round the
/// gap's corners.
pub fn wall_with_gap(half: f64, gap: [f64; 2], p: Point, q: Point) -> f64 {
    let corners: Vec<Point> = [-half, half]
        .into_iter()
        .flat_map(|y| gap.map(|x| [x, y]))
        .collect();
    let sees = |a: Point, b: Point| {
        // Where the segment is within the wall it must be within the gap: linear, so at both ends
        // of that part.
        let rise = b[1] - a[1];
        let at = |y: f64| ((y - a[1]) / rise).clamp(0.0, 1.0);
        let ends = if rise == 0.0 {
            if a[1].abs() >= half {
                return true;
            }
            [0.0, 1.0]
        } else {
            [at(-half), at(half)]
        };
        let part = (ends[0] - ends[1]).abs();
        part == 0.0
            || ends.iter().all(|t| {
                let x = a[0] + t * (b[0] - a[0]);
                x >= gap[0] - 1e-12 && x <= gap[1] + 1e-12
            })
    };
    let mut nodes = vec![p];
    nodes.extend(corners);
    nodes.push(q);
    let mut least = vec![f64::INFINITY; nodes.len()];
    least[0] = 0.0;
    for _ in 0..nodes.len() {
        for i in 0..nodes.len() {
            for j in 0..nodes.len() {
                if sees(nodes[i], nodes[j]) {
                    least[j] = least[j].min(least[i] + distance(nodes[i], nodes[j]));
                }
            }
        }
    }
    least[nodes.len() - 1]
}
