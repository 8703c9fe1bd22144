//! Rigid motions that prescribed displacements leave free, piece by piece of the mesh: the null
//! space of K, and which of it contact constrains.

mod free;
mod least;
mod load;
mod motion;
mod nonnegative;
mod until_contact;

pub(crate) use least::least_motion;
pub use load::DrivenMotion;
pub use motion::{PartMotion, RigidMotion};
pub(crate) use until_contact::{rigid_motion_until_contact, unconstrained_motions};

use super::{Bound, FixedRow, GapRow};
use crate::{
    fem::{Body, Subdomain},
    mesh::Components,
};
use nalgebra::{DMatrix, DVector};
use std::{collections::BTreeSet, ops::Range};

/// The rigid motions that prescribed displacements leave free.
///
/// Those of a piece are orthonormal with respect to ∫u·v, divided by the area of the piece.
#[derive(Debug, Clone)]
pub struct RigidMotions {
    /// Unconstrained, even by contact in either sense.
    pub free: Vec<RigidMotion>,
    /// Per free motion: the largest |u·ν| at axes and gaps, as much as the motion itself is uncertain.
    free_errors: Vec<f64>,
    /// Those that contact resists in one sense, piece by piece.
    pub resisted: Vec<RigidMotion>,
    /// u·ν of the resisted motions, one row per gap condition of the undivided body.
    normal: DMatrix<f64>,
    parts: Vec<Part>,
    part_of_node: Vec<usize>,
    /// Number of pieces of the mesh.
    pub pieces: usize,
    /// Where parts of a piece meet in a node, the first such place, m.
    pub hinge: Option<[f64; 2]>,
}

/// A part of the mesh that hangs together through edges.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    area: f64,
    centre: [f64; 2],
    /// Radius of gyration, m: a rotation by 1/radius moves the part as far as a unit translation.
    radius: f64,
    /// √w with w its part of the piece's area.
    weight: f64,
}

/// Squares of motions are zero below this, relative, that is motions below 3e-5. gmsh cuts a
/// circle into edges that are equal to 1e-8, by which a disc in a bore turns freely to 5e-10
/// (measured); forces within the KKT tolerance 1e-10 cannot tell motions below 1e-5 from none;
/// and one node among a thousand that stops a motion squarely is still 1e-3.
const ROUNDING: f64 = 1e-9;
/// Squares of motions that prescribed displacements prevent are above this, relative: rounding of
/// the Gram matrix and its eigenvalues. A clamp as short as 1e-6 of the body still prevents its
/// rotation.
const PREVENTED: f64 = 1e-14;

impl RigidMotions {
    /// From the fixed rows and the gap conditions, joined node by node as in the bounds. `normal_errors` are
    /// how far the normals at each node may be from those of the geometry, rad: a motion u along a curved boundary
    /// is free although |u·ν| is up to that times |u|.
    pub fn new(body: &Body, fixed: &[FixedRow], gaps: &[GapRow], normal_errors: &[f64]) -> Self {
        let Components { part_of_triangle, part_of_node, pieces, hinges } = body.mesh.components();
        let part_of_node = body.with_midpoints(part_of_node, &part_of_triangle);
        let nodes = &body.nodes.points;
        let mut motions = Self {
            free: Vec::new(),
            free_errors: Vec::new(),
            resisted: Vec::new(),
            normal: DMatrix::zeros(0, 0),
            parts: Part::all(body, &part_of_node, &pieces, &hinges),
            part_of_node,
            pieces: pieces.len(),
            hinge: hinges.first().map(|&(node, _)| nodes[node]),
        };
        let normals: Vec<_> = gaps.iter().map(|gap| (gap.node, gap.normal)).collect();
        for parts in &pieces {
            let here = |node: usize| parts.binary_search(&motions.part_of_node[node]).is_ok();
            let fixed: Vec<_> = fixed.iter().filter(|row| here(row.node)).copied().collect();
            let hinges: Vec<_> = hinges.iter().filter(|hinge| here(hinge.0)).copied().collect();
            let normals: Vec<_> = normals.iter().filter(|row| here(row.0)).copied().collect();
            let (free, resisted) =
                motions.of_piece(nodes, parts, &fixed, &hinges, (&normals, normal_errors));
            motions.free.extend(free);
            motions.resisted.extend(resisted);
        }
        let axes = fixed.iter().map(|row| (row.node, row.direction));
        let conditions: Vec<_> = normals.iter().copied().chain(axes).collect();
        let errors = motions.normal_displacements(nodes, &motions.free, &conditions);
        motions.free_errors = errors.column_iter().map(|column| column.amax()).collect();
        motions.normal = motions.normal_displacements(nodes, &motions.resisted, &normals);
        motions
    }

