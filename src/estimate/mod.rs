//! Error estimates, and meshes adapted to an accuracy.
//!
//! A run solves a discrete problem. This room estimates the difference from the exact solution of the scene, and
//! refines meshes until the difference is within the required accuracy. There are four estimates:
//!
//! - [`RecoveredStrains`]: the error of u in the energy norm, per triangle, from strains fitted around each vertex
//!   (the same strains give the [`NodalStress`] of pictures);
//! - the interpolation error of the damage, per triangle, from recovered gradients of ζ;
//! - [`Measured`]: the error bar of each printed figure, measured by a second run on a finer mesh;
//! - [`ErrorBudget`]: the errors by the mesh, the time steps and the solver.
//!
//! [`adapted`] makes a mesh for an accuracy ([`Adapted`]). Each round has a run with few steps, estimates and
//! bisection. A measurement ends the rounds.
//!
//! What crosses the door: [`run`] calls `evolution`, takes its last state, some earlier states and its factor of K,
//! and returns the [`Outcome`] with the estimates. `command` requests this, an adapted mesh and error bars. Nothing
//! here changes the answer of a run.

mod hierarchical;
mod patches;
mod recovery;
mod stress;
mod extremes;
mod damage_interpolation;
mod error_budget;
mod penetration;
mod adaptive;

pub use adaptive::{AdaptError, Adapted, INSTANTS, Measured, adapted, measured_errors};
pub use extremes::{Extreme, Extremes};
pub use recovery::{EnergyError, RecoveredStrains};
pub use stress::{NodalStress, Strained, principal};

use crate::{
    ROUNDING,
    evolution::{
        Callback, DamageStep, ErrorBudget, Observed, Observer, Outcome, Phases, Run, RunError,
        RunState, Step, all_steps,
    },
    fem::RigidMotion,
    petsc::{PetscError, Session},
    problem::{Bar, DiscreteProblem, State},
    scene::{Stepping, TimeGrid},
};
use nalgebra::DVector;
use std::borrow::Cow;

/// If max |u| of the last step is below this fraction of its maximum in the run, the body counts as unloaded.
const UNLOADED: f64 = 0.01;

/// [`evolution::run`](crate::evolution::run), and at its end the estimates of its errors.
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
    run_from(session, problem, solver, phases, &mut Callback(accepted), None)
}

/// As [`run`], with an `observer` that may keep checkpoints and end the run. It starts from `saved`, if given.
///
/// # Errors
/// See [`RunError`]; every accepted step has been seen by then.
pub fn run_from(
    session: &Session,
    problem: &DiscreteProblem,
    solver: &str,
    phases: &Phases,
    observer: &mut dyn Observer,
    saved: Option<RunState>,
) -> Result<Outcome, RunError> {
    estimated(all_steps(session, problem, solver, phases, observer, saved, &[])?)
}

/// Whether the damage of a run with equal steps begins with its last ones: one more step would do far more damage than all
/// before. The differences of the steps say nothing of their error then. Means are compared, as diffusion does not change
/// them: at a singular point the source alone is far larger than what it does. Collective.
fn begins_at_the_end(damage_step: &DamageStep, outcome: &Outcome) -> bool {
    const FAR_MORE: f64 = 5.0;
    let (problem, state) = (damage_step.problem, &outcome.last.state);
    let Some(TimeGrid { end, stepping: Stepping::Uniform { steps }, .. }) = problem.scene().time
    else {
        return false;
    };
    let vertices = &problem.body.vertices;
    let owned = vertices.partition.owned();
    let source: f64 = damage_step.source(state).load.iter().take(owned).sum();
    let mean_rate = -vertices.partition.comm().total(source) / problem.body.area;
    let next = mean_rate * end / steps as f64;
    let done = problem.body.mean(&problem.initial_damage()) - problem.body.mean(&state.zeta);
    next > FAR_MORE * done && next > f64::EPSILON
}

/// Estimates the errors of a finished run and enters them in its outcome. Collective.
fn estimated(run: Run) -> Result<Outcome, RunError> {
    let Run { damage_step, contact_step, controller, mut outcome } = run;
    let mut fixed_contact = contact_step.into_fixed_contact()?;
    let (problem, phases) = (damage_step.problem, damage_step.phases);
    outcome.accuracy = phases.time("accuracy", || fixed_contact.accuracy(&outcome))?;
    outcome.accuracy.energy = phases.time("accuracy", || energy_error(problem, &outcome))?;
    outcome.penetration = phases.time("accuracy", || {
        problem.penetration_note(&[&outcome.most_displaced().state, &outcome.last.state])
    });
    let is_known = problem.damage().is_some() && !begins_at_the_end(&damage_step, &outcome);
    let steps = controller.step_error().filter(|_| is_known && outcome.stopped.is_none());
    outcome.errors = ErrorBudget::new(problem, &outcome, steps.as_ref().map(DVector::as_slice));
    Ok(outcome)
}

