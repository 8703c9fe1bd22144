//! The decision after an attempt: its answer is accepted, another attempt changes one thing, or the step gives up.

use super::{
    AcceptedState, ContactStep,
    certificate::Candidate,
    solver_error::{Accuracy, MAX_ROUNDING},
};
use crate::{
    contact::{ContactError, ContactOptions, ContactReport},
    evolution::LoadCase,
    petsc::PetscError,
};

/// Maximum number of attempts by one solver, each to a smaller tolerance or from another reference.
///
/// Tuned on the 6 plain runs and ill-conditioned bodies of the tests. 1: some of these bodies have no answer. Twice:
/// nothing changes.
const ATTEMPTS: usize = 3;
/// An answer is mostly rigid if its rigid part is more than this many times the rest. A reference other than zero is
/// then renewed, even if the answer is certified.
///
/// Tuned on the 6 plain runs. Half: nothing changes. Twice: nothing changes.
const DOMINANT: f64 = 10.0;
/// Residuals are the effect of rounding if they are at most this many times its estimate.
const ROUNDED: f64 = 10.0;

/// An attempt at a step.
pub(super) struct Attempt {
    /// The index of its solver in the list of solvers.
    pub(super) solver: usize,
    /// 1, 2, … [`ATTEMPTS`] of this solver.
    number: usize,
    /// The tolerance of the solver.
    pub(super) tolerance: f64,
    /// The force scale of the answer before.
    pub(super) force_scale: Option<f64>,
    /// u and f − Ku of the answer before, if the attempt solves for these residual forces only.
    pub(super) refined: Option<[Vec<f64>; 2]>,
    /// The reference and the warm start of the attempt. The next step starts from them if the answer is accepted.
    pub(super) next: AcceptedState,
    /// The cost of the last solve, and of all attempts of this solver.
    pub(super) spent: ContactReport,
    pub(super) report: ContactReport,
    /// The failure of the solver whose rescuer attempts the step.
    rescued: Option<Failure>,
}

/// The error of an attempt, and the tolerance that double precision can reach if this explains the error.
type Failure = (ContactError, Option<f64>);

/// The decision after an attempt.
#[expect(clippy::large_enum_variant, reason = "one at a time lives, in a loop of few turns")]
pub(super) enum Decision {
    /// The answer is accepted.
    Accept(Attempt, Candidate),
    /// This attempt follows.
    Again(Attempt),
    /// The step has no answer.
    GiveUp(Failure),
}

impl Attempt {
    /// The first attempt of a solver.
    pub(super) fn first(solver: usize, tolerance: f64, next: AcceptedState) -> Self {
        let (force_scale, refined, rescued) = (None, None, None);
        let (spent, report) = Default::default();
        Self { solver, number: 1, tolerance, force_scale, refined, next, spent, report, rescued }
    }

    /// The attempt after this one and its answer, to the same tolerance.
    fn again(self, candidate: &Candidate) -> Self {
        let (number, force_scale) = (self.number + 1, Some(candidate.scales.force));
        Self { number, force_scale, refined: None, ..self }
    }
}

