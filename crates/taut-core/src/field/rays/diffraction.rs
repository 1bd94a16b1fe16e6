//! Diffraction round rims (the boundary of the surface), into the shadow of holes and notches.
//!
//! A ray that grazes a rim goes on along it, from one corner (a point at the rim) to the next. At
//! each corner rays leave that turn no farther than the way along the rim itself does. This is the
//! taut string round an obstacle, whose distances are those of its corners (geometrical theory of
//! diffraction: J. B. Keller, Journal of the Optical Society of America 52, 1962).

use std::collections::BinaryHeap;

use crate::Vector;
use crate::field::plane::{norm, turned_by};
use crate::field::rays::carry::Waiting;
use crate::field::rays::fan::{Bundle, Fan, Graze, Sample};
use crate::field::rays::frame::{Frame, ON_SURFACE};
use crate::field::rays::jet::Heading;
use crate::field::rays::ray::{self, Limits};
use crate::field::sources::{RayOrigin, nearest_entrance};
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::graph::Graph;
use crate::parallel;
use crate::surface::atlas::Lists;
use crate::surface::atlas::rim::DISC_SPACINGS;
use crate::surface::{Geometry, Node};

/// How far points at the rim of a random sample lie short of the true rim on average, in spacings
/// of the points, where a taut string rests on them (measured on round holes of 10 to 60 spacings:
/// 0.45 to 0.75).
const SHORT_OF_BOUNDARY: f64 = 0.65;
/// Longest step along the rim, in spacings of the graph's nodes.
const LONGEST_STEP_ALONG: f64 = 3.0;
/// How much deeper beyond the rim a step may lie than its ends do and than the discs that make the
/// rim sink between them, in spacings of the points.
const DEPTH_SLACK: f64 = 0.1;
/// Largest distance between two points at the rim, in spacings of the points, for which the discs
/// are taken to sink between them.
const WIDEST_SAG: f64 = 4.0;
/// Shares of a step along the rim at which its depth beyond the rim is looked at.
const DEPTH_LOOKS: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// How much longer a way along the rim may be than nearby rays say, in spacings of the graph's
/// nodes, to be of use. The slack is there because those rays may look a little way into the
/// shadow.
const LIT: f64 = 1.0;
/// Improvements of a way along the rim below this share of the nodes' spacing are not made.
const LEAST_GAIN: f64 = 0.01;
/// How uncertain the place of the rim is, in spacings of the graph's nodes, for each radian that a
/// way turns round it.
const DOUBT_OF_TURN: f64 = 0.6;
/// How much shorter rays diffracted at dents of a rough rim must be than straight rays to be
/// believed, in spacings of the graph's nodes.
const DENT_GAIN: f64 = 0.5;
/// How far rays also turn to the side away from the rim, in radians: what lies ahead on a rough rim
/// may end all the other rays.
const TURN_AWAY: f64 = 0.3;
/// Most rims, one behind the other, that a way may be diffracted at.
const MOST_DIFFRACTIONS: usize = 64;

/// A corner: a place at the rim where ways may turn.
struct Corner<const D: usize, P> {
    node: Node<D, P>,
    frame: Frame<D>,
    /// The nearest node of the graph.
    near: u32,
    /// The spacing of the points there, in the input's units.
    spacing: f64,
}

/// The rims of a surface, as a graph of the corners on them.
pub(crate) struct Rims<const D: usize, P> {
    corners: Vec<Corner<D, P>>,
    /// For each node of the graph, the corners whose nearest node it is.
    by_node: Lists,
    /// For each corner, the corners that straight steps from it lead to.
    beside: Lists,
    /// Whether each node of the graph is near a rim; empty where the surface has no rim.
    pub nodes: Vec<bool>,
}

/// How a corner, or a place where a ray grazes the rim, is reached.
#[derive(Clone, Copy)]
struct Reached<const D: usize> {
    distance: f64,
    /// Unit direction in which the way arrives.
    direction: Vector<D>,
    /// Error of the distance because the place of the rim is uncertain, in the input's units.
    doubt: f64,
    /// The angle at which the way's ray left the source, in radians.
    angle: f64,
    /// The source that the way comes from.
    source: u32,
    /// The place that the last step of the way came from.
    from: Start,
}

/// The start of a step along the rim: a place where a ray grazes it, or a corner.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Start {
    Graze(u32),
    Corner(u32),
}

