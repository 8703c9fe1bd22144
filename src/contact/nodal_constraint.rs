//! Displacement conditions at nodes, as in the scene and as bounds on unknowns.

/// A condition on the displacement u of a node along d, a row of the constraint matrix. Its value v may depend on time.
#[derive(Debug, Clone, Copy)]
pub struct NodalConstraint {
    /// The node.
    pub node: usize,
    /// d, a unit vector; ν at a gap.
    pub direction: [f64; 2],
    /// The law between u·d, v and the reaction.
    pub law: RowLaw,
}

/// The law of a row. A match on it has no `_` arm, so that the compiler names the places that a further law concerns.
#[derive(Debug, Clone, Copy)]
pub enum RowLaw {
    /// u·d = v: a component, or 0 across a symmetry axis. The balance of forces determines the reaction, of either sign.
    Prescribed,
    /// A rigid obstacle at the gap v: u·d ≤ v, p ≥ 0, p (v − u·d) = 0. The balance of forces determines p. The row adds
    /// nothing to K: it bounds an unknown.
    Rigid {
        /// The node's tributary length of Γ_C, m.
        tributary_length: f64,
    },
}

impl RowLaw {
    /// The tributary length of a row that resists motions along d in one sense; `None` if it prevents them.
    pub fn resists(self) -> Option<f64> {
        match self {
            Self::Prescribed => None,
            Self::Rigid { tributary_length } => Some(tributary_length),
        }
    }
}

impl NodalConstraint {
    /// Is it the condition of a gap?
    pub fn is_gap(&self) -> bool {
        self.law.resists().is_some()
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
