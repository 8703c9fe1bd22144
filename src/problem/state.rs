//! The fields of the problem at one time.

use crate::contact::ContactPoint;
use serde::{Deserialize, Serialize};

/// The fields at one time.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct State {
    /// t, s.
    pub time: f64,
    /// Displacements (u_x, u_y) in turn, m.
    pub u: Vec<f64>,
    /// ζ at the nodes.
    pub zeta: Vec<f64>,
    /// The nodes of Γ_C that carry a gap condition; two entries at a corner.
    pub contact: Vec<ContactPoint>,
}
