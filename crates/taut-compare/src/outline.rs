//! Shortest ways in a part of the plane with a polygonal edge, by its visibility graph (T.
//! Lozano-Pérez, M. A. Wesley, Communications of the ACM 22, 1979): straight between corners that
//! see each other.

/// A part of the plane: what lies inside an odd number of rings. Rings are closed polygons that do
/// not meet.
#[derive(Clone, Debug)]
pub struct Outline {
    /// The corners of each ring in order.
    pub rings: Vec<Vec<[f64; 2]>>,
}

/// Beside a corner: this share of its shorter edge away.
const CLOSE: f64 = 1e-6;

/// Twice the area of a triangle, positive where it turns left.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn length(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

impl Outline {
    /// A rectangle given by two opposite corners.
    pub fn rectangle(low: [f64; 2], high: [f64; 2]) -> Vec<[f64; 2]> {
        vec![low, [high[0], low[1]], high, [low[0], high[1]]]
    }

    /// A square of side 2 with two notches from opposite sides that overlap.
    #[must_use]
    pub fn notches() -> Self {
        let ring = vec![
            [-1.0, -1.0],
            [-0.4, -1.0],
            [-0.4, 0.3],
            [-0.2, 0.3],
            [-0.2, -1.0],
            [1.0, -1.0],
            [1.0, 1.0],
            [0.4, 1.0],
            [0.4, -0.3],
            [0.2, -0.3],
            [0.2, 1.0],
            [-1.0, 1.0],
        ];
        Self { rings: vec![ring] }
    }

    fn edges(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let ring = |ring: &'_ Vec<[f64; 2]>| {
            let ring = ring.clone();
            (0..ring.len()).map(move |i| [ring[i], ring[(i + 1) % ring.len()]])
        };
        self.rings.iter().flat_map(ring)
    }

    /// Whether a point lies inside.
    pub fn holds(&self, p: [f64; 2]) -> bool {
        let crossed = self.edges().filter(|[a, b]| {
            (a[1] > p[1]) != (b[1] > p[1])
                && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        });
        crossed.count() % 2 == 1
    }

    /// The corners that shortest ways bend round: more than half of what lies round them is inside.
    fn turns(&self) -> Vec<[f64; 2]> {
        let outside = |ring: &[[f64; 2]], i: usize| {
            let corner = ring[i];
            let beside = [
                ring[(i + 1) % ring.len()],
                ring[(i + ring.len() - 1) % ring.len()],
            ];
            let amid = |axis: usize| {
                let share = |end: [f64; 2]| (end[axis] - corner[axis]) / length(corner, end);
                let least = length(corner, beside[0]).min(length(corner, beside[1]));
                corner[axis] + CLOSE * least * (share(beside[0]) + share(beside[1]))
            };
            !self.holds([amid(0), amid(1)])
        };
        let of_ring = |ring: &'_ Vec<[f64; 2]>| {
            let turns = (0..ring.len()).filter(|i| outside(ring, *i));
            turns.map(|i| ring[i]).collect::<Vec<_>>()
        };
        self.rings.iter().flat_map(of_ring).collect()
    }

    /// Whether the straight way between two points, inside or at corners, stays inside. It must not
    /// pass a corner on the way.
    pub fn sees(&self, p: [f64; 2], q: [f64; 2]) -> bool {
        let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        let crosses = |[a, b]: [[f64; 2]; 2]| {
            let at_end = [a, b].iter().any(|end| *end == p || *end == q);
            !at_end
                && (area(p, q, a) > 0.0) != (area(p, q, b) > 0.0)
                && (area(a, b, p) > 0.0) != (area(a, b, q) > 0.0)
        };
        let is_edge = self
            .edges()
            .any(|[a, b]| [a, b] == [p, q] || [b, a] == [p, q]);
        is_edge || (self.holds(middle) && !self.edges().any(crosses))
    }

    /// The lengths of the shortest ways from a source to points, infinite where there is none.
    pub fn distances(&self, source: [f64; 2], points: &[[f64; 2]]) -> Vec<f64> {
        let mut reached: Vec<([f64; 2], f64)> = vec![(source, 0.0)];
        let mut left = self.turns();
        let least = |reached: &[([f64; 2], f64)], point: [f64; 2]| {
            let ways = reached
                .iter()
                .filter(|(corner, _)| self.sees(*corner, point))
                .map(|(corner, way)| way + length(*corner, point));
            ways.fold(f64::INFINITY, f64::min)
        };
        while !left.is_empty() {
            let ways = left.iter().map(|corner| least(&reached, *corner));
            let nearest = ways
                .enumerate()
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|(_, way)| way.is_finite());
            let Some((i, way)) = nearest else { break };
            reached.push((left.swap_remove(i), way));
        }
        points.iter().map(|p| least(&reached, *p)).collect()
    }
}
