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
//! Affine displacements have one strain in a triangle. There φ is taken at the three vertices, from
//! their ζ and that strain, and integrated as an affine function; and η_*(ζ) by its mean over the three
//! vertices. For quadratic ones, φ and η_*(ζ)𝒜ε(u) are taken at three quadrature points.
//!
//! [`run`] is this loop; a step controller plans each step and judges it, so that steps may be chosen as
//! well as uniform.

mod adaptive;
mod both_orders;
mod boundary_conditions;
mod contact_step;
mod damage_step;
mod discrete_problem;
mod error;
mod error_budget;
mod extrapolation;
mod loads;
mod mesh_error;
mod notes;
mod outcome;
mod probe;
mod state;
mod step_controller;
mod supports;
mod unresolved;

pub use crate::contact::ContactPoint;
pub use crate::phases::Phases;
pub use adaptive::{AdaptError, Adapted, SHARE_OF_STEPS, adapted};
pub use boundary_conditions::Foundation;
pub use contact_step::{Accuracy, ContactStep};
pub use discrete_problem::{DiscreteProblem, SetupError};
pub use error::{RunError, StepFailure};
pub use error_budget::ErrorBudget;
pub use extrapolation::Extrapolation;
pub use loads::Loads;
pub use outcome::{BoundViolation, Outcome, Stop};
pub use state::{State, Step, StepRecord};
pub use supports::{ContactRow, Supports};

use crate::petsc::{Communicator, Session};
use contact_step::Compliance;
use damage_step::DamageStep;
use mesh_error::{Instants, mesh_error};
use nalgebra::DVector;
use std::time::Instant;
use step_controller::{StepController, Verdict};

/// The answer of whoever is shown an accepted step: an error ends the run.
pub type Observed = Result<(), Box<dyn std::error::Error + Send + Sync>>;

/// Solves Problem VP^hk with the contact solver called `solver`; `accepted` sees every accepted
/// step, n = 0 included.
///
/// # Errors
/// See [`RunError`]; every accepted step has been seen by then.
pub fn run(
    session: &Session,
    problem: &DiscreteProblem,
    solver: &str,
    phases: &Phases,
    accepted: &mut dyn FnMut(&Step) -> Observed,
) -> Result<Outcome, RunError> {
    let mut show = |step: &Step| {
        let shown = accepted(step).map_err(RunError::Observer);
        agreed(problem.body.nodes.partition.comm(), shown)
    };
    let mut damage_step = DamageStep { session, problem, phases, system: None };
    let mut contact_step = ContactStep::new(session, problem, solver, phases)?;

    // (27): u_0 from ζ_0.
    let first = contact_step.solve(0, problem.start(), &problem.initial_damage())?;
    contact_step.accept(problem.start())?;
    let source = damage_step.source(&first.state);
    let mut controller = StepController::new(problem, &first.state.zeta, source);
    let mut outcome = Outcome::new(first);
    show(&outcome.last)?;
    let mut instants = Instants::new();
    instants.observe(&outcome.last);
    loop {
        let started = Instant::now();
        let Some(planned) = controller.plan(&outcome.last) else { break };
        // (28): ζ_n from ζ_{n−1} and u_{n−1}.
        let verdict = damage_step.solve(&planned).and_then(|damage| {
            if damage.min_max.0 <= problem.threshold() {
                return Ok(controller.judge_stop(&planned, &damage, &outcome.last));
            }
            // (26): u_n from ζ_n.
            let mut step = contact_step.solve(planned.n, planned.time, damage.zeta.as_slice())?;
            step.set_damage_certificate(damage.certificate);
            controller.judge(&planned, &damage, Box::new(step), &mut damage_step)
        });
        match verdict.or_else(|failure| controller.judge_failure(&planned, failure))? {
            Verdict::Accept(mut step) => {
                contact_step.accept(planned.time)?;
                step.record.seconds = started.elapsed().as_secs_f64();
                outcome.accept(*step);
                show(&outcome.last)?;
                instants.observe(&outcome.last);
            }
            Verdict::Retry => outcome.undone += 1,
            Verdict::Stop(stop) => {
                outcome.stopped = Some(stop);
                break;
            }
        }
    }
    let compliance = contact_step.into_compliance()?;
    judge(&mut outcome, &controller, damage_step, compliance, instants)?;
    Ok(outcome)
}

/// Estimates the errors of a run that has ended. Collective.
fn judge(
    outcome: &mut Outcome,
    controller: &StepController,
    mut damage_step: DamageStep,
    mut compliance: Compliance,
    instants: Instants,
) -> Result<(), RunError> {
    let (problem, phases) = (damage_step.problem, damage_step.phases);
    outcome.bound_violation = controller.violation;
    outcome.damage_error = controller.damage_error();
    outcome.accuracy = phases.time("accuracy", || compliance.accuracy(outcome))?;
    let mesh = phases.time("mesh error", || {
        mesh_error(problem, &mut damage_step, compliance, instants, outcome)
    });
    if let (Some(stop), Some(error)) = (&mut outcome.stopped, &mesh) {
        stop.from_mesh = error.delay.map(|delay| 2.0 * delay.abs());
    }
    outcome.damage_indicators = mesh.as_ref().map_or_else(Vec::new, |mesh| mesh.indicators.clone());
    let steps = controller.step_error().filter(|_| problem.damage().is_some());
    outcome.errors =
        ErrorBudget::new(problem, outcome, mesh, steps.as_ref().map(DVector::as_slice));
    Ok(())
}

/// All ranks go on, or none. Collective.
fn agreed<T, E: Into<RunError>>(comm: Communicator, result: Result<T, E>) -> Result<T, RunError> {
    let failed = comm.any(result.is_err());
    match result {
        Ok(_) if failed => Err(RunError::OnAnotherRank),
        result => result.map_err(E::into),
    }
}
