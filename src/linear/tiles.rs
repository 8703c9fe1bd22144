//! The arithmetic of triangular solves, in pieces that fit the registers of a processor.

use nalgebra::{RealField, convert};
use std::ops::{Add, Mul, Sub};
use wide::{f32x8, f64x8};

/// Columns of a panel. One pass over the vector serves all of them.
pub(super) const PANEL_WIDTH: usize = 4;
/// Rows of a tile.
pub(super) const TILE_HEIGHT: usize = 8;

/// A number type with SIMD lanes of [`TILE_HEIGHT`] numbers.
pub(super) trait Number: RealField + Copy {
    /// From an array, or from one number for all lanes.
    type Lanes: Copy
        + From<[Self; TILE_HEIGHT]>
        + From<Self>
        + Into<[Self; TILE_HEIGHT]>
        + Add<Output = Self::Lanes>
        + Sub<Output = Self::Lanes>
        + Mul<Output = Self::Lanes>;
}

impl Number for f32 {
    type Lanes = f32x8;
}

impl Number for f64 {
    type Lanes = f64x8;
}

/// Entries of a panel in consecutive rows below its triangle, by columns.
pub(super) type Tile<T> = [[T; TILE_HEIGHT]; PANEL_WIDTH];

/// The triangle of a panel at the diagonal: D, lower triangular, by columns, with inverses in place
/// of the diagonal entries.
#[derive(Clone, Copy)]
pub(super) struct DiagonalBlock<T>([[T; PANEL_WIDTH]; PANEL_WIDTH]);

impl<T: Number> DiagonalBlock<T> {
    pub(super) fn identity() -> Self {
        let mut columns = [[T::zero(); PANEL_WIDTH]; PANEL_WIDTH];
        (0..PANEL_WIDTH).for_each(|i| columns[i][i] = T::one());
        Self(columns)
    }

    /// Sets the entries of a column from the diagonal down; further entries stay.
    pub(super) fn set_column(&mut self, column: usize, values: &[f64]) {
        for (k, &value) in values.iter().enumerate() {
            self.0[column][column + k] = convert(if k == 0 { value.recip() } else { value });
        }
    }

    /// D⁻¹ `b`.
    pub(super) fn forward(&self, b: &[T]) -> [T; PANEL_WIDTH] {
        let Self([k, l, m, n]) = self;
        let p = b[0] * k[0];
        let q = (b[1] - k[1] * p) * l[1];
        let r = (b[2] - k[2] * p - l[2] * q) * m[2];
        let s = (b[3] - k[3] * p - l[3] * q - m[3] * r) * n[3];
        [p, q, r, s]
    }

    /// D⁻ᵀ (`b` − `sums`).
    pub(super) fn backward(&self, b: &[T], sums: [T; PANEL_WIDTH]) -> [T; PANEL_WIDTH] {
        let Self([k, l, m, n]) = self;
        let s = (b[3] - sums[3]) * n[3];
        let r = (b[2] - sums[2] - m[3] * s) * m[2];
        let q = (b[1] - sums[1] - l[2] * r - l[3] * s) * l[1];
        let p = (b[0] - sums[0] - k[1] * q - k[2] * r - k[3] * s) * k[0];
        [p, q, r, s]
    }
}

/// `front` ← `front` − B `x`, B the rows of a panel that are stored in `tiles`.
pub(super) fn subtract<T: Number>(
    front: &mut [[T; TILE_HEIGHT]],
    tiles: &[Tile<T>],
    x: [T; PANEL_WIDTH],
) {
    let [p, q, r, s] = x.map(T::Lanes::from);
    for (front, tile) in front.iter_mut().zip(tiles) {
        let [a, b, c, d] = tile.map(T::Lanes::from);
        *front = (T::Lanes::from(*front) - (a * p + b * q) - (c * r + d * s)).into();
    }
}

/// Bᵀ `x`, B the rows of a panel that are stored in `tiles`. It goes from the last tile to the first, so that
/// a sweep reads the factor in one direction, and the processor can prefetch.
pub(super) fn transposed_product<T: Number>(
    tiles: &[Tile<T>],
    x: &[[T; TILE_HEIGHT]],
) -> [T; PANEL_WIDTH] {
    let zero = T::Lanes::from(T::zero());
    let [mut p, mut q, mut r, mut s] = [zero; PANEL_WIDTH];
    for (tile, x) in tiles.iter().zip(x).rev() {
        let [a, b, c, d] = tile.map(T::Lanes::from);
        let x = T::Lanes::from(*x);
        (p, q, r, s) = (p + a * x, q + b * x, r + c * x, s + d * x);
    }
    [p, q, r, s].map(|lanes| {
        let [a, b, c, d, e, f, g, h] = lanes.into();
        ((a + e) + (c + g)) + ((b + f) + (d + h))
    })
}
