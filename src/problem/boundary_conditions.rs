//! The conditions of a scene on the named parts of the boundary, node by node and edge by edge.

use crate::{
    ROUNDING,
    contact::{NodalConstraint, RigidMotions, RowLaw},
    fem::{Body, Elasticity, normal_error},
    mesh::{BoundaryFace, Lines, extent, joined_faces},
    scene::{Condition, Expression, Gap, Scene},
};

/// The conditions of all boundaries.
#[derive(Debug, Default)]
pub(super) struct BoundaryConditions {
    /// The prescribed displacements, then the gaps, joined where boundaries meet smoothly.
    pub(super) rows: Vec<NodalConstraint>,
    /// Per row: its value.
    pub(super) values: Vec<RowValue>,
    /// The number of boundaries that support the body, and per row of a prescribed displacement the number of its
    /// boundary among them.
    supports: usize,
    pub(super) prescribed_by: Vec<usize>,
    /// The elasticity of the materials.
    pub(super) elasticity: Elasticity,
    /// Per node: the largest possible angle between the mesh normal and the exact normal, rad.
    normal_errors: Vec<f64>,
}

/// The value of a row as a function of time.
#[derive(Debug, Clone)]
pub(super) struct RowValue {
    /// The place of its node, m.
    point: [f64; 2],
    /// The value is their minimum, m; 0 if there are none, on a symmetry axis.
    of: Vec<Expression>,
}

impl RowValue {
    /// The value at time t, m; NaN if any expression is NaN.
    pub(super) fn at(&self, t: f64) -> f64 {
        let [x, y] = self.point;
        let values = self.of.iter().map(|f| f.eval(x, y, t));
        values.reduce(|min, f| if min.is_nan() || f >= min { min } else { f }).unwrap_or(0.0)
    }

    pub(super) fn depends_on_time(&self) -> bool {
        self.of.iter().any(Expression::depends_on_time)
    }
}

impl BoundaryConditions {
    /// The conditions of `scene` on `body`, whose mesh has all curves that the scene names, and whose boundary is `lines`.
    pub(super) fn new(scene: &Scene, body: &Body, lines: &Lines) -> Self {
        let (mesh, points) = (&body.mesh, &body.nodes.points);
        let elasticity = Elasticity::new(scene.materials());
        let normal_errors = vec![0.0; points.len()];
        let mut conditions = Self { elasticity, normal_errors, ..Self::default() };
        let mut gaps = Vec::new();
        // A smaller constant gap counts as zero: nodes of curves and differences like `0.3-0.1*3` are rounded.
        let rounding = ROUNDING * extent(points);
        for boundary in &scene.boundaries {
            let edges = body.edges(mesh.edges_of(&boundary.name));
            let follows_mesh = boundary.gap().is_none_or(|gap| gap.normal.is_none());
            let normal_error = if follows_mesh { normal_error(&edges, points, lines) } else { 0.0 };
            let faces = edges.iter().flat_map(|edge| edge.faces(points, lines));
            for (node, faces) in joined_faces(faces.map(|(node, face)| (node, face, ()))) {
                let (point, faces) = (points[node], faces.iter().map(|(face, _)| *face));
                let largest = &mut conditions.normal_errors[node];
                *largest = largest.max(normal_error);
                let prescribed =
                    |direction| NodalConstraint { node, direction, law: RowLaw::Prescribed };
                for condition in &boundary.conditions {
                    match condition {
                        Condition::Displacement([x, y]) => {
                            for (value, axis) in [(x, [1.0, 0.0]), (y, [0.0, 1.0])] {
                                let values = value.iter().map(|value| vec![value.clone()]);
                                values.for_each(|of| conditions.add(prescribed(axis), point, of));
                            }
                        }
                        Condition::Symmetry => faces.clone().for_each(|face| {
                            conditions.add(prescribed(face.normal), point, Vec::new());
                        }),
                        Condition::Gap(gap) => {
                            let distance = distance(gap, point, scene.start(), rounding);
                            let length = faces.clone().map(|face| face.length).sum();
                            let plane =
                                gap.normal.map(|normal| BoundaryFace::plane(normal, length));
                            let faces =
                                plane.map_or_else(|| faces.clone().collect(), |of| vec![of]);
                            gaps.extend(faces.into_iter().map(|of| (node, of, distance.clone())));
                        }
                        Condition::Load(_) => {}
                    }
                }
            }
            conditions.supports += usize::from(boundary.is_support());
        }
        for (node, faces) in joined_faces(gaps) {
            for (BoundaryFace { normal: direction, length, .. }, distances) in faces {
                let law = RowLaw::Rigid { tributary_length: length };
                let row = NodalConstraint { node, direction, law };
                conditions.add(row, points[node], distances);
            }
        }
        conditions
    }

    /// Adds a condition at a point; if it prescribes a displacement, for the support that is counted next.
    fn add(&mut self, row: NodalConstraint, point: [f64; 2], of: Vec<Expression>) {
        if !row.is_gap() {
            self.prescribed_by.push(self.supports);
        }
        self.rows.push(row);
        self.values.push(RowValue { point, of });
    }

    /// Finds the rigid motions that the conditions do not prevent. If the normal of an axis or a gap is orthogonal
    /// to a free motion up to rounding, it becomes exactly orthogonal.
    pub(super) fn resolve_motions(&mut self, body: &Body) -> RigidMotions {
        let motions = RigidMotions::new(body, &self.rows, &self.normal_errors);
        let rows = self.rows.iter_mut().zip(&self.values);
        for (row, _) in rows.filter(|(row, value)| row.is_gap() || value.of.is_empty()) {
            row.direction =
                motions.tangential(body, row.node, row.direction, self.normal_errors[row.node]);
        }
        motions
    }
}

/// The distance of a gap at a point. If it is constant and less than `rounding`, it is zero.
fn distance(gap: &Gap, [x, y]: [f64; 2], start: f64, rounding: f64) -> Expression {
    match gap.distance.eval(x, y, start) {
        _ if gap.distance.depends_on_time() => gap.distance.clone(),
        g => Expression::constant(if g.abs() <= rounding { g.max(0.0) } else { g }),
    }
}
