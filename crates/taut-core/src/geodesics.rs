//! Geodesics between points: first guesses on a graph, corrected to a tolerance.
//!
//! A query enters the graph from both ends, finds distinct short routes, and straightens each
//! roughly. The candidates that could still be the shortest are pulled taut to the tolerance. Where
//! the ends are nearly conjugate, rays find the shortest geodesic instead.

mod fan;
mod pairs;
pub(crate) mod ray;
mod runge_kutta;
mod shortest;

pub use pairs::{Guess, Origin};

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use crate::Vector;
use crate::correction::length::HeightErrors;
use crate::correction::newton::Solver;
use crate::correction::{self, Settings, Straight, Taut};
use crate::guess::Guide;
use crate::guess::dijkstra::Search;
use crate::guess::graph::Graph;
use crate::guess::landmarks::Landmarks;
use crate::guess::routes::{DETOUR, Route, Ways};
use crate::order::sort_by_number;
use crate::result::{Path, Status};
use crate::surface::{Geometry, Node};

/// A surface made ready for many path queries.
pub struct Geodesics<const D: usize, S: Guide<D>> {
    surface: S,
    graph: Graph<D, S::Place>,
    /// The component of each node of the graph.
    components: Vec<u32>,
    /// The number of nodes of each component.
    component_sizes: Vec<usize>,
    /// Landmarks on the graph. They are chosen for the first path, because distances everywhere
    /// need none.
    landmarks: OnceLock<Landmarks>,
    /// The largest coordinate of the graph's nodes, found for the first path.
    size: OnceLock<f64>,
    /// Memory that no query is using.
    idle: Mutex<Vec<Workspace<D, S::Place>>>,
}

/// The memory that a query uses.
struct Workspace<const D: usize, P> {
    search: Search,
    solver: Solver<D, P>,
}

/// Which geodesics between two nodes are looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sought {
    /// The shortest one.
    Shortest,
    /// Several ways round, at most this many.
    Several(usize),
}

impl Sought {
    /// The number of guesses that are looked at.
    fn guesses(self) -> usize {
        match self {
            Self::Several(most) => GUESSES + 3 * most,
            Self::Shortest => GUESSES,
        }
    }

    /// The largest length of guesses on the graph, as a multiple of that of the shortest.
    fn detour(self) -> f32 {
        match self {
            Self::Several(_) => 3.0,
            Self::Shortest => DETOUR,
        }
    }

    /// The largest length of straightened guesses that are pulled taut, as a multiple of that of
    /// the shortest.
    fn close(self) -> f64 {
        match self {
            Self::Several(_) => 3.0,
            Self::Shortest => CLOSE_GUESS,
        }
    }
}

/// Number of guesses that are looked at for the shortest path.
const GUESSES: usize = 8;
/// Number of guesses that are looked at where other ways are known to lead beside.
const FEW_GUESSES: usize = 4;
/// Largest length of straightened guesses that are pulled taut to the tolerance, as a multiple of
/// that of the shortest. Those that could still win by what pulling taut has changed so far are
/// pulled taut as well.
const CLOSE_GUESS: f64 = 1.01;
/// Largest distance between nodes, relative to the surface's size, at which the straight way
/// between them may be the path.
const NEAR_NODES: f64 = 1e-9;
/// Most that the surface may turn between near nodes, in radians, for the straight way to be the
/// path.
const FLAT_TURN: f64 = 1e-6;
/// Error of the length of a straight way, in roundings of the coordinates.
const ROUNDINGS: f64 = 16.0;
/// Least turning of a path, in radians, above which another way round the surface may be shorter
/// although the few samples of an equation make it longer.
const ROUND: f64 = 2.2;
/// Largest length of guesses, as a multiple of that of the shortest, that are looked at where a
/// path turns by more than [`ROUND`].
const DETOUR_ROUND: f32 = 1.3;
/// Largest length of straightened guesses that are pulled taut where a path turns by more than
/// [`ROUND`], as a multiple of that of the shortest.
const CLOSE_ROUND: f64 = 1.03;
/// Largest relative difference of length between two paths that also run together and so are one.
const SAME_LENGTH: f64 = 1e-4;

impl<const D: usize, S: Guide<D>> Geodesics<D, S> {
    pub(crate) fn with_graph(surface: S, graph: Graph<D, S::Place>) -> Self {
        let (components, component_sizes) = graph.components();
        Self {
            surface,
            graph,
            components,
            component_sizes,
            landmarks: OnceLock::new(),
            size: OnceLock::new(),
            idle: Mutex::new(Vec::new()),
        }
    }

