//! One run of a study, seen at given times and timed.

use super::{Fields, StudyError, refined};
use signorini::{
    evolution::{self, DiscreteProblem, Phases, State, StepRecord},
    fem::Body,
    mesh::{self, Mesh, MeshError, Order},
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
}

impl StudyRun {
    /// Its mesh.
    ///
    /// # Errors
    /// The scene's mesh cannot be made or read.
    pub(super) fn mesh(&self) -> Result<Mesh, MeshError> {
        let mesh = mesh::load(&self.scene.mesh.file, &self.scene.mesh.parameters, Order::Linear)?;
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
        let mut sampler = Sampler::new(times);
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
        })
    }
}

/// Takes the fields at given times out of a run, between two steps on the line through both.
#[derive(Debug)]
pub struct Sampler<'a> {
    times: &'a [f64],
    before: Option<State>,
    /// The fields at the times that the run has passed.
    pub states: Vec<Fields>,
}

impl<'a> Sampler<'a> {
    /// For these rising times, s.
    pub fn new(times: &'a [f64]) -> Self {
        Self { times, before: None, states: Vec::new() }
    }

    /// Sees the next state of the run.
    pub fn observe(&mut self, state: &State) {
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
