//! Error estimates, and meshes adapted to an accuracy.
//!
//! A run solves a discrete problem. This room estimates the difference from the exact solution of the scene, and
//! refines meshes until the difference is within the required accuracy. There are four estimates:
//!
//! - [`RecoveredStrains`]: the error of u in the energy norm, per triangle, from strains fitted around each vertex;
//! - the error of the damage: (25) is solved again, for the difference from a much finer mesh;
//! - [`Bar`]: the error bar of each printed figure, measured by a second run on the mesh bisected everywhere;
//! - [`ErrorBudget`]: the errors by the mesh, the time steps and the solver.
//!
//! [`adapted`] makes a mesh for an accuracy ([`Adapted`]). Each round has a run with few steps, estimates and
//! bisection. A measurement ends the rounds.
//!
//! What crosses the door: at the end of a run `evolution` hands over its last state, some earlier states and its
//! factor of K. It gets the estimates in its [`Outcome`]. `command` requests an adapted mesh and error bars.
//! Nothing here changes the answer of a run.

mod hierarchical;
mod recovery;
mod order_pair;
mod fine_solve;
mod fine_strains;
mod instants;
mod quadratic_system;
mod damage_error;
mod error_budget;
mod figures;
mod penetration;
mod unresolved;
mod adaptive;

pub use adaptive::{AdaptError, Adapted, adapted, measured_bars};
pub use error_budget::{ErrorBudget, percent};
pub use figures::Bar;
pub(crate) use instants::Instants;
pub use recovery::{EnergyError, RecoveredStrains, strains_at_nodes};
pub(crate) use unresolved::notes as unresolved_notes;

use crate::evolution::{Compliance, DamageStep, Outcome, RunError, StepController};
use damage_error::damage_error;
use nalgebra::DVector;

/// The error bar of the time of ζ_* over the estimated delay. A coarse mesh may not show all of the delay.
const DELAYS: f64 = 1.5;

/// Estimates the errors of a finished run and enters them in its outcome. Collective.
pub(crate) fn estimate_run(
    outcome: &mut Outcome,
    controller: &StepController,
    mut damage_step: DamageStep,
    mut compliance: Compliance,
    instants: Instants,
) -> Result<(), RunError> {
    let (problem, phases) = (damage_step.problem, damage_step.phases);
    outcome.bound_violation = controller.violation();
    outcome.damage_error = controller.damage_error();
    outcome.accuracy = phases.time("accuracy", || compliance.accuracy(outcome))?;
    outcome.penetration = phases.time("accuracy", || {
        let states = instants.states.iter().chain([&outcome.last.state]);
        problem.penetration_note(states)
    });
    let mesh = phases.time("mesh error", || {
        damage_error(problem, &mut damage_step, compliance, instants, outcome)
    });
    if let (Some(stop), Some(error)) = (&mut outcome.stopped, &mesh) {
        stop.from_mesh = error.delay.map(|delay| DELAYS * delay.abs());
    }
    outcome.damage_indicators = mesh.as_ref().map_or_else(Vec::new, |mesh| mesh.indicators.clone());
    let steps = controller.step_error().filter(|_| problem.damage().is_some());
    outcome.errors =
        ErrorBudget::new(problem, outcome, mesh, steps.as_ref().map(DVector::as_slice));
    Ok(())
}