/// A place that steps along the rim start from.
struct Diffraction<'a, const D: usize, P> {
    node: Node<D, P>,
    frame: &'a Frame<D>,
    near: u32,
    reached: Reached<D>,
}

/// A place where a ray grazes the rim, with the doubt of the way to it and the way's source.
pub(crate) struct Grazed<const D: usize, P> {
    pub graze: Graze<D, P>,
    pub doubt: f64,
    pub source: u32,
}

impl<const D: usize, P: Copy + Send + Sync> Rims<D, P> {
    pub fn none() -> Self {
        Self {
            corners: Vec::new(),
            by_node: Lists::default(),
            beside: Lists::default(),
            nodes: Vec::new(),
        }
    }

    /// Finds the corners of a surface and the steps between them. O(m) in the points at the rim.
    pub fn new<S: Guide<D, Place = P>>(geodesics: &Geodesics<D, S>, spacing: &[f64]) -> Self {
        let (surface, graph) = (geodesics.surface(), geodesics.graph());
        let rim = surface.rim();
        let corner = |geometry: &mut Geometry<D>, i: usize| {
            let (node, outward, spacing) = rim[i];
            let mut place = node.place;
            // Points at the rim of a sample end short of the surface, so the corner is moved
            // outwards.
            let x: Vector<D> = node.point + outward * (SHORT_OF_BOUNDARY * spacing);
            let point = surface.foot(&x, &mut place, geometry)?;
            let frame = super::frame(surface, &Node { point, place }, geometry)?;
            let (entrance, _) = nearest_entrance(&geodesics.entrances(&node))?;
            Some(Corner {
                near: ray::nearest(graph, &node.point, entrance),
                node: Node { point, place },
                frame,
                spacing,
            })
        };
        let scratch = || Geometry::new(D - surface.intrinsic_dimension());
        let found = parallel::map_with(rim.len(), scratch, corner);
        let corners: Vec<Corner<D, P>> = found.into_iter().flatten().collect();
        if corners.is_empty() {
            return Self::none();
        }
        let by_node = super::by_node(corners.iter().map(|c| c.near), graph.nodes.len());
        let nodes = (0..graph.nodes.len() as u32)
            .map(|node| around(graph, node).any(|n| !by_node.of(n).is_empty()))
            .collect();
        let mut rims = Self {
            corners,
            by_node,
            beside: Lists::default(),
            nodes,
        };
        let beside = parallel::map(rims.corners.len(), |i| {
            let corner = &rims.corners[i];
            let reach = LONGEST_STEP_ALONG * spacing[corner.near as usize];
            let from = (&corner.node, &corner.frame, corner.near);
            let mut others = rims.steps(surface, graph, from, reach);
            others.retain(|j| *j as usize != i);
            others
        });
        rims.beside = Lists::new(beside.iter().map(|list| list.iter().copied()));
        rims
    }

