//! Rigid motions that no contact force resists. (26) then has many answers with the same forces.

use super::{AcceptedState, ContactStep, active_bounds, certificate::Candidate};
use crate::{
    contact::{self, ContactPoint, least_motion},
    fem::RigidMotion,
    petsc::PetscError,
    problem::{DiscreteProblem, LoadCase},
};
use nalgebra::DVector;

impl ContactStep<'_> {
    /// The rigid motions that only contact constrains and no contact force resists. With N nodes, the tolerance τ and the force
    /// scale F, forces below N τF may be residuals and do not count: by Cauchy and Schwarz, a residual τF works on a rigid motion
    /// like a force √N τF. At a lever of one mesh width, 1/√N of the body, this is a force N τF.
    fn unresisted(&self, contact: &[ContactPoint], force: f64) -> Vec<DVector<f64>> {
        let DiscreteProblem { body, constraints, tolerance, .. } = &**self.problem;
        let uncertain = body.nodes.partition.total() as f64 * tolerance;
        let active = active_bounds(constraints, contact, uncertain * force);
        contact::unconstrained_motions(body.comm(), &self.rigid, &active)
    }

    /// A rigid motion that the active nodes leave unconstrained. `None` without load (`force` = 0).
    pub(super) fn unconstrained_motion(
        &self,
        contact: &[ContactPoint],
        force: f64,
    ) -> Option<RigidMotion> {
        let motions = self.unresisted(contact, force);
        let first = motions.first().filter(|_| force > 0.0)?;
        Some(self.problem.motions.combined(&self.problem.body, first))
    }

    /// The answer of minimum ∫|u|² among all that differ from the certified `candidate` by an unresisted motion; it
    /// does not depend on the solver. Its certificate fails if a neglected contact force counts or acts across an
    /// opening gap. Then `candidate` is returned. Collective.
    pub(super) fn of_minimum_displacement(
        &self,
        next: &mut AcceptedState,
        candidate: Candidate,
        case: &LoadCase,
    ) -> Result<Candidate, PetscError> {
        let problem = self.problem;
        let left = self.unresisted(&candidate.contact, candidate.force);
        if left.is_empty() || candidate.force == 0.0 {
            return Ok(candidate);
        }
        let total = next.reference.total(candidate.u.clone());
        let amplitudes = problem.motions.amplitudes(&problem.body, &total);
        let (bounds, c) = self.at_bounds(&next.reference, case)?;
        let (comm, motions) = (problem.body.comm(), (&self.rigid, &left[..]));
        let Some(further) = least_motion(comm, motions, &amplitudes, &bounds, &c) else {
            return Ok(candidate);
        };
        let mut reference = next.reference.clone();
        self.move_rigidly(&mut reference, &further);
        let moved = self.certify(&reference, candidate.u.clone(), case);
        if !moved.kkt.within(candidate.kkt.worst().max(problem.tolerance)) {
            return Ok(candidate);
        }
        next.reference = reference;
        Ok(moved)
    }
}