    /// The motions of the piece of these `parts`, the free ones and the resisted ones: the null space
    /// of Σ r rᵀ over the rows r·v = 0 of prescribed displacements and hinges. Of these, the free ones
    /// are in the null space of u·ν at its gap conditions too.
    ///
    /// The coordinates v are of part k √w_k (a_x, a_y, r_k θ) with w_k its part of the piece's area, so
    /// that |v|² is the mean of |u|² over the piece.
    fn of_piece(
        &self,
        nodes: &[[f64; 2]],
        parts: &[usize],
        fixed: &[FixedRow],
        hinges: &[(usize, [usize; 2])],
        (normals, normal_errors): (&[(usize, [f64; 2])], &[f64]),
    ) -> (Vec<RigidMotion>, Vec<RigidMotion>) {
        let (mut free, mut resisted) = (Vec::new(), Vec::new());
        let row = |part: usize, node: usize, d: [f64; 2]| {
            let mut row = DVector::zeros(3 * parts.len());
            let of_part = self.parts[part].row(nodes[node], d);
            let k = parts.partition_point(|&other| other < part);
            row.as_mut_slice()[3 * k..3 * k + 3].copy_from_slice(&of_part);
            row
        };
        let mut gram = DMatrix::zeros(3 * parts.len(), 3 * parts.len());
        let mut add = |row: DVector<f64>| gram.ger(1.0, &row, &row, 1.0);
        for &FixedRow { node, direction: d } in fixed {
            let part = self.part_of_node[node];
            // An axis is exact, the normal of a polygon is not.
            let uncertain = ROUNDING + normal_errors[node].powi(2);
            let weight = if d.contains(&0.0) { 1.0 } else { (PREVENTED / uncertain).sqrt() };
            add(row(part, node, d) * self.parts[part].weight * weight);
        }
        for &(node, [a, b]) in hinges {
            for d in [[1.0, 0.0], [0.0, 1.0]] {
                add((row(a, node, d) - row(b, node, d)).normalize());
            }
        }
        let basis = null_space(gram, PREVENTED * (fixed.len() + 2 * hinges.len()) as f64);
        if basis.is_empty() {
            return (free, resisted);
        }
        let motion = |v: &DVector<f64>| {
            let of_part = |(v, &part): (&[f64], &usize)| self.parts[part].motion(part, v);
            let parts = v.as_slice().chunks(3).zip(parts).map(of_part).collect();
            RigidMotion { parts, pieces: self.pieces }
        };
        let all: Vec<_> = basis.iter().map(motion).collect();
        let contact = self.normal_displacements(nodes, &all, normals);
        let eigen = (contact.transpose() * &contact).symmetric_eigen();
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let v: DVector<f64> = basis.iter().zip(vector.iter()).map(|(m, c)| m * *c).sum();
            let motion = motion(&v);
            let tangential = |&(node, [nx, ny]): &(usize, [f64; 2])| {
                let [x, y] = self.at(&motion, nodes, node);
                (x * nx + y * ny).abs() <= ROUNDING.sqrt() + normal_errors[node] * x.hypot(y)
            };
            match *value > ROUNDING * normals.len() as f64 && !normals.iter().all(tangential) {
                true => resisted.push(motion),
                false => free.push(motion),
            }
        }
        (free, resisted)
    }

    /// The same motions with the nodes that a rank knows.
    pub fn restrict(self, subdomain: &Subdomain) -> Self {
        Self { part_of_node: subdomain.field(&self.part_of_node, 1), ..self }
    }

    /// Whether prescribed displacements prevent all rigid motions (K is then positive definite).
    pub fn all_prevented(&self) -> bool {
        self.free.is_empty() && self.resisted.is_empty()
    }

    /// Number of motions that contact alone constrains: the dimension of K's null space once the
    /// free ones are pinned.
    pub fn resisted(&self) -> usize {
        self.resisted.len()
    }

    /// The resisted motions of each piece that has any, and their places among all.
    fn resisted_by_piece(&self) -> impl Iterator<Item = (Range<usize>, &[RigidMotion])> {
        let of_one_piece = |a: &RigidMotion, b: &RigidMotion| a.parts[0].part == b.parts[0].part;
        self.resisted.chunk_by(of_one_piece).scan(0, |end, motions| {
            let first = *end;
            *end += motions.len();
            Some((first..*end, motions))
        })
    }

    /// A motion at all nodes, m (two entries per node).
    pub fn field(&self, motion: &RigidMotion, body: &Body) -> Vec<f64> {
        let nodes = &body.nodes.points;
        (0..nodes.len()).flat_map(|node| self.at(motion, nodes, node)).collect()
    }

    /// The nodal displacements of the motions that contact alone constrains, with these amplitudes.
    pub fn displacement(&self, body: &Body, amplitudes: &DVector<f64>) -> Vec<f64> {
        let mut u = vec![0.0; 2 * body.nodes.points.len()];
        for (motion, amplitude) in self.resisted.iter().zip(amplitudes.iter()) {
            u.iter_mut().zip(self.field(motion, body)).for_each(|(u, m)| *u += amplitude * m);
        }
        u
    }

    /// u·ν at `bounds` (rows) of the motions that contact alone constrains (columns).
    pub fn normal_at(&self, body: &Body, bounds: &[Bound]) -> DMatrix<f64> {
        let normals: Vec<_> = bounds.iter().map(|bound| (bound.node, bound.normal)).collect();
        self.normal_displacements(&body.nodes.points, &self.resisted, &normals)
    }

    /// u·ν at nodes with these normals (rows) of `motions` (columns).
    fn normal_displacements(
        &self,
        nodes: &[[f64; 2]],
        motions: &[RigidMotion],
        normals: &[(usize, [f64; 2])],
    ) -> DMatrix<f64> {
        DMatrix::from_fn(normals.len(), motions.len(), |i, j| {
            let (node, [x, y]) = normals[i];
            let u = self.at(&motions[j], nodes, node);
            u[0] * x + u[1] * y
        })
    }

    fn at(&self, motion: &RigidMotion, nodes: &[[f64; 2]], node: usize) -> [f64; 2] {
        motion.at(self.part_of_node[node], nodes[node])
    }
}