    /// The same with its surface as another type: one that holds surfaces of several kinds is
    /// compiled once for all of them.
    #[must_use]
    pub fn into_kind<T>(self) -> Geodesics<D, T>
    where
        T: Guide<D, Place: From<S::Place>> + From<S>,
    {
        Geodesics {
            surface: self.surface.into(),
            graph: self.graph.into_kind(),
            components: self.components,
            component_sizes: self.component_sizes,
            landmarks: self.landmarks,
            size: self.size,
            idle: Mutex::new(Vec::new()),
        }
    }

    fn landmarks(&self) -> &Landmarks {
        self.landmarks
            .get_or_init(|| Landmarks::new(&self.graph, &self.components, &self.component_sizes))
    }

    /// The surface that paths are on.
    #[must_use]
    pub fn surface(&self) -> &S {
        &self.surface
    }

    /// The graph that first guesses are found on.
    pub(crate) fn graph(&self) -> &Graph<D, S::Place> {
        &self.graph
    }

    /// The number of graph nodes of each component of the surface, largest first.
    #[must_use]
    pub fn component_sizes(&self) -> &[usize] {
        &self.component_sizes
    }

    /// The component of each graph node.
    #[must_use]
    pub fn components(&self) -> &[u32] {
        &self.components
    }

    /// The shortest geodesic found between two nodes of the surface.
    ///
    /// It takes the best few distinct guesses that could still win, pulls each taut, and keeps the
    /// shortest.
    pub fn path(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        settings: &Settings,
    ) -> Path<D> {
        let paths = self.search(from, to, settings, Sought::Shortest);
        paths.into_iter().next().unwrap_or_else(Path::none)
    }

    /// Distinct paths, roughly taut, that could be the shortest between two nodes: polylines with
    /// their lengths to a few parts in a thousand, shortest first.
    pub(crate) fn rough_paths(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
    ) -> Vec<Taut<D, S::Place>> {
        let mut workspace = self.take_workspace();
        let Workspace { search, solver } = &mut workspace;
        let (start, end) = (self.entrances(from), self.entrances(to));
        let longest = DETOUR * search.one_to_many(&self.graph, &start, &end, DETOUR);
        let guesses = self.routes(from, to, FEW_GUESSES, longest, search);
        let straight = guesses
            .iter()
            .filter_map(|guess| correction::straighten(&self.surface, guess, solver));
        let mut all: Vec<Taut<D, S::Place>> = straight.map(|straight| straight.taut).collect();
        self.put_back(workspace);
        sort_by_number(&mut all, Taut::length);
        let mut kept: Vec<Taut<D, S::Place>> = Vec::new();
        for taut in all {
            let longest = kept
                .first()
                .map_or(f64::INFINITY, |first| CLOSE_GUESS * first.length());
            let is_new = !kept.iter().any(|other| other.runs_with(&taut, SAME_LENGTH));
            if is_new && taut.length() <= longest {
                kept.push(taut);
            }
        }
        kept
    }

    /// Up to `most` distinct geodesics, shortest first: one for each way round that was found, at
    /// most three times as long as the shortest.
    pub fn alternatives(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        settings: &Settings,
        most: usize,
    ) -> Vec<Path<D>> {
        let mut paths = self.search(from, to, settings, Sought::Several(most));
        paths.truncate(most);
        paths
    }

    /// The geodesics that are looked for between two nodes, shortest first.
    fn search(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        settings: &Settings,
        sought: Sought,
    ) -> Vec<Path<D>> {
        if let Some(path) = self.straight(from, to) {
            return vec![path];
        }
        let mut workspace = self.take_workspace();
        let Workspace { search, solver } = &mut workspace;
        let guesses = sought.guesses();
        let mut first = self.guesses(from, to, guesses, sought.detour(), search);
        let is_joined = !first.is_empty();
        let may_be = is_joined || self.is_unknown(self.entrance(from), self.entrance(to));
        if may_be {
            first.extend(self.surface.ways(from, to, is_joined));
        }
        let is_unknown = may_be && first.is_empty();
        let more = || self.guesses(from, to, guesses, DETOUR_ROUND, search);
        let mut paths = self.pull_taut(first, more, settings, sought, solver);
        self.put_back(workspace);
        if is_unknown {
            paths.push(Path::unknown());
        }
        paths
    }

