//! Problem VP^hk of the paper: damage and contact in turn, step by step.
//!
//! Displacements u_n and damage ζ_n are affine on the triangles of one mesh, (22) and (23); or u_n is
//! quadratic there. With the nodal functions λ_i of ζ and the matrices and vectors
//!
//! M_ij = ∫ λ_i λ_j, L_ij = ∫ ∇λ_i·∇λ_j, b_i(u, ζ) = ∫ φ(ε(u), ζ) λ_i,
//! vᵀK(ζ)u = ∫ η_*(ζ) 𝒜ε(u)·ε(v), fᵀv = ∫_Ω f_B·v + ∫_{Γ_N} f_N·v,
//!
//! and the admissible set (24), U_n = {v: v = u_D(t_n) on Γ_D, v·ν ≤ g at the nodes of Γ_C}:
//!
//! - (27): ζ_0 interpolates ζ₀, and u_0 minimises ½ uᵀK(ζ_0)u − f_0ᵀu over U_0.
//!
//! For n = 1, …, N:
//!
//! - (25), solved as (28): (M + kκL) ζ_n = M ζ_{n−1} + k b(u_{n−1}, ζ_{n−1});
//! - the program stops when min ζ_n ≤ ζ_*;
//! - (26): u_n minimises ½ uᵀK(ζ_n)u − f_nᵀu over U_n.
//!
//! Affine displacements have one strain in a triangle. There φ is evaluated at the three vertices and integrated as
//! an affine function, and η_*(ζ) enters by its mean over the vertices. For quadratic displacements, φ and
//! η_*(ζ)𝒜ε(u) are evaluated at three quadrature points.
//!
//! `all_steps` is this loop, and `Run::step` one of its steps. [`ContactStep`] solves and certifies (26), `DamageStep` solves (28), and `StepController`
//! plans each step and accepts or rejects it; steps are uniform or adaptive.
//!
//! What crosses the door: `command` starts a run of an [`ObservedProblem`] with an [`Observer`], which sees every
//! accepted [`Step`], by way of `estimate`, which enters its error estimates in the [`Outcome`].

mod run_options;
mod contact_step;
mod damage_step;
mod error;
mod error_budget;
mod notes;
mod observer;
mod outcome;
mod state;
mod step_controller;

pub use crate::contact::ContactPoint;
pub use crate::{
    observe::{ContactRow, ObservedProblem, Supports},
    problem::{DiscreteProblem, Loads, SetupError, State},
};
pub use contact_step::{Accuracy, ContactStep};
pub(crate) use damage_step::DamageStep;
pub use error::{RunError, StepFailure};
pub use error_budget::{ErrorBudget, percent};
pub use observer::{Next, Observed, Observer};
pub use outcome::{BoundViolation, Outcome, Stop};
pub use run_options::RunOptions;
pub use state::{GoverningValue, Step, StepRecord};
pub use step_controller::AIM;
pub(crate) use step_controller::StepController;

use crate::{
    linear::FactorState,
    model::ChosenSource,
    petsc::{Communicator, Session, stage},
    problem::{LoadCase, LoadCurve},
};
use contact_step::ContactState;
use serde::{Deserialize, Serialize};
use std::time::Instant;
use step_controller::{Decision, StepState};

/// Solves Problem VP^hk with these `run_options`. The `observer` sees every accepted step, and may keep
/// checkpoints and end the run. It starts from `saved`, if given. Adaptive steps end at the times `followed` of another
/// run. Everything at the end is returned, without error estimates.
///
/// # Errors
/// See [`RunError`]; every accepted step has been seen by then.
pub(crate) fn all_steps<'a>(
    session: &'a Session,
    problem: &'a ObservedProblem,
    run_options: &'a RunOptions,
    observer: &mut dyn Observer,
    saved: Option<RunState>,
    followed: &'a [f64],
) -> Result<Run<'a>, RunError> {
    let law = &run_options.source;
    if matches!(law, ChosenSource::Own(_)) && problem.damage().is_none() {
        return Err(RunError::NoDamage);
    }
    let damage_step = DamageStep { session, problem, law, system: None, loaded: None };
    let mut contact_step = ContactStep::new(session, problem, run_options)?;
    let (zeta, start) = (problem.initial_damage(), problem.scene().start());
    let (mut first, mut source) = Default::default();
    if saved.is_none() {
        // (27): u_0 from ζ_0.
        first = contact_step.solve(0, start, &zeta)?;
        contact_step.accept(start)?;
        source = damage_step.source(&mut first)?;
    }
    let controller = StepController::new(problem, law, &zeta, source, followed);
    let outcome = Outcome::new(first, problem);
    let mut run = Run { damage_step, contact_step, controller, outcome };
    match saved {
        None => run.report(observer)?,
        Some(saved) => {
            run.contact_step.set_state(saved.contact);
            run.damage_step.loaded = saved.damage_factor;
            run.controller.set_state(saved.controller);
            run.outcome = saved.outcome;
        }
    }
    while run.step(observer)? {}
    run.contact_step.check_scales(&run.outcome.last)?;
    run.outcome.bound_violation = run.controller.violation();
    run.outcome.damage_error = run.controller.damage_error();
    run.outcome.may_stop = run.controller.may_stop().filter(|_| run.outcome.stopped.is_none());
    Ok(run)
}

