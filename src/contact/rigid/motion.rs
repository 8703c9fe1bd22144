//! Motions without strain, and their names in messages.

use serde::{Deserialize, Serialize};
use std::fmt;

/// An infinitesimal rigid motion of one part of the mesh, u(x) = a + θ e_z × (x − centre).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
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

    /// Adds `factor` times another motion of the same part.
    pub(super) fn add(&mut self, factor: f64, other: &Self) {
        let ([ax, ay], [bx, by]) = (self.translation, other.translation);
        self.translation = [ax + factor * bx, ay + factor * by];
        self.rotation += factor * other.rotation;
    }
}

/// A component of a motion that moves the part less than this, relative, is left out of its name.
const NEGLIGIBLE: f64 = 1e-6;

impl fmt::Display for PartMotion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [ax, ay] = self.translation;
        let length = ax.hypot(ay);
        if self.rotation.abs() * self.radius > NEGLIGIBLE * length {
            // Where the motion is at rest: a + θ e_z × (x − centre) = 0.
            let [x, y] = self.centre;
            let at_rest = [x - ay / self.rotation, y + ax / self.rotation];
            return write!(f, "the rotation about {}", place(at_rest));
        }
        match [ax, ay].map(|a| a.abs() > NEGLIGIBLE * length) {
            [true, false] => write!(f, "the horizontal translation"),
            [false, _] => write!(f, "the vertical translation"),
            _ => write!(f, "the translation along ({:.3}, {:.3})", ax / length, ay / length),
        }
    }
}

/// A motion without strain: rigid on each of some parts of the mesh, continuous where parts meet,
/// 0 elsewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RigidMotion {
    /// The motions of the parts of a piece.
    pub parts: Vec<PartMotion>,
    /// Number of pieces of the mesh.
    pub pieces: usize,
}

impl RigidMotion {
    /// Σ factor·motion of motions of one piece.
    pub(super) fn combination(motions: &[Self], factors: &[f64]) -> Self {
        let mut sum = motions[0].clone();
        sum.parts.iter_mut().for_each(|part| (part.translation, part.rotation) = ([0.0; 2], 0.0));
        for (motion, factor) in motions.iter().zip(factors) {
            sum.parts.iter_mut().zip(&motion.parts).for_each(|(s, part)| s.add(*factor, part));
        }
        sum
    }

    /// The displacement at a point of the part `part`.
    pub fn at(&self, part: usize, x: [f64; 2]) -> [f64; 2] {
        self.parts.iter().find(|motion| motion.part == part).map_or([0.0; 2], |m| m.at(x))
    }

    /// The motion of the part that moves most, which stands for all in messages.
    pub(super) fn largest(&self) -> PartMotion {
        let largest = self.parts.iter().max_by(|a, b| a.mean_square().total_cmp(&b.mean_square()));
        largest.copied().unwrap_or_default()
    }

    /// What moves, in words.
    pub(super) fn what_moves(&self) -> String {
        match (self.parts.len(), self.pieces) {
            (1, 1) => "the body".to_owned(),
            (1, _) => format!("the piece around {}", place(self.largest().centre)),
            _ => format!("the part around {}", place(self.largest().centre)),
        }
    }
}

impl fmt::Display for RigidMotion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match (self.parts.len(), self.pieces) {
            (1, 1) => write!(f, "{}", self.largest()),
            _ => write!(f, "{} of {}", self.largest(), self.what_moves()),
        }
    }
}

/// Coordinates, rounded before they are printed: no -0.0000.
fn place(x: [f64; 2]) -> String {
    let [x, y] = x.map(|v| (1e4 * v).round() / 1e4 + 0.0);
    format!("({x:.4}, {y:.4})")
}
