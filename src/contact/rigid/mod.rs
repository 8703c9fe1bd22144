//! Rigid motions that prescribed displacements leave free, piece by piece of the mesh: the null
//! space of K, and which of it contact constrains.

mod free;
mod load;
mod motion;
mod nonnegative;
mod until_contact;

pub use load::DrivenMotion;
pub use motion::{Extent, PartMotion, RigidMotion};
pub(crate) use until_contact::{rigid_motion_until_contact, unconstrained_motions};

use super::{Bound, FixedRow, GapRow};
use crate::{
    fem::{Body, Subdomain},
    mesh::Components,
};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The rigid motions that prescribed displacements leave free.
///
/// Those of a piece are orthonormal with respect to ∫u·v, divided by the area of the piece.
#[derive(Debug, Clone)]
pub struct RigidMotions {
    /// Unconstrained, even by contact in either sense.
    pub free: Vec<RigidMotion>,
    /// Those that contact resists in one sense.
    resisted: Vec<RigidMotion>,
    /// The pieces that have any of these motions.
    movable: Vec<MovablePiece>,
    parts: Vec<Part>,
    part_of_node: Vec<usize>,
    /// Number of pieces of the mesh.
    pub pieces: usize,
    /// Where parts of a piece meet in a node, the first such place, m.
    pub hinge: Option<[f64; 2]>,
}

/// A piece of the mesh that has rigid motions left.
#[derive(Debug, Clone)]
struct MovablePiece {
    parts: Vec<usize>,
    /// Its motions among the free and among the resisted ones.
    free: Range<usize>,
    resisted: Range<usize>,
    /// u·ν of its resisted motions, one row per gap condition.
    normal: DMatrix<f64>,
}

/// A part of the mesh that hangs together through edges.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    area: f64,
    centre: [f64; 2],
    /// Radius of gyration, m: a rotation by 1/radius moves the part as far as a unit translation.
    radius: f64,
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
    /// From the fixed rows and the gap conditions, joined node by node as in the bounds.
    pub fn new(body: &Body, fixed: &[FixedRow], gaps: &[GapRow]) -> Self {
        let Components { part_of_node, pieces, hinges } = body.mesh.components();
        let mut motions = Self {
            free: Vec::new(),
            resisted: Vec::new(),
            movable: Vec::new(),
            parts: Part::all(body, &part_of_node),
            part_of_node,
            pieces: pieces.len(),
            hinge: hinges.first().map(|&(node, _)| body.mesh.nodes[node]),
        };
        let mut piece_of_part = vec![0; motions.parts.len()];
        for (piece, parts) in pieces.iter().enumerate() {
            parts.iter().for_each(|&part| piece_of_part[part] = piece);
        }
        let mut rows = vec![Rows::default(); pieces.len()];
        let piece = |node: usize| piece_of_part[motions.part_of_node[node]];
        fixed.iter().for_each(|row| rows[piece(row.node)].fixed.push(*row));
        gaps.iter().for_each(|row| rows[piece(row.node)].normals.push((row.node, row.normal)));
        hinges.iter().for_each(|hinge| rows[piece(hinge.0)].hinges.push(*hinge));
        for (parts, rows) in pieces.into_iter().zip(&rows) {
            motions.add_piece(&body.mesh.nodes, parts, rows);
        }
        motions
    }

    /// Finds the motions of the piece of these `parts`: the null space of Σ r rᵀ over the rows
    /// r·v = 0 of prescribed displacements and hinges. Of these, the free ones are in the null
    /// space of u·ν at its gap conditions too.
    fn add_piece(&mut self, nodes: &[[f64; 2]], parts: Vec<usize>, rows: &Rows) {
        let piece = Piece::new(&self.parts, &parts, self.pieces == 1);
        let mut gram = DMatrix::zeros(3 * parts.len(), 3 * parts.len());
        let mut add = |row: DVector<f64>| gram.ger(1.0, &row, &row, 1.0);
        for &FixedRow { node, direction: d } in &rows.fixed {
            let part = self.part_of_node[node];
            // An axis is exact, the normal of a polygon is not.
            let weight = if d.contains(&0.0) { 1.0 } else { (PREVENTED / ROUNDING).sqrt() };
            add(piece.row(part, nodes[node], d) * piece.weight(part) * weight);
        }
        for &(node, [a, b]) in &rows.hinges {
            for d in [[1.0, 0.0], [0.0, 1.0]] {
                add((piece.row(a, nodes[node], d) - piece.row(b, nodes[node], d)).normalize());
            }
        }
        let cut = PREVENTED * (rows.fixed.len() + 2 * rows.hinges.len()) as f64;
        let basis = null_space(gram, cut);
        if basis.is_empty() {
            return;
        }
        let all: Vec<_> = basis.iter().map(|v| piece.motion(v)).collect();
        let contact = self.normal_displacements(nodes, &all, &rows.normals);
        let eigen = (contact.transpose() * &contact).symmetric_eigen();
        let (mut free, mut resisted) = (Vec::new(), Vec::new());
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let v: DVector<f64> = basis.iter().zip(vector.iter()).map(|(m, c)| m * *c).sum();
            match *value > ROUNDING * rows.normals.len() as f64 {
                true => resisted.push(piece.motion(&v)),
                false => free.push(piece.motion(&v)),
            }
        }
        let normal = self.normal_displacements(nodes, &resisted, &rows.normals);
        self.movable.push(MovablePiece {
            parts,
            free: self.free.len()..self.free.len() + free.len(),
            resisted: self.resisted.len()..self.resisted.len() + resisted.len(),
            normal,
        });
        self.free.extend(free);
        self.resisted.extend(resisted);
    }

    /// Those of a rank's subdomain.
    pub fn restrict(self, subdomain: &Subdomain) -> Self {
        Self { part_of_node: subdomain.field(&self.part_of_node, 1), ..self }
    }

    /// Whether prescribed displacements prevent all rigid motions (K is then positive definite).
    pub fn all_prevented(&self) -> bool {
        self.movable.is_empty()
    }

    /// Number of motions that contact alone constrains: the dimension of K's null space once the
    /// free ones are pinned.
    pub fn resisted(&self) -> usize {
        self.resisted.len()
    }

    /// A motion at all nodes, m (two entries per node).
    pub fn field(&self, motion: &RigidMotion, body: &Body) -> Vec<f64> {
        let nodes = &body.mesh.nodes;
        (0..nodes.len()).flat_map(|node| self.at(motion, nodes, node)).collect()
    }

    /// The nodal displacements of the motions that contact alone constrains, with these amplitudes.
    pub fn displacement(&self, body: &Body, amplitudes: &DVector<f64>) -> Vec<f64> {
        let mut u = vec![0.0; 2 * body.mesh.nodes.len()];
        for (motion, amplitude) in self.resisted.iter().zip(amplitudes.iter()) {
            u.iter_mut().zip(self.field(motion, body)).for_each(|(u, m)| *u += amplitude * m);
        }
        u
    }

    /// u·ν at `bounds` (rows) of the motions that contact alone constrains (columns).
    pub fn normal_at(&self, body: &Body, bounds: &[Bound]) -> DMatrix<f64> {
        let normals: Vec<_> = bounds.iter().map(|bound| (bound.node, bound.normal)).collect();
        self.normal_displacements(&body.mesh.nodes, &self.resisted, &normals)
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

/// What concerns one piece: prescribed directions, nodes with normals, hinges between two parts.
#[derive(Clone, Default)]
struct Rows {
    fixed: Vec<FixedRow>,
    normals: Vec<(usize, [f64; 2])>,
    hinges: Vec<(usize, [usize; 2])>,
}

impl Part {
    /// Area, centre and radius of all parts by the areas of their nodes: orthogonality is then
    /// exact in the sums over nodes that take the place of integrals.
    fn all(body: &Body, part_of_node: &[usize]) -> Vec<Self> {
        let count = part_of_node.iter().max().map_or(0, |last| last + 1);
        let mut parts = vec![Self::default(); count];
        let nodes = || part_of_node.iter().zip(&body.mesh.nodes).zip(&body.node_area);
        for ((&part, [x, y]), area) in nodes() {
            let Self { area: sum, centre: [cx, cy], .. } = &mut parts[part];
            (*sum, *cx, *cy) = (*sum + area, *cx + area * x, *cy + area * y);
        }
        parts.iter_mut().for_each(|part| part.centre = part.centre.map(|v| v / part.area));
        for ((&part, [x, y]), area) in nodes() {
            let part = &mut parts[part];
            part.radius += area * ((x - part.centre[0]).powi(2) + (y - part.centre[1]).powi(2));
        }
        parts.iter_mut().for_each(|part| part.radius = (part.radius / part.area).sqrt());
        parts
    }

    /// Its motion as the part numbered `part`.
    fn motion(&self, part: usize, translation: [f64; 2], rotation: f64) -> PartMotion {
        PartMotion { part, translation, rotation, centre: self.centre, radius: self.radius }
    }
}

/// Coordinates v for the motions of one piece: of part k √w_k (a_x, a_y, r_k θ) with w_k its part
/// of the piece's area, so that |v|² is the mean of |u|² over the piece.
struct Piece<'a> {
    all: &'a [Part],
    parts: &'a [usize],
    area: f64,
    extent: Extent,
}

