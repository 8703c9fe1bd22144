//! One run of a study, seen at given times and timed.

use super::{Fields, StudyError, refined};
use signorini::{
    contact::Kkt,
    evolution::{self, DiscreteProblem, Phases, State, StepRecord},
    fem::Body,
    mesh::{self, Mesh, MeshError},
    petsc::Session,
    scene::Scene,
};
use std::time::{Duration, Instant};

/// A run of a scene on its mesh or a refinement of it.
#[derive(Debug, Clone)]
pub(super) struct StudyRun {
    pub(super) scene: Scene,
    /// How often the scene's mesh is refined.
    pub(super) refinements: usize,
    pub(super) solver: String,
}

/// What a run gave.
#[derive(Debug)]
pub(super) struct History {
    /// The body it was computed on.
    pub(super) body: Body,
    /// The fields at the times asked for.
    pub(super) states: Vec<Fields>,
    /// Wall time of reading the mesh, set-up and all steps, s, without looking on.
    pub(super) seconds: f64,
    /// The last step.
    pub(super) last: StepRecord,
    /// Worst residuals of all steps.
    pub(super) kkt: Kkt,
}

impl StudyRun {
    /// Its mesh.
    ///
    /// # Errors
    /// The scene's mesh cannot be made or read.
    pub(super) fn mesh(&self) -> Result<Mesh, MeshError> {
        let mesh = mesh::load(&self.scene.mesh.file, &self.scene.mesh.parameters)?;
        Ok((0..self.refinements).fold(mesh, |mesh, _| refined(&mesh)))
    }

    /// Runs it; `accepted` sees every step, `times` (rising, from 0) are those of the states.
    ///
    /// # Errors
    /// The run failed or stopped at ζ_* before the last of `times`.
    pub(super) fn run(
        &self,
        session: &Session,
        times: &[f64],
        accepted: &mut dyn FnMut(&StepRecord),
    ) -> Result<History, StudyError> {
        // The time gmsh may need is not the program's.
        self.mesh()?;
        let started = Instant::now();
        let problem = DiscreteProblem::new(self.scene.clone(), self.mesh()?)?;
        let mut sampler = Sampler { times, before: None, states: Vec::new() };
        let mut aside = Duration::ZERO;
        let outcome =
            evolution::run(session, &problem, &self.solver, &Phases::default(), &mut |step| {
                let paused = Instant::now();
                sampler.observe(&step.state);
                accepted(&step.record);
                aside += paused.elapsed();
                Ok(())
            })?;
        let seconds = (started.elapsed() - aside).as_secs_f64();
        if let Some(stop) = outcome.stopped {
            let nodes = problem.body.mesh.nodes.len();
            let scene = self.scene.path.display().to_string();
            return Err(StudyError::Stopped { scene, nodes, time: stop.time });
        }
        Ok(History {
            body: problem.body,
            states: sampler.states,
            seconds,
            last: outcome.last.record,
            kkt: outcome.kkt,
        })
    }
}

/// Takes the fields at given times out of a run, between two steps on the line through both.
struct Sampler<'a> {
    times: &'a [f64],
    before: Option<State>,
    states: Vec<Fields>,
}

impl Sampler<'_> {
    fn observe(&mut self, state: &State) {
        // Uniform steps meet the times but for rounding.
        let rounding = 1e-9 * self.times.last().unwrap_or(&0.0);
        while let Some(&time) = self.times.get(self.states.len())
            && time <= state.time + rounding
        {
            let fields = match &self.before {
                Some(before) if time < state.time - rounding => {
                    let share = (time - before.time) / (state.time - before.time);
                    let mix = |a: &[f64], b: &[f64]| {
                        a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
                    };
                    Fields { u: mix(&before.u, &state.u), zeta: mix(&before.zeta, &state.zeta) }
                }
                _ => Fields { u: state.u.clone(), zeta: state.zeta.clone() },
            };
            self.states.push(fields);
        }
        self.before = Some(state.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// u = (t, t²) and ζ = 1 − t at one node, seen at steps of 0.3.
    #[test]
    fn fields_between_two_steps_lie_on_the_line_through_both() {
        let times = [0.0, 0.1, 0.3, 0.5, 0.6];
        let mut sampler = Sampler { times: &times, before: None, states: Vec::new() };
        // 0.1 + 0.2 is not 0.3.
        for time in [0.0, 0.1 + 0.2, 0.6] {
            sampler.observe(&State {
                time,
                u: vec![time, time * time],
                zeta: vec![1.0 - time],
                contact: Vec::new(),
            });
        }
        let squares = [0.0, 0.03, 0.09, 0.27, 0.36];
        assert_eq!(sampler.states.len(), times.len());
        for ((state, time), square) in sampler.states.iter().zip(times).zip(squares) {
            for (found, expected) in [(state.u[0], time), (state.u[1], square)] {
                assert!((found - expected).abs() < 1e-15, "{found} is not {expected} at {time}");
            }
            assert!((state.zeta[0] - 1.0 + time).abs() < 1e-15);
        }
    }
}
