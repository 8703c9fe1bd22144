//! Repeats the contact solve until the answer is certified.

use super::{
    ContactStep, accuracy::MAX_ROUNDING, certificate::Candidate, minimisation::displacement,
};
use crate::{
    contact::{ContactError, ContactReport},
    evolution::{LoadCase, RunError},
    petsc::{PetscError, stage},
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

/// What an attempt takes from the one before.
struct Attempt {
    /// 1, 2, … [`ATTEMPTS`].
    number: usize,
    /// The tolerance of the solver.
    tolerance: f64,
    /// The force scale of the answer before.
    force_scale: Option<f64>,
    /// u and f − Ku of the answer before, if the attempt solves for these residual forces only.
    refined: Option<[Vec<f64>; 2]>,
}

impl Attempt {
    /// The attempt after this one and its answer, by default to the same tolerance.
    fn next(&self, candidate: &Candidate) -> Self {
        let (number, force_scale) = (self.number + 1, Some(candidate.scales.force));
        Self { number, tolerance: self.tolerance, force_scale, refined: None }
    }
}

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
        let mut attempt =
            Attempt { number: 1, tolerance: required, force_scale: None, refined: None };
        let mut report = ContactReport::default();
        loop {
            let (solved, candidate) = self.attempt(&attempt, case, failed)?;
            let (is_certified, is_last) =
                (candidate.kkt.within(required), attempt.number == ATTEMPTS);
            let moved = !self.next.reference.is_zero();
            if (moved || !is_certified) && !is_last && self.move_reference(&candidate)? {
                attempt = attempt.next(&candidate);
                continue;
            }
            // Residuals of rounding are accepted once a further attempt has not helped or is impossible. The change by a
            // solve for the residual forces is the error of the answer before.
            let error = attempt.refined.as_ref().map(|[u, _]| self.difference(&candidate.u, u));
            let is_accepted = is_certified
                || (attempt.number > 1 || solved.is_err())
                    && self.is_exact_to_rounding(&candidate, error);
            match solved {
                Ok(solved) => report.add(&solved),
                Err(error) if !is_accepted => return Err(failed(self.limited(error, &candidate))),
                Err(ContactError::NotConverged { report: spent, .. }) => report.add(&spent),
                Err(_) => {}
            }
            // If K is indefinite, a KKT point need not be a minimum. Only some solvers notice this.
            if candidate.is_indefinite() {
                return Err(failed(ContactError::NotDefinite { method: self.solver.name() }));
            }
            if is_accepted {
                return Ok((self.of_minimum_displacement(candidate, case)?, report));
            }
            if is_last || candidate.kkt.worst().is_nan() {
                let (method, residuals) = (self.solver.name(), candidate.kkt);
                let error = ContactError::NotCertified { method, tolerance: required, residuals };
                return Err(failed(self.limited(error, &candidate)));
            }
            attempt = attempt.next(&candidate);
            attempt.tolerance *= 0.3 * required / candidate.kkt.worst();
            if self.is_rounding(&candidate) || candidate.kkt.within(MAX_ROUNDING) {
                attempt.refined = Some([candidate.u, candidate.unbalanced]);
            }
        }
    }

    /// Solves from the reference. Returns the solver's report, or its error if it stopped short, and the answer with its
    /// residuals.
    fn attempt(
        &mut self,
        attempt: &Attempt,
        case: &LoadCase,
        failed: impl Fn(ContactError) -> RunError,
    ) -> Result<(Result<ContactReport, ContactError>, Candidate), RunError> {
        let (c_prescribed, bounds) =
            self.next.reference.prescribed_and_bounds(&self.problem.constraints, case);
        let unbalanced = attempt.refined.as_ref().map(|[_, unbalanced]| unbalanced.clone());
        let known = (attempt.force_scale, unbalanced);
        let solved =
            match self.solve_contact(case, &c_prescribed, &bounds, attempt.tolerance, known) {
                // All ranks know that the method stopped short. Any other error may concern one rank only.
                Err(error) if !matches!(error, ContactError::NotConverged { .. }) => {
                    return Err(failed(error));
                }
                solved => solved,
            };
        let u = displacement(self.problem, c_prescribed, &self.c)?;
        Ok((solved, stage("certificate", || self.certify(u, case))))
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
