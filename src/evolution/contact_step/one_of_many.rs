//! Rigid motions without resistance by contact forces: (26) then has many answers, with the same forces.

use super::{ContactStep, active_bounds, certificate::Judged};
use crate::{
    contact::{self, ContactPoint, least_motion},
    fem::RigidMotion,
    petsc::PetscError,
    problem::LoadCase,
};
use nalgebra::DVector;

impl ContactStep<'_> {
    /// The combinations of motions along which no contact force above `level` times F does work.
    fn unresisted(&self, contact: &[ContactPoint], level: f64, force: f64) -> Vec<DVector<f64>> {
        let active = active_bounds(&self.problem.constraints, contact, level * force);
        let comm = self.problem.body.nodes.partition.comm();
        contact::unconstrained_motions(comm, &self.rigid, &active)
    }

    /// The fraction of F below which a contact force is uncertain. A residual at the tolerance does work up
    /// to √N times the tolerance on a motion (Cauchy and Schwarz). At a lever of one mesh width, 1/√N of the
    /// body, this is a force √N times as large.
    fn uncertain(&self) -> f64 {
        self.problem.body.nodes.partition.total() as f64 * self.problem.tolerance
    }

    /// A rigid motion that the active nodes leave unconstrained. Without load (`force` = 0) the body rests.
    pub(super) fn unconstrained_motion(
        &self,
        contact: &[ContactPoint],
        force: f64,
    ) -> Option<RigidMotion> {
        let motions = self.unresisted(contact, self.uncertain(), force);
        let first = motions.first().filter(|_| force > 0.0)?;
        Some(self.problem.motions.combined(&self.problem.body, first))
    }

    /// Among the answers that differ from a certified one by such a motion, the answer with the minimum
    /// ∫|u|². It is the same for every solver. If the certificate rejects it, because a neglected force
    /// matters, the answer stays; the second value is then the largest residual of the rejected answer.
    /// Collective.
    pub(super) fn of_least_displacement(
        &mut self,
        judged: Judged,
        case: &LoadCase,
    ) -> Result<(Judged, f64), PetscError> {
        let mut refused = 0.0;
        let problem = self.problem;
        let tolerance = judged.kkt.worst().max(problem.tolerance);
        for level in [self.uncertain(), problem.tolerance] {
            let left = self.unresisted(&judged.contact, level, judged.force);
            if left.is_empty() || judged.force == 0.0 {
                break;
            }
            let before = self.next.datum.clone();
            let total = before.total(judged.u.clone());
            let amplitudes = problem.motions.amplitudes(&problem.body, &total);
            let (_, bounds) = before.pose(&problem.constraints, case);
            let c: Vec<f64> = self.c.read(|c| bounds.iter().map(|b| c[b.dof]).collect())?;
            let (comm, motions) = (problem.body.nodes.partition.comm(), (&self.rigid, &left[..]));
            let Some(further) = least_motion(comm, motions, &amplitudes, &bounds, &c) else {
                break;
            };
            let motion = problem.motions.combined(&problem.body, &further);
            self.next.datum.add(&problem.constraints, &motion.field(&problem.body));
            let moved = self.certify(judged.u.clone(), case);
            if moved.kkt.within(tolerance) {
                return Ok((moved, 0.0));
            }
            refused = moved.kkt.worst();
            self.next.datum = before;
        }
        Ok((judged, refused))
    }
}
