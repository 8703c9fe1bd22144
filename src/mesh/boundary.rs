//! Normals and tributary lengths at the nodes of a boundary.

use std::collections::BTreeMap;

/// Directions at most at this angle, rad, are one: with two of them a node would lose too many digits.
pub const SAME_DIRECTION: f64 = 1e-4;

/// The boundary at a node as a plane face: its normal and its tributary length. A corner has two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryFace {
    /// Outward unit normal.
    pub normal: [f64; 2],
    /// A vector normal to the boundary that the mesh approximates. Where this is smooth, both edges have the same one.
    pub of_line: [f64; 2],
    /// Tributary length, m: half the length of each edge of the face.
    pub length: f64,
}

impl BoundaryFace {
    /// A face with this unit normal on a plane boundary.
    pub fn plane(normal: [f64; 2], length: f64) -> Self {
        Self { normal, of_line: normal, length }
    }

    /// Does the other face continue this one smoothly: are the normals of the approximated boundaries parallel, or those of the
    /// faces?
    pub fn continues(&self, other: &Self) -> bool {
        angle(self.of_line, other.of_line).min(self.angle(other)) <= SAME_DIRECTION
    }

    /// The angle between both normals, rad.
    pub fn angle(&self, other: &Self) -> f64 {
        angle(self.normal, other.normal)
    }

    /// Both faces as one: the length-weighted mean of the normals, the sum of the lengths.
    pub fn joined(&self, other: &Self) -> Self {
        let sum = [0, 1].map(|i| self.length * self.normal[i] + other.length * other.normal[i]);
        let norm = sum[0].hypot(sum[1]);
        Self { normal: sum.map(|x| x / norm), length: self.length + other.length, ..*self }
    }
}

/// The angle between two vectors, rad.
fn angle([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    // The cosine alone would lose small angles to rounding.
    (a * d - b * c).abs().atan2(a * c + b * d)
}

/// The faces of each node of a boundary, one, or two at a corner. (More only where parts of the body touch in a point.) Each
/// item of `faces` is a node and the face of one edge at this node.
///
/// Faces that continue each other smoothly are joined: a node's normal is the length-weighted mean of its edges' normals.
/// The sum of the lengths of all faces is the length of the edges. Each joined face gets the `T` of its parts.
pub fn joined_faces<T>(
    faces: impl IntoIterator<Item = (usize, BoundaryFace, T)>,
) -> BTreeMap<usize, Vec<(BoundaryFace, Vec<T>)>> {
    let mut nodes: BTreeMap<usize, Vec<(BoundaryFace, Vec<T>)>> = BTreeMap::new();
    for (node, own, of_own) in faces {
        let faces = nodes.entry(node).or_default();
        match faces.iter_mut().find(|(face, _)| face.continues(&own)) {
            Some((face, of_face)) => {
                *face = face.joined(&own);
                of_face.push(of_own);
            }
            None => faces.push((own, vec![of_own])),
        }
    }
    nodes
}
