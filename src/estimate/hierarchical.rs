//! Quadratic functions on a straight triangle in the hierarchical basis
//!
//! λ_a, λ_b, λ_c, w_ab = 4λ_aλ_b, w_bc, w_ca.
//!
//! The first three coefficients are the values at the vertices. The others are the heights of the bubbles on the
//! sides: the values at the midpoints minus the affine part.

use crate::fem::Triangle;
use nalgebra::{Matrix6, SMatrix};

/// The vertices of each side, in the order of the midpoints.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// The coefficients of functions (a column each) from their values at the vertices and midpoints.
pub(super) fn coefficients<const N: usize>(mut values: SMatrix<f64, 6, N>) -> SMatrix<f64, 6, N> {
    for (side, [i, j]) in SIDES.into_iter().enumerate() {
        let mean = 0.5 * (values.row(i) + values.row(j));
        values.set_row(3 + side, &(values.row(3 + side) - mean));
    }
    values
}

/// The mass matrix, m²: ∫ λ_i λ_j = |T|/12 (1 + δ_ij), ∫ w_e w_f = 4/45 |T| (1 + δ_ef), and ∫ λ_i w_e is
/// 2/15 |T| for the ends i of a side e, 1/15 |T| for the opposite vertex.
pub(super) fn mass(triangle: &Triangle) -> Matrix6<f64> {
    let end = |i: usize, side: usize| if SIDES[side].contains(&i) { 2.0 } else { 1.0 };
    let twice_if = |equal: bool| if equal { 2.0 } else { 1.0 };
    triangle.area()
        * Matrix6::from_fn(|i, j| match (i, j) {
            (..3, ..3) => twice_if(i == j) / 12.0,
            (..3, _) => end(i, j - 3) / 15.0,
            (_, ..3) => end(j, i - 3) / 15.0,
            _ => twice_if(i == j) * 4.0 / 45.0,
        })
}
