//! Triangular solves with a supernodal Cholesky factor.
//!
//! L is a sequence of supernodes, consecutive columns with the same rows below their diagonal block (Ng and
//! Peyton, SIAM J. Sci. Comput. 14, 1993). Let a supernode have the diagonal block D and the rows B below it.
//! The forward solve computes y_s ← D⁻¹ y_s and then y_rows ← y_rows − B y_s. The backward solve goes from
//! the last supernode to the first: y_s ← D⁻ᵀ (y_s − Bᵀ y_rows).
//!
//! Reading L limits the speed of both, so L is stored in the order of reading. A supernode is cut into panels
//! of [`PANEL_WIDTH`] columns. A panel is cut into its triangle at the diagonal and tiles of [`TILE_HEIGHT`]
//! rows. The entries of y for a supernode are first gathered in a front: its own entries, padded to whole
//! panels, then those of the rows below.

use super::{
    cholmod::Cholmod,
    tiles::{DiagonalBlock, Number, PANEL_WIDTH, TILE_HEIGHT, Tile, subtract, transposed_product},
};
use nalgebra::{convert, convert_unchecked};

/// Solves with the first rows and columns of a factor and eliminates them from the others: see
/// [`Cholesky::solve`](super::Cholesky::solve).
pub(super) trait TriangularSolver {
    /// Frees the values. Solves need new values first.
    fn clear(&mut self);

    /// Takes the values of L₁₁ and L₂₁ supernode by supernode, its columns from the diagonal block down, and
    /// ignores entries above the diagonal. It frees the values of the factor meanwhile: two copies of L would
    /// be most of the memory of a run.
    fn take_values(&mut self, factor: &mut Cholmod);

    /// L₁₁ y₁ = (P b)₁; returns y₂ = (P b)₂ − L₂₁ y₁.
    fn forward(&mut self, b: &[f64]) -> Vec<f64>;

    /// L₁₁ᵀ (P x)₁ = y₁ − L₂₁ᵀ (P x)₂ for the y₁ of the last forward solve and (P x)₂ = `interface`.
    fn backward(&mut self, interface: &[f64], x: &mut [f64]);

    /// Both solves for two right sides, without an interface. They read L once: two take 1.3 times as long as one.
    fn solve_two(&mut self, b: [&[f64]; 2], x: [&mut [f64]; 2]);

    /// Bytes that a solve reads.
    fn bytes(&self) -> f64;
}

/// Consecutive columns of L with the same rows below their diagonal block.
struct Supernode {
    first: usize,
    columns: usize,
    /// The number of rows below the diagonal block.
    below: usize,
}

impl Supernode {
    fn panels(&self) -> usize {
        self.columns.div_ceil(PANEL_WIDTH)
    }

    /// Tiles from the top of the front to its end.
    fn front_height(&self) -> usize {
        (PANEL_WIDTH * self.panels() + self.below).div_ceil(TILE_HEIGHT)
    }

    /// The first tile of the front below a panel's triangle. It has zeros in rows of the triangle.
    fn first_tile(panel: usize) -> usize {
        PANEL_WIDTH * (panel + 1) / TILE_HEIGHT
    }

    /// Tiles of all panels.
    fn tiles(&self) -> usize {
        (0..self.panels()).map(|panel| self.front_height() - Self::first_tile(panel)).sum()
    }

    /// The position in the front of a row of the supernode.
    fn position(&self, row: usize) -> usize {
        if row < self.columns { row } else { row - self.columns + PANEL_WIDTH * self.panels() }
    }
}

/// L₁₁ and L₂₁ with entries `T`, in the order in which they are read.
pub(super) struct Supernodal<T> {
    /// P: the row of A of each row of L.
    permutation: Vec<u32>,
    supernodes: Vec<Supernode>,
    /// Per supernode: the rows below its diagonal block.
    rows: Vec<u32>,
    /// Per panel: the triangle at the diagonal.
    diagonal: Vec<DiagonalBlock<T>>,
    /// Per panel: the tiles below its triangle.
    tiles: Vec<Tile<T>>,
    /// The right sides. The second one has no entries before it is used.
    sides: [Side<T>; 2],
}

/// A right side and its solution.
struct Side<T> {
    /// P b, y or P x, divided by `scale`: the exponents of `f32` end at 10^±38.
    y: Vec<T>,
    scale: f64,
    front: Vec<[T; TILE_HEIGHT]>,
}

impl<T: Number> Side<T> {
    fn new(rows: usize, front: usize) -> Self {
        Self { y: vec![T::zero(); rows], scale: 0.0, front: vec![[T::zero(); TILE_HEIGHT]; front] }
    }

