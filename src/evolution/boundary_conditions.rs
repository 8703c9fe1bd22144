//! What a scene asks for on the named parts of the boundary, in terms of the mesh, and the foundation
//! opposite Γ_C for pictures.

use crate::{
    contact::{FixedRow, GapRow, RigidMotions},
    fem::{Body, Edge},
    mesh::{BoundaryNode, Mesh, boundary_nodes, extent},
    scene::{Boundary, Condition, Expression, Gap, Scene, SurfaceLoad},
};

/// A constant gap nearer to zero than this, relative to the size of the body, is zero: nodes on curved
/// boundaries carry the mesh generator's rounding, differences like `0.3-0.1*3` their own.
const ROUNDING: f64 = 1e-12;

/// The conditions of all boundaries.
#[derive(Debug, Default)]
pub(super) struct BoundaryConditions {
    /// Prescribed components and symmetry axes as rows u·d = value.
    pub(super) fixed: Vec<FixedRow>,
    /// The values of these rows: a point and an expression, `None` for the 0 of a symmetry axis.
    pub(super) prescribed: Vec<Option<([f64; 2], Expression)>>,
    /// The gap conditions u·ν ≤ g of Γ_C, by node, joined where boundaries meet smoothly.
    pub(super) gaps: Vec<GapRow>,
    /// Of these the ones that depend on time.
    pub(super) moving: Vec<MovingGap>,
    /// The edges of Γ_C with their directions ν.
    pub(super) contact_edges: Vec<([usize; 2], [f64; 2])>,
    /// The surface loads of Γ_N.
    pub(super) tractions: Vec<Traction>,
}

/// A gap that depends on time.
#[derive(Debug, Clone)]
pub(super) struct MovingGap {
    /// The number of its row.
    pub(super) number: usize,
    /// Where it is, m.
    pub(super) point: [f64; 2],
    /// The distances, of which the least counts, m.
    pub(super) distances: Vec<Expression>,
}

impl MovingGap {
    /// g at a time, m; NaN if any distance is.
    pub(super) fn at(&self, t: f64) -> f64 {
        let [x, y] = self.point;
        let distances = self.distances.iter().map(|g| g.eval(x, y, t));
        distances
            .fold(f64::INFINITY, |least, g| if least.is_nan() || g >= least { least } else { g })
    }
}

/// A surface load on a part of the boundary.
#[derive(Debug, Clone)]
pub(super) struct Traction {
    /// The boundary's name.
    pub(super) boundary: String,
    pub(super) edges: Vec<Edge>,
    /// f_N, N/m².
    pub(super) force: SurfaceLoad,
}

