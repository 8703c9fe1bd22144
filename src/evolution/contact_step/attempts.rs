//! Solves until the certificate accepts the answer.

use super::{
    ContactStep,
    certificate::{Judged, MOST_ROUNDING},
    minimisation::displacement,
};
use crate::{
    contact::{ContactError, ContactReport},
    evolution::{LoadCase, RunError},
    petsc::PetscError,
};

/// The largest number of solves for one answer: with a smaller tolerance or another datum.
const ATTEMPTS: usize = 3;
/// An answer is mostly rigid if its rigid part exceeds this multiple of the rest.
const DOMINANT: f64 = 10.0;
/// Above this multiple even a certified answer is solved again from a new datum, if the present one is not
/// zero.
const FAR: f64 = 1e3;

impl ContactStep<'_> {
    /// Solves until the certificate accepts the answer, with a smaller tolerance or another datum in each
    /// attempt. Among many answers it takes the one with the minimum ∫|u|². The certificate decides, not the
    /// solver.
    pub(super) fn solve_certified(
        &mut self,
        step: usize,
        case: &LoadCase,
    ) -> Result<(Judged, ContactReport), RunError> {
        let (problem, asked) = (self.problem, self.problem.tolerance);
        let failed = |source| RunError::contact(problem, step, case.time, source);
        let (mut tolerance, mut attempt, mut refined) = (asked, 0, None::<Vec<f64>>);
        let (mut before, mut report) = ((None, None), ContactReport::default());
        loop {
            attempt += 1;
            let (lift, bounds) = self.next.datum.pose(&problem.constraints, case);
            let solved = match self.solve_contact(case, &lift, &bounds, tolerance, before) {
                // All ranks know that the method stopped above its tolerance. Other errors may concern one
                // rank.
                Err(error) if !error.stopped_short() => return Err(failed(error)),
                solved => solved,
            };
            let u = displacement(problem, lift, &self.c)?;
            let judged = self.phases.time("certificate", || self.certify(u, case));
            let certified = judged.kkt.within(asked);
            let far = !self.next.datum.is_zero() && judged.rigid_max > FAR * judged.elastic_max;
            // The change by a solve for the unbalanced forces is the error of the answer before.
            let error = refined.take().map(|before| self.difference(&judged.u, &before));
            before = (Some(judged.scales.force), None);
            if (far || !certified) && attempt < ATTEMPTS && self.move_datum(&judged)? {
                continue;
            }
            // If a further attempt does not help, or is impossible, residuals within rounding are accepted.
            let certified = certified
                || (attempt > 1 || solved.is_err()) && self.is_exact_to_rounding(&judged, error);
            match solved {
                Ok(solved) => report.add(&solved),
                Err(error) if !certified => return Err(failed(self.limited(error, &judged))),
                Err(ContactError::NotConverged { report: spent, .. }) => report.add(&spent),
                Err(_) => {}
            }
            // A KKT point of an indefinite K need not be a minimum, and a solver may not notice.
            if judged.is_indefinite() {
                return Err(failed(ContactError::NotDefinite { method: self.solver.name() }));
            }
            if certified {
                let (judged, refused) = self.of_least_displacement(judged, case)?;
                if attempt == ATTEMPTS || refused <= asked {
                    return Ok((judged, report));
                }
                tolerance *= 0.3 * asked / refused;
                continue;
            }
            if attempt == ATTEMPTS || judged.kkt.worst().is_nan() {
                let (method, residuals) = (self.solver.name(), judged.kkt);
                let error = ContactError::NotCertified { method, tolerance: asked, residuals };
                return Err(failed(self.limited(error, &judged)));
            }
            tolerance *= 0.3 * asked / judged.kkt.worst();
            if self.is_rounding(&judged) || judged.kkt.within(MOST_ROUNDING) {
                before.1 = Some(judged.unbalanced);
                refined = Some(judged.u);
            }
        }
    }

    /// Moves the datum by the rigid part of an answer, if the answer is mostly that.
    fn move_datum(&mut self, judged: &Judged) -> Result<bool, PetscError> {
        if judged.rigid_max <= DOMINANT * judged.elastic_max {
            return Ok(false);
        }
        let (datum, constraints) = (&mut self.next.datum, &self.problem.constraints);
        let nodes = &self.problem.body.nodes.points;
        let motion: Vec<f64> = nodes.iter().flat_map(|&x| judged.rigid.at(x)).collect();
        self.c.write(|c| {
            datum.shift(constraints, c, 1.0);
            datum.add(constraints, &motion);
            datum.shift(constraints, c, -1.0);
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