    /// y ← P `b`.
    fn set(&mut self, b: &[f64], permutation: &[u32]) {
        self.scale = b.iter().fold(f64::MIN_POSITIVE, |scale, b| scale.max(b.abs()));
        for (y, &row) in self.y.iter_mut().zip(permutation) {
            *y = convert(b[row as usize] / self.scale);
        }
    }

    /// P `x` ← y.
    fn write(&self, x: &mut [f64], permutation: &[u32]) {
        for (&y, &row) in self.y.iter().zip(permutation) {
            x[row as usize] = self.scale * convert_unchecked::<T, f64>(y);
        }
    }
}

impl<T: Number> Supernodal<T> {
    /// The first `interior` columns of an analysed factor, still without values.
    pub(super) fn new(factor: &Cholmod, interior: usize) -> Self {
        let (mut supernodes, mut below) = (Vec::new(), Vec::new());
        for (columns, rows, _) in factor.supernodes() {
            let (first, end) = (columns.start, interior.min(columns.end));
            if first < end {
                let rows = &rows[end - first..];
                supernodes.push(Supernode { first, columns: end - first, below: rows.len() });
                below.extend(rows.iter().map(|&row| row as u32));
            }
        }
        let panels = supernodes.iter().map(Supernode::panels).sum();
        let front = supernodes.iter().map(Supernode::front_height).max().unwrap_or(0);
        Self {
            permutation: factor.permutation().iter().map(|&row| row as u32).collect(),
            diagonal: vec![DiagonalBlock::identity(); panels],
            tiles: Vec::new(),
            sides: [Side::new(factor.permutation().len(), front), Side::new(0, front)],
            supernodes,
            rows: below,
        }
    }

    /// y₁ ← L₁₁⁻¹ y₁, y₂ ← y₂ − L₂₁ y₁ for the first `count` right sides. Each panel serves all of them while it is in the cache.
    fn solve_forward(&mut self, count: usize) {
        let (mut diagonal, mut tiles) = (&self.diagonal[..], &self.tiles[..]);
        let (mut rows, sides) = (&self.rows[..], &mut self.sides[..count]);
        for s in &self.supernodes {
            let own = s.first..s.first + s.columns;
            for Side { front, y, .. } in &mut *sides {
                let front = &mut front[..s.front_height()];
                front.fill([T::zero(); TILE_HEIGHT]);
                front.as_flattened_mut()[..s.columns].copy_from_slice(&y[own.clone()]);
            }
            let panels = diagonal.split_off(..s.panels()).unwrap_or_default();
            for (k, panel) in panels.iter().enumerate() {
                let first_tile = Supernode::first_tile(k);
                let below = tiles.split_off(..s.front_height() - first_tile).unwrap_or_default();
                for Side { front, .. } in &mut *sides {
                    let front = &mut front[..s.front_height()];
                    let head =
                        &mut front.as_flattened_mut()[PANEL_WIDTH * k..PANEL_WIDTH * (k + 1)];
                    let solved = panel.forward(head);
                    head.copy_from_slice(&solved);
                    subtract(&mut front[first_tile..], below, solved);
                }
            }
            let below = rows.split_off(..s.below).unwrap_or_default();
            for Side { front, y, .. } in &mut *sides {
                let front = front[..s.front_height()].as_flattened();
                y[own.clone()].copy_from_slice(&front[..s.columns]);
                for (&row, &change) in below.iter().zip(&front[PANEL_WIDTH * s.panels()..]) {
                    y[row as usize] += change;
                }
            }
        }
    }

    /// y₁ ← L₁₁⁻ᵀ (y₁ − L₂₁ᵀ y₂) for the first `count` right sides.
    fn solve_backward(&mut self, count: usize) {
        let (mut diagonal, mut tiles) = (&self.diagonal[..], &self.tiles[..]);
        let (mut rows, sides) = (&self.rows[..], &mut self.sides[..count]);
        for s in self.supernodes.iter().rev() {
            let own = s.first..s.first + s.columns;
            let below = rows.split_off(rows.len() - s.below..).unwrap_or_default();
            for Side { front, y, .. } in &mut *sides {
                let front = &mut front[..s.front_height()];
                front.fill([T::zero(); TILE_HEIGHT]);
                let entries = front.as_flattened_mut();
                entries[..s.columns].copy_from_slice(&y[own.clone()]);
                for (&row, value) in below.iter().zip(&mut entries[PANEL_WIDTH * s.panels()..]) {
                    *value = y[row as usize];
                }
            }
            let panels = diagonal.split_off(diagonal.len() - s.panels()..).unwrap_or_default();
            for (k, panel) in panels.iter().enumerate().rev() {
                let first_tile = Supernode::first_tile(k);
                let first = tiles.len() - (s.front_height() - first_tile);
                let below = tiles.split_off(first..).unwrap_or_default();
                for Side { front, .. } in &mut *sides {
                    let front = &mut front[..s.front_height()];
                    let sums = transposed_product(below, &front[first_tile..]);
                    let head =
                        &mut front.as_flattened_mut()[PANEL_WIDTH * k..PANEL_WIDTH * (k + 1)];
                    let solved = panel.backward(head, sums);
                    head.copy_from_slice(&solved);
                }
            }
            for Side { front, y, .. } in &mut *sides {
                y[own.clone()].copy_from_slice(&front.as_flattened()[..s.columns]);
            }
        }
    }