/// A run between two steps.
pub(crate) struct Run<'a> {
    pub(crate) damage_step: DamageStep<'a>,
    pub(crate) contact_step: ContactStep<'a>,
    pub(crate) controller: StepController<'a>,
    pub(crate) outcome: Outcome,
}

impl Run<'_> {
    /// Tries a step, which is accepted or rejected; false at the end of the run.
    fn step(&mut self, observer: &mut dyn Observer) -> Result<bool, RunError> {
        let started = Instant::now();
        let Self { damage_step, contact_step, controller, outcome, .. } = self;
        let Some(planned) = controller.plan(&outcome.last) else { return Ok(false) };
        // (28): ζ_n from ζ_{n−1} and u_{n−1}.
        let decision = damage_step.solve(&planned).and_then(|damage| {
            if damage.min_max.0 <= damage_step.problem.threshold() {
                return Ok(controller.decide_stop(&planned, &damage, &outcome.last));
            }
            // (26): u_n from ζ_n.
            let mut step = contact_step.solve(planned.n, planned.time, damage.zeta.as_slice())?;
            step.set_damage_certificate(damage.certificate);
            controller.decide(&planned, &damage, Box::new(step), damage_step)
        });
        match decision.or_else(|failure| controller.decide_failure(&planned, failure))? {
            Decision::Accept(mut step) => {
                contact_step.accept(planned.time)?;
                step.record.seconds = started.elapsed().as_secs_f64();
                outcome.accept(*step, contact_step.problem);
                self.report(observer)?;
            }
            Decision::Retry => outcome.rejected += 1,
            Decision::Stop(stop) => {
                outcome.stopped = Some(stop);
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Reports the last accepted step to the observer. Then the run goes on, keeps a checkpoint or ends, as the
    /// observers of all ranks decide. Collective.
    fn report(&mut self, observer: &mut dyn Observer) -> Result<(), RunError> {
        let comm = self.damage_step.problem.body.comm();
        let wanted = observer.accept(&self.outcome.last).map_err(RunError::Observer);
        let next = Next::of_urgency(comm.max(agreed(comm, wanted)?.urgency()));
        if next != Next::Step {
            let kept = stage("checkpoint", || {
                observer.keep(RunState {
                    contact: self.contact_step.state(),
                    damage_factor: self.damage_step.factor_state(),
                    controller: self.controller.state(),
                    outcome: self.outcome.clone(),
                })
            });
            agreed(comm, kept.map_err(RunError::Observer))?;
        }
        if let Next::End(signal) = next { Err(RunError::Interrupted(signal)) } else { Ok(()) }
    }
}

/// A checkpoint: all that determines the next steps, to the last bit.
#[derive(Debug, Serialize, Deserialize)]
pub struct RunState {
    contact: ContactState,
    damage_factor: Option<FactorState>,
    controller: StepState,
    outcome: Outcome,
}

impl RunState {
    /// The last accepted step.
    pub fn last(&self) -> &Step {
        &self.outcome.last
    }
}

/// Fails on all ranks if `result` is an error on any rank. Collective.
pub(crate) fn agreed<T, E: Into<RunError>>(
    comm: Communicator,
    result: Result<T, E>,
) -> Result<T, RunError> {
    let failed = comm.any(result.is_err());
    match result {
        Ok(_) if failed => Err(RunError::OnAnotherRank),
        result => result.map_err(E::into),
    }
}
