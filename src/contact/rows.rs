//! Displacement conditions at nodes, as posed and as bounds on unknowns.

/// u·d is prescribed at a node (a displacement component, or 0 across a symmetry axis).
#[derive(Debug, Clone)]
pub struct FixedRow {
    /// The node.
    pub node: usize,
    /// d, a unit vector.
    pub direction: [f64; 2],
}

/// u·ν ≤ g at a node of Γ_C.
#[derive(Debug, Clone)]
pub struct GapRow {
    /// The node.
    pub node: usize,
    /// ν, a unit vector.
    pub normal: [f64; 2],
    /// g ≥ 0, m.
    pub gap: f64,
    /// The node's share of Γ_C, m.
    pub tributary_length: f64,
}

/// Gap conditions of a node as bounds on one unknown: lower ≤ c_dof ≤ upper.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// The unknown, 2·node + component in the node's basis.
    pub dof: usize,
    /// The node.
    pub node: usize,
    /// ν: the unknown is u·ν.
    pub normal: [f64; 2],
    /// Least u·ν, m: −∞ unless an obstacle stands on the other side too.
    pub lower: f64,
    /// Largest u·ν, m.
    pub upper: f64,
    /// The node's tributary length of Γ_C, m.
    pub tributary_length: f64,
}

impl Bound {
    /// Whether the obstacles leave the unknown one value.
    pub fn is_equality(&self) -> bool {
        self.lower == self.upper
    }

    /// The value nearest to `c` that both sides admit, m.
    pub fn nearest(&self, c: f64) -> f64 {
        c.max(self.lower).min(self.upper)
    }
}
