//! Nodal loads of body forces and tractions, (f, w)_V of the paper.

use super::{
    Body, Cells, Edge, Elements,
    edge::THREE_GAUSS,
    element::{POINTS, quadratic_values},
};
use crate::mesh::{midpoint, quadratic_measure, twice_area};
use nalgebra::Matrix3;
use rustc_hash::FxHashMap as HashMap;

/// The triangles that are integrated in parts, by their index in the undivided mesh. Per part: the
/// barycentric coordinates of its corners.
pub type TriangleParts = HashMap<usize, Vec<[[f64; 3]; 3]>>;

/// The corners of a straight triangle, then the midpoints of the sides 01, 12, 20, m.
pub fn six_points([a, b, c]: [[f64; 2]; 3]) -> [[f64; 2]; 6] {
    [a, b, c, midpoint(a, b), midpoint(b, c), midpoint(c, a)]
}

/// From barycentric coordinates in a part of a triangle to those in the triangle.
pub fn part_point(corners: &[[f64; 3]; 3], point: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| corners.iter().zip(point).map(|(corner, l)| l * corner[k]).sum())
}

/// Calls `add` with the parts of the body force f_i = ∫_T f_B·φ_i: the triangle T, the number of the node in it, and the
/// force. f_B, in N/m³, is a function of the triangle and the
/// point. The integration points are the side midpoints for P1, which is exact for affine f_B, and the quadrature
/// points of the element for P2. A divided triangle has three points in each part.
pub fn add_body_force(
    body: &Body,
    parts_of_triangles: &TriangleParts,
    force: impl Fn(usize, [f64; 2]) -> [f64; 2],
    add: &mut dyn FnMut(usize, usize, [f64; 2]),
) {
    /// The midpoints of the sides.
    const MIDPOINTS: [[f64; 3]; 3] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];
    let parts = |t: usize| parts_of_triangles.get(&body.global_triangles[t]).map(Vec::as_slice);
    match body.elements() {
        Elements::Linear(cells) => {
            let twice_area = |&[a, b, c]: &[[f64; 2]; 3], _: [f64; 3]| twice_area(a, b, c);
            let rule = (MIDPOINTS, |l| l, twice_area);
            integrate(&cells, &body.nodes.points, parts, rule, force, add);
        }
        Elements::Quadratic(cells) => {
            let rule = (POINTS, quadratic_values, quadratic_measure);
            integrate(&cells, &body.nodes.points, parts, rule, force, add);
        }
    }
}

/// Calls `add` with ∫ f φ_i over the elements, with the integration points of undivided triangles, the functions φ_i and
/// twice the area per reference area, all by barycentric coordinates.
fn integrate<'a, const N: usize, const Q: usize>(
    cells: &Cells<N, Q>,
    points: &[[f64; 2]],
    parts: impl Fn(usize) -> Option<&'a [[[f64; 3]; 3]]>,
    (of_whole, functions, twice_area): (
        [[f64; 3]; 3],
        impl Fn([f64; 3]) -> [f64; N],
        impl Fn(&[[f64; 2]; N], [f64; 3]) -> f64,
    ),
    force: impl Fn(usize, [f64; 2]) -> [f64; 2],
    add: &mut dyn FnMut(usize, usize, [f64; 2]),
) {
    for (t, nodes) in cells.nodes.iter().enumerate() {
        let corners = nodes.map(|node| points[node]);
        let mut add_point = |weight: f64, point: [f64; 3]| {
            let values = functions(point);
            let f = force(t, weighted(&corners, &values));
            let weight = weight / 6.0 * twice_area(&corners, point);
            for (i, value) in values.into_iter().enumerate() {
                add(t, i, f.map(|f| weight * value * f));
            }
        };
        match parts(t) {
            None => of_whole.into_iter().for_each(|point| add_point(1.0, point)),
            Some(parts) => parts.iter().for_each(|part| {
                let size = Matrix3::from(*part).determinant().abs();
                POINTS.into_iter().for_each(|point| add_point(size, part_point(part, point)));
            }),
        }
    }
}

/// Σ φ_i x_i.
fn weighted<const N: usize>(points: &[[f64; 2]; N], values: &[f64; N]) -> [f64; 2] {
    [0, 1].map(|k| points.iter().zip(values).map(|(x, value)| value * x[k]).sum())
}

/// Calls `add` with the surface loads f_i = ∫ f_N·φ_i over `parts` of boundary edges between `points`, from and to an s
/// each: the edge, its node and the force. f_N, in N/m², is a function of the point and the outward normal there. Three Gauss points a part
/// are exact, on straight edges, where f_N is a polynomial of degree 4 for P1 and 3 for P2.
pub fn add_traction(
    points: &[[f64; 2]],
    parts: impl IntoIterator<Item = (Edge, [f64; 2])>,
    traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2],
    add: &mut dyn FnMut(&Edge, usize, [f64; 2]),
) {
    for (edge, [from, to]) in parts {
        for [s, share] in THREE_GAUSS {
            let s = from + s * (to - from);
            let [dx, dy] = edge.tangent(points, s);
            let length = dx.hypot(dy);
            let f = traction(edge.at(points, s), [dy / length, -dx / length]);
            for (node, value) in edge.values(s) {
                let weight = share * (to - from) * length * value;
                add(&edge, node, f.map(|f| weight * f));
            }
        }
    }
}
