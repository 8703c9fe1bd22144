//! The first contact of the foundations that are open at the start, as figures of the steps.
//!
//! While a foundation is open, its least remaining gap o = min (g − u·ν) is kept. When a step begins contact, the steps before it at
//! the times t₁ > t₂ > t₃ give its time as the root s of the line through the last two gaps, corrected by the second divided
//! difference and cut to this step:
//!
//! s = t₁ − o₁/o[t₁, t₂],   t = s − δ,   δ = o[t₁, t₂, t₃] (s − t₁)(s − t₂) / o[t₁, t₂].
//!
//! Its error is |δ|, and at most the distance to the farther end of the step, as it is with fewer than three such steps.

use super::{ObservedProblem, Step};
use crate::observe::{FIRST_CONTACT, Observation};
use serde::{Deserialize, Serialize};

/// The history of a foundation.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct FirstContact {
    /// The last three times before contact, s, and the least remaining gap then, m, the latest first. Empty if the first step has
    /// contact.
    open: Vec<[f64; 2]>,
    /// The figures [`FIRST_CONTACT`] with their errors from the time steps, once there is contact.
    pub(crate) found: Option<[[f64; 2]; 3]>,
}

impl FirstContact {
    /// The foundations in a state.
    pub(super) fn of(observation: &Observation, time: f64) -> Vec<Self> {
        let of = |opening: f64| Self { open: vec![[time, opening]], found: None };
        observation.contact[1..].iter().map(|of_foundation| of(of_foundation.opening)).collect()
    }

    /// The history up to this step, from that up to the step before; `None` for the first one. `load` returns the resultant of all
    /// loads at a time. Collective.
    fn after(&mut self, before: Option<&Self>, load: impl Fn(f64) -> [f64; 2]) {
        let is_open = self.open[0][1] > 0.0;
        match before {
            None if !is_open => self.open.clear(),
            None => {}
            Some(before) if before.found.is_some() || before.open.is_empty() => {
                self.clone_from(before);
            }
            Some(before) if is_open => {
                self.open.extend_from_slice(&before.open[..before.open.len().min(2)]);
            }
            Some(before) => {
                let [time, error] = first_contact(&before.open, self.open[0][0]);
                let [at, earlier, later] = [time, time - error, time + error].map(load);
                let of_load = |k: usize| {
                    let changes = [earlier, later].map(|of| (of[k] - at[k]).abs());
                    [at[k], changes[0].max(changes[1])]
                };
                self.found = Some([[time, error], of_load(0), of_load(1)]);
            }
        }
    }
}

/// The time at which contact begins in the step that ends at `end`, and its error, s, from the gaps before.
fn first_contact(open: &[[f64; 2]], end: f64) -> [f64; 2] {
    let start = open[0][0];
    let slope = |[[t, o], [s, p]]: [[f64; 2]; 2]| (o - p) / (t - s);
    let slopes: Vec<f64> = open.windows(2).map(|of| slope([of[0], of[1]])).collect();
    let [first, before @ ..] = &slopes[..] else {
        return [0.5 * (start + end), 0.5 * (end - start)];
    };
    let root = start - open[0][1] / first;
    let correction = before.first().map(|second| {
        let curvature = (first - second) / (start - open[2][0]);
        curvature * (root - start) * (root - open[1][0]) / first
    });
    // A gap that does not close has no root ahead.
    let is_ahead = *first < 0.0;
    let time = if is_ahead { root - correction.unwrap_or(0.0) } else { end };
    let time = time.clamp(start, end);
    let most = (time - start).max(end - time);
    [time, correction.filter(|_| is_ahead).map_or(most, |of| of.abs().min(most))]
}

impl Step {
    /// Sets the figures of the first contact from the step before, `None` for the first step. Collective.
    pub(super) fn set_first_contact(&mut self, problem: &ObservedProblem, before: Option<&Self>) {
        let (body, partition) = (&problem.body, &problem.body.nodes.partition);
        let load = |time: f64| {
            let loads = problem.loads.at(body, time.max(0.0));
            let axis = |k: usize| {
                (0..loads.len()).map(|i| f64::from(u8::from(i % 2 == k))).collect::<Vec<_>>()
            };
            [0, 1].map(|k| partition.dot(&loads, &axis(k), 2))
        };
        // The first step of a restarted run has none.
        for (i, name) in problem.foundations.iter().enumerate().take(self.first_contact.len()) {
            self.first_contact[i].after(before.map(|step| &step.first_contact[i]), load);
            for (k, kind) in FIRST_CONTACT.into_iter().enumerate() {
                let number = problem.figures.number(&format!("{name}.{kind}"));
                if let (Some(number), Some(found)) = (number, self.first_contact[i].found) {
                    self.figures[number] = found[k][0].into();
                }
            }
        }
    }
}
