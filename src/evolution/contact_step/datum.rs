//! Where displacements are measured from.

use crate::{contact::Bound, evolution::DiscreteProblem};

/// A rigid motion of the body. It causes no forces, so (26) holds for the rest of u as it stands,
/// with gaps and prescribed values less the motion.
///
/// A body that falls through a wide gap, or is carried along, deforms by little of the way that it
/// goes: u has no digits left for the deformation, its rest has all of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Datum {
    /// Its nodal displacements, m; empty while they are zero.
    pub(super) field: Vec<f64>,
    /// The same in the nodal bases.
    unknowns: Vec<f64>,
}

impl Datum {
    /// The prescribed unknowns `lift` and the `bounds`, measured from here.
    pub(super) fn pose(
        &self,
        problem: &DiscreteProblem,
        (lift, bounds): &(Vec<f64>, Vec<Bound>),
    ) -> (Vec<f64>, Vec<Bound>) {
        let (mut lift, mut bounds) = (lift.clone(), bounds.clone());
        if !self.field.is_empty() {
            problem.constraints.prescribed().for_each(|dof| lift[dof] -= self.unknowns[dof]);
            for bound in &mut bounds {
                bound.lower -= self.unknowns[bound.dof];
                bound.upper -= self.unknowns[bound.dof];
            }
        }
        (lift, bounds)
    }

    /// Free unknowns measured from here, of unknowns c measured from zero.
    pub(super) fn relative(&self, problem: &DiscreteProblem, c: Vec<f64>) -> Vec<f64> {
        self.shifted(problem, c, -1.0)
    }

    /// The inverse of [`Self::relative`].
    pub(super) fn absolute(&self, problem: &DiscreteProblem, c: Vec<f64>) -> Vec<f64> {
        self.shifted(problem, c, 1.0)
    }

    fn shifted(&self, problem: &DiscreteProblem, mut c: Vec<f64>, sign: f64) -> Vec<f64> {
        let fixed = problem.constraints.bases.fixed();
        for ((c, own), _) in c.iter_mut().zip(&self.unknowns).zip(fixed).filter(|(_, on)| !**on) {
            *c += sign * own;
        }
        c
    }

    /// u of displacements measured from here.
    pub(super) fn total(&self, mut u: Vec<f64>) -> Vec<f64> {
        u.iter_mut().zip(&self.field).for_each(|(u, own)| *u += own);
        u
    }

    /// Moves on by a rigid motion of each piece of the mesh, in nodal displacements.
    pub(super) fn add(&mut self, problem: &DiscreteProblem, motion: &[f64]) {
        self.field.resize(motion.len(), 0.0);
        self.field.iter_mut().zip(motion).for_each(|(own, more)| *own += more);
        self.unknowns = self.field.clone();
        problem.constraints.bases.displacement_to_local(&mut self.unknowns);
    }
}
