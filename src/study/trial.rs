//! One run of the convergence study, seen at given times and timed.

use super::{Fields, Grid, StudyError};
use crate::{
    contact::Kkt,
    evolution::{self, Phases, Setting, State, StepRecord},
    petsc::Session,
    scene::Scene,
};
use std::{
    path::Path,
    time::{Duration, Instant},
};

/// Example I with λ_U = 2: with the data as printed no run comes to T = 1.
pub(super) const SCENE: &str = include_str!("../../geo/square-mild.toml");
/// T, s.
pub(super) const END: f64 = 1.0;

/// A run: the scene of the study on a grid, with a solver and settings.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    pub(super) grid: Grid,
    pub(super) solver: String,
    /// As of `--set`.
    pub(super) set: Vec<String>,
}

/// What a run gave.
#[derive(Debug)]
pub(super) struct Trace {
    /// The fields at the times asked for.
    pub(super) states: Vec<Fields>,
    /// Wall time of mesh, setting and all steps, s, without looking on.
    pub(super) seconds: f64,
    /// The last step.
    pub(super) last: StepRecord,
    /// Worst residuals of all steps.
    pub(super) kkt: Kkt,
}

impl Trial {
    /// Runs it; `accepted` sees every step, `times` (rising, from 0) are those of the states.
    ///
    /// # Errors
    /// The run failed or stopped at ζ_* before the last of `times`.
    pub(super) fn run(
        &self,
        session: &Session,
        times: &[f64],
        accepted: &mut dyn FnMut(&StepRecord),
    ) -> Result<Trace, StudyError> {
        let started = Instant::now();
        let scene = Scene::parse(SCENE, Path::new("square-mild.toml"), &self.set)?;
        let setting = Setting::new(scene, self.grid.mesh())?;
        let mut sampler = Sampler { times, before: None, states: Vec::new() };
        let mut aside = Duration::ZERO;
        let outcome =
            evolution::run(session, &setting, &self.solver, &Phases::default(), &mut |step| {
                let paused = Instant::now();
                sampler.observe(&step.state);
                accepted(&step.record);
                aside += paused.elapsed();
                Ok(())
            })?;
        let seconds = (started.elapsed() - aside).as_secs_f64();
        match outcome.stopped {
            Some(stop) => Err(StudyError::Stopped { time: stop.time }),
            None => Ok(Trace {
                states: sampler.states,
                seconds,
                last: outcome.last.record,
                kkt: outcome.kkt,
            }),
        }
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
        let rounding = 1e-9 * END;
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
                zeta_mean: Vec::new(),
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
