//! Quadratic functions on straight triangles, by their values at the vertices and the midpoints of the
//! sides 01, 12, 20.

use super::{Body, Mass, Triangle};
use crate::petsc::PetscError;
use nalgebra::Vector3;
use std::array;

/// ∫ φ_i φ_j / |T| of the six P2 functions, times 180.
const MASS: [[f64; 6]; 6] = [
    [6.0, -1.0, -1.0, 0.0, -4.0, 0.0],
    [-1.0, 6.0, -1.0, 0.0, 0.0, -4.0],
    [-1.0, -1.0, 6.0, -4.0, 0.0, 0.0],
    [0.0, 0.0, -4.0, 32.0, 16.0, 16.0],
    [-4.0, 0.0, 0.0, 16.0, 32.0, 16.0],
    [0.0, -4.0, 0.0, 16.0, 16.0, 32.0],
];

/// The vertices of each side.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// ∫ v·w / |T| of quadratic v and w.
pub fn mean_product<V>(v: &[V; 6], w: &[V; 6], product: impl Fn(&V, &V) -> f64) -> f64 {
    let rows = MASS.iter().zip(v).flat_map(|(row, v)| row.iter().map(move |mass| (mass, v)));
    let pairs = rows.zip(w.iter().cycle());
    pairs.map(|((mass, v), w)| mass / 180.0 * product(v, w)).sum()
}

/// The loads ∫ f λ_i of a quadratic f: |T|/60 times 2 f at the vertex less f at the others, 8 f at the
/// midpoints of its sides, 4 f at that of the opposite side.
pub fn quadratic_load(triangle: &Triangle, [a, b, c, ab, bc, ca]: [f64; 6]) -> [f64; 3] {
    let unit = triangle.area() / 60.0;
    let load = |own: f64, others: f64, sides: f64, opposite: f64| {
        unit * (2.0 * own - others + 8.0 * sides + 4.0 * opposite)
    };
    [load(a, b + c, ab + ca, bc), load(b, c + a, bc + ab, ca), load(c, a + b, ca + bc, ab)]
}

/// z − Iz at the midpoints of the sides of each triangle, from the nodal values Iz of a smooth function
/// z with ∂z/∂n = 0 on the boundary: ⅛ (∇z(a) − ∇z(b))·(b − a) on the side ab. Collective.
///
/// ∇z at a vertex is the mean of ∇Iz over its triangles, at the boundary without its normal part.
///
/// # Errors
/// PETSc failed.
pub fn interpolation_error(body: &Body, values: &[f64]) -> Result<Vec<[f64; 3]>, PetscError> {
    // Σ |T|, Σ |T| ∇z and Σ |T| ∇λ_i around each vertex i; the last is the normal of the boundary
    // times its length there, and rounding inside.
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
    let at_middle = |a: usize, b: usize| {
        let part = |k: usize| (gradients[a][k] - gradients[b][k]) * (points[b][k] - points[a][k]);
        (part(0) + part(1)) / 8.0
    };
    let of = |t: &[usize; 3]| SIDES.map(|[i, j]| at_middle(t[i], t[j]));
    Ok(body.mesh.triangles.iter().map(of).collect())
}

/// A function at the vertices and the midpoints of the sides, affine but for `middles`.
pub fn bulged(vertices: [f64; 3], middles: [f64; 3]) -> [f64; 6] {
    let middle = |side: usize| {
        let [a, b] = SIDES[side].map(|i| vertices[i]);
        0.5 * (a + b) + middles[side]
    };
    let [a, b, c] = vertices;
    [a, b, c, middle(0), middle(1), middle(2)]
}

/// ∫ ζ′ λ_i, m²/s, of a ζ′ with these values at the vertices, affine but for `middles`, less what the mass
/// matrix of the run makes of it.
pub fn missing_mass(
    mass: Mass,
    triangle: &Triangle,
    rate: [f64; 3],
    middles: [f64; 3],
) -> [f64; 3] {
    let whole = quadratic_load(triangle, bulged(rate, middles));
    let own = mass.of(triangle) * Vector3::from(rate);
    array::from_fn(|i| whole[i] - own[i])
}

/// ∫ ∇β·∇λ_i, where ∫ ∇(4 λ_a λ_b) = 4/3 |T| (∇λ_a + ∇λ_b).
pub fn diffusion_load(triangle: &Triangle, middles: [f64; 3]) -> [f64; 3] {
    let slopes = triangle.gradients();
    let flux = |k: usize| -> f64 {
        SIDES.iter().zip(middles).map(|([a, b], c)| c * (slopes[*a][k] + slopes[*b][k])).sum()
    };
    let (x, y) = (flux(0), flux(1));
    slopes.map(|[dx, dy]| 4.0 / 3.0 * triangle.area() * (x * dx + y * dy))
}

/// ∫ f w_e of a quadratic f, with the bubbles w_e = 4 λ_a λ_b of the sides.
pub fn bubble_load(triangle: &Triangle, values: [f64; 6]) -> [f64; 3] {
    let row =
        |e: usize| MASS[3 + e].iter().zip(values).map(|(mass, value)| mass * value).sum::<f64>();
    [0, 1, 2].map(|e| triangle.area() / 180.0 * row(e))
}

/// ∫ β w_e of β = Σ c_f w_f with c = `middles`: 4/45 |T| (c_e + Σ c_f).
pub fn bubble_mass(triangle: &Triangle, middles: [f64; 3]) -> [f64; 3] {
    let sum = middles.iter().sum::<f64>();
    middles.map(|own| 4.0 / 45.0 * triangle.area() * (own + sum))
}

/// ∫ ∇p·∇λ_i of an affine p with these values at the vertices.
pub fn affine_diffusion(triangle: &Triangle, values: [f64; 3]) -> [f64; 3] {
    let slopes = triangle.gradients();
    let p = [0, 1].map(|k| slopes.iter().zip(values).map(|(slope, p)| p * slope[k]).sum::<f64>());
    slopes.map(|[dx, dy]| triangle.area() * (p[0] * dx + p[1] * dy))
}

/// ∫ ∇p·∇w_e of the same: 4/3 |T| ∇p·(∇λ_a + ∇λ_b).
pub fn bubble_flux(triangle: &Triangle, values: [f64; 3]) -> [f64; 3] {
    let own = affine_diffusion(triangle, values);
    SIDES.map(|[a, b]| 4.0 / 3.0 * (own[a] + own[b]))
}

/// ∫ ∇β·∇w_e of β = Σ c_f w_f with c = `middles`, where with G_ij = ∇λ_i·∇λ_j
/// ∫ ∇w_ab·∇w_ab = 8/3 |T| (G_aa + G_bb + G_ab) and ∫ ∇w_ab·∇w_bc = 8/3 |T| G_ac.
pub fn bubble_diffusion(triangle: &Triangle, middles: [f64; 3]) -> [f64; 3] {
    let slopes = triangle.gradients();
    let g = |i: usize, j: usize| slopes[i][0] * slopes[j][0] + slopes[i][1] * slopes[j][1];
    array::from_fn(|e| {
        // The sides e = ab, bc and ca.
        let [a, b, c] = [e, (e + 1) % 3, (e + 2) % 3];
        let own = (g(a, a) + g(b, b) + g(a, b)) * middles[e];
        let others = g(a, c) * middles[b] + g(b, c) * middles[c];
        8.0 / 3.0 * triangle.area() * (own + others)
    })
}
