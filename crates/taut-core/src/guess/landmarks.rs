//! Lower bounds of distances along a graph, from the distances to a few landmarks. By the triangle
//! inequality d(v, t) >= |d(l, t) - d(l, v)| (Goldberg, Harrelson, "Computing the Shortest Path: A*
//! Search Meets Graph Theory", SODA 2005).

use crate::guess::dijkstra::Distances;
use crate::guess::graph::Graph;

/// Number of landmarks of a graph: a node's distances from all of them fill a cache line.
const LANDMARKS: usize = 16;
/// Number of maxima that are taken side by side.
const LANES: usize = 4;
/// Components with fewer nodes than the number of all nodes divided by this get no landmark.
const SMALLEST_SHARE: usize = 16;

/// Distances of every node from each landmark; 0 where the landmark is unreachable or there are
/// fewer landmarks.
#[derive(Clone, Debug)]
pub(crate) struct Landmarks {
    distances: Vec<[f32; LANDMARKS]>,
}

/// Lower bounds of the distance to one goal, a point that is joined to some nodes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goal<'a> {
    landmarks: &'a Landmarks,
    /// Distance of the goal from each landmark: the least over the goal's entrances.
    least: [f32; LANDMARKS],
    /// The most, over the goal's entrances, by which the distance of an entrance from a landmark
    /// exceeds its distance from the goal.
    most: [f32; LANDMARKS],
}

impl Landmarks {
    /// Chooses nodes that are farthest from those chosen before. O(n log n) in the nodes.
    pub fn new<const D: usize, P: Copy>(
        graph: &Graph<D, P>,
        components: &[u32],
        component_sizes: &[usize],
    ) -> Self {
        let count = graph.nodes.len();
        let mut landmarks = Self {
            distances: vec![[0.0; LANDMARKS]; count],
        };
        let large = |v: &u32| {
            let component = components[*v as usize] as usize;
            SMALLEST_SHARE * component_sizes[component] >= count
        };
        let mut candidates: Vec<(u32, f32)> = (0..count as u32)
            .filter(large)
            .map(|v| (v, f32::INFINITY))
            .collect();
        let mut found = Distances::new(graph);
        let everywhere = |_, _| f32::INFINITY;
        // The first search may start anywhere: the farthest node from there is the first landmark.
        let mut next = candidates.first().map(|candidate| candidate.0);
        for column in 0..=LANDMARKS {
            let Some(landmark) = next else {
                break;
            };
            found.clear();
            found.search(graph, &[(landmark, 0.0)], |_| 0.0, everywhere);
            if column > 0 {
                for v in found.reached() {
                    landmarks.distances[*v as usize][column - 1] = found.distance(*v);
                }
            }
            for (v, nearest) in &mut candidates {
                // The distance is infinite where no landmark reaches yet, and such a node comes
                // first.
                *nearest = if column < 2 {
                    found.distance(*v)
                } else {
                    nearest.min(found.distance(*v))
                };
            }
            next = candidates
                .iter()
                .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
                .filter(|farthest| farthest.1 > 0.0)
                .map(|farthest| farthest.0);
        }
        landmarks
    }

    /// Bounds for a goal at the given lengths from its entrances.
    pub fn goal(&self, entrances: &[(u32, f32)]) -> Goal<'_> {
        let mut goal = Goal {
            landmarks: self,
            least: [f32::INFINITY; LANDMARKS],
            most: [f32::NEG_INFINITY; LANDMARKS],
        };
        for (node, length) in entrances {
            let distances = &self.distances[*node as usize];
            for (l, distance) in distances.iter().enumerate() {
                goal.least[l] = goal.least[l].min(distance + length);
                goal.most[l] = goal.most[l].max(distance - length);
            }
        }
        goal
    }
}

impl Goal<'_> {
    /// A lower bound of the length of all routes from the node to the goal.
    pub fn bound(&self, node: u32) -> f32 {
        let distances = &self.landmarks.distances[node as usize];
        let mut largest = [0.0_f32; LANES];
        for l in 0..LANDMARKS {
            let above = self.least[l] - distances[l];
            let below = distances[l] - self.most[l];
            let bound = if above > below { above } else { below };
            let lane = &mut largest[l % LANES];
            *lane = if bound > *lane { bound } else { *lane };
        }
        largest.into_iter().fold(0.0, f32::max)
    }
}