impl<'a> Piece<'a> {
    fn new(all: &'a [Part], parts: &'a [usize], only: bool) -> Self {
        let extent = match (parts.len(), only) {
            (1, true) => Extent::Body,
            (1, false) => Extent::Piece,
            _ => Extent::Parts,
        };
        Self { all, parts, area: parts.iter().map(|&part| all[part].area).sum(), extent }
    }

    /// √w_k of a part.
    fn weight(&self, part: usize) -> f64 {
        (self.all[part].area / self.area).sqrt()
    }

    /// The vector r for which r·v is u·d at a point of a part.
    fn row(&self, part: usize, [x, y]: [f64; 2], d: [f64; 2]) -> DVector<f64> {
        let (Part { centre, radius, .. }, weight) = (self.all[part], self.weight(part));
        let turn = ((x - centre[0]) * d[1] - (y - centre[1]) * d[0]) / radius;
        let mut row = DVector::zeros(3 * self.parts.len());
        if let Ok(k) = self.parts.binary_search(&part) {
            row.as_mut_slice()[3 * k..3 * k + 3]
                .copy_from_slice(&[d[0], d[1], turn].map(|v| v / weight));
        }
        row
    }

    /// The motion with the coordinates v.
    fn motion(&self, v: &DVector<f64>) -> RigidMotion {
        let part = |(v, &part): (&[f64], &usize)| {
            let weight = self.weight(part);
            let [ax, ay, turn] = [v[0], v[1], v[2]].map(|v| v / weight);
            self.all[part].motion(part, [ax, ay], turn / self.all[part].radius)
        };
        let parts = v.as_slice().chunks(3).zip(self.parts).map(part).collect();
        RigidMotion { parts, extent: self.extent }
    }
}

/// An orthonormal basis of what a Gram matrix maps to at most `cut` times itself.
fn null_space(gram: DMatrix<f64>, cut: f64) -> Vec<DVector<f64>> {
    let eigen = gram.symmetric_eigen();
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs.filter(|(value, _)| **value <= cut).map(|(_, v)| v.into_owned()).collect()
}
