//! Surfaces with the ends of paths located on them.

use taut::End;
use taut::kind::{Kind, Place};
use taut_core::geodesics::Geodesics;
use taut_core::result::Path;
use taut_core::surface::{Node, Surface};
use taut_core::{correction, parallel};

use crate::answer::FoundPath;
use crate::exit::Failure;

/// What to ask of every pair.
pub struct Request {
    pub correction: correction::Settings,
    /// Further paths besides the shortest, at most.
    pub alternatives: usize,
}

/// A surface of R^D made ready, and ends on it.
pub struct Located<const D: usize> {
    pub geodesics: Geodesics<D, Kind<D>>,
    /// Coordinates of a point.
    pub dimension: usize,
    pub ends: Vec<EndNode<D>>,
    /// What speaks against all answers on the surface, in sentences.
    pub doubts: Vec<String>,
}

/// An end as the user named it; its node and how far it was moved there, or why it has none.
pub struct EndNode<const D: usize> {
    pub named: End,
    pub located: Result<(Node<D, Place<D>>, f64), String>,
}

impl<const D: usize> Located<D> {
    /// Locates points of `dimension` coordinates; `rows_kept` are the file's rows that were read,
    /// where some were not.
    pub fn new(
        geodesics: Geodesics<D, Kind<D>>,
        dimension: usize,
        ends: Vec<End>,
        rows_kept: Option<&[usize]>,
    ) -> Self {
        let located = parallel::map(ends.len(), |i| {
            locate(geodesics.surface(), dimension, rows_kept, &ends[i])
        });
        let of = |(named, located)| EndNode { named, located };
        let ends = ends.into_iter().zip(located).map(of).collect();
        Self {
            doubts: geodesics.surface().doubts(),
            geodesics,
            dimension,
            ends,
        }
    }

    /// The nodes of the ends, or why one cannot be used.
    pub fn nodes(&self) -> Result<Vec<Node<D, Place<D>>>, Failure> {
        let node = |end: &EndNode<D>| match &end.located {
            Ok((node, _)) => Ok(*node),
            Err(reason) => Err(Failure::End {
                end: end.named.to_string(),
                reason: reason.clone(),
            }),
        };
        self.ends.iter().map(node).collect()
    }

    /// A path in the coordinates of the input.
    pub fn found(&self, path: &Path<D>) -> FoundPath {
        let surface = self.geodesics.surface();
        let mut found = FoundPath::new(path, &surface.origin(), self.dimension);
        found.surface_error = found
            .surface_error
            .filter(|_| surface.estimates_its_error());
        found
    }

    /// The shortest path between two nodes, and further ones if asked for.
    pub fn paths(
        &self,
        from: &Node<D, Place<D>>,
        to: &Node<D, Place<D>>,
        request: &Request,
    ) -> Vec<FoundPath> {
        let mut paths = match request.alternatives {
            0 => vec![self.geodesics.path(from, to, &request.correction)],
            more => self
                .geodesics
                .alternatives(from, to, &request.correction, more + 1),
        };
        if paths.is_empty() {
            paths.push(Path::none());
        }
        paths.iter().map(|path| self.found(path)).collect()
    }
}

/// The node of an end named for points of `dimension` coordinates, and how far it was moved there,
/// or why it has none; `rows_kept` are the file's rows that were read, where some were not.
pub fn locate<const D: usize>(
    surface: &Kind<D>,
    dimension: usize,
    rows_kept: Option<&[usize]>,
    end: &End,
) -> Result<(Node<D, Place<D>>, f64), String> {
    let located = match (end, rows_kept) {
        (End::Point(point), _) if point.len() != dimension => {
            return Err(format!(
                "found {} coordinates, expected {dimension}, as many as the points of the surface have",
                point.len()
            ));
        }
        (End::Row(row), Some(rows)) => surface.locate(&End::Row(row_read(*row, rows)?)),
        (end, _) => surface.locate(end),
    };
    located.map_err(|error| error.to_string())
}

/// The position of a file's row among those that were read.
fn row_read(row: usize, rows_kept: &[usize]) -> Result<usize, String> {
    rows_kept.binary_search(&row).map_err(|_| {
        "the row is not among those read (left out by --class, marked invalid, or past the end)"
            .to_owned()
    })
}
