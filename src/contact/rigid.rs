//! Rigid motions that nothing holds and that only contact holds, piece by piece of the mesh.

mod free;
mod load;
mod motion;

pub use motion::{DrivenMotion, Mover, PartMotion, RigidMotion};

use super::{Bound, GapRow};
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
    /// Held by nothing, not even contact in either sense.
    pub free: Vec<RigidMotion>,
    /// Directions of motion that contact resists in one sense.
    resisted: Vec<RigidMotion>,
    /// The pieces that prescribed displacements do not hold.
    unheld: Vec<Unheld>,
    parts: Vec<Part>,
    part_of_node: Vec<usize>,
    /// Number of pieces of the mesh.
    pub pieces: usize,
    /// Where parts of a piece meet in a node, the first such place.
    pub hinge: Option<[f64; 2]>,
}

/// A piece of the mesh that prescribed displacements do not hold.
#[derive(Debug, Clone)]
struct Unheld {
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

/// What concerns one piece: fixed directions, gap conditions, hinges.
type Rows<'a> = (Vec<(usize, [f64; 2])>, Vec<&'a GapRow>, Vec<(usize, [usize; 2])>);

impl RigidMotions {
    /// From the fixed directions (node, d) and the gap conditions, joined node by node as in the
    /// bounds.
    pub fn new(body: &Body, fixed: &[(usize, [f64; 2])], gaps: &[GapRow]) -> Self {
        let Components { part_of_node, pieces, hinges } = body.mesh.components();
        let parts = parts(body, &part_of_node);
        let mut piece_of_part = vec![0; parts.len()];
        for (piece, parts) in pieces.iter().enumerate() {
            parts.iter().for_each(|&part| piece_of_part[part] = piece);
        }
        let piece = |node: usize| piece_of_part[part_of_node[node]];
        let mut rows: Vec<Rows> = vec![Rows::default(); pieces.len()];
        fixed.iter().for_each(|row| rows[piece(row.0)].0.push(*row));
        gaps.iter().for_each(|row| rows[piece(row.node)].1.push(row));
        hinges.iter().for_each(|hinge| rows[piece(hinge.0)].2.push(*hinge));
        let mut motions = Self {
            free: Vec::new(),
            resisted: Vec::new(),
            unheld: Vec::new(),
            parts,
            part_of_node,
            pieces: pieces.len(),
            hinge: hinges.first().map(|&(node, _)| body.mesh.nodes[node]),
        };
        for (parts, rows) in pieces.into_iter().zip(rows) {
            motions.add_piece(&body.mesh.nodes, parts, &rows);
        }
        motions
    }