/// The estimated discretisation error of u, relative, in the energy norm: of the last step, or of the step with the
/// maximum displacement if the last one is unloaded. The small u left then gives a poor estimate. Collective.
fn energy_error(problem: &DiscreteProblem, outcome: &Outcome) -> Result<f64, PetscError> {
    let (last, most) = (&outcome.last, outcome.most_displaced());
    let unloaded = last.record.displacement_max < UNLOADED * most.record.displacement_max;
    let state = if unloaded { &most.state } else { &last.state };
    problem.energy_error(&state.zeta, &strained(problem, state).u)
}

/// `state`, without displacements if the body only moves rigidly: its strains are rounding. Collective.
fn strained<'a>(problem: &DiscreteProblem, state: &'a State) -> Cow<'a, State> {
    let motion = RigidMotion::nearest(&problem.body, &state.u);
    let [rigid, rest] = motion.max_norms(&problem.body, &state.u);
    match rest > ROUNDING * rigid {
        true => Cow::Borrowed(state),
        false => Cow::Owned(State { u: vec![0.0; state.u.len()], ..state.clone() }),
    }
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
        let unknown = problem.damage().is_some() && self.errors.zeta_steps.is_none();
        if let Some(stop) = &mut self.stopped {
            stop.from_mesh = measured.stop;
            return Ok(());
        }
        self.errors.damage_mesh = measured.damage;
        if unknown || measured.bars.is_empty() {
            return Ok(());
        }
        self.bars = measured.bars.clone();
        let [most, mean] = self.errors.zeta_steps.unwrap_or_default();
        let displacement = self.errors.displacement_steps.unwrap_or(0.0);
        problem.add_step_errors(&mut self.bars, [most, mean, displacement]);
        let (state, nodal) = (&self.last.state, NodalStress::new(problem));
        self.set_bars_of_extremes(&Extremes::of(problem, state, &nodal, measured)?);
        Ok(())
    }

    /// Sets the bars of the extremes of the whole, and enters the bars in the errors, except those of extremes that the mesh
    /// does not determine.
    fn set_bars_of_extremes(&mut self, extremes: &Extremes) {
        extremes.join(&mut self.bars);
        let unknown =
            |bar: &&Bar| extremes.of_points.iter().any(|of| of.name == bar.name && !of.is_known());
        let known = self.bars.iter().filter(|bar| !unknown(bar));
        self.errors.figures = known.map(|bar| (bar.name.clone(), bar.bar)).collect();
    }

    /// Measures the errors of the time steps by the run `longer`, whose steps had a larger tolerance. Errors are of
    /// second order: with r the square of the ratio of the numbers of steps, the error of a figure F is r/(1 − r) times
    /// the change of F; twice this counts, and at least half of the change. Where this is less than the estimate, it
    /// takes its place, as far down as the part of the estimate that did not grow in later steps. The estimated growth
    /// assumes strains proportional to 1/ζ, which prescribed displacements prevent. If a load makes ζ fall without bound, the
    /// error of the time of ζ_* is of first order. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn measure_steps(
        &mut self,
        problem: &DiscreteProblem,
        longer: &Outcome,
        measured: &Measured,
    ) -> Result<(), PetscError> {
        let [before, now] = [longer, &*self].map(|run| run.last.record.step as f64);
        let ratio = (before / now).powi(2);
        if ratio >= 1.0 || longer.stopped.is_some() != self.stopped.is_some() {
            return Ok(());
        }
        let factor = (2.0 * ratio / (1.0 - ratio)).max(0.5);
        if let (Some(stop), Some(other)) = (&mut self.stopped, longer.stopped) {
            let first_order = before / (now - before);
            let measured = factor.max(first_order) * (stop.time - other.time).abs();
            stop.uncertainty = stop.uncertainty.min(measured.max(self.ungrown * stop.uncertainty));
        }
        let nodal = NodalStress::new(problem);
        let [before, extremes] =
            [longer, &*self].map(|run| Extremes::of(problem, &run.last.state, &nodal, measured));
        let (before, extremes) = (before?, extremes?);
        let [before, now] = [(&longer.last, &before), (&self.last, &extremes)]
            .map(|(step, extremes)| [step.figures(), extremes.values()].concat());
        let names = problem.figure_names();
        for (bar, of_mesh) in self.bars.iter_mut().zip(&measured.bars) {
            if let Some(i) = names.iter().position(|name| *name == bar.name) {
                let estimated = bar.bar - of_mesh.bar;
                let measured = factor * (now[i] - before[i]).abs() + problem.tolerance * bar.scale;
                bar.bar = of_mesh.bar + estimated.min(measured.max(self.ungrown * estimated));
            }
        }
        self.set_bars_of_extremes(&extremes);
        Ok(())
    }
}
