//! Which pairs a table has, and which are found together.

use std::ops::Range;

/// Rows and columns of a block.
const EDGE: usize = 32;

/// A table of pairs of ends.
pub struct Plan {
    /// Number of ends that rows stand for, the first of all.
    pub rows: usize,
    /// Number of ends behind them that columns stand for, `None` where columns are the same as rows.
    pub columns: Option<usize>,
    /// Only pairs within this distance, in the input's units.
    pub radius: Option<f64>,
}

/// Some pairs of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Its number.
    pub index: usize,
    pub rows: Range<usize>,
    pub columns: Range<usize>,
}

impl Plan {
    pub fn shape(&self) -> [usize; 2] {
        [self.rows, self.columns.unwrap_or(self.rows)]
    }

    /// The distance from i to j is that from j to i, and found once.
    pub fn is_symmetric(&self) -> bool {
        self.columns.is_none()
    }

    /// All blocks. Within a radius few columns matter to a row, and a block has them all.
    pub fn blocks(&self) -> Vec<Block> {
        let [rows, columns] = self.shape();
        let width = self.radius.map_or(EDGE, |_| columns.max(1));
        let mut blocks: Vec<Block> = Vec::new();
        for first in (0..rows).step_by(EDGE) {
            let rows = first..(first + EDGE).min(rows);
            for first in (0..columns).step_by(width) {
                let columns = first..(first + width).min(columns);
                if self.is_symmetric() && columns.end <= rows.start {
                    continue;
                }
                blocks.push(Block {
                    index: blocks.len(),
                    rows: rows.clone(),
                    columns,
                });
            }
        }
        blocks
    }

    /// The pairs of a block that are found: above the diagonal where the table is symmetric.
    pub fn pairs(&self, block: &Block) -> Vec<[usize; 2]> {
        let all = block
            .rows
            .clone()
            .flat_map(|i| block.columns.clone().map(move |j| [i, j]));
        all.filter(|[i, j]| i < j || !self.is_symmetric()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_every_pair_once() {
        for (rows, columns) in [
            (1, None),
            (33, None),
            (70, None),
            (33, Some(65)),
            (2, Some(1)),
        ] {
            let plan = Plan {
                rows,
                columns,
                radius: None,
            };
            let blocks = plan.blocks();
            let mut pairs: Vec<_> = blocks.iter().flat_map(|block| plan.pairs(block)).collect();
            let expected = match columns {
                None => rows * (rows - 1) / 2,
                Some(columns) => rows * columns,
            };
            assert_eq!(pairs.len(), expected);
            pairs.sort_unstable();
            pairs.dedup();
            assert_eq!(pairs.len(), expected);
            assert!(
                (0..)
                    .zip(&blocks)
                    .all(|(index, block)| block.index == index)
            );
        }
    }
}
