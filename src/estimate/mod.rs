//! Error estimates, and meshes adapted to an accuracy.
//!
//! A run solves a discrete problem. This room estimates the difference from the exact solution of the scene, and
//! refines meshes until the difference is within the required accuracy. There are three estimates:
//!
//! - [`RecoveredStrains`]: the error of u in the energy norm, per triangle, from strains fitted around each vertex
//!   (the same strains give the [`NodalStress`](crate::problem::NodalStress) of pictures);
//! - [`Measured`]: the error bar of each printed figure, measured by the same run on three meshes;
//! - [`ErrorBudget`]: the errors by the mesh, the time steps and the solver.
//!
//! For the error of u from the mesh a run also proves a bound if it is asked for
//! ([`Simulation::bound`]), from an [`EquilibratedStress`].
//!
//! [`adapted`] makes a mesh for an accuracy ([`Adapted`]). Each round has a run with few steps, estimates and
//! bisection. A measurement ends the rounds.
//!
//! What crosses the door: a [`Simulation`] calls `evolution`, takes its last state, some earlier states and its factor of K,
//! and returns the [`Outcome`] with the estimates. `command` requests this, an adapted mesh and error bars. Nothing
//! here changes the answer of a run.

mod equilibrated;
mod recovery;
mod extremes;
mod error_budget;
mod adaptive;
mod simulation;

pub use adaptive::{
    AdaptError, Adapted, INSTANTS, Measured, adapted, first_mesh, kinks, measured_errors,
};

pub use equilibrated::{EquilibratedStress, Unproved};
pub use extremes::{Extreme, Extremes, KINKS_OF_TABLE};
pub use recovery::{EnergyError, RecoveredStrains};
pub use simulation::Simulation;

use crate::{
    evolution::{AIM, ErrorBudget, Outcome, Run, RunError},
    petsc::{PetscError, stage},
    problem::{Bar, DiscreteProblem, State},
};
use nalgebra::DVector;

/// If max |u| of the last step is below this fraction of its maximum in the run, the body counts as unloaded.
const UNLOADED: f64 = 0.01;

/// Estimates the errors of a finished run, with a proved bound on that of u if it is `asked`, and enters them in its outcome.
/// Collective.
fn estimated(run: Run, asked: bool) -> Result<Outcome, RunError> {
    let Run { mut damage_step, mut contact_step, mut controller, mut outcome } = run;
    let problem = damage_step.problem;
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
        && controller.add_last_error(&mut damage_step).is_ok();
    let steps = is_known.then(|| [controller.step_error(), controller.step_bar()]);
    outcome.errors = ErrorBudget::new(problem, &outcome, steps, proof);
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

impl Outcome {
    /// Sets the error bars: the `measured` errors of the mesh plus the errors of the time steps. A run that stopped at
    /// ζ_* has the bar of this time alone, because another mesh stops at another time. There are none if the run has too
    /// few steps for an estimate. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn set_bars(
        &mut self,
        problem: &DiscreteProblem,
        measured: &Measured,
    ) -> Result<(), PetscError> {
        let unknown = problem.damage().is_some() && self.errors.bars_of_steps.is_none();
        if let Some(stop) = &mut self.stopped {
            stop.from_mesh = measured.stop;
            return Ok(());
        }
        self.errors.damage_mesh = measured.damage;
        self.errors.set_measured(measured.displacement);
        if unknown || measured.bars.is_empty() {
            return Ok(());
        }
        self.bars = measured.bars.clone();
        let now = self.set_scales(problem, measured);
        let none = (DVector::zeros(self.last.state.zeta.len()), 0.0);
        let of_steps = self.errors.bars_of_steps.as_ref().unwrap_or(&none);
        let last = (&self.last.state, &self.last.figures[..]);
        problem.add_step_errors(&mut self.bars, &now, last, of_steps)?;
        problem.join_bars(&mut self.bars, &self.last.figures);
        Ok(())
    }

    /// The factor for the tolerance of the time steps with which a run is within the required accuracy, if the time steps of
    /// this one take more than the part that the `measured` errors of the mesh leave. It is at least 1/64: the error of a step is of
    /// third order, so there are then about four times as many steps.
    pub fn shorter_steps(&self, problem: &DiscreteProblem, measured: &Measured) -> Option<f64> {
        let accuracy = problem.scene().accuracy?;
        let bars = measured.bars.iter().zip(&self.bars);
        let bars = bars.filter(|(bar, _)| problem.scene().requires_accuracy_of(&bar.name));
        let bars = bars.map(|(of_mesh, of_both)| [of_mesh.relative(), of_both.relative()]);
        let of_stop = self
            .stopped
            .map(|stop| [stop.from_mesh.unwrap_or(0.0), stop.bar()].map(|bar| bar / stop.time));
        let factor = bars.chain(of_stop).map(|[of_mesh, of_both]| {
            let (of_steps, left) = (of_both - of_mesh, accuracy - of_mesh);
            if of_steps > left { AIM * left / of_steps } else { 1.0 }
        });
        // The time steps alone may cause a stop that no run has measured.
        let limit = if self.stopped.is_some() && measured.stop.is_none() { 0.5 } else { 1.0 };
        let factor = factor.fold(limit, f64::min);
        (0.0 < factor && factor < 1.0).then_some(factor.max(1.0 / 64.0))
    }

    /// Takes the scales of the bars from this run. The runs that measured the errors of the mesh have few steps and may end
    /// in a less damaged state: their relative errors count. Returns the scales of the bars in the last state. An extreme
    /// that grows is no scale.
    fn set_scales(&mut self, problem: &DiscreteProblem, measured: &Measured) -> Vec<f64> {
        let scales = |sizes: &[f64], forces: f64| {
            let scales = problem.figure_scales(sizes, &measured.unsettled, 0.0, forces);
            let of = |bar: &Bar| problem.figures.number(&bar.name).map_or(0.0, |i| scales[i]);
            Vec::from_iter(self.bars.iter().map(of))
        };
        let largest = scales(&self.sizes(problem), self.last.forces);
        let last = self.last.figures.iter().map(|of| of.value);
        let now = scales(&problem.figures.magnitudes(last), 0.0);
        for (bar, scale) in self.bars.iter_mut().zip(largest) {
            if scale > bar.scale && bar.scale > 0.0 {
                bar.bar *= scale / bar.scale;
                bar.scale = scale;
            }
        }
        now
    }
}
