//! Quadratic functions on straight triangles, by their values at the vertices and the midpoints of the
//! sides 01, 12, 20.

use super::{Body, Cells, Triangle, element::Quadratic};
use nalgebra::SMatrix;

/// ∫ φ_i φ_j / |T| of the six P2 functions, times 180.
const MASS: [[f64; 6]; 6] = [
    [6.0, -1.0, -1.0, 0.0, -4.0, 0.0],
    [-1.0, 6.0, -1.0, 0.0, 0.0, -4.0],
    [-1.0, -1.0, 6.0, -4.0, 0.0, 0.0],
    [0.0, 0.0, -4.0, 32.0, 16.0, 16.0],
    [-4.0, 0.0, 0.0, 16.0, 32.0, 16.0],
    [0.0, -4.0, 0.0, 16.0, 16.0, 32.0],
];

/// ∫ v·w / |T| of quadratic v and w.
pub fn mean_product<V>(v: &[V; 6], w: &[V; 6], product: impl Fn(&V, &V) -> f64) -> f64 {
    let rows = MASS.iter().zip(v).flat_map(|(row, v)| row.iter().map(move |mass| (mass, v)));
    let pairs = rows.zip(w.iter().cycle());
    pairs.map(|((mass, v), w)| mass / 180.0 * product(v, w)).sum()
}

/// The P2 mass matrix ∫ φ_i φ_j, m², of a straight triangle.
pub(super) fn mass(triangle: &Triangle) -> SMatrix<f64, 6, 6> {
    SMatrix::from_fn(|i, j| triangle.area() / 180.0 * MASS[i][j])
}

/// The P2 Laplace matrix ∫ ∇φ_i·∇φ_j of the straight triangle between three vertices.
pub(super) fn laplace(vertices: [[f64; 2]; 3]) -> SMatrix<f64, 6, 6> {
    let [a, b, c] = vertices;
    let middle = |p: [f64; 2], q: [f64; 2]| [0, 1].map(|k| 0.5 * (p[k] + q[k]));
    let element = Quadratic::new([a, b, c, middle(a, b), middle(b, c), middle(c, a)]);
    SMatrix::from_fn(|i, j| {
        let product = |g: &[[f64; 2]; 6]| g[i][0] * g[j][0] + g[i][1] * g[j][1];
        element.points.iter().map(|point| point.weight * product(&point.gradients)).sum()
    })
}

/// The load b_i = ∫ f φ_i at the nodes of P2, of a function f that is quadratic in each triangle.
pub fn quadratic_load(body: &Body, cells: Cells<6, 3>, values: &[[f64; 6]]) -> Vec<f64> {
    let mut load = vec![0.0; body.nodes.points.len()];
    for ((nodes, triangle), values) in cells.nodes.iter().zip(&body.triangles).zip(values) {
        for (node, row) in nodes.iter().zip(&MASS) {
            let sum: f64 = row.iter().zip(values).map(|(mass, value)| mass * value).sum();
            load[*node] += triangle.area() / 180.0 * sum;
        }
    }
    load
}
