//! Displacement conditions at nodes, as posed and as bounds on unknowns.

use crate::mesh::Face;
use std::collections::BTreeMap;

/// u·d is prescribed at a node (a displacement component, or 0 across a symmetry axis).
#[derive(Debug, Clone, Copy)]
pub struct FixedRow {
    /// The node.
    pub node: usize,
    /// d, a unit vector.
    pub direction: [f64; 2],
}

/// u·ν ≤ g at a node of Γ_C.
#[derive(Debug, Clone, Copy)]
pub struct GapRow {
    /// The node.
    pub node: usize,
    /// ν, a unit vector.
    pub normal: [f64; 2],
    /// g, m, negative if body and obstacle overlap. If the gap depends on time, its value in the first solve.
    pub gap: f64,
    /// The node's tributary length of Γ_C, m.
    pub tributary_length: f64,
}

impl GapRow {
    /// Joins rows by node. The rows of one smooth boundary become one row with the mean normal, the sum of
    /// the lengths and the smallest gap. At a corner both rows stay. Returns with each row the `T` of its
    /// parts.
    pub fn joined<T>(rows: impl IntoIterator<Item = (Self, T)>) -> (Vec<Self>, Vec<Vec<T>>) {
        let mut nodes: BTreeMap<usize, Vec<(Self, Vec<T>)>> = BTreeMap::new();
        for (new, of_new) in rows {
            let rows = nodes.entry(new.node).or_default();
            match rows.iter_mut().find(|(row, _)| row.face().continues(&new.face())) {
                None => rows.push((new, vec![of_new])),
                Some((row, of_row)) => {
                    let Face { normal, length } = row.face().joined(&new.face());
                    let gap = row.gap.min(new.gap);
                    *row = Self { normal, gap, tributary_length: length, ..*row };
                    of_row.push(of_new);
                }
            }
        }
        nodes.into_values().flatten().unzip()
    }

    /// Its gap, m: its own one, or if gaps depend on time, the entry `number` of all gaps at this time.
    pub(super) fn gap_of(&self, number: usize, gaps: &[f64]) -> f64 {
        gaps.get(number).copied().unwrap_or(self.gap)
    }

    fn face(&self) -> Face {
        Face { normal: self.normal, length: self.tributary_length }
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
