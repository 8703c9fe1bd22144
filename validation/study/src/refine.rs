//! Uniform refinement: nested triangulations of the same polygon.

use signorini::mesh::{Curve, Mesh};
use std::collections::HashMap;

/// Red refinement: the midpoints of its edges cut every triangle of `mesh` into four similar ones.
///
/// Every P1 function on the mesh is one on the refined mesh. The nodes keep their numbers,
/// midpoints follow. A polygon stays that polygon: midpoints of edges on a curved boundary do
/// not move onto the curve.
#[must_use]
pub fn refined(mesh: &Mesh) -> Mesh {
    let mut nodes = mesh.nodes.clone();
    let mut midpoints = HashMap::new();
    let mut midpoint = |a: usize, b: usize| {
        *midpoints.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            let ([ax, ay], [bx, by]) = (nodes[a], nodes[b]);
            nodes.push([0.5 * (ax + bx), 0.5 * (ay + by)]);
            nodes.len() - 1
        })
    };
    let quarters = mesh.triangles.iter().flat_map(|&[a, b, c]| {
        let [ab, bc, ca] = [midpoint(a, b), midpoint(b, c), midpoint(c, a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    });
    let triangles = quarters.collect();
    let mut halves = |curve: &Curve| {
        let cut = curve.edges.iter().map(|&[a, b]| (a, midpoint(a, b), b));
        let edges = cut.flat_map(|(a, middle, b)| [[a, middle], [middle, b]]).collect();
        Curve { edges, interior_edges: 2 * curve.interior_edges }
    };
    let curves = mesh.curves.iter().map(|(name, curve)| (name.clone(), halves(curve)));
    let curves = curves.collect();
    Mesh { nodes, triangles, curves }
}

/// h: the length of the longest edge, m.
#[must_use]
pub fn longest_edge(mesh: &Mesh) -> f64 {
    let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges.map(|edge| mesh.edge_normal(edge).1).fold(0.0, f64::max)
}
