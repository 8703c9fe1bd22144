//! The foundation opposite Γ_C, for pictures of the results.

use super::boundary_conditions::BoundaryConditions;
use crate::{contact::GapRow, mesh::Mesh};

/// What is opposite Γ_C: for each edge an entry with its two ends.
#[derive(Debug, Clone, Default)]
pub struct Foundation {
    /// The edge, m.
    pub contact_boundary: Vec<[[f64; 2]; 2]>,
    /// The foundation opposite, m; its segments meet at the nodes.
    pub segments: Vec<[[f64; 2]; 2]>,
    /// Unit vectors along which the body slides there; (0, 0) at a corner, which does not slide.
    pub tangents: Vec<[[f64; 2]; 2]>,
}

impl Foundation {
    /// Opposite the edges of Γ_C.
    pub(super) fn new(conditions: &BoundaryConditions, mesh: &Mesh) -> Self {
        let gaps = &conditions.gaps;
        let at = |node: usize| {
            let first = gaps.partition_point(|row| row.node < node);
            &gaps[first..first + gaps[first..].partition_point(|row| row.node == node)]
        };
        let mut foundation = Self::default();
        for &(edge, normal) in &conditions.contact_edges {
            let ends = edge.map(|node| {
                let ([x, y], (d, tangent)) = (mesh.nodes[node], opposite(at(node), normal));
                ([x, y], [x + d[0], y + d[1]], tangent)
            });
            foundation.contact_boundary.push(ends.map(|(point, ..)| point));
            foundation.segments.push(ends.map(|(_, opposite, _)| opposite));
            foundation.tangents.push(ends.map(|(.., tangent)| tangent));
        }
        foundation
    }
}

/// The vector d from a node of Γ_C with these gap conditions to the foundation, and the direction in
/// which the node may slide: at a corner the d with d·ν = g for both conditions, and (0, 0); else
/// d = g ν and the tangent. At a node between two plates, the condition nearer to `normal` counts.
fn opposite(rows: &[GapRow], normal: [f64; 2]) -> ([f64; 2], [f64; 2]) {
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