impl BoundaryConditions {
    /// The conditions of `scene` on `body`, whose mesh has all curves that the scene names.
    pub(super) fn new(scene: &Scene, body: &Body) -> Self {
        let (mesh, points) = (&body.mesh, &body.nodes.points);
        let mut conditions = Self::default();
        let mut gaps = Vec::new();
        let start = if scene.time.is_some() { 0.0 } else { 1.0 };
        let rounding = ROUNDING * extent(points);
        for boundary in &scene.boundaries {
            let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
            let edges = body.edges(&curve.edges);
            for node in boundary_nodes(edges.iter().flat_map(|edge| edge.faces(points))) {
                conditions.add_fixed_rows(boundary, points, &node);
                let Some(gap) = boundary.gap() else { continue };
                let [x, y] = points[node.node];
                let distance = match gap.distance.eval(x, y, start) {
                    g if g.abs() <= rounding && !gap.distance.depends_on_time() => g.max(0.0),
                    g => g,
                };
                gaps.extend(gap_rows(gap, distance, &node).map(|row| (row, &gap.distance)));
            }
            if let Some(gap) = boundary.gap() {
                let normal = |edge| gap.normal.unwrap_or(mesh.edge_normal(edge).0);
                conditions.contact_edges.extend(curve.edges.iter().map(|&e| (e, normal(e))));
            }
            conditions.tractions.extend(boundary.loads().map(|force| Traction {
                boundary: boundary.name.clone(),
                edges: edges.clone(),
                force: force.clone(),
            }));
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

    /// The edges of Γ_C, with what is opposite their ends.
    pub(super) fn contact_boundary(&self, mesh: &Mesh) -> ContactBoundary {
        let ends = |&(edge, normal): &([usize; 2], [f64; 2])| {
            edge.map(|node| End { point: mesh.nodes[node], rows: self.opposite(node, normal) })
        };
        ContactBoundary { edges: self.contact_edges.iter().map(ends).collect() }
    }

    /// The gap conditions at a node of Γ_C that tell where the foundation is: at a corner both. At a
    /// node between two plates, the condition nearer to `normal`.
    fn opposite(&self, node: usize, normal: [f64; 2]) -> Vec<(usize, GapRow)> {
        let first = self.gaps.partition_point(|row| row.node < node);
        let end = self.gaps.partition_point(|row| row.node <= node);
        let rows: Vec<_> = (first..end).map(|number| (number, self.gaps[number])).collect();
        if let [(_, a), (_, b), ..] = rows[..]
            && cross(a.normal, b.normal).abs() > 1e-4
        {
            return rows[..2].to_vec();
        }
        let along =
            |(_, row): &(usize, GapRow)| row.normal[0] * normal[0] + row.normal[1] * normal[1];
        rows.into_iter().max_by(|a, b| along(a).total_cmp(&along(b))).into_iter().collect()
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

/// The rows of a gap of the width `distance`, m, at a node.
fn gap_rows(gap: &Gap, distance: f64, at: &BoundaryNode) -> impl Iterator<Item = GapRow> {
    let row = |normal, tributary_length| GapRow {
        node: at.node,
        normal,
        gap: distance,
        tributary_length,
    };
    let rows: Vec<GapRow> = match gap.normal {
        Some(normal) => vec![row(normal, at.faces.iter().map(|face| face.length).sum())],
        None => at.faces.iter().map(|face| row(face.normal, face.length)).collect(),
    };
    rows.into_iter()
}

/// Γ_C, edge by edge.
#[derive(Debug, Clone)]
pub(super) struct ContactBoundary {
    pub(super) edges: Vec<[End; 2]>,
}

/// An end of an edge of Γ_C.
#[derive(Debug, Clone)]
pub(super) struct End {
    point: [f64; 2],
    /// The gap conditions that tell where the foundation is, with their numbers: two at a corner.
    rows: Vec<(usize, GapRow)>,
}

impl ContactBoundary {
    /// The foundation where the rows have these `gaps`, m.
    pub(super) fn foundation(&self, gaps: &[f64]) -> Foundation {
        let mut foundation = Foundation::default();
        for ends in &self.edges {
            let opposite = ends.each_ref().map(|end| end.opposite(gaps));
            let at = |i: usize| [0, 1].map(|k| ends[i].point[k] + opposite[i].0[k]);
            foundation.contact_boundary.push([0, 1].map(|i| ends[i].point));
            foundation.segments.push([0, 1].map(at));
            foundation.tangents.push(opposite.map(|(_, tangent)| tangent));
        }
        foundation
    }
}

impl End {
    /// The vector d to the foundation, and the direction in which the node may slide: at a corner the d
    /// with d·ν = g for both conditions, and (0, 0); else d = g ν and the tangent.
    fn opposite(&self, gaps: &[f64]) -> ([f64; 2], [f64; 2]) {
        match self.rows[..] {
            [(i, GapRow { normal: p, .. }), (j, GapRow { normal: q, .. })] => {
                let (x, y) = (gaps[i] * q[1] - gaps[j] * p[1], gaps[j] * p[0] - gaps[i] * q[0]);
                ([x / cross(p, q), y / cross(p, q)], [0.0; 2])
            }
            [(i, GapRow { normal: [x, y], .. }), ..] => ([gaps[i] * x, gaps[i] * y], [-y, x]),
            [] => Default::default(),
        }
    }
}

fn cross(p: [f64; 2], q: [f64; 2]) -> f64 {
    p[0] * q[1] - p[1] * q[0]
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