    /// The corners that straight steps along the surface from a node lead to, not longer than
    /// `reach`.
    fn steps<S: Guide<D, Place = P>>(
        &self,
        surface: &S,
        graph: &Graph<D, P>,
        (node, frame, near): (&Node<D, P>, &Frame<D>, u32),
        reach: f64,
    ) -> Vec<u32> {
        let passes = |to: &Corner<D, P>| {
            let spacing = to.spacing;
            // Between two points that it touches, a disc sinks deeper.
            let half = 0.5 * ((to.node.point - node.point).norm() / spacing).min(WIDEST_SAG);
            let sunk = DISC_SPACINGS - (DISC_SPACINGS * DISC_SPACINGS - half * half).sqrt();
            let deepest = (SHORT_OF_BOUNDARY + DEPTH_SLACK + sunk) * spacing;
            DEPTH_LOOKS.iter().all(|t| {
                let x = node.point + (to.node.point - node.point) * *t;
                let depth = |place| surface.beyond_rim(&x, place).map_or(0.0, |d| d.0);
                depth(node.place).max(depth(to.node.place)) <= deepest
            })
        };
        // The straight way between two nodes may cross a rim where the way between two corners does
        // not.
        let mut nodes: Vec<u32> = around(graph, near).flat_map(|n| around(graph, n)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let near = nodes.iter().flat_map(|n| self.by_node.of(*n));
        let reached = near.filter(|i| {
            let to = &self.corners[**i as usize];
            norm(frame.log(&to.node.point, ON_SURFACE)) <= reach && passes(to)
        });
        reached.copied().collect()
    }

    /// The jets of the rays that are diffracted at the rims where other rays graze them. `lit` says
    /// how far rays say that a place near a node is; `limits` says where rays end that start at a
    /// distance.
    pub fn diffracted<'a, S: Guide<D, Place = P>>(
        &self,
        surface: &S,
        mut grazed: Vec<Grazed<D, P>>,
        lit: impl Fn(&Frame<D>, u32) -> f64,
        reachable: usize,
        limits: impl Fn(f64) -> Limits<'a, D, P> + Sync,
    ) -> Vec<(Sample<D>, u32)>
    where
        P: 'a,
    {
        let mut samples = Vec::new();
        let mut reached: Vec<Option<Reached<D>>> = vec![None; self.corners.len()];
        let mut open: Vec<Option<f64>> = vec![None; self.corners.len()];
        // Each round follows the rims from where rays graze them, and shoots rays from the places
        // that ways lead on from. Where these rays graze further rims, the next round begins.
        for _ in 0..MOST_DIFFRACTIONS {
            if grazed.is_empty() {
                break;
            }
            let mut lit = |i: usize| {
                let corner = &self.corners[i];
                *open[i].get_or_insert_with(|| lit(&corner.frame, corner.near))
            };
            let places = limits(0.0);
            let turns = self.along(surface, &grazed, &mut reached, &mut lit, &places);
            let fans = parallel::map(turns.len(), |i| {
                let (start, sector) = turns[i];
                let diffraction = self.diffraction(start, &grazed, &reached);
                let at = diffraction.reached;
                let [x, y] = diffraction.frame.coordinates(&at.direction);
                let ahead = y.atan2(x);
                let unsure = DOUBT_OF_TURN * places.spacing[diffraction.near as usize];
                let doubt = |angle: f64| at.doubt + unsure * turned_by(ahead, angle).abs();
                let origin = RayOrigin {
                    node: &diffraction.node,
                    frame: diffraction.frame,
                    near: diffraction.near,
                    start: at.distance,
                };
                let angles = Some(sector.map(|turn| ahead + turn));
                let bundle = Bundle::of_point(&origin, angles);
                let fan = Fan::new(surface, &bundle, reachable, &limits(at.distance));
                let mut samples = fan.samples();
                for sample in &mut samples {
                    let doubt = doubt(sample.jet.heading.angle);
                    sample.surface_error += doubt;
                    sample.doubt = doubt + DENT_GAIN * places.spacing[sample.near as usize];
                    // All rays from here left the source as the ray that grazed the rim did.
                    sample.jet.heading = Heading::same(at.angle);
                }
                let grazes = fan.grazes().into_iter().map(|graze| Grazed {
                    doubt: doubt(graze.angle),
                    graze: Graze {
                        angle: at.angle,
                        ..graze
                    },
                    source: at.source,
                });
                (samples, grazes.collect::<Vec<_>>(), at.source)
            });
            grazed = Vec::new();
            for (found, grazes, source) in fans {
                samples.extend(found.into_iter().map(|sample| (sample, source)));
                grazed.extend(grazes);
            }
        }
        samples
    }

