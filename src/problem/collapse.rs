//! The time at which the loads drive a rigid motion that nothing supports any more.
//!
//! It follows from the loads and the contact conditions alone: are there contact forces p ≥ 0 that balance the
//! resultant of the loads ([`RigidMotions::check`](crate::contact::RigidMotions::check))?

use super::{DiscreteProblem, SetupError};
use crate::{
    ROUNDING,
    fem::RigidMotion,
    scene::{Stepping, TimeGrid},
};

/// The collapse of the body.
#[derive(Debug, Clone, Copy)]
pub struct Collapse {
    /// The time, s. The run ends a little before it, and the time is known at least as well as this distance.
    pub time: f64,
    /// The motion that nothing supports any more.
    pub motion: RigidMotion,
}

/// The run ends this fraction of its end time before the collapse, where contact forces are still unique.
const ACCURACY: f64 = 1e-6;

impl DiscreteProblem {
    /// Checks the data at sampled times ([`sample_times`](crate::scene::Scene::sample_times)), before any output.
    /// If the loads drive an unsupported motion from some time on, the run ends there.
    ///
    /// # Errors
    /// Those of [`Self::load_case`]; nothing supports the body from the start.
    pub(super) fn until_collapse(mut self) -> Result<Self, SetupError> {
        // Integrating a body force costs as much as the loads of a step, so fewer times are checked.
        let most = if self.loads.body_force_depends_on_time() { 100 } else { 1000 };
        let mut times = self.scene.sample_times(most);
        times.truncate(if self.loads.depend_on_time() { usize::MAX } else { 1 });
        let mut before = 0.0;
        for time in times {
            match self.check_time(time) {
                Err(driven @ SetupError::Driven { .. }) => {
                    let Some(grid) = self.scene.time else { return Err(driven) };
                    let collapse = self.collapse_between([before, time], driven)?;
                    self.end_before(collapse, grid);
                    return Ok(self);
                }
                checked => checked?,
            }
            before = time;
        }
        Ok(self)
    }

    fn check_time(&self, time: f64) -> Result<(), SetupError> {
        self.prescribed_and_bounds(time, &self.loads.values_at(time))?;
        if self.motions.all_prevented() {
            return Ok(());
        }
        self.checked_load(time).map(drop)
    }

    /// Bisects an interval. The body is supported at its start, and not at its end, with the error `driven` there.
    fn collapse_between(
        &self,
        [mut supported, mut time]: [f64; 2],
        driven: SetupError,
    ) -> Result<Collapse, SetupError> {
        let mut first = None;
        let end = self.scene.time.map_or(0.0, |grid| grid.end);
        while time - supported > ROUNDING * end {
            let middle = 0.5 * (supported + time);
            match self.checked_load(middle) {
                Ok(_) => supported = middle,
                Err(error @ SetupError::Driven { .. }) => (time, first) = (middle, Some(error)),
                Err(error) => return Err(error),
            }
        }
        match (first.as_ref().unwrap_or(&driven), time > 2.0 * ACCURACY * end) {
            (SetupError::Driven { source, .. }, true) => {
                Ok(Collapse { time, motion: source.motion })
            }
            _ => Err(driven),
        }
    }

    /// Lets the run end just before the collapse, with steps that are not longer than before.
    fn end_before(&mut self, collapse: Collapse, grid: TimeGrid) {
        let end = collapse.time - (ACCURACY * grid.end).min(0.5 * collapse.time);
        let stepping = match grid.stepping {
            Stepping::Uniform { steps } => {
                let steps = (steps as f64 * end / grid.end - 1e-9).ceil().max(1.0);
                Stepping::Uniform { steps: steps as usize }
            }
            adaptive => adaptive,
        };
        self.scene.time = Some(TimeGrid { end, step: None, stepping, ..grid });
        self.collapse = Some(collapse);
    }
}
