//! Where the foundation is, for figures.

use crate::{
    contact::{Constraints, GapRow},
    mesh::Mesh,
    scene::Scene,
};

/// What is opposite Γ_C: of each edge of it an entry with both its ends.
#[derive(Debug, Clone, Default)]
pub struct Foundation {
    /// The edge, m.
    pub contact_boundary: Vec<[[f64; 2]; 2]>,
    /// The foundation opposite, m.
    pub segments: Vec<[[f64; 2]; 2]>,
    /// Unit vectors along which the body slides there; (0, 0) at a corner, which stands still.
    pub tangents: Vec<[[f64; 2]; 2]>,
}

impl Foundation {
    /// The edges of Γ_C and what is opposite them; segments of the foundation meet at the nodes.
    pub(super) fn new(scene: &Scene, mesh: &Mesh, constraints: &Constraints) -> Self {
        let rows = &constraints.gaps;
        let at = |node: usize| {
            let first = rows.partition_point(|row| row.node < node);
            &rows[first..first + rows[first..].partition_point(|row| row.node == node)]
        };
        let mut foundation = Self::default();
        for boundary in &scene.boundaries {
            let (Some(gap), Some(curve)) = (boundary.gap(), mesh.curves.get(&boundary.name)) else {
                continue;
            };
            for &edge in &curve.edges {
                let points = edge.map(|node| mesh.nodes[node]);
                let normal = gap.normal.unwrap_or(mesh.edge_normal(edge).0);
                let ways = edge.map(|node| way(at(node), normal));
                let opposite = |i: usize| [0, 1].map(|k| points[i][k] + ways[i].0[k]);
                foundation.contact_boundary.push(points);
                foundation.tangents.push(ways.map(|(_, tangent)| tangent));
                foundation.segments.push([opposite(0), opposite(1)]);
            }
        }
        foundation
    }
}

/// The way d from a node of Γ_C with these gap conditions to the foundation, and the direction in
/// which the node may slide: at a corner the d with d·ν = g for both conditions, and (0, 0); else
/// d = g ν and the tangent. Of a node between two plates the condition nearer to `normal` counts.
fn way(rows: &[GapRow], normal: [f64; 2]) -> ([f64; 2], [f64; 2]) {
    if let [a, b, ..] = rows {
        let (p, q) = (a.normal, b.normal);
        let cross = p[0] * q[1] - p[1] * q[0];
        if cross.abs() > 1e-4 {
            let d = [(a.gap * q[1] - b.gap * p[1]) / cross, (b.gap * p[0] - a.gap * q[0]) / cross];
            return (d, [0.0; 2]);
        }
    }
    let along = |row: &&GapRow| row.normal[0] * normal[0] + row.normal[1] * normal[1];
    let nearer = rows.iter().max_by(|a, b| along(a).total_cmp(&along(b)));
    nearer.map_or_else(Default::default, |row| {
        let [x, y] = row.normal;
        ([row.gap * x, row.gap * y], [-y, x])
    })
}