impl Part {
    /// Area, centre and radius of all parts by the areas of their nodes: orthogonality is then
    /// exact in the sums over nodes that take the place of integrals.
    ///
    /// A hinge counts for its own part, and for another one that has no node of its own.
    fn all(
        body: &Body,
        part_of_node: &[usize],
        pieces: &[Vec<usize>],
        hinges: &[(usize, [usize; 2])],
    ) -> Vec<Self> {
        let mut parts = vec![Self::default(); pieces.iter().map(Vec::len).sum()];
        let mut nodes: Vec<(usize, usize)> = part_of_node.iter().copied().zip(0..).collect();
        let own: BTreeSet<usize> = part_of_node.iter().copied().collect();
        let further = hinges.iter().map(|&(node, [_, part])| (part, node));
        nodes.extend(further.filter(|(part, _)| !own.contains(part)));
        for &(part, node) in &nodes {
            let ([x, y], area) = (body.nodes.points[node], body.nodes.weights[node]);
            let Self { area: sum, centre: [cx, cy], .. } = &mut parts[part];
            (*sum, *cx, *cy) = (*sum + area, *cx + area * x, *cy + area * y);
        }
        parts.iter_mut().for_each(|part| part.centre = part.centre.map(|v| v / part.area));
        for &(part, node) in &nodes {
            let ([x, y], area) = (body.nodes.points[node], body.nodes.weights[node]);
            let part = &mut parts[part];
            part.radius += area * ((x - part.centre[0]).powi(2) + (y - part.centre[1]).powi(2));
        }
        parts.iter_mut().for_each(|part| part.radius = (part.radius / part.area).sqrt());
        for piece in pieces {
            let area: f64 = piece.iter().map(|&part| parts[part].area).sum();
            piece.iter().for_each(|&part| parts[part].weight = (parts[part].area / area).sqrt());
        }
        parts
    }

    /// The r for which r·v is u·d at a point, with v the part's coordinates
    /// ([`RigidMotions::of_piece`]).
    fn row(&self, [x, y]: [f64; 2], d: [f64; 2]) -> [f64; 3] {
        let turn = ((x - self.centre[0]) * d[1] - (y - self.centre[1]) * d[0]) / self.radius;
        [d[0], d[1], turn].map(|v| v / self.weight)
    }

    /// Its motion with the coordinates v as the part numbered `part`.
    fn motion(&self, part: usize, v: &[f64]) -> PartMotion {
        let [ax, ay, turn] = [v[0], v[1], v[2]].map(|v| v / self.weight);
        let Self { centre, radius, .. } = *self;
        PartMotion { part, translation: [ax, ay], rotation: turn / radius, centre, radius }
    }
}

/// An orthonormal basis of what a Gram matrix maps to at most `cut` times itself.
fn null_space(gram: DMatrix<f64>, cut: f64) -> Vec<DVector<f64>> {
    let eigen = gram.symmetric_eigen();
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs.filter(|(value, _)| **value <= cut).map(|(_, v)| v.into_owned()).collect()
}
