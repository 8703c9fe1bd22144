//! Quadratic functions on a straight triangle in the hierarchical basis
//!
//! λ_a, λ_b, λ_c, w_ab = 4λ_aλ_b, w_bc, w_ca.
//!
//! The first three coefficients are the values at the vertices. The others are the heights of the bubbles on the
//! sides: the values at the midpoints minus the affine part.

use crate::{
    fem::{Body, Triangle},
    petsc::PetscError,
};
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

/// The heights of the bubbles on the sides of each triangle, from the nodal values of a smooth function z
/// with ∂z/∂n = 0 on the boundary: ⅛ (∇z(a) − ∇z(b))·(b − a) on the side ab. Collective.
///
/// ∇z at a vertex is the mean of ∇Iz over its triangles, at the boundary without its normal part.
///
/// # Errors
/// PETSc failed.
pub(super) fn interpolation_error(
    body: &Body,
    values: &[f64],
) -> Result<Vec<[f64; 3]>, PetscError> {
    // Per vertex i: Σ |T|, Σ |T| ∇z and Σ |T| ∇λ_i over its triangles. The last is the normal of the
    // boundary times its length there, and rounding inside.
    let mut sums = vec![[0.0; 5]; values.len()];
    for (nodes, triangle) in body.mesh.triangles.iter().zip(&body.triangles) {
        let (area, slopes) = (triangle.area(), triangle.gradients());
        let [x, y] = [0, 1].map(|k| (0..3).map(|i| values[nodes[i]] * slopes[i][k]).sum::<f64>());
        for (&node, [dx, dy]) in nodes.iter().zip(slopes) {
            let parts = [1.0, x, y, *dx, *dy];
            sums[node].iter_mut().zip(parts).for_each(|(sum, part)| *sum += area * part);
        }
    }
    let gradient = |[area, x, y, nx, ny]: [f64; 5]| {
        let square = nx * nx + ny * ny;
        let normal = if square > 1e-12 * area { (x * nx + y * ny) / square } else { 0.0 };
        [(x - normal * nx) / area, (y - normal * ny) / area]
    };
    let mut gradients: Vec<[f64; 2]> = sums.into_iter().map(gradient).collect();
    body.vertices.partition.update(gradients.as_flattened_mut(), 2)?;
    let points = &body.mesh.nodes;
    let height = |a: usize, b: usize| {
        let part = |k: usize| (gradients[a][k] - gradients[b][k]) * (points[b][k] - points[a][k]);
        (part(0) + part(1)) / 8.0
    };
    let heights = |nodes: &[usize; 3]| SIDES.map(|[i, j]| height(nodes[i], nodes[j]));
    Ok(body.mesh.triangles.iter().map(heights).collect())
}
