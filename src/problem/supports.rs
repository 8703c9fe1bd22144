//! The boundaries that support the body and the forces they exert.

use super::{ContactLine, State, boundary_conditions::BoundaryConditions};
use crate::{
    fem::{Body, Edge, Subdomain},
    mesh::{BoundaryFace, Lines, sorted},
    scene::{Boundary, Scene},
};
use nalgebra::{Matrix2, Vector2, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// The boundaries with prescribed displacements or a gap, and the nodes of this rank on them.
#[derive(Debug, Clone, Default)]
pub struct Supports {
    /// Their names, in the order of the scene.
    pub names: Vec<String>,
    /// Per node with a prescribed displacement: its prescribed directions, with the number of the boundary.
    prescribed: BTreeMap<usize, Vec<(usize, [f64; 2])>>,
    /// Per node at which several boundaries prescribe the displacement: their edges there.
    edges: BTreeMap<usize, Vec<NodeEdge>>,
    /// Γ_C.
    pub contact: ContactLine,
}

/// An edge of a boundary at one of its nodes i.
#[derive(Debug, Clone)]
struct NodeEdge {
    /// The number of the boundary.
    boundary: usize,
    /// The triangle of the edge, and the node's barycentric coordinates in it.
    triangle: usize,
    at: [f64; 3],
    /// ν and ∫φ_i.
    face: BoundaryFace,
}

impl Supports {
    /// The supports of `scene` on the undivided `body`, with its `conditions` and the lines of its boundary.
    pub(super) fn new(
        scene: &Scene,
        body: &Body,
        conditions: &BoundaryConditions,
        lines: &Lines,
    ) -> Self {
        let mut supports = Self { names: conditions.supports.clone(), ..Self::default() };
        for (row, boundary) in conditions.rows.iter().zip(&conditions.prescribed_by) {
            supports.prescribed.entry(row.node).or_default().push((*boundary, row.direction));
        }
        let contact = scene.boundaries.iter().filter_map(|boundary @ Boundary { name, .. }| {
            let number = supports.names.iter().position(|other| other == name)?;
            let edges = body.edges(body.mesh.edges_of(name));
            Some((number, &**name, boundary.gap()?, edges))
        });
        // There an interface ends at the boundary.
        let is_between = |(node, ends): (usize, Vec<usize>)| {
            let of_boundary = lines.ends.get(&node).map_or(0, Vec::len);
            (of_boundary > 0 && ends.len() > of_boundary).then_some(node)
        };
        let zones =
            (!body.materials.is_empty()).then(|| Lines::new(&body.mesh, |t| body.material(t)));
        let between = zones.into_iter().flat_map(|of| of.ends).filter_map(is_between).collect();
        supports.contact = ContactLine::new(contact, &body.nodes.points, lines, &between);
        let several = |of: &[(usize, [f64; 2])]| of.iter().any(|(number, _)| *number != of[0].0);
        let shared = supports.prescribed.iter().filter(|(_, of)| several(of));
        let shared: BTreeSet<usize> = shared.map(|(node, _)| *node).collect();
        let is_shared = |edge: &&[usize; 2]| edge.iter().any(|node| shared.contains(node));
        for (number, name) in supports.names.iter().enumerate() {
            let edges = body.mesh.edges_of(name).iter().filter(is_shared).copied();
            let edges = Vec::from_iter(edges);
            let triangles = body.mesh.triangles_at(&edges);
            for edge in body.edges(&edges) {
                let (triangle, _) = triangles[&sorted(edge.ends)];
                for (node, face) in edge.faces(&body.nodes.points, lines) {
                    let at = coordinates(&body.mesh.triangles[triangle], &edge, node);
                    let of_node = NodeEdge { boundary: number, triangle, at, face };
                    supports.edges.entry(node).or_default().push(of_node);
                }
            }
        }
        supports.edges.retain(|node, _| shared.contains(node));
        supports
    }

    pub(super) fn restrict(&self, subdomain: &Subdomain) -> Self {
        let own = |node: &usize| subdomain.owned(*node);
        let prescribed = self.prescribed.iter();
        // A rank keeps all triangles around its own nodes.
        let local = |edge: &NodeEdge| {
            Some(NodeEdge { triangle: subdomain.triangle(edge.triangle)?, ..edge.clone() })
        };
        let edges = self.edges.iter();
        let edges =
            edges.filter_map(|(n, of)| Some((own(n)?, of.iter().filter_map(local).collect())));
        Self {
            names: self.names.clone(),
            prescribed: prescribed.filter_map(|(n, of)| Some((own(n)?, of.clone()))).collect(),
            edges: edges.collect(),
            contact: self.contact.restrict(own),
        }
    }

    /// Per boundary: (F_x, F_y, M), this rank's part, with F = Σ R_i, N per metre of thickness, and M = Σ x_i × R_i
    /// about the origin, positive anticlockwise, N.
    ///
    /// R_i = (Ku − f)_i is the force on the body at node i; `unbalanced` is f − Ku. At a prescribed node with a
    /// closed gap, the obstacle exerts the normal reaction and the other boundaries exert the rest. `stress` is σ in a
    /// triangle at barycentric coordinates, Pa.
    pub(super) fn resultants(
        &self,
        body: &Body,
        state: &State,
        unbalanced: &[f64],
        stress: impl Fn(usize, [f64; 3]) -> Vector3<f64>,
    ) -> Vec<[f64; 3]> {
        let (contact, t) = (&state.contact[..], state.time);
        let mut sums = vec![[0.0; 3]; self.names.len()];
        let points = &body.nodes.points;
        let mut add = |boundary: usize, [x, y]: [f64; 2], [fx, fy]: [f64; 2]| {
            for (sum, part) in sums[boundary].iter_mut().zip([fx, fy, x * fy - y * fx]) {
                *sum += part;
            }
        };
        let mut rest: BTreeMap<usize, [f64; 2]> = (self.prescribed.keys())
            .map(|&node| (node, [-unbalanced[2 * node], -unbalanced[2 * node + 1]]))
            .collect();
        for point in contact {
            let force = point.normal.map(|n| -point.force * n);
            for share in self.contact.shares(point, t) {
                let boundary = self.contact.line_nodes[share.line_node].boundary;
                add(boundary, points[point.node], force.map(|f| share.force * f));
            }
            if let Some([x, y]) = rest.get_mut(&point.node) {
                (*x, *y) = (*x - force[0], *y - force[1]);
            }
        }
        for ([from, to], at, force) in self.contact.moved_forces(body, (contact, t)) {
            add(from, at, force.map(|f| -f));
            add(to, at, force);
        }
        for (node, force) in rest {
            let exerted = self.divided(node, force.into(), &stress);
            exerted
                .into_iter()
                .for_each(|(boundary, force)| add(boundary, points[node], force.into()));
        }
        sums
    }

    /// Divides the force F at a node, N/m, between the boundaries that prescribe its displacement.
    ///
    /// The tractions of a boundary B on its edges there have the part R_B = P_B ∫φ σν, with the projection P_B on the
    /// directions that it prescribes. Its length ℓ_B = ∫φ takes a share in the rest: B exerts R_B + ℓ_B P_B λ, where
    /// (Σ ℓ_B P_B) λ = F − Σ R_B.
    fn divided(
        &self,
        node: usize,
        force: Vector2<f64>,
        stress: impl Fn(usize, [f64; 3]) -> Vector3<f64>,
    ) -> Vec<(usize, Vector2<f64>)> {
        let prescribed = &self.prescribed[&node];
        let Some(edges) = self.edges.get(&node) else { return vec![(prescribed[0].0, force)] };
        let numbers: BTreeSet<usize> = prescribed.iter().map(|(number, _)| *number).collect();
        let part = |number: usize| {
            let own = edges.iter().filter(|edge| edge.boundary == number);
            let traction = own.clone().map(|NodeEdge { triangle, at, face, .. }| {
                let [xx, yy, xy] = stress(*triangle, *at).into();
                Matrix2::new(xx, xy, xy, yy) * Vector2::from(face.normal) * face.length
            });
            let length: f64 = own.map(|edge| edge.face.length).sum();
            let directions = prescribed.iter().filter(|(other, _)| *other == number);
            let onto = projection(directions.map(|(_, direction)| Vector2::from(*direction)));
            (number, onto * traction.sum::<Vector2<f64>>(), length * onto)
        };
        let parts: Vec<_> = numbers.into_iter().map(part).collect();
        let weights: Matrix2<f64> = parts.iter().map(|(.., weight)| weight).sum();
        let rest = force - parts.iter().map(|(_, own, _)| own).sum::<Vector2<f64>>();
        // A negative tolerance would be an error.
        let inverse = weights.pseudo_inverse(SINE * SINE * weights.trace()).unwrap_or_default();
        let rest = inverse * rest;
        let exerted = parts.iter().map(|(number, own, weight)| (*number, own + weight * rest));
        let mut exerted: Vec<_> = exerted.collect();
        // Rounding across all directions.
        let all = exerted.iter().map(|(_, own)| own).sum::<Vector2<f64>>();
        exerted[0].1 += force - all;
        exerted
    }
}

/// Directions are parallel if the sine of the angle between them is at most this.
const SINE: f64 = 1e-6;

/// The projection on the span of unit vectors.
fn projection(directions: impl Iterator<Item = Vector2<f64>> + Clone) -> Matrix2<f64> {
    let first = directions.clone().next().unwrap_or_default();
    let is_plane = directions.map(|other| first.perp(&other).abs()).any(|sine| sine > SINE);
    if is_plane { Matrix2::identity() } else { first * first.transpose() }
}

/// The barycentric coordinates of a node of an edge in a triangle.
fn coordinates(triangle: &[usize; 3], edge: &Edge, node: usize) -> [f64; 3] {
    triangle.map(|vertex| match edge.middle == Some(node) && edge.ends.contains(&vertex) {
        true => 0.5,
        false => f64::from(u8::from(vertex == node)),
    })
}
