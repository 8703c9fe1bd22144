//! Nodal loads of body forces and tractions, (f, w)_V of the paper.

use super::{
    Body, Edge, Elements,
    edge::GAUSS,
    element::{POINTS, quadratic_values},
};

/// The midpoint of the side from `p` to `q`: where [`add_body_force`] takes f_B for P1.
pub fn midpoint(p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
    [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]
}

/// Adds the body force f_i = ∫_Ω f_B·φ_i to the nodal loads, with f_B in N/m³ as a function of the
/// point: by the side midpoints for P1, which is exact where f_B is affine, by the quadrature points
/// of the element for P2.
pub fn add_body_force(body: &Body, force: impl Fn([f64; 2]) -> [f64; 2], load: &mut [f64]) {
    let points = &body.nodes.points;
    let mut add = |node: usize, weight: f64, f: [f64; 2]| {
        load[2 * node] += weight * f[0];
        load[2 * node + 1] += weight * f[1];
    };
    match body.elements() {
        Elements::Linear(cells) => {
            for (nodes, element) in cells.nodes.iter().zip(cells.elements) {
                for side in 0..3 {
                    let (a, b) = (nodes[side], nodes[(side + 1) % 3]);
                    let f = force(midpoint(points[a], points[b]));
                    // At a side's midpoint both its end functions are ½ and the third is 0.
                    [a, b].into_iter().for_each(|node| add(node, element.area() / 6.0, f));
                }
            }
        }
        Elements::Quadratic(cells) => {
            let values = POINTS.map(quadratic_values);
            for (nodes, element) in cells.nodes.iter().zip(cells.elements) {
                for (point, values) in element.points.iter().zip(&values) {
                    let x = [0, 1].map(|k| {
                        nodes.iter().zip(values).map(|(&node, value)| value * points[node][k]).sum()
                    });
                    let f = force(x);
                    nodes
                        .iter()
                        .zip(values)
                        .for_each(|(&n, value)| add(n, point.weight * value, f));
                }
            }
        }
    }
}

/// Adds the surface load f_i = ∫ f_N·φ_i over boundary `edges` to the nodal loads, with f_N in N/m² as
/// a function of the point and the outward normal there. Two Gauss points an edge are exact, on
/// straight edges, where f_N is quadratic for P1 and affine for P2; where it jumps, `parts` of each edge
/// have two of their own.
pub fn add_traction(
    body: &Body,
    edges: &[Edge],
    parts: usize,
    traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2],
    load: &mut [f64],
) {
    let points = &body.nodes.points;
    let part = 1.0 / parts as f64;
    let places = || (0..parts).flat_map(|i| GAUSS.map(|s| part * (i as f64 + s)));
    for edge in edges {
        for s in places() {
            let [dx, dy] = edge.tangent(points, s);
            let length = dx.hypot(dy);
            let f = traction(edge.at(points, s), [dy / length, -dx / length]);
            for (node, value) in edge.values(s) {
                load[2 * node] += 0.5 * part * length * value * f[0];
                load[2 * node + 1] += 0.5 * part * length * value * f[1];
            }
        }
    }
}
