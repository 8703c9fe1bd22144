//! Nodal loads of body forces and tractions, (f, w)_V of the paper.

use super::{
    Body, Edge, Elements,
    edge::THREE_GAUSS,
    element::{POINTS, quadratic_measure, quadratic_values},
};
use nalgebra::Matrix3;
use rustc_hash::FxHashMap as HashMap;

/// The triangles that are integrated in parts, by their index in the undivided mesh. Per part: the
/// barycentric coordinates of its corners.
pub type TriangleParts = HashMap<usize, Vec<[[f64; 3]; 3]>>;

/// The midpoint of the side from `p` to `q`: where [`add_body_force`] takes f_B for P1.
pub fn midpoint(p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
    [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]
}

/// The corners of a straight triangle, then the midpoints of the sides 01, 12, 20, m.
pub fn six_points([a, b, c]: [[f64; 2]; 3]) -> [[f64; 2]; 6] {
    [a, b, c, midpoint(a, b), midpoint(b, c), midpoint(c, a)]
}

/// From barycentric coordinates in a part of a triangle to those in the triangle.
pub fn part_point(corners: &[[f64; 3]; 3], point: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| corners.iter().zip(point).map(|(corner, l)| l * corner[k]).sum())
}

/// Adds the body force f_i = ∫_Ω f_B·φ_i to the nodal loads, with f_B in N/m³ as a function of the triangle and the
/// point. The integration points are the side midpoints for P1, which is exact for affine f_B, and the quadrature
/// points of the element for P2. A divided triangle has three points in each part.
pub fn add_body_force(
    body: &Body,
    parts_of_triangles: &TriangleParts,
    force: impl Fn(usize, [f64; 2]) -> [f64; 2],
    load: &mut [f64],
) {
    let points = &body.nodes.points;
    let parts = |t: usize| parts_of_triangles.get(&body.global_triangles[t]);
    let mut add = |node: usize, weight: f64, f: [f64; 2]| {
        load[2 * node] += weight * f[0];
        load[2 * node + 1] += weight * f[1];
    };
    match body.elements() {
        Elements::Linear(cells) => {
            for (t, (nodes, element)) in cells.nodes.iter().zip(cells.elements).enumerate() {
                if let Some(parts) = parts(t) {
                    let corners = nodes.map(|node| points[node]);
                    let twice = |_| 2.0 * element.area();
                    in_parts(
                        parts,
                        corners,
                        |l| l,
                        twice,
                        |x| force(t, x),
                        |i, w, f| add(nodes[i], w, f),
                    );
                    continue;
                }
                for side in 0..3 {
                    let (a, b) = (nodes[side], nodes[(side + 1) % 3]);
                    let f = force(t, midpoint(points[a], points[b]));
                    // At the midpoint of a side the functions of its ends are ½, and the third one is 0.
                    [a, b].into_iter().for_each(|node| add(node, element.area() / 6.0, f));
                }
            }
        }
        Elements::Quadratic(cells) => {
            let values = POINTS.map(quadratic_values);
            for (t, (nodes, element)) in cells.nodes.iter().zip(cells.elements).enumerate() {
                let x = nodes.map(|node| points[node]);
                if let Some(parts) = parts(t) {
                    let twice = |l| quadratic_measure(&x, l);
                    let add = |i: usize, w, f| add(nodes[i], w, f);
                    in_parts(parts, x, quadratic_values, twice, |x| force(t, x), add);
                    continue;
                }
                for (point, values) in element.points.iter().zip(&values) {
                    let f = force(t, weighted(&x, values));
                    nodes
                        .iter()
                        .zip(values)
                        .for_each(|(&n, value)| add(n, point.weight * value, f));
                }
            }
        }
    }
}

/// Adds ∫ f φ_i over the parts of an element with these nodes and functions φ_i, and `twice` the area per
/// reference area, all by barycentric coordinates.
fn in_parts<const N: usize>(
    parts: &[[[f64; 3]; 3]],
    nodes: [[f64; 2]; N],
    functions: impl Fn([f64; 3]) -> [f64; N],
    twice: impl Fn([f64; 3]) -> f64,
    force: impl Fn([f64; 2]) -> [f64; 2],
    mut add: impl FnMut(usize, f64, [f64; 2]),
) {
    for part in parts {
        let share = Matrix3::from(*part).determinant().abs() / 6.0;
        for point in POINTS.map(|point| part_point(part, point)) {
            let values = functions(point);
            let f = force(weighted(&nodes, &values));
            let weight = share * twice(point);
            (0..N).for_each(|i| add(i, weight * values[i], f));
        }
    }
}

/// Σ φ_i x_i.
fn weighted<const N: usize>(points: &[[f64; 2]; N], values: &[f64; N]) -> [f64; 2] {
    [0, 1].map(|k| points.iter().zip(values).map(|(x, value)| value * x[k]).sum())
}

/// Adds the surface load f_i = ∫ f_N·φ_i over `parts` of boundary edges between `points`, from and to an s each, to the
/// nodal loads, with f_N in N/m² as a function of the point and the outward normal there. Three Gauss points a part
/// are exact, on straight edges, where f_N is a polynomial of degree 4 for P1 and 3 for P2.
pub fn add_traction(
    points: &[[f64; 2]],
    parts: impl IntoIterator<Item = (Edge, [f64; 2])>,
    traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2],
    load: &mut [f64],
) {
    for (edge, [from, to]) in parts {
        for [s, share] in THREE_GAUSS {
            let s = from + s * (to - from);
            let [dx, dy] = edge.tangent(points, s);
            let length = dx.hypot(dy);
            let f = traction(edge.at(points, s), [dy / length, -dx / length]);
            for (node, value) in edge.values(s) {
                let weight = share * (to - from) * length * value;
                load[2 * node] += weight * f[0];
                load[2 * node + 1] += weight * f[1];
            }
        }
    }
}
