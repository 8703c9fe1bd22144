//! The state of the accuracy loop of a run: the mesh, the measured errors, and whether the run is repeated.

use super::{AdaptError, Adapted, Measured, SHORTEST_STEPS, adapted, measured_errors};
use crate::{
    advice::locks,
    evolution::{Outcome, RunOptions},
    mesh::Mesh,
    observe::ObservedProblem,
    petsc::Session,
    scene::{Scene, Stepping},
};
use serde::{Deserialize, Serialize};

/// All that is known of the errors from the mesh before the run that is written. A restart needs nothing else of the loop.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct LoopState {
    /// The adapted mesh, if an accuracy is required.
    pub adapted: Option<Adapted>,
    /// The measured errors of the mesh; empty if they were not measured.
    pub measured: Measured,
    /// Is the run a repetition with shorter steps?
    pub repeats: bool,
    /// Notes on error bars that are missing, and on the curves that they follow.
    pub notes: Vec<String>,
}

impl LoopState {
    /// The loop up to the run that is written, with the mesh of this run. If the scene requires an accuracy, the loop adapts the
    /// `mesh` and the time steps of the scene; a restart takes those that it has `saved`. Otherwise the loop has a fixed mesh and
    /// measures the error `bars` on request. `seen` is called with each adapted mesh. Collective.
    ///
    /// # Errors
    /// No mesh can be adapted, or a signal has ended a run.
    pub fn start(
        session: &Session,
        scene: &mut Scene,
        mesh: Mesh,
        (bars, saved): (bool, Option<Self>),
        seen: &mut dyn FnMut(&Adapted),
    ) -> Result<(Self, Mesh), AdaptError> {
        let saved = saved.filter(|state| state.adapted.is_some());
        let (mut state, run_options) = (saved.unwrap_or_default(), RunOptions::of(scene));
        if let (None, Some(accuracy)) = (&state.adapted, scene.accuracy) {
            let (curved, notes) = mesh.on_smooth_curves();
            state.notes.extend(notes);
            let found = adapted(session, scene, curved, &run_options, accuracy, seen)?;
            (state.measured, state.adapted) = (found.measured.clone(), Some(found));
        }
        let Some(Adapted { mesh, steps, damage, .. }) = &state.adapted else {
            if bars {
                state.measured = state.measure(session, scene, &mesh, None)?;
            }
            return Ok((state, mesh));
        };
        if let Some(grid) = &mut scene.time {
            grid.stepping = Stepping::Auto { tolerance: *steps, expected: *damage };
        }
        let mesh = mesh.clone();
        Ok((state, mesh))
    }

    /// Measures the errors from the mesh, in runs with few steps or with the error `of_steps` of ζ. If such a run fails, or a finer
    /// mesh would not show the error, a note reports it. Collective.
    fn measure(
        &mut self,
        session: &Session,
        scene: &Scene,
        mesh: &Mesh,
        of_steps: Option<f64>,
    ) -> Result<Measured, AdaptError> {
        // A mesh that was adapted is so fine that it does not lock.
        if of_steps.is_none() && locks(scene).is_some() {
            let note = "no error bars: a finer mesh does not show that linear triangles lock (explain locking)";
            self.notes.push(note.to_owned());
            return Ok(Measured::default());
        }
        let (curved, notes) = mesh.on_smooth_curves();
        self.notes.extend(notes);
        match measured_errors(session, scene, [mesh, &curved], &RunOptions::of(scene), of_steps) {
            // The scene fits this mesh, perhaps not the finer one.
            Err(error) if error.signal().is_none() => {
                self.notes
                    .push(format!("the error bars could not be measured: {error} (explain bars)"));
                Ok(Measured::default())
            }
            measured => measured,
        }
    }

    /// The factor for the tolerance of the time steps of a repetition of the run of `problem` with this `outcome`. `None` if there
    /// is none: its time steps are short enough, it is the last rung, or there is no time, with the seconds `passed`
    /// since the start and those of the run.
    pub fn shorter_steps(
        &self,
        problem: &ObservedProblem,
        outcome: &Outcome,
        [passed, seconds]: [f64; 2],
    ) -> Option<f64> {
        // Lengths of steps are on a ladder of √2, and their errors are of second order: an error may be twice the one
        // asked for.
        let accuracy = problem.scene().accuracy?;
        let ratio = outcome.shorter_steps(problem, &self.measured);
        let ratio = 0.5 * ratio.filter(|_| !self.is_last(outcome, accuracy))?;
        let most = problem.scene().max_seconds.unwrap_or(f64::INFINITY);
        (passed + seconds / ratio.sqrt() <= most).then_some(ratio)
    }

    /// Sets the time steps of a repetition, shorter by `ratio`. If the run stopped at ζ_*, but not the runs with few steps that
    /// measured its errors, then the time of ζ_* is measured with steps whose error is half of ζ_*. Collective.
    ///
    /// # Errors
    /// A signal has ended a run.
    pub fn repeat(
        &mut self,
        session: &Session,
        problem: &mut ObservedProblem,
        outcome: &Outcome,
        ratio: f64,
    ) -> Result<(), AdaptError> {
        self.repeats = true;
        if self.is_unconfirmed_stop(outcome) {
            let scene = problem.scene();
            let of_steps = scene.damage.as_ref().map(|damage| 0.5 * damage.law.threshold);
            let confirmed = self.measure(session, scene, problem.mesh(), of_steps)?;
            if confirmed.stop.is_some() {
                self.measured = confirmed;
            }
        }
        if let Some(adapted) = &mut self.adapted {
            adapted.steps *= ratio;
            problem.set_step_tolerance(adapted.steps);
        }
        Ok(())
    }

    /// Is no repetition of a run with this `outcome` possible? A run that stops is repeated once, and another one while the
    /// tolerance of its steps is not very much below the `accuracy`.
    pub(super) fn is_last(&self, outcome: &Outcome, accuracy: f64) -> bool {
        let is_short = |of: &Adapted| of.steps < SHORTEST_STEPS * accuracy;
        self.repeats && (outcome.stopped.is_some() || self.adapted.as_ref().is_none_or(is_short))
    }

    /// Did the run stop at ζ_*, but not the runs that measured the errors of the mesh? The time steps may cause the stop.
    pub(super) fn is_unconfirmed_stop(&self, outcome: &Outcome) -> bool {
        self.adapted.is_some() && outcome.stopped.is_some() && self.measured.stop.is_none()
    }
}
