//! Error estimates of a run on one mesh.
//!
//! A run solves a discrete problem. This room estimates the difference from the exact solution of the scene:
//!
//! - [`RecoveredStrains`]: the error of u in the energy norm, per triangle, from strains fitted around each vertex
//!   (the same strains give the [`NodalStress`](crate::observe::NodalStress) of pictures);
//! - [`EquilibratedStress`]: a proved bound on the error of u from the mesh, if it is asked for ([`Simulation::bound`]);
//! - [`ErrorBudget`]: the errors by the mesh, the time steps and the solver.
//!
//! What crosses the door: a [`Simulation`] calls `evolution`, takes its last state, some earlier states and its factor of K,
//! and returns the [`Outcome`] with the estimates. Nothing here changes the answer of a run. The room
//! [`accuracy`](crate::accuracy) compares the answers of several runs.

mod equilibrated;
mod recovery;
mod damage_errors;
mod simulation;

pub use equilibrated::{EquilibratedStress, Unproved};
pub(crate) use recovery::mass;
pub use recovery::{EnergyError, RecoveredStrains};
pub use simulation::Simulation;

use crate::{
    evolution::{ErrorBudget, Outcome, Run, RunError},
    petsc::{PetscError, stage},
    problem::{DiscreteProblem, State},
};
use damage_errors::{displacement_error_of, relative_to_damage};
use nalgebra::DVector;

/// If max |u| of the last step is below this fraction of its maximum in the run, the body counts as unloaded.
pub(crate) const UNLOADED: f64 = 0.01;

/// Estimates the errors of a finished run, with a proved bound on that of u if it is `asked`, and enters them in its outcome.
/// Collective.
fn estimated(run: Run, asked: bool) -> Result<Outcome, RunError> {
    let Run { mut contact_step, controller, mut outcome, .. } = run;
    let problem = contact_step.problem;
    outcome.accuracy = stage("accuracy", || contact_step.accuracy(&outcome))?;
    outcome.accuracy.energy = stage("accuracy", || energy_error(problem, &outcome))?;
    let state = representative(&outcome).clone();
    let prove = || equilibrated::proved_error(&mut contact_step, &state, outcome.accuracy.energy);
    let proof = asked.then(|| stage("proof", prove)).transpose()?;
    if let Some(Ok(proof)) = &proof
        && proof.left_out.is_empty()
    {
        outcome.accuracy.energy = outcome.accuracy.energy.min(proof.relative);
    }
    outcome.penetration = stage("accuracy", || {
        problem.penetration_note(&[&outcome.most_displaced().state, &outcome.last.state])
    });
    let is_known = problem.damage().is_some()
        && outcome.stopped.is_none()
        && outcome.may_stop.is_none()
        && outcome.last.record.step > 0;
    let last = &outcome.last.state;
    let caused = |error: &DVector<f64>| displacement_error_of(problem, error.as_slice(), last);
    let error = is_known.then(|| controller.step_error());
    let bar = is_known.then(|| controller.step_bar());
    let (displacement_bound, reservations) = match proof {
        Some(Ok(proof)) => (Some(proof.relative), proof.left_out),
        Some(Err(reason)) => (None, vec![reason]),
        None => (None, Vec::new()),
    };
    outcome.errors = ErrorBudget {
        displacement_mesh: outcome.accuracy.energy,
        displacement_bound,
        reservations,
        displacement_steps: error.as_ref().map(caused),
        damage_steps: error
            .as_ref()
            .and_then(|error| relative_to_damage(problem, error.as_slice(), last)),
        solver: outcome.accuracy.displacement,
        can_be_damaged: problem.damage().is_some(),
        bars_of_steps: bar.map(|bar| (bar.clone(), caused(&bar))),
        ..ErrorBudget::default()
    };
    Ok(outcome)
}

/// The last state, or the one with the maximum displacement if the last one is unloaded. The small u left then gives a poor
/// estimate.
fn representative(outcome: &Outcome) -> &State {
    let (last, most) = (&outcome.last, outcome.most_displaced());
    let unloaded = last.record.displacement_max < UNLOADED * most.record.displacement_max;
    if unloaded { &most.state } else { &last.state }
}

/// The estimated discretisation error of u, relative, in the energy norm. Collective.
fn energy_error(problem: &DiscreteProblem, outcome: &Outcome) -> Result<f64, PetscError> {
    let state = representative(outcome);
    let (body, u) = (&problem.body, &problem.strained(state).u);
    let (recovered, zeta) = (RecoveredStrains::new(body, u)?, problem.zeta_at_points(&state.zeta));
    Ok(recovered.energy_error(&problem.elasticity, &zeta, u).relative())
}
