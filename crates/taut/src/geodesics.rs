//! Geodesics between points: first guesses on a graph, corrected to a tolerance.

mod fan;
mod pairs;
mod ray;
mod runge_kutta;
mod shortest;

pub use pairs::{Guess, Origin};

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use crate::correction::newton::Solver;
use crate::correction::{self, Settings, Straight, Taut};
use crate::guess::Guide;
use crate::guess::dijkstra::Search;
use crate::guess::graph::Graph;
use crate::guess::landmarks::Landmarks;
use crate::guess::routes::{DETOUR, Route, Ways};
use crate::result::{Path, Status};
use crate::surface::Node;

/// A surface made ready for many path queries.
pub struct Geodesics<const D: usize, S: Guide<D>> {
    surface: S,
    graph: Graph<D, S::Place>,
    components: Vec<u32>,
    component_sizes: Vec<usize>,
    /// Found for the first path: distances everywhere need none.
    landmarks: OnceLock<Landmarks>,
    /// Memory that no query is using.
    idle: Mutex<Vec<Workspace<D, S::Place>>>,
}

/// Memory of a query.
struct Workspace<const D: usize, P> {
    search: Search,
    solver: Solver<D, P>,
}

/// Guesses looked at for the shortest path.
const GUESSES: usize = 8;
/// Straightened guesses within this factor of the shortest are pulled taut to the tolerance, and those
/// that could still win by what pulling taut has changed so far.
const CLOSE: f64 = 1.01;
/// A path that turns by this much, in radians, may have another way round the surface that the few samples of an equation make
/// longer than it is: there detours up to this factor are looked at as well, and polylines within this one pulled taut.
const ROUND: f64 = 2.2;
const DETOUR_ROUND: f32 = 1.3;
const CLOSE_ROUND: f64 = 1.03;
/// Two paths of lengths this near, relative, that also run together are one.
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
            idle: Mutex::new(Vec::new()),
        }
    }

    fn landmarks(&self) -> &Landmarks {
        self.landmarks
            .get_or_init(|| Landmarks::new(&self.graph, &self.components, &self.component_sizes))
    }

    /// The surface.
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
    /// Takes the best few distinct guesses that could still win, pulls each taut, keeps the shortest.
    pub fn path(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        settings: &Settings,
    ) -> Path<D> {
        self.search(from, to, settings, GUESSES, DETOUR, CLOSE)
            .into_iter()
            .next()
            .unwrap_or_else(Path::none)
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
        let mut paths = self.search(from, to, settings, GUESSES + 3 * most, 3.0, 3.0);
        paths.truncate(most);
        paths
    }

    fn search(
        &self,
        from: &Node<D, S::Place>,
        to: &Node<D, S::Place>,
        settings: &Settings,
        guesses: usize,
        detour: f32,
        close: f64,
    ) -> Vec<Path<D>> {
        let mut workspace = self.take_workspace();
        let Workspace { search, solver } = &mut workspace;
        let first = self.guesses(from, to, guesses, detour, search);
        let more = || self.guesses(from, to, guesses, DETOUR_ROUND, search);
        let paths = self.pull_taut(first, more, settings, close, solver);
        self.put_back(workspace);
        paths
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

    /// The distinct geodesics that the guesses lead to, shortest first; `more` gives the same guesses and longer ones behind them.
    fn pull_taut(
        &self,
        mut guesses: Vec<Vec<Node<D, S::Place>>>,
        more: impl FnOnce() -> Vec<Vec<Node<D, S::Place>>>,
        settings: &Settings,
        mut close: f64,
        solver: &mut Solver<D, S::Place>,
    ) -> Vec<Path<D>> {
        let shortest_only = close == CLOSE;
        let mut straight: Vec<Straight<D, S::Place>> = Vec::new();
        let mut rays = None;
        let mut more = shortest_only.then_some(more);
        let mut next = 0;
        while let Some(guess) = guesses.get(next) {
            next += 1;
            let Some(found) = correction::straighten(&self.surface, guess, solver) else {
                continue;
            };
            // Where the ends are nearly conjugate, guesses do not tell apart ways that differ by little; rays do.
            if rays.is_none() && shortest::nearly_conjugate(&self.surface, guess, found.spread) {
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
        straight.sort_by(|a, b| a.taut.length().total_cmp(&b.taut.length()));
        let Some(shortest) = straight.first().map(|first| first.taut.length()) else {
            // Where there are guesses the points are connected, if by none that can be followed.
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

    /// The nodes of the graph that a point is joined to, and how long the joins are.
    pub(crate) fn entrances(&self, node: &Node<D, S::Place>) -> Vec<(u32, f32)> {
        let mut list = Vec::new();
        self.surface.entrances(node, &mut |i| {
            let length = (self.graph.nodes[i as usize].point - node.point).norm();
            list.push((i, length as f32));
        });
        list
    }

    /// Distinct guesses, shortest on the graph first; empty where none connects the two.
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