    /// The straight way between two nodes of one sheet that are so near that the surface does not
    /// curve between them beyond rounding; `None` for other nodes.
    fn straight(&self, from: &Node<D, S::Place>, to: &Node<D, S::Place>) -> Option<Path<D>> {
        let chord = to.point - from.point;
        let length = chord.norm();
        let size = from.point.amax() + self.size();
        if length > NEAR_NODES * size || !self.same_sheet(from, to) {
            return None;
        }
        let rounding = ROUNDINGS * f64::EPSILON * size;
        let mut scratch = Geometry::new(D - self.surface.intrinsic_dimension());
        let mut normals = [Vector::zeros(); 2];
        let mut curvature = 0.0;
        for (node, normal) in [from, to].into_iter().zip(&mut normals) {
            if self.surface.geometry(&node.point, node.place, &mut scratch) {
                *normal = scratch.normal(0);
                let along = scratch.project(&chord);
                let off = (chord - along).norm();
                if let Some(tangent) = along.try_normalize(0.0) {
                    curvature = scratch.normal_curvature(&tangent).norm().max(curvature);
                }
                if off > rounding + FLAT_TURN * length {
                    return None;
                }
            } else if length > rounding {
                return None;
            }
        }
        if length > rounding && curvature * length > FLAT_TURN {
            return None;
        }
        let mut height_errors = HeightErrors::default();
        let (error, radius) = (
            self.surface.height_error(from.place),
            self.surface.resolution(from.place),
        );
        // Within a chart's radius all errors are the same one.
        height_errors.add(radius, curvature, error, radius);
        let of_chart = height_errors.length_error();
        Some(Path {
            status: Status::Converged,
            length,
            length_error: rounding.min(length),
            surface_error: if radius > 0.0 {
                of_chart / radius * length
            } else {
                0.0
            },
            stable: true,
            points: vec![from.point, to.point],
            normals: normals.to_vec(),
            arc_length: vec![0.0, length],
            ..Path::none()
        })
    }

    /// Whether both nodes lie beside one node of the graph.
    fn same_sheet(&self, from: &Node<D, S::Place>, to: &Node<D, S::Place>) -> bool {
        let (start, end) = (self.entrances(from), self.entrances(to));
        let mut shared = start.iter();
        start.is_empty() || shared.any(|one| end.iter().any(|other| other.0 == one.0))
    }

    /// The largest coordinate of the graph's nodes.
    fn size(&self) -> f64 {
        *self.size.get_or_init(|| {
            let nodes = self.graph.nodes.iter();
            nodes.map(|node| node.point.amax()).fold(0.0, f64::max)
        })
    }

    fn take_workspace(&self) -> Workspace<D, S::Place> {
        let idle = self.locked_idle().pop();
        idle.unwrap_or_else(|| Workspace {
            search: Search::new(&self.graph),
            solver: Solver::new(D - self.surface.intrinsic_dimension()),
        })
    }

    fn put_back(&self, workspace: Workspace<D, S::Place>) {
        self.locked_idle().push(workspace);
    }

