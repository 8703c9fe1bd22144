//! Triangular solves with a supernodal Cholesky factor.

use super::tiles::{Number, Panel, TALL, Tile, WIDE, products, subtract};
use nalgebra::{convert, convert_unchecked};
use std::mem::take;

/// What solves with the first columns of a factor L of P A Pᵀ = L Lᵀ: forwards, then backwards.
///
/// Where these are not all, with L₁₁ and L₂₁ in them, a forward solve leaves b₂ − L₂₁ y₁ in the last
/// entries, and a backward one takes x₂ from there.
pub(super) trait Triangle {
    /// Takes over the values of L: of each supernode its columns from the diagonal block down,
    /// whatever stands above the diagonal.
    fn set_values(&mut self, values: &[f64]);

    /// y₁ ← L₁₁⁻¹ P `b`₁.
    fn forward(&mut self, b: &[f64]);

    /// The last entries of y.
    fn last(&self, count: usize) -> Vec<f64>;

    /// Replaces the last entries of y.
    fn set_last(&mut self, values: &[f64]);

    /// P `x`₁ ← L₁₁⁻ᵀ (y₁ − L₂₁ᵀ x₂); destroys y.
    fn backward(&mut self, x: &mut [f64]);

    /// Bytes that both solves read.
    fn traffic(&self) -> f64;
}

/// Where the entries of L are: by supernodes, consecutive columns with the same rows below them
/// (Ng and Peyton, SIAM J. Sci. Comput. 14, 1993).
pub(super) struct Structure {
    /// The rows of A in the order of L: place → row.
    pub(super) order: Vec<u32>,
    pub(super) supernodes: Vec<Supernode>,
    /// Of each supernode the rows below its diagonal block.
    pub(super) rows: Vec<u32>,
}

/// Columns with the same rows below their diagonal block.
pub(super) struct Supernode {
    pub(super) first: usize,
    pub(super) columns: usize,
    /// The number of those rows.
    pub(super) below: usize,
}

/// L with entries `T`, in the order in which they are read; that is most of what a solve does.
pub(super) struct Supernodal<T> {
    structure: Structure,
    panels: Vec<Panel<T>>,
    /// Of each panel what stands below its triangle.
    tiles: Vec<Tile<T>>,
    /// b, y or x in the order of L, brought to size 1: the exponents of `f32` end soon.
    y: Vec<T>,
    size: f64,
    /// The part of y that a supernode works on: its columns, then the rows below.
    front: Vec<[T; TALL]>,
}

impl Supernode {
    fn panels(&self) -> usize {
        self.columns.div_ceil(WIDE)
    }

    /// Tiles from the top of the front to its end.
    fn tall(&self) -> usize {
        (WIDE * self.panels() + self.below).div_ceil(TALL)
    }

    /// Of a panel's triangle the first tile below; it may hold rows of the triangle, as zeros.
    fn top(panel: usize) -> usize {
        WIDE * (panel + 1) / TALL
    }

    /// Tiles of all panels.
    fn tiles(&self) -> usize {
        (0..self.panels()).map(|panel| self.tall() - Self::top(panel)).sum()
    }

    /// Where a row of the supernode lies in the front.
    fn place(&self, row: usize) -> usize {
        if row < self.columns { row } else { row - self.columns + WIDE * self.panels() }
    }
}

impl<T: Number> Supernodal<T> {
    /// The identity in the place of L.
    pub(super) fn new(structure: Structure) -> Self {
        let Structure { order, supernodes, .. } = &structure;
        Self {
            panels: vec![Panel::identity(); supernodes.iter().map(Supernode::panels).sum()],
            tiles: vec![[[T::zero(); TALL]; WIDE]; supernodes.iter().map(Supernode::tiles).sum()],
            y: vec![T::zero(); order.len()],
            size: 0.0,
            front: vec![
                [T::zero(); TALL];
                supernodes.iter().map(Supernode::tall).max().unwrap_or(0)
            ],
            structure,
        }
    }