    /// The number of columns of L₁₁.
    fn interior(&self) -> usize {
        self.supernodes.last().map_or(0, |s| s.first + s.columns)
    }
}

impl<T: Number> TriangularSolver for Supernodal<T> {
    fn clear(&mut self) {
        self.tiles = Vec::new();
    }

    fn take_values(&mut self, factor: &mut Cholmod) {
        let count = self.supernodes.iter().map(Supernode::tiles).sum();
        self.tiles = vec![[[T::zero(); TILE_HEIGHT]; PANEL_WIDTH]; count];
        let (mut diagonal, mut tiles) = (&mut self.diagonal[..], &mut self.tiles[..]);
        let starts: Vec<usize> = factor.supernodes().map(|(.., start)| start).collect();
        // From the last supernode on: values at the end of the factor can be freed.
        for (s, start) in self.supernodes.iter().zip(starts).rev() {
            let panels = diagonal.split_off_mut(diagonal.len() - s.panels()..).unwrap_or_default();
            let mut own_tiles = tiles.split_off_mut(tiles.len() - s.tiles()..).unwrap_or_default();
            let height = s.columns + s.below;
            let values = &factor.values()[start..start + s.columns * height];
            for (k, panel) in panels.iter_mut().enumerate() {
                let first_tile = Supernode::first_tile(k);
                let height_below = s.front_height() - first_tile;
                let below = own_tiles.split_off_mut(..height_below).unwrap_or_default();
                let end = s.columns.min(PANEL_WIDTH * (k + 1));
                for j in PANEL_WIDTH * k..end {
                    let column = &values[j * height..(j + 1) * height];
                    panel.set_column(j % PANEL_WIDTH, &column[j..end]);
                    for (i, &value) in column.iter().enumerate().skip(end) {
                        let (tile, row) =
                            (s.position(i) / TILE_HEIGHT, s.position(i) % TILE_HEIGHT);
                        below[tile - first_tile][j % PANEL_WIDTH][row] = convert(value);
                    }
                }
            }
            factor.truncate_values(start);
        }
    }

    fn forward(&mut self, b: &[f64]) -> Vec<f64> {
        self.sides[0].set(b, &self.permutation);
        self.solve_forward(1);
        let Side { y, scale, .. } = &self.sides[0];
        let number = |&y: &T| scale * convert_unchecked::<T, f64>(y);
        y[self.interior()..].iter().map(number).collect()
    }

    fn backward(&mut self, interface: &[f64], x: &mut [f64]) {
        let interior = self.interior();
        let side = &mut self.sides[0];
        let (inner, outer) = side.y.split_at_mut(interior);
        let scale = interface.iter().fold(side.scale, |scale, value| scale.max(value.abs()));
        if scale > side.scale {
            let smaller = convert(side.scale / scale);
            inner.iter_mut().for_each(|y| *y *= smaller);
            side.scale = scale;
        }
        outer.iter_mut().zip(interface).for_each(|(y, value)| *y = convert(value / scale));
        self.solve_backward(1);
        self.sides[0].write(x, &self.permutation);
    }

    fn solve_two(&mut self, b: [&[f64]; 2], x: [&mut [f64]; 2]) {
        self.sides[1].y.resize(self.permutation.len(), T::zero());
        for (side, b) in self.sides.iter_mut().zip(b) {
            side.set(b, &self.permutation);
        }
        self.solve_forward(2);
        self.solve_backward(2);
        for (side, x) in self.sides.iter().zip(x) {
            side.write(x, &self.permutation);
        }
    }

    fn bytes(&self) -> f64 {
        2.0 * (size_of_val(&self.tiles[..]) + size_of_val(&self.diagonal[..])) as f64
    }
}
