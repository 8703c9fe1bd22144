//! Motions without strain, and how they are told.

use std::fmt;

/// An infinitesimal rigid motion of one part of the mesh, u(x) = a + θ e_z × (x − centre).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartMotion {
    /// The part, see [`Components`](crate::mesh::Components).
    pub part: usize,
    /// a, m.
    pub translation: [f64; 2],
    /// θ, rad.
    pub rotation: f64,
    /// The part's centre, m.
    pub centre: [f64; 2],
    /// The part's radius of gyration, m.
    pub radius: f64,
}

impl PartMotion {
    /// The displacement at a point of the part.
    pub fn at(&self, x: [f64; 2]) -> [f64; 2] {
        [
            self.translation[0] - self.rotation * (x[1] - self.centre[1]),
            self.translation[1] + self.rotation * (x[0] - self.centre[0]),
        ]
    }

    /// The mean of |u|² over the part.
    pub(super) fn mean_square(&self) -> f64 {
        let [ax, ay] = self.translation;
        ax * ax + ay * ay + (self.radius * self.rotation).powi(2)
    }

    pub(super) fn scale(&mut self, factor: f64) {
        let [ax, ay] = self.translation;
        (self.translation, self.rotation) = ([factor * ax, factor * ay], factor * self.rotation);
    }

    /// Adds `factor` times another motion of the same part.
    pub(super) fn add(&mut self, factor: f64, other: &Self) {
        let ([ax, ay], [bx, by]) = (self.translation, other.translation);
        self.translation = [ax + factor * bx, ay + factor * by];
        self.rotation += factor * other.rotation;
    }
}

/// A rotation that moves the part less than this, relative to its translation, is not told.
const TRANSLATION: f64 = 1e-6;

impl fmt::Display for PartMotion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [ax, ay] = self.translation;
        let size = ax.hypot(ay);
        if self.rotation.abs() * self.radius <= TRANSLATION * size {
            match (ax.abs() > 1e-6 * size, ay.abs() > 1e-6 * size) {
                (true, false) => write!(f, "the horizontal translation"),
                (false, _) => write!(f, "the vertical translation"),
                _ => write!(f, "the translation along ({:.3}, {:.3})", ax / size, ay / size),
            }
        } else {
            // Where the motion is at rest: a + θ e_z × (x − centre) = 0.
            let (dx, dy) = (-ay / self.rotation, ax / self.rotation);
            write!(f, "the rotation about {}", place([self.centre[0] + dx, self.centre[1] + dy]))
        }
    }
}

/// What a motion moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mover {
    /// The whole mesh, in one part.
    Body,
    /// One of several pieces of the mesh.
    Piece,
    /// Parts of a piece, which turn about the nodes where they meet.
    Part,
}

/// A motion without strain: rigid on each of some parts of the mesh, continuous where parts meet,
/// 0 elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidMotion {
    /// The parts that move.
    pub parts: Vec<PartMotion>,
    /// What it moves.
    pub mover: Mover,
}

impl RigidMotion {
    /// The displacement at a point of the part `part`.
    pub fn at(&self, part: usize, x: [f64; 2]) -> [f64; 2] {
        self.parts.iter().find(|motion| motion.part == part).map_or([0.0; 2], |m| m.at(x))
    }

    /// The motion of the part that moves most, which stands for all in messages.
    pub fn largest(&self) -> Option<&PartMotion> {
        self.parts.iter().max_by(|a, b| a.mean_square().total_cmp(&b.mean_square()))
    }

    /// What moves, in words.
    pub fn what_moves(&self) -> String {
        let centre = place(self.largest().map_or([0.0; 2], |motion| motion.centre));
        match self.mover {
            Mover::Body => "the body".to_owned(),
            Mover::Piece => format!("the piece around {centre}"),
            Mover::Part => format!("the part around {centre}"),
        }
    }

    /// How it moves, in words.
    pub fn how_it_moves(&self) -> String {
        self.largest().map(PartMotion::to_string).unwrap_or_default()
    }
}

impl fmt::Display for RigidMotion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.mover {
            Mover::Body => f.write_str(&self.how_it_moves()),
            _ => write!(f, "{} of {}", self.how_it_moves(), self.what_moves()),
        }
    }
}

/// Coordinates, rounded before they are printed: no -0.0000.
fn place(x: [f64; 2]) -> String {
    let [x, y] = x.map(|v| (1e4 * v).round() / 1e4 + 0.0);
    format!("({x:.4}, {y:.4})")
}

/// The load does work on a rigid motion that nothing holds.
#[derive(Debug, Clone, thiserror::Error)]
#[error(
    "{}nothing holds {} against {}, and the load drives it (resultant ({:.4e}, {:.4e}) N/m, \
     moment about its centre {moment:.4e} N): hold it by a `displacement`, a `symmetry` axis or a `gap`, \
     or balance the load",
    disjoint(*pieces, motion.mover), motion.what_moves(), motion.how_it_moves(), force[0], force[1]
)]
pub struct DrivenMotion {
    /// The motion.
    pub motion: RigidMotion,
    /// The load's resultant on what moves and hangs on it, N per metre of thickness.
    pub force: [f64; 2],
    /// The load's moment about the centre of what moves, N m per metre of thickness.
    pub moment: f64,
    /// Number of pieces of the mesh.
    pub pieces: usize,
}

fn disjoint(pieces: usize, mover: Mover) -> String {
    match (pieces, mover) {
        (_, Mover::Part) => "parts of the mesh meet in single nodes only; ".to_owned(),
        (1, _) => String::new(),
        _ => format!("the mesh has {pieces} pieces (gmsh: Coherence joins those that touch); "),
    }
}
