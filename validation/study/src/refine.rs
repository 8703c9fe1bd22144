//! Uniform refinement: nested triangulations of the same polygon.

use signorini::mesh::{Curve, Mesh};
use std::collections::{BTreeMap, HashMap};

/// Red refinement: the midpoints of its edges cut every triangle of `mesh` into four similar ones.
///
/// Every P1 function on the mesh is one on the refined mesh, and every isoparametric P2 function.
/// The nodes keep their numbers, midpoints follow. The body stays the same polygon, or if edges are
/// quadratic, bounded by the same parabolas.
#[must_use]
pub fn refined(mesh: &Mesh) -> Mesh {
    let mut nodes = mesh.nodes.clone();
    let mut midpoints = HashMap::new();
    let mut midpoint = |a: usize, b: usize| {
        *midpoints.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            nodes.push(mesh.midpoint([a, b]));
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
    let quarters = |t: &usize| 4 * t..4 * t + 4;
    let surfaces = mesh.surfaces.iter();
    let surfaces = surfaces.map(|(name, t)| (name.clone(), t.iter().flat_map(quarters).collect()));
    let (surfaces, curved) = (surfaces.collect(), BTreeMap::new());
    let mut fine = Mesh { nodes, triangles, curves, surfaces, curved };
    for triangle in mesh.triangles.iter().filter(|&&triangle| mesh.is_curved(triangle)) {
        // x(t) = (1−t)a + tb + 4t(1−t)d has a quarter of the offset on each half, and so has the
        // line of the map that runs beside it through the middles of the other sides.
        let middle = |[a, b]: [usize; 2]| midpoints[&[a.min(b), a.max(b)]];
        let &[a, b, c] = triangle;
        let sides = [[a, b, c], [b, c, a], [c, a, b]];
        for ([a, b, c], offset) in sides.into_iter().zip(mesh.offsets(*triangle)) {
            let [ab, bc, ca] = [middle([a, b]), middle([b, c]), middle([c, a])];
            for edge in [[a, ab], [ab, b], [bc, ca]] {
                fine.set_offset(edge, offset.map(|d| 0.25 * d));
            }
        }
    }
    fine
}

/// h: the length of the longest edge, m.
#[must_use]
pub fn longest_edge(mesh: &Mesh) -> f64 {
    let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges.map(|edge| mesh.edge_normal(edge).1).fold(0.0, f64::max)
}
