//! The boundaries that support the body and the forces they exert.

use super::{ContactLine, ObservedProblem};
use crate::{
    ROUNDING,
    contact::ContactPoint,
    fem::{Body, Edge, Subdomain},
    mesh::{BoundaryFace, Lines, extent, sorted},
    problem::{DiscreteProblem, State},
    scene::{Boundary, SurfaceLoad},
};
use nalgebra::{Matrix2, Vector2, Vector3};
use std::{
    cell::LazyCell,
    collections::{BTreeMap, BTreeSet},
};

/// The boundaries with prescribed displacements or a gap, and the nodes of this rank on them.
#[derive(Debug, Clone, Default)]
pub struct Supports {
    /// Their names, in the order of the scene.
    pub names: Vec<String>,
    /// Per node with a prescribed displacement: its prescribed directions, with the number of the boundary.
    prescribed: BTreeMap<usize, Vec<(usize, [f64; 2])>>,
    /// Per node at which one boundary prescribes the displacement and another one supports the body, too: their edges there.
    edges: BTreeMap<usize, Vec<NodeEdge>>,
    /// A gap up to this is closed, m.
    closed: f64,
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
    /// The surface loads on it.
    loads: Vec<SurfaceLoad>,
}

impl Supports {
    /// The supports of an undivided problem, with the lines of its boundary.
    pub(super) fn new(problem: &DiscreteProblem, lines: &Lines) -> Self {
        let (scene, body) = (problem.scene(), &problem.body);
        let closed = ROUNDING * extent(&body.nodes.points);
        let names = scene.boundaries.iter().filter(|of| of.is_support());
        let names = names.map(|of| of.name.clone()).collect();
        let mut supports = Self { names, closed, ..Self::default() };
        for (boundary, row) in &problem.prescribed {
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
        let is_shared = |(node, of): &(&usize, &Vec<(usize, [f64; 2])>)| {
            supports.contact.has(**node) || of.iter().any(|(number, _)| *number != of[0].0)
        };
        let shared = supports.prescribed.iter().filter(is_shared);
        let shared: BTreeSet<usize> = shared.map(|(node, _)| *node).collect();
        let mut loads = BTreeMap::<[usize; 2], Vec<&SurfaceLoad>>::new();
        for boundary in &scene.boundaries {
            let edges = body.mesh.edges_of(&boundary.name).iter();
            let loaded = edges.flat_map(|edge| boundary.loads().map(|load| (sorted(*edge), load)));
            loaded.for_each(|(edge, load)| loads.entry(edge).or_default().push(load));
        }
        let is_shared = |edge: &&[usize; 2]| edge.iter().any(|node| shared.contains(node));
        for (number, name) in supports.names.iter().enumerate() {
            let edges = body.mesh.edges_of(name).iter().filter(is_shared).copied();
            let edges = Vec::from_iter(edges);
            let triangles = body.mesh.triangles_at(&edges);
            for edge in body.edges(&edges) {
                let (triangle, _) = triangles[&sorted(edge.ends)];
                let loads = loads.get(&sorted(edge.ends)).into_iter().flatten();
                let loads: Vec<SurfaceLoad> = loads.map(|load| (*load).clone()).collect();
                for (node, face) in edge.faces(&body.nodes.points, lines) {
                    let at = coordinates(&body.mesh.triangles[triangle], &edge, node);
                    let loads = loads.clone();
                    let of_node = NodeEdge { boundary: number, triangle, at, face, loads };
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
            closed: self.closed,
        }
    }

    /// Per boundary: (F_x, F_y, M), this rank's part, with F = Σ R_i, N per metre of thickness, and M = Σ x_i × R_i
    /// about the origin, positive anticlockwise, N.
    ///
    /// R_i = (Ku − f)_i is the force on the body at node i; `unbalanced` is f − Ku. The obstacle exerts the forces of the
    /// `state`, and the other boundaries exert the rest. `stress` is σ in a triangle at barycentric coordinates, Pa.
    pub(super) fn resultants(
        &self,
        body: &Body,
        state: &State,
        unbalanced: &[f64],
        stress: impl Fn(usize, [f64; 3]) -> Vector3<f64>,
    ) -> Vec<[f64; 3]> {
        let t = state.time;
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
        for point in state.of_contact() {
            let force = point.normal.map(|n| -point.force * n);
            for share in self.contact.shares(point, t) {
                let boundary = self.contact.line_nodes[share.line_node].boundary;
                add(boundary, points[point.node], force.map(|f| share.force * f));
            }
            if let Some([x, y]) = rest.get_mut(&point.node) {
                (*x, *y) = (*x - force[0], *y - force[1]);
            }
        }
        for ([from, to], at, force) in self.contact.moved_forces(body, state) {
            add(from, at, force.map(|f| -f));
            add(to, at, force);
        }
        for (node, force) in rest {
            let at = (node, points[node], t);
            let exerted = self.divided(at, force.into(), &self.prescribed[&node], &stress);
            exerted
                .into_iter()
                .for_each(|(boundary, force)| add(boundary, points[node], force.into()));
        }
        sums
    }

    /// Divides the force F at a node, N/m, between the boundaries that support it in these `directions`. The node has the place
    /// x, m, at the time t.
    ///
    /// The tractions of a boundary B on its edges there have the part R_B = P_B ∫φ (σν − f_N), with the projection P_B on the
    /// directions in which it supports the node, and its loads f_N. Its length ℓ_B = ∫φ takes a share in the rest: B exerts
    /// R_B + ℓ_B P_B λ, where (Σ ℓ_B P_B) λ = F − Σ R_B.
    fn divided(
        &self,
        (node, x, t): (usize, [f64; 2], f64),
        force: Vector2<f64>,
        directions: &[(usize, [f64; 2])],
        stress: impl Fn(usize, [f64; 3]) -> Vector3<f64>,
    ) -> Vec<(usize, Vector2<f64>)> {
        let numbers: BTreeSet<usize> = directions.iter().map(|(number, _)| *number).collect();
        let Some(edges) = self.edges.get(&node).filter(|_| numbers.len() > 1) else {
            return vec![(directions[0].0, force)];
        };
        let part = |number: usize| {
            let own = edges.iter().filter(|edge| edge.boundary == number);
            let traction = own.clone().map(|NodeEdge { triangle, at, face, loads, .. }| {
                let [xx, yy, xy] = stress(*triangle, *at).into();
                let loads = loads.iter().map(|load| Vector2::from(load.at(x, face.normal, t)));
                let internal = Matrix2::new(xx, xy, xy, yy) * Vector2::from(face.normal);
                (internal - loads.sum::<Vector2<f64>>()) * face.length
            });
            let length: f64 = own.map(|edge| edge.face.length).sum();
            let directions = directions.iter().filter(|(other, _)| *other == number);
            let onto = projection(directions.map(|(_, direction)| Vector2::from(*direction)));
            (number, onto * traction.sum::<Vector2<f64>>(), length * onto)
        };
        let parts: Vec<_> = numbers.into_iter().map(part).collect();
        let weights: Matrix2<f64> = parts.iter().map(|(.., weight)| weight).sum();
        let rest = force - parts.iter().map(|(_, own, _)| own).sum::<Vector2<f64>>();
        // The square makes the tolerance positive, as nalgebra demands.
        let inverse = weights.pseudo_inverse(SINE * SINE * weights.trace()).unwrap_or_default();
        let rest = inverse * rest;
        let exerted = parts.iter().map(|(number, own, weight)| (*number, own + weight * rest));
        let mut exerted: Vec<_> = exerted.collect();
        // The parts sum to the force, up to rounding. The first boundary takes the difference.
        let all = exerted.iter().map(|(_, own)| own).sum::<Vector2<f64>>();
        exerted[0].1 += force - all;
        exerted
    }
}

impl ObservedProblem {
    /// σ of a state in a triangle at barycentric coordinates, Pa.
    pub(super) fn stress_in(&self, state: &State) -> impl Fn(usize, [f64; 3]) -> Vector3<f64> {
        let zeta = LazyCell::new(|| self.zeta_at_points(&state.zeta));
        move |t, at| self.elasticity.stress_at(&self.body, (t, at), &zeta, &state.u)
    }

    /// The nodes of Γ_C with a prescribed normal displacement, with the part of their reactions that Γ_C exerts. It presses
    /// where its gap is closed, and this part is more than `rounding`, N per metre of thickness.
    /// `unbalanced` is f − Ku.
    pub(crate) fn pressed(
        &self,
        state: &State,
        unbalanced: &[f64],
        rounding: f64,
    ) -> Vec<ContactPoint> {
        let (supports, stress) = (&self.supports, self.stress_in(state));
        let pressed = |point: &ContactPoint| {
            let shares = supports.contact.shares(point, state.time);
            let bears = shares.iter().find(|share| share.force > 0.0)?;
            let number = supports.contact.line_nodes[bears.line_node].boundary;
            let gap = [(number, point.normal)];
            let directions = [supports.prescribed.get(&point.node)?, &gap[..]].concat();
            let at = (point.node, self.body.nodes.points[point.node], state.time);
            let reaction =
                -Vector2::new(unbalanced[2 * point.node], unbalanced[2 * point.node + 1]);
            let exerted = supports.divided(at, reaction, &directions, &stress);
            let own = exerted.iter().filter(|(other, _)| *other == number);
            let normal = Vector2::from(point.normal);
            let force: f64 = own.map(|(_, force)| -force.dot(&normal)).sum();
            let edges = supports.edges.get(&point.node)?.iter().filter(|of| of.boundary == number);
            let length: f64 = edges.map(|edge| edge.face.length).sum();
            let active = point.gap <= supports.closed && force > rounding;
            let [force, pressure] = if active { [force, force / length] } else { [0.0; 2] };
            Some(ContactPoint { force, pressure, active, ..*point })
        };
        state.prescribed.iter().map(|point| pressed(point).unwrap_or(*point)).collect()
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
