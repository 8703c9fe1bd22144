//! Displacement conditions at nodes, as in the scene and as bounds on unknowns.

/// A constraint on the displacement u of a node, a row of the constraint matrix. Its value may depend on time. u·d is
/// prescribed (a component, or 0 across a symmetry axis), or at a node of Γ_C u·d is at most the gap, with d = ν.
#[derive(Debug, Clone, Copy)]
pub struct NodalConstraint {
    /// The node.
    pub node: usize,
    /// d, a unit vector.
    pub direction: [f64; 2],
    /// The node's tributary length of Γ_C, m; `None` where u·d is prescribed.
    pub tributary_length: Option<f64>,
}

impl NodalConstraint {
    /// Is it the condition of a gap?
    pub fn is_gap(&self) -> bool {
        self.tributary_length.is_some()
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
