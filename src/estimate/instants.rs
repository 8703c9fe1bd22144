//! A run at a few times, kept for the estimates at its end.

use crate::evolution::{State, Step};
use serde::{Deserialize, Serialize};

/// So many intervals of time at least and about twice as many at most, if there are so many steps; with
/// three the error of a load that swings once was estimated at 0.6 of it.
const INTERVALS: usize = 5;

/// States of a run at a few times, evenly spread over its steps.
#[derive(Serialize, Deserialize)]
pub(crate) struct Instants {
    /// Every so many steps.
    stride: usize,
    pub(crate) states: Vec<State>,
    /// t_n and min ζ_n of all steps.
    pub(crate) falling: Vec<(f64, f64)>,
}

impl Instants {
    pub(crate) fn new() -> Self {
        Self { stride: 1, states: Vec::new(), falling: Vec::new() }
    }

    /// Sees an accepted step.
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

    /// The last state becomes the last of these.
    pub(crate) fn end(&mut self, last: &State) {
        if let [.., before, end] = &self.states[..]
            && last.time - end.time < 0.5 * (end.time - before.time)
        {
            self.states.pop();
        }
        self.states.push(last.clone());
    }

    /// How long after `time` min ζ of the run falls to `level`, s; `None` where it does not.
    pub(crate) fn delay(&self, time: f64, level: f64) -> Option<f64> {
        let after = self.falling.iter().position(|(_, zeta)| *zeta <= level)?;
        let (t, zeta) = self.falling[after];
        let (t0, zeta0) = self.falling[after.saturating_sub(1)];
        let part = if zeta0 > zeta { (zeta0 - level) / (zeta0 - zeta) } else { 1.0 };
        Some(t0 + part * (t - t0) - time)
    }
}
