//! Repeats the contact solve until the answer is certified.

use super::{
    ContactStep, accuracy::MAX_ROUNDING, certificate::Candidate, minimisation::displacement,
};
use crate::{
    contact::{ContactError, ContactReport},
    evolution::{LoadCase, RunError},
    petsc::PetscError,
};

/// Maximum number of solves for one answer, each to a smaller tolerance or from another reference.
///
/// Tuned on the 6 plain runs and ill-conditioned bodies of the tests. 1: some of these bodies have no answer. Twice:
/// nothing changes.
const ATTEMPTS: usize = 3;
/// An answer is mostly rigid if its rigid part is more than this many times the rest. A reference other than zero is
/// then renewed, even if the answer is certified.
///
/// Tuned on the 6 plain runs. Half: nothing changes. Twice: nothing changes.
const DOMINANT: f64 = 10.0;

impl ContactStep<'_> {
    /// Solves until the answer is certified, each time to a smaller tolerance or from another reference. The
    /// solver's own convergence test does not count. If there are many answers, returns the one with minimum ∫|u|².
    pub(super) fn solve_certified(
        &mut self,
        step: usize,
        case: &LoadCase,
    ) -> Result<(Candidate, ContactReport), RunError> {
        let (problem, required) = (self.problem, self.problem.tolerance);
        let failed = |source| RunError::contact(problem, step, case.time, source);
        let (mut tolerance, mut attempt, mut refined) = (required, 0, None::<Vec<f64>>);
        let (mut force_scale, mut unbalanced) = (None, None);
        let mut report = ContactReport::default();
        loop {
            attempt += 1;
            let (c_prescribed, bounds) =
                self.next.reference.prescribed_and_bounds(&problem.constraints, case);
            let known = (force_scale, unbalanced.take());
            let solved = match self.solve_contact(case, &c_prescribed, &bounds, tolerance, known) {
                // All ranks know that the method stopped short. Any other error may concern one rank only.
                Err(error) if !matches!(error, ContactError::NotConverged { .. }) => {
                    return Err(failed(error));
                }
                solved => solved,
            };
            let u = displacement(problem, c_prescribed, &self.c)?;
            let candidate = self.phases.time("certificate", || self.certify(u, case));
            let certified = candidate.kkt.within(required);
            // The change by a solve for the residual forces is the error of the answer before.
            let error = refined.take().map(|before| self.difference(&candidate.u, &before));
            force_scale = Some(candidate.scales.force);
            let moved = !self.next.reference.is_zero();
            if (moved || !certified) && attempt < ATTEMPTS && self.move_reference(&candidate)? {
                continue;
            }
            // Residuals of rounding are accepted once a further attempt has not helped or is impossible.
            let certified = certified
                || (attempt > 1 || solved.is_err()) && self.is_exact_to_rounding(&candidate, error);
            match solved {
                Ok(solved) => report.add(&solved),
                Err(error) if !certified => return Err(failed(self.limited(error, &candidate))),
                Err(ContactError::NotConverged { report: spent, .. }) => report.add(&spent),
                Err(_) => {}
            }
            // If K is indefinite, a KKT point need not be a minimum. Only some solvers notice this.
            if candidate.is_indefinite() {
                return Err(failed(ContactError::NotDefinite { method: self.solver.name() }));
            }
            if certified {
                return Ok((self.of_minimum_displacement(candidate, case)?, report));
            }
            if attempt == ATTEMPTS || candidate.kkt.worst().is_nan() {
                let (method, residuals) = (self.solver.name(), candidate.kkt);
                let error = ContactError::NotCertified { method, tolerance: required, residuals };
                return Err(failed(self.limited(error, &candidate)));
            }
            tolerance *= 0.3 * required / candidate.kkt.worst();
            if self.is_rounding(&candidate) || candidate.kkt.within(MAX_ROUNDING) {
                unbalanced = Some(candidate.unbalanced);
                refined = Some(candidate.u);
            }
        }
    }

    /// Moves the reference by the rigid part of an answer; returns false if the answer is not mostly rigid.
    fn move_reference(&mut self, candidate: &Candidate) -> Result<bool, PetscError> {
        if candidate.rigid_max <= DOMINANT * candidate.elastic_max {
            return Ok(false);
        }
        let (reference, constraints) = (&mut self.next.reference, &self.problem.constraints);
        let nodes = &self.problem.body.nodes.points;
        let motion: Vec<f64> = nodes.iter().flat_map(|&x| candidate.rigid.at(x)).collect();
        self.c.write(|c| {
            reference.translate(constraints, c, 1.0);
            reference.add(constraints, &motion);
            reference.translate(constraints, c, -1.0);
        })?;
        Ok(true)
    }

    /// max |u − v| / max |u|. Collective.
    fn difference(&self, u: &[f64], v: &[f64]) -> f64 {
        let partition = &self.problem.body.nodes.partition;
        let difference: Vec<f64> = u.iter().zip(v).map(|(u, v)| u - v).collect();
        partition.max_norm(&difference) / partition.max_norm(u)
    }
}
