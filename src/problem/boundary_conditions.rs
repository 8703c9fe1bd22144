//! The conditions of a scene on the named parts of the boundary, node by node and edge by edge.

use crate::{
    contact::{FixedRow, GapRow, RigidMotions},
    fem::{Body, Edge, normal_error},
    mesh::{BoundaryNode, Face, boundary_nodes, extent},
    scene::{Boundary, Condition, Expression, Gap, Scene, SurfaceLoad},
};

/// A constant gap below this fraction of the body's size counts as zero. The mesh generator rounds the nodes of
/// curved boundaries, and differences like `0.3-0.1*3` are rounded as well.
const ZERO_GAP: f64 = 1e-12;

/// The conditions of all boundaries.
#[derive(Debug, Default)]
pub(super) struct BoundaryConditions {
    /// Prescribed components and symmetry axes as rows u·d = value.
    pub(super) fixed: Vec<FixedRow>,
    /// Per row: the point and the expression of its value; `None` on a symmetry axis, where the value is 0.
    pub(super) prescribed: Vec<Option<([f64; 2], Expression)>>,
    /// The gap conditions u·ν ≤ g at the nodes of Γ_C, joined where boundaries meet smoothly.
    pub(super) gaps: Vec<GapRow>,
    pub(super) moving: Vec<MovingGap>,
    /// The surface loads of Γ_N.
    pub(super) tractions: Vec<Traction>,
    /// Per node: the largest possible angle between the mesh normal and the exact normal, rad.
    normal_errors: Vec<f64>,
}

/// A gap that depends on time.
#[derive(Debug, Clone)]
pub(super) struct MovingGap {
    /// The number of its row.
    pub(super) number: usize,
    /// The node, m.
    pub(super) point: [f64; 2],
    /// The distances, m; the gap is their minimum.
    pub(super) distances: Vec<Expression>,
}

impl MovingGap {
    /// g at time t, m; NaN if any distance is NaN.
    pub(super) fn at(&self, t: f64) -> f64 {
        let [x, y] = self.point;
        let distances = self.distances.iter().map(|g| g.eval(x, y, t));
        distances.fold(f64::INFINITY, |min, g| if min.is_nan() || g >= min { min } else { g })
    }
}

/// A surface load on a part of the boundary.
#[derive(Debug, Clone)]
pub(super) struct Traction {
    pub(super) edges: Vec<Edge>,
    /// f_N, N/m².
    pub(super) force: SurfaceLoad,
}

impl BoundaryConditions {
    /// The conditions of `scene` on `body`, whose mesh has all curves that the scene names.
    pub(super) fn new(scene: &Scene, body: &Body) -> Self {
        let (mesh, points) = (&body.mesh, &body.nodes.points);
        let mut conditions = Self { normal_errors: vec![0.0; points.len()], ..Self::default() };
        let mut gaps = Vec::new();
        let start = if scene.time.is_some() { 0.0 } else { 1.0 };
        let rounding = ZERO_GAP * extent(points);
        for boundary in &scene.boundaries {
            let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
            let edges = body.edges(&curve.edges);
            let follows_mesh = boundary.gap().is_none_or(|gap| gap.normal.is_none());
            let normal_error = if follows_mesh { normal_error(&edges, points) } else { 0.0 };
            for node in boundary_nodes(edges.iter().flat_map(|edge| edge.faces(points))) {
                conditions.add_fixed_rows(boundary, points, &node);
                let largest = &mut conditions.normal_errors[node.node];
                *largest = largest.max(normal_error);
                let Some(gap) = boundary.gap() else { continue };
                let [x, y] = points[node.node];
                let distance = match gap.distance.eval(x, y, start) {
                    g if g.abs() <= rounding && !gap.distance.depends_on_time() => g.max(0.0),
                    g => g,
                };
                gaps.extend(gap_rows(gap, distance, &node).map(|row| (row, &gap.distance)));
            }
            conditions.tractions.extend(
                boundary.loads().map(|f| Traction { edges: edges.clone(), force: f.clone() }),
            );
        }
        let (gaps, distances) = GapRow::joined(gaps);
        let moving = distances.into_iter().enumerate().map(|(number, distances)| MovingGap {
            number,
            point: points[gaps[number].node],
            distances: distances.into_iter().cloned().collect(),
        });
        let moves = |gap: &MovingGap| gap.distances.iter().any(Expression::depends_on_time);
        conditions.moving = moving.filter(moves).collect();
        Self { gaps, ..conditions }
    }

    /// Finds the rigid motions that the conditions do not prevent. If the normal of an axis or a gap is orthogonal
    /// to a free motion up to rounding, it becomes exactly orthogonal.
    pub(super) fn resolve_motions(&mut self, body: &Body) -> RigidMotions {
        let motions = RigidMotions::new(body, &self.fixed, &self.gaps, &self.normal_errors);
        let axes = self.fixed.iter_mut().zip(&self.prescribed);
        for (row, _) in axes.filter(|(_, value)| value.is_none()) {
            row.direction =
                motions.tangential(body, row.node, row.direction, self.normal_errors[row.node]);
        }
        for row in &mut self.gaps {
            row.normal =
                motions.tangential(body, row.node, row.normal, self.normal_errors[row.node]);
        }
        motions
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
}

/// The rows of a gap of width `distance`, m, at a node.
fn gap_rows(gap: &Gap, distance: f64, at: &BoundaryNode) -> impl Iterator<Item = GapRow> {
    let faces = match gap.normal {
        Some(normal) => {
            vec![Face { normal, length: at.faces.iter().map(|face| face.length).sum() }]
        }
        None => at.faces.clone(),
    };
    let node = at.node;
    faces.into_iter().map(move |Face { normal, length }| GapRow {
        node,
        normal,
        gap: distance,
        tributary_length: length,
    })
}
