//! The fields of the problem at one time.

use super::DiscreteProblem;
use crate::{ROUNDING, contact::ContactPoint, fem::RigidMotion};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

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
    /// The nodes of Γ_C whose normal displacement is prescribed, with the part of their reaction that Γ_C exerts.
    pub prescribed: Vec<ContactPoint>,
}

impl State {
    /// The nodes of Γ_C, those with a prescribed normal displacement last.
    pub(crate) fn of_contact(&self) -> impl Iterator<Item = &ContactPoint> {
        self.contact.iter().chain(&self.prescribed)
    }
}

impl DiscreteProblem {
    /// `state`, without displacements if the body only moves rigidly: its strains are rounding. Collective.
    pub(crate) fn strained<'a>(&self, state: &'a State) -> Cow<'a, State> {
        let motion = RigidMotion::nearest(&self.body, &state.u);
        let [rigid, rest] = motion.max_norms(&self.body, &state.u);
        match rest > ROUNDING * rigid {
            true => Cow::Borrowed(state),
            false => Cow::Owned(State { u: vec![0.0; state.u.len()], ..state.clone() }),
        }
    }
}