    fn locked_idle(&self) -> MutexGuard<'_, Vec<Workspace<D, S::Place>>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The distinct geodesics that the guesses lead to, shortest first; `more` gives the same
    /// guesses with longer ones after them.
    fn pull_taut(
        &self,
        mut guesses: Vec<Vec<Node<D, S::Place>>>,
        more: impl FnOnce() -> Vec<Vec<Node<D, S::Place>>>,
        settings: &Settings,
        sought: Sought,
        solver: &mut Solver<D, S::Place>,
    ) -> Vec<Path<D>> {
        let shortest_only = !matches!(sought, Sought::Several(_));
        let mut close = sought.close();
        let mut straight: Vec<Straight<D, S::Place>> = Vec::new();
        let mut rays = None;
        let mut more = shortest_only.then_some(more);
        let mut next = 0;
        while let Some(guess) = guesses.get(next) {
            next += 1;
            let Some(found) = correction::straighten(&self.surface, guess, solver) else {
                continue;
            };
            // Where the ends are nearly conjugate, or a tip lies beside the way, guesses do not
            // tell apart ways that differ by little, but rays do.
            let is_unsure = || {
                shortest::nearly_conjugate(&self.surface, guess, found.spread)
                    || self.surface.passes_tip(guess)
            };
            if rays.is_none() && is_unsure() {
                let known = found.taut.length();
                let shot = shortest::by_rays(&self.surface, guess, known, settings, solver);
                if shortest_only && shot.proves_shortest() {
                    return shot.best_first();
                }
                rays = Some(shot);
            }
            let on_samples = self.surface.resolution(guess[0].place) == 0.0;
            if found.turning() > ROUND
                && on_samples
                && let Some(more) = more.take()
            {
                close = CLOSE_ROUND;
                guesses.extend(more().into_iter().skip(guesses.len()));
            }
            straight.push(found);
        }
        sort_by_number(&mut straight, |straight| straight.taut.length());
        let Some(shortest) = straight.first().map(|first| first.taut.length()) else {
            // Where there are guesses the points are connected, even if by none that can be
            // followed.
            return guesses.first().map(|_| Path::lost()).into_iter().collect();
        };
        let mut rays = rays.unwrap_or_default();
        let mut paths: Vec<Path<D>> = std::mem::take(&mut rays.paths);
        let mut kept: Vec<Taut<D, S::Place>> = Vec::new();
        let mut longest = close * shortest;
        let mut change: f64 = 0.0;
        for candidate in straight {
            let taut = &candidate.taut;
            let straight_length = taut.length();
            let usable = paths.iter().any(|path| path.status != Status::OffSurface);
            if usable && straight_length > longest {
                break;
            }
            if kept.iter().any(|other| other.runs_with(taut, SAME_LENGTH)) {
                continue;
            }
            kept.push(taut.clone());
            let path = correction::tighten(&self.surface, candidate, settings, solver);
            if straight_length > 0.0 {
                change = change.max((path.length / straight_length - 1.0).abs());
            }
            let best = paths.iter().map(|p| p.length).fold(path.length, f64::min);
            longest = longest.max((1.0 + change) * best);
            if !paths.iter().any(|other| other.is_same(&path)) {
                paths.push(path);
            }
        }
        rays.merge(paths);
        if settings.prove_shortest {
            rays.prove(&self.surface, &guesses[0], settings, solver);
        }
        rays.best_first()
    }

    /// The nodes of the graph that a node is joined to, with the lengths of the joins.
    pub(crate) fn entrances(&self, node: &Node<D, S::Place>) -> Vec<(u32, f32)> {
        let mut list = Vec::new();
        self.surface.entrances(node, &mut |i| {
            let length = (self.graph.nodes[i as usize].point - node.point).norm();
            list.push((i, length as f32));
        });
        list
    }

    /// A node of the graph that a node is joined to.
    fn entrance(&self, node: &Node<D, S::Place>) -> Option<u32> {
        self.entrances(node).first().map(|entrance| entrance.0)
    }

    /// Whether something may connect two parts of the surface that the graph does not join.
    pub(crate) fn is_unknown(&self, from: Option<u32>, to: Option<u32>) -> bool {
        let component = |node: Option<u32>| node.map(|node| self.components[node as usize]);
        let is_one = component(from).is_some() && component(from) == component(to);
        !is_one && !self.surface.apart(from, to)
    }

    /// Distinct guesses, shortest on the graph first; none where nothing connects the two nodes.
    fn guesses(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        most: usize,
        detour: f32,
        search: &mut Search,
    ) -> Vec<Vec<Node<D, S::Place>>> {
        let (start, end) = (self.entrances(from), self.entrances(to));
        let longest =
            detour * search.both_ways(&self.graph, self.landmarks(), &start, &end, detour);
        self.routes(from, to, most, longest, search)
    }

    /// The distinct guesses from the distances to both ends, at most `longest` on the graph.
    fn routes(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        most: usize,
        longest: f32,
        search: &Search,
    ) -> Vec<Vec<Node<D, S::Place>>> {
        let (forward, backward) = (&search.forward, &search.backward);
        let ways = Ways {
            graph: &self.graph,
            through: |v| forward.distance(v) + backward.distance(v),
            before: |v| forward.previous(v),
            after: |v| backward.previous(v),
        };
        let routes = ways.routes(backward.reached(), most, longest);
        self.along(from, to, routes)
    }

    /// The guesses along routes from one node to another.
    fn along(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        routes: Vec<Route>,
    ) -> Vec<Vec<Node<D, S::Place>>> {
        routes
            .into_iter()
            .map(|route| {
                let inner = route.nodes.iter().map(|v| self.graph.nodes[*v as usize]);
                std::iter::once(*from)
                    .chain(inner)
                    .chain(std::iter::once(*to))
                    .collect()
            })
            .collect()
    }
}