    /// Finds and sorts the motions of the piece of these `parts`.
    fn add_piece(&mut self, nodes: &[[f64; 2]], parts: Vec<usize>, (fixed, gaps, hinges): &Rows) {
        let piece = Piece { all: &self.parts, parts: &parts, whole: self.pieces == 1 };
        let mut gram = DMatrix::zeros(3 * parts.len(), 3 * parts.len());
        let mut add = |row: DVector<f64>| gram.ger(1.0, &row, &row, 1.0);
        for &(node, d) in fixed {
            let part = self.part_of_node[node];
            // An axis is exact, the normal of a polygon is not.
            let weight = if d.contains(&0.0) { 1.0 } else { (HELD / ROUNDING).sqrt() };
            add(piece.row(part, nodes[node], d) * piece.weight(part) * weight);
        }
        for &(node, [a, b]) in hinges {
            for d in [[1.0, 0.0], [0.0, 1.0]] {
                add((piece.row(a, nodes[node], d) - piece.row(b, nodes[node], d)).normalize());
            }
        }
        let basis = null_space(gram, fixed.len() + 2 * hinges.len());
        if basis.is_empty() {
            return;
        }
        let normals = |motions: &[RigidMotion]| {
            DMatrix::from_fn(gaps.len(), motions.len(), |i, j| {
                let (node, [x, y]) = (gaps[i].node, gaps[i].normal);
                let u = motions[j].at(self.part_of_node[node], nodes[node]);
                u[0] * x + u[1] * y
            })
        };
        let contact = normals(&basis.iter().map(|v| piece.motion(v)).collect::<Vec<_>>());
        let eigen = (contact.transpose() * &contact).symmetric_eigen();
        let (mut free, mut resisted) = (Vec::new(), Vec::new());
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let v: DVector<f64> = basis.iter().zip(vector.iter()).map(|(m, c)| m * *c).sum();
            match *value > ROUNDING * gaps.len() as f64 {
                true => resisted.push(piece.motion(&v)),
                false => free.push(piece.motion(&v)),
            }
        }
        let normal = normals(&resisted);
        let range = |old: &[RigidMotion], new: &[RigidMotion]| old.len()..old.len() + new.len();
        let (new_free, new_resisted) = (range(&self.free, &free), range(&self.resisted, &resisted));
        self.free.extend(free);
        self.resisted.extend(resisted);
        self.unheld.push(Unheld { parts, free: new_free, resisted: new_resisted, normal });
    }

    /// Those of a rank's share of the body.
    pub fn restrict(self, subdomain: &Subdomain) -> Self {
        Self { part_of_node: subdomain.field(&self.part_of_node, 1), ..self }
    }

    /// Whether prescribed displacements alone hold the body (K is then positive definite).
    pub fn held(&self) -> bool {
        self.unheld.is_empty()
    }

    /// Number of motions that contact alone holds: the dimension of K's null space.
    pub fn resisted(&self) -> usize {
        self.resisted.len()
    }

    /// A motion at a node.
    fn at(&self, motion: &RigidMotion, body: &Body, node: usize) -> [f64; 2] {
        motion.at(self.part_of_node[node], body.mesh.nodes[node])
    }

    /// A motion at all nodes.
    pub fn field(&self, motion: &RigidMotion, body: &Body) -> Vec<f64> {
        (0..body.mesh.nodes.len()).flat_map(|node| self.at(motion, body, node)).collect()
    }

    /// The nodal displacements of the motions that only contact holds, with these amplitudes.
    pub fn displacement(&self, body: &Body, amplitudes: &DVector<f64>) -> Vec<f64> {
        let mut u = vec![0.0; 2 * body.mesh.nodes.len()];
        for (motion, amplitude) in self.resisted.iter().zip(amplitudes.iter()) {
            u.iter_mut().zip(self.field(motion, body)).for_each(|(u, m)| *u += amplitude * m);
        }
        u
    }

    /// u·ν at `bounds` (rows) of the motions that only contact holds (columns).
    pub fn normal_at(&self, body: &Body, bounds: &[Bound]) -> DMatrix<f64> {
        DMatrix::from_fn(bounds.len(), self.resisted.len(), |i, j| {
            let u = self.at(&self.resisted[j], body, bounds[i].node);
            u[0] * bounds[i].normal[0] + u[1] * bounds[i].normal[1]
        })
    }
}

/// Area, centre and radius of all parts by the areas of their nodes: orthogonality is then exact
/// in the sums over nodes that take the place of integrals.
fn parts(body: &Body, part_of_node: &[usize]) -> Vec<Part> {
    let count = part_of_node.iter().max().map_or(0, |last| last + 1);
    let mut parts = vec![Part::default(); count];
    let nodes = || part_of_node.iter().zip(&body.mesh.nodes).zip(&body.node_area);
    for ((&part, [x, y]), area) in nodes() {
        let Part { area: sum, centre: [cx, cy], .. } = &mut parts[part];
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

/// Coordinates for the motions of one piece: of part k √w_k (a_x, a_y, r_k θ) with w_k its share
/// of the piece's area, so that |v|² is the mean of |u|² over the piece.
struct Piece<'a> {
    all: &'a [Part],
    parts: &'a [usize],
    /// The only one of the mesh.
    whole: bool,
}

impl Piece<'_> {
    /// √w_k of a part.
    fn weight(&self, part: usize) -> f64 {
        let area: f64 = self.parts.iter().map(|&part| self.all[part].area).sum();
        (self.all[part].area / area).sqrt()
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
            let (Part { centre, radius, .. }, weight) = (self.all[part], self.weight(part));
            let [ax, ay, turn] = [v[0], v[1], v[2]].map(|v| v / weight);
            PartMotion { part, translation: [ax, ay], rotation: turn / radius, centre, radius }
        };
        let mover = match (self.parts.len(), self.whole) {
            (1, true) => Mover::Body,
            (1, false) => Mover::Piece,
            _ => Mover::Part,
        };
        RigidMotion { parts: v.as_slice().chunks(3).zip(self.parts).map(part).collect(), mover }
    }
}

/// Squares of motions that prescribed displacements hold are above this, relative: rounding of the
/// Gram matrix and its eigenvalues. A clamp as short as 1e-6 of the body still holds its rotation.
const HELD: f64 = 1e-14;

/// An orthonormal basis of the null space of a Gram matrix of so many `rows` of unit size at most.
fn null_space(gram: DMatrix<f64>, rows: usize) -> Vec<DVector<f64>> {
    let cut = HELD * rows as f64;
    let eigen = gram.symmetric_eigen();
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs.filter(|(value, _)| **value <= cut).map(|(_, v)| v.into_owned()).collect()
}
