//! Some states of a run, kept for the estimates at its end.

use super::{State, Step};
use serde::{Deserialize, Serialize};

/// Minimum number of intervals between the kept states; there are at most twice as many. Fewer intervals
/// underestimate the error under a load that rises and falls once.
const INTERVALS: usize = 5;

/// States of a run, evenly spread over its steps.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Instants {
    /// The number of steps between two states.
    stride: usize,
    pub(crate) states: Vec<State>,
    /// t_n and min ζ_n of all steps.
    pub(crate) falling: Vec<(f64, f64)>,
}

impl Instants {
    pub(crate) fn new() -> Self {
        Self { stride: 1, states: Vec::new(), falling: Vec::new() }
    }

    /// Records an accepted step. If there are too many states, every other state is dropped.
    pub(crate) fn observe(&mut self, step: &Step) {
        self.falling.push((step.state.time, step.record.zeta_min));
        if !step.record.step.is_multiple_of(self.stride) {
            return;
        }
        self.states.push(step.state.clone());
        if self.states.len() > 2 * INTERVALS {
            self.stride *= 2;
            let mut index = 0..;
            self.states.retain(|_| index.next().is_some_and(|i| i % 2 == 0));
        }
    }

    /// Appends the last state of the run. If the state before is close to it, that state is dropped.
    pub(crate) fn end(&mut self, last: &State) {
        if let [.., before, end] = &self.states[..]
            && last.time - end.time < 0.5 * (end.time - before.time)
        {
            self.states.pop();
        }
        self.states.push(last.clone());
    }

    /// The delay after `time`, s, with which min ζ of the run falls to `level`; `None` if it does not.
    pub(crate) fn delay(&self, time: f64, level: f64) -> Option<f64> {
        let after = self.falling.iter().position(|(_, zeta)| *zeta <= level)?;
        let (t, zeta) = self.falling[after];
        let (t0, zeta0) = self.falling[after.saturating_sub(1)];
        let part = if zeta0 > zeta { (zeta0 - level) / (zeta0 - zeta) } else { 1.0 };
        Some(t0 + part * (t - t0) - time)
    }
}
