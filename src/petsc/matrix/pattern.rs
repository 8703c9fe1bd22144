//! The pattern of a sparse matrix.

use crate::by_number;

/// The positions of the entries in the rows of a rank, in compressed sparse rows (CSR): row i has the global
/// columns `columns[starts[i]..starts[i + 1]]`, increasing.
pub struct Pattern {
    pub(super) starts: Vec<i32>,
    pub(super) columns: Vec<i32>,
}

impl Pattern {
    /// The pattern with `rows` rows from the row and the global column of each entry. The order is free, and
    /// entries may repeat.
    pub fn new(rows: usize, entries: impl Iterator<Item = (usize, i32)> + Clone) -> Self {
        let (first, mut all) = by_number(rows, entries);
        let (mut starts, mut columns) = (vec![0], Vec::new());
        for span in first.windows(2) {
            let row = &mut all[span[0]..span[1]];
            row.sort_unstable();
            columns.extend(row.chunk_by(|a, b| a == b).map(|same| same[0]));
            starts.push(columns.len() as i32);
        }
        Self { starts, columns }
    }

    /// The number of entries.
    pub fn entries(&self) -> usize {
        self.columns.len()
    }

    /// The position of an entry.
    pub fn position(&self, row: usize, column: i32) -> Option<usize> {
        let [start, end] = [row, row + 1].map(|row| self.starts[row] as usize);
        let place = self.columns[start..end].iter().position(|other| *other == column);
        place.map(|place| start + place)
    }

    /// The pattern in which every entry becomes a block of 2×2 entries.
    pub fn of_blocks(&self) -> Self {
        let (mut starts, mut columns) = (vec![0], Vec::with_capacity(4 * self.entries()));
        for span in self.starts.windows(2) {
            let row = &self.columns[span[0] as usize..span[1] as usize];
            for _ in 0..2 {
                columns.extend(row.iter().flat_map(|column| [2 * column, 2 * column + 1]));
                starts.push(columns.len() as i32);
            }
        }
        Self { starts, columns }
    }

    /// The positions in [`Self::of_blocks`] at which the two rows of a block begin. The block belongs to the
    /// entry in `row` at `position`.
    pub fn rows_of_block(&self, row: usize, position: usize) -> [usize; 2] {
        let [start, end] = [row, row + 1].map(|row| self.starts[row] as usize);
        let first = 2 * (start + position);
        [first, first + 2 * (end - start)]
    }
}
