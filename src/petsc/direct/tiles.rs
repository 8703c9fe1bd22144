//! The arithmetic of triangular solves, in pieces that fit the registers of a processor.

use nalgebra::{RealField, convert};
use std::ops::{Add, Mul, Sub};
use wide::{f32x8, f64x8};

/// Columns that are worked on together, so that what they work on is read once for all.
pub(super) const WIDE: usize = 4;
/// Rows of a tile.
pub(super) const TALL: usize = 8;

/// A number that comes in lanes of [`TALL`], worked on side by side.
pub(super) trait Number: RealField + Copy {
    /// From an array, or from one number for all lanes.
    type Lanes: Copy
        + From<[Self; TALL]>
        + From<Self>
        + Into<[Self; TALL]>
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

/// Entries of a panel in consecutive rows, by columns.
pub(super) type Tile<T> = [[T; TALL]; WIDE];

/// Consecutive columns of a triangular matrix where they meet the diagonal: a triangle by columns,
/// with inverses in place of the diagonal.
#[derive(Clone, Copy)]
pub(super) struct Panel<T>([[T; WIDE]; WIDE]);

impl<T: Number> Panel<T> {
    pub(super) fn identity() -> Self {
        let mut triangle = [[T::zero(); WIDE]; WIDE];
        (0..WIDE).for_each(|i| triangle[i][i] = T::one());
        Self(triangle)
    }

    /// Takes over the entries of a column from the diagonal down; those missing stay.
    pub(super) fn set_column(&mut self, column: usize, values: &[f64]) {
        for (k, &value) in values.iter().enumerate() {
            self.0[column][column + k] = convert(if k == 0 { value.recip() } else { value });
        }
    }

    /// The solution of the triangular system for `b`.
    pub(super) fn forward(&self, b: &[T]) -> [T; WIDE] {
        let Self([k, l, m, n]) = self;
        let p = b[0] * k[0];
        let q = (b[1] - k[1] * p) * l[1];
        let r = (b[2] - k[2] * p - l[2] * q) * m[2];
        let s = (b[3] - k[3] * p - l[3] * q - m[3] * r) * n[3];
        [p, q, r, s]
    }

    /// The solution of the transposed system for `b` less `sums`.
    pub(super) fn backward(&self, b: &[T], sums: [T; WIDE]) -> [T; WIDE] {
        let Self([k, l, m, n]) = self;
        let s = (b[3] - sums[3]) * n[3];
        let r = (b[2] - sums[2] - m[3] * s) * m[2];
        let q = (b[1] - sums[1] - l[2] * r - l[3] * s) * l[1];
        let p = (b[0] - sums[0] - k[1] * q - k[2] * r - k[3] * s) * k[0];
        [p, q, r, s]
    }
}

/// `front` less the products of the tiles with `x`.
pub(super) fn subtract<T: Number>(front: &mut [[T; TALL]], tiles: &[Tile<T>], x: [T; WIDE]) {
    let [p, q, r, s] = x.map(T::Lanes::from);
    for (front, tile) in front.iter_mut().zip(tiles) {
        let [a, b, c, d] = tile.map(T::Lanes::from);
        *front = (T::Lanes::from(*front) - (a * p + b * q) - (c * r + d * s)).into();
    }
}

/// The products of the columns of the tiles with `x`. From the end: sweeps through a whole factor
/// go one way in memory, which the processor sees and fetches ahead.
pub(super) fn products<T: Number>(tiles: &[Tile<T>], x: &[[T; TALL]]) -> [T; WIDE] {
    let zero = T::Lanes::from(T::zero());
    let [mut p, mut q, mut r, mut s] = [zero; WIDE];
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
