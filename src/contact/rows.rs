//! Displacement conditions at nodes, as posed and as bounds on unknowns.

use crate::mesh::Face;
use std::collections::BTreeMap;

/// A condition on the displacement of a node, with a value that may depend on time: u·d is prescribed (a component, or
/// 0 across a symmetry axis), or at a node of Γ_C u·d is at most the gap, with d = ν.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// The node.
    pub node: usize,
    /// d, a unit vector.
    pub direction: [f64; 2],
    /// The node's tributary length of Γ_C, m; `None` where u·d is prescribed.
    pub tributary_length: Option<f64>,
}

impl Row {
    /// Is it the condition of a gap?
    pub fn is_gap(&self) -> bool {
        self.tributary_length.is_some()
    }

    /// Joins the gap conditions `faces` node by node. Those of one smooth boundary become one condition with the mean
    /// normal and the sum of the lengths. At a corner both stay. Returns with each the `T` of its parts.
    pub fn joined<T>(
        faces: impl IntoIterator<Item = (usize, Face, T)>,
    ) -> impl Iterator<Item = (Self, Vec<T>)> {
        let mut nodes: BTreeMap<usize, Vec<(Face, Vec<T>)>> = BTreeMap::new();
        for (node, new, of_new) in faces {
            let faces = nodes.entry(node).or_default();
            match faces.iter_mut().find(|(face, _)| face.continues(&new)) {
                None => faces.push((new, vec![of_new])),
                Some((face, of_face)) => {
                    *face = face.joined(&new);
                    of_face.push(of_new);
                }
            }
        }
        let row = |node, Face { normal: direction, length }| {
            let tributary_length = Some(length);
            Self { node, direction, tributary_length }
        };
        nodes.into_iter().flat_map(move |(node, faces)| {
            faces.into_iter().map(move |(face, of_face)| (row(node, face), of_face))
        })
    }
}

/// Gap conditions of a node as bounds on one unknown: lower ≤ c_dof ≤ upper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// The unknown, 2·node + component in the node's basis.
    pub dof: usize,
    /// The node.
    pub node: usize,
    /// ν: the unknown is u·ν.
    pub normal: [f64; 2],
    /// Lower bound of u·ν, m: −∞ without an obstacle on the other side.
    pub lower: f64,
    /// Upper bound of u·ν, m.
    pub upper: f64,
    /// The node's tributary length of Γ_C, m.
    pub tributary_length: f64,
}

impl Bound {
    /// Do the obstacles allow a single value?
    pub fn is_equality(&self) -> bool {
        self.lower == self.upper
    }

    /// The value on a side: 1 the upper bound, −1 the lower one, 0 none, m.
    pub fn at(&self, side: f64) -> Option<f64> {
        (side != 0.0).then_some(if side > 0.0 { self.upper } else { self.lower })
    }

    /// The side that `c` reaches: 1 the upper bound, −1 the lower one, 0 none.
    pub fn side(&self, c: f64) -> f64 {
        if c >= self.upper { 1.0 } else { -f64::from(c <= self.lower) }
    }

    /// The admissible value nearest to `c`, m.
    pub fn nearest(&self, c: f64) -> f64 {
        c.max(self.lower).min(self.upper)
    }
}