impl ContactStep<'_> {
    /// Decides by the certificate of an answer, which counts instead of the solver's own test. `stopped` is the error of
    /// a solver that stopped short of its tolerance. Collective.
    ///
    /// - A mostly rigid answer: again, from a reference that has moved along.
    /// - Small residuals: accept. Residuals of rounding are accepted once a further attempt has not helped or is
    ///   impossible.
    /// - The solver stopped short, energy is negative, or all attempts are used: the rescuer, or give up.
    /// - Otherwise: again, to a smaller tolerance. If the residuals are near rounding, the solver gets the residual
    ///   forces as its load.
    pub(super) fn decide(
        &mut self,
        mut attempt: Attempt,
        stopped: Option<ContactError>,
        candidate: Candidate,
        case: &LoadCase,
    ) -> Result<Decision, PetscError> {
        let required = self.problem.tolerance;
        let (is_certified, is_last) = (candidate.kkt.within(required), attempt.number == ATTEMPTS);
        attempt.report.add(&attempt.spent);
        let has_moved = !attempt.next.reference.is_zero();
        let is_rigid = candidate.rigid_max > DOMINANT * candidate.elastic_max;
        if is_rigid && (has_moved || !is_certified) && !is_last {
            self.move_reference(&mut attempt, &candidate)?;
            return Ok(Decision::Again(attempt.again(&candidate)));
        }
        // The change by a solve for the residual forces is the error of the answer before.
        let error = attempt.refined.as_ref().map(|[u, _]| self.difference(&candidate.u, u));
        let is_accepted = is_certified
            || (attempt.number > 1 || stopped.is_some())
                && self.is_exact_to_rounding(&candidate, error);
        let method = self.solvers[attempt.solver].name();
        let failure = match stopped {
            Some(error) if !is_accepted => (error, self.attainable(&candidate)),
            // If K is indefinite, a KKT point need not be a minimum. Only some solvers notice this.
            _ if candidate.is_indefinite() => (ContactError::NotDefinite { method }, None),
            _ if is_accepted => return Ok(Decision::Accept(attempt, candidate)),
            _ if is_last || candidate.kkt.worst().is_nan() => {
                let residuals = candidate.kkt;
                let error = ContactError::NotCertified { method, tolerance: required, residuals };
                (error, self.attainable(&candidate))
            }
            _ => {
                let mut next = attempt.again(&candidate);
                next.tolerance *= 0.3 * required / candidate.kkt.worst();
                if self.is_rounding(&candidate) || candidate.kkt.within(MAX_ROUNDING) {
                    next.refined = Some([candidate.u, candidate.unbalanced]);
                }
                return Ok(Decision::Again(next));
            }
        };
        self.give_up(attempt, failure, case)
    }

    /// After the last attempt of a solver: the first one of its rescuer, if another method may succeed. Of the errors of both the
    /// first is reported, unless only the second states the limit by rounding.
    pub(super) fn give_up(
        &mut self,
        attempt: Attempt,
        failure: Failure,
        case: &LoadCase,
    ) -> Result<Decision, PetscError> {
        let (comm, next) = (self.problem.body.comm(), attempt.solver + 1);
        if next < self.solvers.len() && failure.0.may_be_rescued(comm) {
            let first = self.first_attempt(next, case)?;
            return Ok(Decision::Again(Attempt { rescued: Some(failure), ..first }));
        }
        Ok(Decision::GiveUp(match attempt.rescued {
            Some(first) if first.1.is_some() || failure.1.is_none() => first,
            _ => failure,
        }))
    }

    /// Moves the reference of an attempt by the rigid part of its answer.
    fn move_reference(
        &mut self,
        attempt: &mut Attempt,
        candidate: &Candidate,
    ) -> Result<(), PetscError> {
        let (reference, constraints) = (&mut attempt.next.reference, &self.problem.constraints);
        let nodes = &self.problem.body.nodes.points;
        let motion: Vec<f64> = nodes.iter().flat_map(|&x| candidate.rigid.at(x)).collect();
        self.c.write(|c| {
            reference.translate(constraints, c, 1.0);
            reference.add(constraints, &motion);
            reference.translate(constraints, c, -1.0);
        })
    }

    /// max |u − v| / max |u|. Collective.
    fn difference(&self, u: &[f64], v: &[f64]) -> f64 {
        let partition = &self.problem.body.nodes.partition;
        let difference: Vec<f64> = u.iter().zip(v).map(|(u, v)| u - v).collect();
        partition.max_norm(&difference) / partition.max_norm(u)
    }

    /// The tolerance that double precision can reach, if it is above the required one and the residuals are within it.
    fn attainable(&self, candidate: &Candidate) -> Option<f64> {
        let attainable = ROUNDED * self.rounding(candidate);
        let is_limit = self.problem.tolerance < attainable && attainable < 1.0;
        (is_limit && candidate.kkt.within(attainable)).then_some(attainable)
    }

    /// Is u exact for a stiffness whose entries are off by ε_machine? In addition, its residuals must be at most
    /// `MAX_ROUNDING`, or its relative `error` at most the promised one. A tolerance below the default must be met.
    fn is_exact_to_rounding(&self, candidate: &Candidate, error: Option<f64>) -> bool {
        let tolerance = self.problem.tolerance;
        let is_small = |error| error <= Accuracy::promised(tolerance);
        tolerance >= ContactOptions::default().tolerance
            && self.is_rounding(candidate)
            && (candidate.kkt.within(MAX_ROUNDING) || error.is_some_and(is_small))
    }

    /// Are the residuals of u at most the rounding of its internal forces? Rounding near F, as of a body that has moved far
    /// away, says nothing about u.
    fn is_rounding(&self, candidate: &Candidate) -> bool {
        candidate.kkt.within(self.rounding(candidate).min(1.0 / ROUNDED))
    }

    /// The rounding of the internal forces of u, ε_machine ‖|K||u|‖₂ / F.
    fn rounding(&self, candidate: &Candidate) -> f64 {
        let body = &self.problem.body;
        let elasticity = &self.problem.elasticity;
        let rounding = elasticity.force_rounding(body, &self.zeta_at_points, &candidate.u);
        body.nodes.partition.norm(&rounding, 2) / candidate.scales.force
    }
}
