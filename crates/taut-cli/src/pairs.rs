//! Ends located on a surface, and the paths between them.

use taut::End;
use taut::kind::{self, Located};
use taut::size::coordinates;
use taut_core::result::Path;
use taut_core::surface::{Node, Surface};
use taut_core::{correction, parallel};

use crate::answer::{Answer, FoundPath, LocatedEnd, Outcome, Place};
use crate::exit::Failure;
use crate::located::refused;
use crate::ready::Ready;

/// What to ask of every pair.
#[derive(Default)]
pub struct Request {
    pub correction: correction::Settings,
    /// Further paths besides the shortest, at most.
    pub alternatives: usize,
}

/// Ends on a surface.
pub struct Ends<'a, const D: usize> {
    ready: &'a Ready<'a, D>,
    /// As the user named them.
    named: &'a [End],
    /// Their nodes and how far they were moved there, or why they have none.
    located: Vec<Result<Located<D>, String>>,
    /// What speaks against all answers on the surface, in sentences.
    doubts: Vec<String>,
}

impl<'a, const D: usize> Ends<'a, D> {
    pub fn new(ready: &'a Ready<'a, D>, named: &'a [End]) -> Self {
        Self {
            located: parallel::map(named.len(), |i| ready.find(&named[i])),
            doubts: ready.geodesics.surface().doubts(),
            ready,
            named,
        }
    }

    /// The nodes of the ends, or why one cannot be used.
    pub fn nodes(&self) -> Result<Vec<Node<D, kind::Place<D>>>, Failure> {
        let node = |(end, located): (&End, &Result<Located<D>, String>)| match located {
            Ok((node, _)) => Ok(*node),
            Err(reason) => Err(refused(end, reason.clone())),
        };
        self.named.iter().zip(&self.located).map(node).collect()
    }

    /// Finds the paths between two of the ends.
    pub fn answer(&self, pair: [usize; 2], request: &Request) -> Answer {
        let mut paths = match pair.map(|end| &self.located[end]) {
            [Ok((from, _)), Ok((to, _))] => self.paths(from, to, request),
            _ => vec![FoundPath {
                outcome: Outcome::UnusableEnd,
                ..self.ready.found(&Path::none())
            }],
        };
        Answer {
            path: paths.remove(0),
            alternatives: paths,
            ends: pair.map(|end| self.end(end)),
            doubts: self.doubts.clone(),
        }
    }

    fn end(&self, end: usize) -> LocatedEnd {
        let surface = self.ready.geodesics.surface();
        let place = |(node, moved): Located<D>| Place {
            point: coordinates(&(node.point + surface.origin()), self.ready.dimension),
            moved,
            farthest: surface.farthest_point(&node),
            off: surface.spacings_off(&node, moved),
        };
        LocatedEnd {
            named: self.named[end].clone(),
            place: self.located[end].clone().map(place),
        }
    }

    /// The shortest path between two nodes, and further ones if asked for.
    fn paths(
        &self,
        from: &Node<D, kind::Place<D>>,
        to: &Node<D, kind::Place<D>>,
        request: &Request,
    ) -> Vec<FoundPath> {
        let geodesics = &self.ready.geodesics;
        let mut paths = match request.alternatives {
            0 => vec![geodesics.path(from, to, &request.correction)],
            more => geodesics.alternatives(from, to, &request.correction, more + 1),
        };
        if paths.is_empty() {
            paths.push(Path::none());
        }
        paths.iter().map(|path| self.ready.found(path)).collect()
    }
}

impl<const D: usize> Ready<'_, D> {
    /// A path in the coordinates of the input.
    pub fn found(&self, path: &Path<D>) -> FoundPath {
        let surface = self.geodesics.surface();
        let mut found = FoundPath::new(path, &surface.origin(), self.dimension);
        found.surface_error = found
            .surface_error
            .filter(|_| surface.estimates_its_error());
        found
    }
}
