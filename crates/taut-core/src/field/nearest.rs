//! The points nearest to the sources, found by a field that goes no farther than it takes to hold
//! them.

use std::collections::BinaryHeap;

use crate::error::Error;
use crate::field::sources::nearest_entrance;
use crate::field::{Field, Fields, Settings, Source, Sources};
use crate::guess::Guide;
use crate::guess::dijkstra::Distances;
use crate::surface::Node;

/// Largest ratio of a step from a node of the graph to a point beside it, which curves with the
/// surface, to the step's chord.
const ARC_OVER_CHORD: f64 = 1.1;
/// Distance before the end of a field, in spacings of the graph's nodes, up to which its values are
/// those of a field without end.
const FIELD_MARGIN: f64 = 3.0;

/// The indices of the `count` least of some distances, least first; of equal distances the first
/// comes first. There are fewer indices if fewer distances are finite. O(n + `count` log `count`).
#[must_use]
pub fn least(distances: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..distances.len())
        .filter(|i| distances[*i].is_finite())
        .collect();
    let by_distance = |a: &usize, b: &usize| distances[*a].total_cmp(&distances[*b]).then(a.cmp(b));
    if count < order.len() {
        order.select_nth_unstable_by(count, by_distance);
        order.truncate(count);
    }
    order.sort_unstable_by(by_distance);
    order
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The distances from the sources, as far as it takes to hold the `count` of `nodes` that are
    /// nearest, which [`least`] picks. What lies farther may or may not be reached.
    ///
    /// Distances along the graph, which are never too short, tell how far that is. Costs are found
    /// everywhere.
    ///
    /// # Errors
    /// The same errors as [`from`](Self::from).
    pub fn nearest_of<'s>(
        &self,
        sources: impl Into<Sources<'s, D, S::Place>>,
        nodes: &[Node<D, S::Place>],
        count: usize,
        settings: &Settings,
    ) -> Result<Field<D>, Error>
    where
        S::Place: 's,
    {
        let sources = sources.into().simplified();
        if self.ground.net.is_some() {
            return self.from(sources, settings);
        }
        let beside = nodes.iter().filter_map(|node| {
            let nearest = nearest_entrance(&self.geodesics.entrances(node))?;
            Some((nearest.0, f64::from(nearest.1)))
        });
        self.up_to(sources, beside, count, settings)
    }

    /// The field as far as `count` of some points lie, each beside a node of the graph and at a
    /// distance from it.
    fn up_to(
        &self,
        sources: Sources<'_, D, S::Place>,
        points: impl Iterator<Item = (u32, f64)>,
        count: usize,
        settings: &Settings,
    ) -> Result<Field<D>, Error> {
        let mut beside = vec![(0, 0.0_f64); self.geodesics.graph().nodes.len()];
        for (node, distance) in points {
            let (points, reach) = &mut beside[node as usize];
            *points += 1;
            *reach = reach.max(distance);
        }
        let far = match sources {
            Sources::Points(points) => self.far_enough(points, &beside, count),
            Sources::Curve(curve) => self.far_enough(&self.pieces(curve).0, &beside, count),
        };
        let settings = Settings {
            max_distance: settings.max_distance.min(far),
            ..*settings
        };
        self.from(sources, &settings)
    }

    /// A distance within which `count` points lie, with a margin for the edge of the field;
    /// infinite if there are fewer points. `beside` has the number of points at each node of the
    /// graph and their largest distance from the node.
    fn far_enough(
        &self,
        sources: &[Source<D, S::Place>],
        beside: &[(usize, f64)],
        count: usize,
    ) -> f64 {
        let graph = self.geodesics.graph();
        let entrances = sources.iter().flat_map(|source| {
            let list = self.geodesics.entrances(&source.node).into_iter();
            list.map(|(node, length)| (node, length + source.start as f32))
        });
        let entrances: Vec<(u32, f32)> = entrances.collect();
        // Upper bounds of the distances of the points at the nodes passed, the largest first. Only
        // as many are kept as it takes to hold `count` points.
        let mut held: BinaryHeap<Passed> = BinaryHeap::new();
        let (mut points, mut edge) = (0, 0.0_f64);
        let mut passed = vec![false; beside.len()];
        Distances::new(graph).search(
            graph,
            &entrances,
            |_| 0.0,
            |node, distance| {
                let (here, reach) = beside[node as usize];
                if here > 0 && !std::mem::replace(&mut passed[node as usize], true) {
                    let bound = f64::from(distance) + ARC_OVER_CHORD * reach;
                    held.push(Passed {
                        bound,
                        points: here,
                    });
                    points += here;
                    edge = edge.max(self.ground.spacing[node as usize]);
                    while let Some(farthest) = held.peek() {
                        if points - farthest.points < count {
                            break;
                        }
                        points -= farthest.points;
                        held.pop();
                    }
                }
                match held.peek() {
                    Some(farthest) if points >= count => farthest.bound as f32,
                    _ => f32::INFINITY,
                }
            },
        );
        match held.peek() {
            Some(farthest) if points >= count => farthest.bound + FIELD_MARGIN * edge,
            _ => f64::INFINITY,
        }
    }
}

/// Points beside a node that the search along the graph has passed.
struct Passed {
    /// An upper bound of the distances of these points.
    bound: f64,
    /// The number of these points.
    points: usize,
}

impl PartialEq for Passed {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Passed {}

impl Ord for Passed {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let order = self.bound.total_cmp(&other.bound);
        order.then(self.points.cmp(&other.points))
    }
}

impl PartialOrd for Passed {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl<const D: usize, S: Guide<D>> Fields<'_, D, S> {
    /// The field of [`nearest_of`](Self::nearest_of) for the points of the cloud. Costs also end
    /// there, because their march passes points in the order of cost. On a surface that is no
    /// atlas, which has no points, it is the field of [`from`](Self::from).
    ///
    /// # Errors
    /// The same errors as [`from`](Self::from).
    pub fn nearest<'s>(
        &self,
        sources: impl Into<Sources<'s, D, S::Place>>,
        count: usize,
        settings: &Settings,
    ) -> Result<Field<D>, Error>
    where
        S::Place: 's,
    {
        let sources = sources.into().simplified();
        if let Some(net) = &self.ground.net {
            return self.by_cost(net, sources, count, settings);
        }
        let Some(atlas) = self.geodesics.surface().atlas() else {
            return self.from(sources, settings);
        };
        let nodes = &self.geodesics.graph().nodes;
        let points = atlas.cloud().points.iter().enumerate().map(|(i, x)| {
            let owner = atlas.owner(i);
            (owner, (x - nodes[owner as usize].point).norm())
        });
        self.up_to(sources, points, count, settings)
    }
}

#[cfg(test)]
mod tests {
    use super::least;

    #[test]
    fn the_least_come_in_order_and_ties_by_index() {
        let far = f64::INFINITY;
        let distances = [3.0, 1.0, far, 1.0, 2.0, f64::NAN, 1.0];
        assert_eq!(least(&distances, 0), [0_usize; 0]);
        assert_eq!(least(&distances, 2), [1, 3]);
        assert_eq!(least(&distances, 4), [1, 3, 6, 4]);
        assert_eq!(least(&distances, 9), [1, 3, 6, 4, 0]);
    }
}
