//! The reference configuration of the displacements.

use crate::{
    contact::{Bound, Constraints},
    problem::LoadCase,
};
use serde::{Deserialize, Serialize};

/// A rigid motion of the body, from which displacements are measured.
///
/// A body may fall through a wide gap or follow prescribed displacements. Its deformation is then a small part of
/// u, for which double precision leaves few digits. Measured from the end of the rigid motion it has all digits. A
/// rigid motion causes no forces, so (26) holds for the rest of u with gaps and prescribed values less the motion.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Reference {
    /// Its nodal displacements, m; empty while they are zero.
    pub(super) field: Vec<f64>,
    /// The same in the nodal bases.
    unknowns: Vec<f64>,
    /// Whether there was a motion, the same on all ranks: a rank without nodes has no displacements.
    has_moved: bool,
}

impl Reference {
    pub(super) fn is_zero(&self) -> bool {
        !self.has_moved
    }

    /// The prescribed unknowns and the bounds, measured from the reference.
    pub(super) fn prescribed_and_bounds(
        &self,
        of: &Constraints,
        case: &LoadCase,
    ) -> (Vec<f64>, Vec<Bound>) {
        let (mut c_prescribed, mut bounds) = (case.c_prescribed.clone(), case.bounds.clone());
        if !self.is_zero() {
            of.prescribed().for_each(|dof| c_prescribed[dof] -= self.unknowns[dof]);
            for bound in &mut bounds {
                bound.lower -= self.unknowns[bound.dof];
                bound.upper -= self.unknowns[bound.dof];
            }
        }
        (c_prescribed, bounds)
    }

    /// Adds `sign` times the motion to the free unknowns c: −1 changes to the reference, 1 back to zero.
    pub(super) fn translate(&self, of: &Constraints, c: &mut [f64], sign: f64) {
        let unknowns = c.iter_mut().zip(&self.unknowns).zip(of.bases.fixed());
        unknowns.filter(|(_, fixed)| !**fixed).for_each(|((c, own), _)| *c += sign * own);
    }

    /// The total displacements, for u measured from the reference.
    pub(super) fn total(&self, mut u: Vec<f64>) -> Vec<f64> {
        u.iter_mut().zip(&self.field).for_each(|(u, own)| *u += own);
        u
    }

    /// Adds a rigid motion, given by nodal displacements.
    pub(super) fn add(&mut self, of: &Constraints, motion: &[f64]) {
        self.has_moved = true;
        self.field.resize(motion.len(), 0.0);
        self.field.iter_mut().zip(motion).for_each(|(own, more)| *own += more);
        self.unknowns = self.field.clone();
        of.bases.displacement_to_local(&mut self.unknowns);
    }
}
