//! Nodal loads of body forces and tractions, (f, w)_V of the paper.

use super::Body;

/// The midpoint of the side from `p` to `q`: where [`add_body_force`] takes f_B.
pub fn midpoint(p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
    [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]
}

/// The two Gauss points of the edge from `p` to `q`, where [`add_traction`] takes f_N; each is
/// (1 − s) p + s q.
pub fn gauss_points(p: [f64; 2], q: [f64; 2]) -> [[f64; 2]; 2] {
    GAUSS.map(|s| [p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])])
}

/// ½ ∓ 1/√12.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_08, 0.788_675_134_594_812_9];

/// Adds the body force f_i = ∫_Ω f_B·φ_i to the nodal loads, with f_B in N/m³ as a function of the
/// point. The rule of the side midpoints is exact where f_B is affine.
pub fn add_body_force(body: &Body, force: impl Fn([f64; 2]) -> [f64; 2], load: &mut [f64]) {
    for (nodes, triangle) in body.mesh.triangles.iter().zip(&body.triangles) {
        for side in 0..3 {
            let (a, b) = (nodes[side], nodes[(side + 1) % 3]);
            let (p, q) = (body.mesh.nodes[a], body.mesh.nodes[b]);
            let f = force(midpoint(p, q));
            // At a side's midpoint both its end functions are ½ and the third is 0.
            for node in [a, b] {
                load[2 * node] += triangle.area / 6.0 * f[0];
                load[2 * node + 1] += triangle.area / 6.0 * f[1];
            }
        }
    }
}

/// Adds the traction f_i = ∫ f_N·φ_i over boundary `edges` to the nodal loads, with f_N in N/m² as
/// a function of the point. Two Gauss points an edge are exact where f_N is quadratic.
pub fn add_traction(
    body: &Body,
    edges: &[[usize; 2]],
    traction: impl Fn([f64; 2]) -> [f64; 2],
    load: &mut [f64],
) {
    for &[a, b] in edges {
        let (p, q) = (body.mesh.nodes[a], body.mesh.nodes[b]);
        let (_, length) = body.mesh.edge_normal([a, b]);
        for (s, point) in GAUSS.into_iter().zip(gauss_points(p, q)) {
            let f = traction(point);
            for (node, weight) in [(a, 1.0 - s), (b, s)] {
                load[2 * node] += 0.5 * length * weight * f[0];
                load[2 * node + 1] += 0.5 * length * weight * f[1];
            }
        }
    }
}