    /// The forward solve: each supernode solves for its part of y and subtracts its share from the rows
    /// below.
    fn eliminate(&mut self) {
        let Structure { supernodes, rows, .. } = &self.structure;
        let (mut panels, mut tiles, mut rows) = (&self.panels[..], &self.tiles[..], &rows[..]);
        for s in supernodes {
            let front = &mut self.front[..s.tall()];
            let own = s.first..s.first + s.columns;
            front.fill([T::zero(); TALL]);
            front.as_flattened_mut()[..s.columns].copy_from_slice(&self.y[own.clone()]);
            let (diagonal, others) = panels.split_at(s.panels());
            panels = others;
            for (k, panel) in diagonal.iter().enumerate() {
                let top = Supernode::top(k);
                let (below, others) = tiles.split_at(s.tall() - top);
                tiles = others;
                let head = &mut front.as_flattened_mut()[WIDE * k..WIDE * (k + 1)];
                let solved = panel.forward(head);
                head.copy_from_slice(&solved);
                subtract(&mut front[top..], below, solved);
            }
            let front = front.as_flattened();
            self.y[own].copy_from_slice(&front[..s.columns]);
            let (below, others) = rows.split_at(s.below);
            rows = others;
            for (&row, &change) in below.iter().zip(&front[WIDE * s.panels()..]) {
                self.y[row as usize] += change;
            }
        }
    }

    /// The backward solve: each supernode fetches the rows below, which are solved, and solves for its
    /// own.
    fn substitute(&mut self) {
        let Structure { supernodes, rows, .. } = &self.structure;
        let (mut panels, mut tiles, mut rows) = (&self.panels[..], &self.tiles[..], &rows[..]);
        for s in supernodes.iter().rev() {
            let front = &mut self.front[..s.tall()];
            let own = s.first..s.first + s.columns;
            front.fill([T::zero(); TALL]);
            let entries = front.as_flattened_mut();
            entries[..s.columns].copy_from_slice(&self.y[own.clone()]);
            let (others, below) = rows.split_at(rows.len() - s.below);
            rows = others;
            for (&row, value) in below.iter().zip(&mut entries[WIDE * s.panels()..]) {
                *value = self.y[row as usize];
            }
            let (others, diagonal) = panels.split_at(panels.len() - s.panels());
            panels = others;
            for (k, panel) in diagonal.iter().enumerate().rev() {
                let top = Supernode::top(k);
                let (others, below) = tiles.split_at(tiles.len() - (s.tall() - top));
                tiles = others;
                let sums = products(below, &front[top..]);
                let head = &mut front.as_flattened_mut()[WIDE * k..WIDE * (k + 1)];
                let solved = panel.backward(head, sums);
                head.copy_from_slice(&solved);
            }
            self.y[own].copy_from_slice(&front.as_flattened()[..s.columns]);
        }
    }
}

impl<T: Number> Triangle for Supernodal<T> {
    fn set_values(&mut self, mut values: &[f64]) {
        let (mut panels, mut tiles) = (&mut self.panels[..], &mut self.tiles[..]);
        for s in &self.structure.supernodes {
            let height = s.columns + s.below;
            let (diagonal, others) = take(&mut panels).split_at_mut(s.panels());
            panels = others;
            for (k, panel) in diagonal.iter_mut().enumerate() {
                let top = Supernode::top(k);
                let (below, others) = take(&mut tiles).split_at_mut(s.tall() - top);
                tiles = others;
                let end = s.columns.min(WIDE * (k + 1));
                for j in WIDE * k..end {
                    let column = &values[j * height..(j + 1) * height];
                    panel.set_column(j % WIDE, &column[j..end]);
                    for (i, &value) in column.iter().enumerate().skip(end) {
                        let place = s.place(i);
                        below[place / TALL - top][j % WIDE][place % TALL] = convert(value);
                    }
                }
            }
            values = &values[s.columns * height..];
        }
    }

    fn forward(&mut self, b: &[f64]) {
        self.size = b.iter().fold(f64::MIN_POSITIVE, |size, b| size.max(b.abs()));
        for (y, &row) in self.y.iter_mut().zip(&self.structure.order) {
            *y = convert(b[row as usize] / self.size);
        }
        self.eliminate();
    }

    fn last(&self, count: usize) -> Vec<f64> {
        let last = &self.y[self.y.len() - count..];
        last.iter().map(|&y| self.size * convert_unchecked::<T, f64>(y)).collect()
    }

    fn set_last(&mut self, values: &[f64]) {
        let (rest, last) = self.y.split_at_mut(self.structure.order.len() - values.len());
        let size = values.iter().fold(self.size, |size, value| size.max(value.abs()));
        let smaller = convert(self.size / size);
        rest.iter_mut().for_each(|y| *y *= smaller);
        last.iter_mut().zip(values).for_each(|(y, value)| *y = convert(value / size));
        self.size = size;
    }

    fn backward(&mut self, x: &mut [f64]) {
        self.substitute();
        for (&y, &row) in self.y.iter().zip(&self.structure.order) {
            x[row as usize] = self.size * convert_unchecked::<T, f64>(y);
        }
    }

    fn traffic(&self) -> f64 {
        2.0 * (size_of_val(&self.tiles[..]) + size_of_val(&self.panels[..])) as f64
    }
}
