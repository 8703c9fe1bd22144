//! What a scene asks for on the named parts of the boundary, in terms of the mesh, and the foundation
//! opposite Γ_C for pictures.

use crate::{
    contact::{FixedRow, GapRow, RigidMotions},
    fem::{Body, Edge},
    mesh::{BoundaryNode, Mesh, boundary_nodes},
    scene::{Boundary, Condition, Expression, Scene},
};

/// The conditions of all boundaries.
#[derive(Debug, Default)]
pub(super) struct BoundaryConditions {
    /// Prescribed components and symmetry axes as rows u·d = value.
    pub(super) fixed: Vec<FixedRow>,
    /// The values of these rows: a point and an expression, `None` for the 0 of a symmetry axis.
    pub(super) prescribed: Vec<Option<([f64; 2], Expression)>>,
    /// The gap conditions u·ν ≤ g of Γ_C, by node, joined where boundaries meet smoothly.
    pub(super) gaps: Vec<GapRow>,
    /// The edges of Γ_C with their directions ν.
    pub(super) contact_edges: Vec<([usize; 2], [f64; 2])>,
    /// The tractions of Γ_N.
    pub(super) tractions: Vec<Traction>,
}

/// A traction on a part of the boundary.
#[derive(Debug, Clone)]
pub(super) struct Traction {
    /// The boundary's name.
    pub(super) boundary: String,
    pub(super) edges: Vec<Edge>,
    /// f_N, N/m².
    pub(super) force: [Expression; 2],
}

impl BoundaryConditions {
    /// The conditions of `scene` on `body`, whose mesh has all curves that the scene names.
    pub(super) fn new(scene: &Scene, body: &Body) -> Self {
        let (mesh, points) = (&body.mesh, &body.nodes.points);
        let mut conditions = Self::default();
        for boundary in &scene.boundaries {
            let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
            let edges = body.edges(&curve.edges);
            for node in boundary_nodes(edges.iter().flat_map(|edge| edge.faces(points))) {
                conditions.add_fixed_rows(boundary, points, &node);
                conditions.add_gap_rows(boundary, points, &node);
            }
            if let Some(gap) = boundary.gap() {
                let normal = |edge| gap.normal.unwrap_or(mesh.edge_normal(edge).0);
                conditions.contact_edges.extend(curve.edges.iter().map(|&e| (e, normal(e))));
            }
            if let Some(force) = boundary.traction() {
                let boundary = boundary.name.clone();
                conditions.tractions.push(Traction { boundary, edges, force: force.clone() });
            }
        }
        conditions.gaps = GapRow::joined(conditions.gaps);
        conditions
    }

    /// Finds the rigid motions that the conditions do not prevent, and makes the normals of axes and
    /// gaps exactly orthogonal to the free motions to which they are orthogonal up to rounding.
    pub(super) fn resolve_motions(&mut self, body: &Body) -> RigidMotions {
        let motions = RigidMotions::new(body, &self.fixed, &self.gaps);
        let axes = self.fixed.iter_mut().zip(&self.prescribed);
        for (row, _) in axes.filter(|(_, value)| value.is_none()) {
            row.direction = motions.tangential(body, row.node, row.direction);
        }
        for row in &mut self.gaps {
            row.normal = motions.tangential(body, row.node, row.normal);
        }
        motions
    }

    /// The foundation opposite the edges of Γ_C.
    pub(super) fn foundation(&self, mesh: &Mesh) -> Foundation {
        let mut foundation = Foundation::default();
        for &(edge, normal) in &self.contact_edges {
            let ends = edge.map(|node| {
                let ([x, y], (d, tangent)) = (mesh.nodes[node], self.opposite(node, normal));
                ([x, y], [x + d[0], y + d[1]], tangent)
            });
            foundation.contact_boundary.push(ends.map(|(point, ..)| point));
            foundation.segments.push(ends.map(|(_, opposite, _)| opposite));
            foundation.tangents.push(ends.map(|(.., tangent)| tangent));
        }
        foundation
    }

    /// The vector d from a node of Γ_C to the foundation, and the direction in which the node may
    /// slide: at a corner the d with d·ν = g for both conditions, and (0, 0); else d = g ν and the
    /// tangent. At a node between two plates, the condition nearer to `normal` counts.
    fn opposite(&self, node: usize, normal: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let first = self.gaps.partition_point(|row| row.node < node);
        let end = self.gaps.partition_point(|row| row.node <= node);
        let rows = &self.gaps[first..end];
        if let [a, b, ..] = rows {
            let (p, q) = (a.normal, b.normal);
            let cross = p[0] * q[1] - p[1] * q[0];
            if cross.abs() > 1e-4 {
                let (x, y) = (a.gap * q[1] - b.gap * p[1], b.gap * p[0] - a.gap * q[0]);
                return ([x / cross, y / cross], [0.0; 2]);
            }
        }
        let along = |row: &&GapRow| row.normal[0] * normal[0] + row.normal[1] * normal[1];
        let nearer = rows.iter().max_by(|a, b| along(a).total_cmp(&along(b)));
        nearer.map_or_else(Default::default, |row| {
            let [x, y] = row.normal;
            ([row.gap * x, row.gap * y], [-y, x])
        })
    }

    fn add_fixed_rows(&mut self, boundary: &Boundary, points: &[[f64; 2]], at: &BoundaryNode) {
        let node = at.node;
        for condition in &boundary.conditions {
            if let Condition::Displacement(components) = condition {
                for (component, direction) in components.iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
                    let Some(value) = component else { continue };
                    self.fixed.push(FixedRow { node, direction });
                    self.prescribed.push(Some((points[node], value.clone())));
                }
            }
            if let Condition::Symmetry = condition {
                for face in &at.faces {
                    self.fixed.push(FixedRow { node, direction: face.normal });
                    self.prescribed.push(None);
                }
            }
        }
    }

    fn add_gap_rows(&mut self, boundary: &Boundary, points: &[[f64; 2]], at: &BoundaryNode) {
        let Some(gap) = boundary.gap() else { return };
        let (node, distance) = (at.node, gap.at(points[at.node]));
        let row =
            |normal, tributary_length| GapRow { node, normal, gap: distance, tributary_length };
        match gap.normal {
            Some(normal) => {
                self.gaps.push(row(normal, at.faces.iter().map(|face| face.length).sum()));
            }
            None => self.gaps.extend(at.faces.iter().map(|face| row(face.normal, face.length))),
        }
    }
}

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
