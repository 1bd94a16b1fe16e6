//! The paths of a table, block by block.

use std::ops::Range;

use taut::kind::{Kind, Place};
use taut_core::correction;
use taut_core::geodesics::{Geodesics, Origin};
use taut_core::parallel;
use taut_core::surface::Node;

use crate::answer::FoundPath;
use crate::exit::Failure;
use crate::matrix::plan::{Block, Plan};
use crate::progress::Progress;
use crate::ready::Ready;

/// What is to be found.
pub struct Work<'a> {
    pub plan: &'a Plan,
    /// The blocks that are left.
    pub blocks: Vec<Block>,
    pub correction: correction::Settings,
    pub progress: &'a Progress,
}

/// A pair of a table, by row and column, and the path found.
pub struct Entry {
    pub pair: [usize; 2],
    pub path: FoundPath,
}

pub type Keep<'a> = &'a mut dyn FnMut(&Block, Vec<Entry>) -> Result<(), Failure>;

/// Memory for the distances along the graph, in bytes.
const MEMORY: usize = 512 << 20;
/// What a node of the graph takes of it.
const NODE: usize = 8;

/// Finds the paths between nodes for all blocks that are left, and hands over each block when it is
/// done.
pub fn fill<const D: usize>(
    ready: &Ready<'_, D>,
    nodes: &[Node<D, Place<D>>],
    work: &Work<'_>,
    keep: Keep<'_>,
) -> Result<(), Failure> {
    let (rows, columns) = match work.plan.columns {
        None => (nodes, nodes),
        Some(_) => nodes.split_at(work.plan.rows),
    };
    match work.plan.radius {
        None => all(ready, [rows, columns], work, keep),
        Some(radius) => near(ready, [rows, columns], radius, work, keep),
    }
}

/// Every pair. Rows go in strips, as many as memory holds distances for; each strip meets all
/// columns, so that a column's distances are found once a strip.
fn all<const D: usize>(
    ready: &Ready<'_, D>,
    [rows, columns]: [&[Node<D, Place<D>>]; 2],
    work: &Work<'_>,
    keep: Keep<'_>,
) -> Result<(), Failure> {
    let Work { plan, progress, .. } = work;
    let geodesics = &ready.geodesics;
    let node_count: usize = geodesics.component_sizes().iter().sum();
    let strip_length = (MEMORY / (NODE * node_count)).max(1);
    let strip_of = |block: &Block| block.rows.start / strip_length;
    let mut blocks = work.blocks.clone();
    blocks.sort_unstable_by_key(|block| (strip_of(block), block.columns.start, block.rows.start));
    progress.count_to(blocks.iter().map(|block| plan.pairs(block).len()).sum());
    let mut across = Origins::none();
    for strip in blocks.chunk_by(|a, b| strip_of(a) == strip_of(b)) {
        let first = strip.iter().map(|block| block.rows.start).min();
        let last = strip.iter().map(|block| block.rows.end).max();
        let range = first.unwrap_or(0)..last.unwrap_or(0);
        let down = Origins::new(geodesics, rows, range);
        for block in strip {
            let here = plan.is_symmetric() && down.has(&block.columns);
            if !here && !across.has(&block.columns) {
                across = Origins::new(geodesics, columns, block.columns.clone());
            }
            let across = if here { &down } else { &across };
            let pairs = plan.pairs(block);
            let find = |i: usize| {
                let pair = pairs[i];
                let path = if rows[pair[0]].point == columns[pair[1]].point {
                    FoundPath::nowhere()
                } else {
                    let (from, to) = (down.of(pair[0]), across.of(pair[1]));
                    ready.found(&geodesics.path_between(from, to, &work.correction))
                };
                progress.done(1);
                Entry { pair, path }
            };
            keep(block, parallel::map(pairs.len(), find))?;
        }
    }
    Ok(())
}

/// The distances along the graph from some of many nodes.
struct Origins<const D: usize> {
    range: Range<usize>,
    origins: Vec<Origin<D, Place<D>>>,
}

impl<const D: usize> Origins<D> {
    fn none() -> Self {
        Self {
            range: 0..0,
            origins: Vec::new(),
        }
    }

    fn new(
        geodesics: &Geodesics<D, Kind<D>>,
        nodes: &[Node<D, Place<D>>],
        range: Range<usize>,
    ) -> Self {
        let chosen = &nodes[range.clone()];
        Self {
            range,
            origins: parallel::map(chosen.len(), |i| geodesics.origin(&chosen[i])),
        }
    }

    fn has(&self, range: &Range<usize>) -> bool {
        self.range.start <= range.start && range.end <= self.range.end
    }

    fn of(&self, index: usize) -> &Origin<D, Place<D>> {
        &self.origins[index - self.range.start]
    }
}

/// The pairs within a radius, and those whose length is unknown.
fn near<const D: usize>(
    ready: &Ready<'_, D>,
    [rows, columns]: [&[Node<D, Place<D>>]; 2],
    radius: f64,
    work: &Work<'_>,
    keep: Keep<'_>,
) -> Result<(), Failure> {
    let Work { plan, progress, .. } = work;
    let geodesics = &ready.geodesics;
    progress.count_to(work.blocks.iter().map(|block| block.rows.len()).sum());
    for block in &work.blocks {
        let beside = |row: usize| -> Vec<[usize; 2]> {
            let i = block.rows.start + row;
            let first = if plan.is_symmetric() { i + 1 } else { 0 };
            let found = geodesics.maybe_within(&rows[i], &columns[first..], radius);
            found.into_iter().map(|j| [i, first + j]).collect()
        };
        let pairs = parallel::map(block.rows.len(), beside).concat();
        let find = |i: usize| {
            let pair = pairs[i];
            let [from, to] = [&rows[pair[0]], &columns[pair[1]]];
            if from.point == to.point {
                let path = FoundPath::nowhere();
                return Some(Entry { pair, path });
            }
            let path = geodesics.path(from, to, &work.correction);
            let wanted = path.length <= radius || path.length.is_nan();
            wanted.then(|| Entry {
                pair,
                path: ready.found(&path),
            })
        };
        let entries = parallel::map(pairs.len(), find);
        keep(block, entries.into_iter().flatten().collect())?;
        progress.done(block.rows.len());
    }
    Ok(())
}
