//! The interpolation error of the damage.
//!
//! ζ is affine on a triangle, the damage z of a much finer mesh is curved. Its curvature follows from gradients of ζ that
//! are averaged at the vertices. Near ζ the squared difference is 4/45 |T| (Σh² + (Σh)²), with the heights h of the
//! bubbles on the sides.

use crate::{
    fem::Body,
    petsc::PetscError,
    problem::{DiscreteProblem, State},
};
use nalgebra::Vector3;

/// Per triangle of this rank: ‖z − ζ‖²_T / ‖ζ₀ − ζ‖² of a state; zeros without damage. Collective.
///
/// # Errors
/// PETSc failed.
pub(super) fn interpolation_shares(
    problem: &DiscreteProblem,
    state: &State,
) -> Result<Vec<f64>, PetscError> {
    let (body, initial) = (&problem.body, problem.initial_damage());
    let heights = bubble_heights(body, &state.zeta)?;
    let (mut squares, mut done) = (Vec::with_capacity(body.own_triangles), 0.0);
    for (t, nodes) in body.mesh.triangles.iter().enumerate().take(body.own_triangles) {
        let damage = Vector3::from(nodes.map(|node| initial[node] - state.zeta[node]));
        let (sum_of_squares, sum) =
            heights[t].iter().fold((0.0, 0.0), |(q, s), h| (q + h * h, s + h));
        squares.push(4.0 / 45.0 * body.triangles[t].area() * (sum_of_squares + sum * sum));
        done += damage.dot(&(body.triangles[t].mass() * damage));
    }
    let done = body.vertices.partition.comm().total(done);
    squares.iter_mut().for_each(|square| *square = if done > 0.0 { *square / done } else { 0.0 });
    Ok(squares)
}

/// The heights of the bubbles on the sides of each triangle, from the nodal values of a smooth function z
/// with ∂z/∂n = 0 on the boundary: ⅛ (∇z(a) − ∇z(b))·(b − a) on the side ab. Collective.
///
/// ∇z at a vertex is the mean of ∇Iz over its triangles, at the boundary without its normal part.
fn bubble_heights(body: &Body, values: &[f64]) -> Result<Vec<[f64; 3]>, PetscError> {
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
    let heights =
        |nodes: &[usize; 3]| [[0, 1], [1, 2], [2, 0]].map(|[i, j]| height(nodes[i], nodes[j]));
    Ok(body.mesh.triangles.iter().map(heights).collect())
}