    /// The place that a step along the rim starts from, with how it is reached.
    fn diffraction<'a>(
        &'a self,
        start: Start,
        grazed: &'a [Grazed<D, P>],
        reached: &[Option<Reached<D>>],
    ) -> Diffraction<'a, D, P> {
        match start {
            Start::Graze(i) => {
                let Grazed {
                    graze,
                    doubt,
                    source,
                } = &grazed[i as usize];
                let knot = &graze.knot;
                Diffraction {
                    node: Node {
                        point: knot.frame.point,
                        place: knot.place,
                    },
                    frame: &knot.frame,
                    near: knot.near,
                    reached: Reached {
                        distance: graze.distance,
                        direction: knot.frame.tangents[0],
                        doubt: *doubt,
                        angle: graze.angle,
                        source: *source,
                        from: start,
                    },
                }
            }
            Start::Corner(i) => {
                let corner = &self.corners[i as usize];
                let direction = corner.frame.tangents[0];
                let never = Reached {
                    distance: f64::INFINITY,
                    direction,
                    doubt: 0.0,
                    angle: 0.0,
                    source: u32::MAX,
                    from: start,
                };
                Diffraction {
                    node: corner.node,
                    frame: &corner.frame,
                    near: corner.near,
                    reached: reached[i as usize].unwrap_or(never),
                }
            }
        }
    }

    /// Finds the ways along the rim from where rays graze it, in the order of distance (Dijkstra).
    /// For each place that a way leads on from, the answer holds the angles to the direction of
    /// arrival between which rays turn there.
    fn along<S: Guide<D, Place = P>>(
        &self,
        surface: &S,
        grazed: &[Grazed<D, P>],
        reached: &mut [Option<Reached<D>>],
        lit: &mut impl FnMut(usize) -> f64,
        limits: &Limits<D, P>,
    ) -> Vec<(Start, [f64; 2])> {
        let mut heap = BinaryHeap::new();
        let mut touched: Vec<u32> = Vec::new();
        let mut offer = |start: Start,
                         to: u32,
                         reached: &mut [Option<Reached<D>>],
                         heap: &mut BinaryHeap<Waiting>| {
            let i = to as usize;
            let corner = &self.corners[i];
            let spacing = limits.spacing[corner.near as usize];
            let diffraction = self.diffraction(start, grazed, reached);
            let v = diffraction.frame.log(&corner.node.point, ON_SURFACE);
            let distance = diffraction.reached.distance + norm(v);
            let known = reached[i].map_or(f64::INFINITY, |r| r.distance);
            let most = limits.longest.min(lit(i) + LIT * spacing);
            if distance > (known - LEAST_GAIN * spacing).min(most) {
                return;
            }
            let back = corner.frame.log(&diffraction.node.point, ON_SURFACE);
            let Some(direction) = corner.frame.vector(back).try_normalize(0.0) else {
                return;
            };
            let turn = turn(&diffraction, v).abs();
            let new = Reached {
                distance,
                direction: -direction,
                doubt: diffraction.reached.doubt + DOUBT_OF_TURN * spacing * turn,
                angle: diffraction.reached.angle,
                source: diffraction.reached.source,
                from: start,
            };
            reached[i] = Some(new);
            touched.push(to);
            heap.push(Waiting { distance, node: to });
        };
        // Rays that graze the rim offer distances to the corners within a step; shorter distances
        // replace longer ones until none changes.
        for (i, found) in (0..).zip(grazed) {
            let knot = &found.graze.knot;
            let node = Node {
                point: knot.frame.point,
                place: knot.place,
            };
            let reach = LONGEST_STEP_ALONG * limits.spacing[knot.near as usize];
            let from = (&node, &knot.frame, knot.near);
            for to in self.steps(surface, limits.graph, from, reach) {
                offer(Start::Graze(i), to, reached, &mut heap);
            }
        }
        while let Some(Waiting { distance, node }) = heap.pop() {
            if reached[node as usize].is_some_and(|r| r.distance < distance) {
                continue;
            }
            for to in self.beside.of(node) {
                offer(Start::Corner(node), *to, reached, &mut heap);
            }
        }
        // Only corners that were reached now are turned at; the rays from a place must cover all
        // the steps that lead on from it.
        touched.sort_unstable();
        touched.dedup();
        let mut turns: Vec<(Start, f64)> = touched
            .iter()
            .filter_map(|i| {
                let start = reached[*i as usize]?.from;
                let diffraction = self.diffraction(start, grazed, reached);
                let v = diffraction
                    .frame
                    .log(&self.corners[*i as usize].node.point, ON_SURFACE);
                Some((start, turn(&diffraction, v)))
            })
            .collect();
        turns.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let groups = turns.chunk_by(|a, b| a.0 == b.0);
        let sector = |group: &[(Start, f64)]| {
            let (first, last) = (group[0], group[group.len() - 1]);
            let lower = if first.1 < 0.0 { first.1 } else { -TURN_AWAY };
            (
                first.0,
                [lower, if last.1 > 0.0 { last.1 } else { TURN_AWAY }],
            )
        };
        groups.map(sector).collect()
    }
}

/// The angle from the direction in which a place is reached to a step from there, in radians.
fn turn<const D: usize, P>(diffraction: &Diffraction<D, P>, step: [f64; 2]) -> f64 {
    let [a, b] = diffraction
        .frame
        .coordinates(&diffraction.reached.direction);
    (a * step[1] - b * step[0]).atan2(a * step[0] + b * step[1])
}

/// A node of the graph and the nodes that its edges lead to.
fn around<const D: usize, P: Copy>(graph: &Graph<D, P>, node: u32) -> impl Iterator<Item = u32> {
    std::iter::once(node).chain(graph.edges(node).iter().map(|edge| edge.to))
}
