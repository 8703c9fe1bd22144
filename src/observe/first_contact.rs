//! The first contact of the foundations that are open at the start.
//!
//! While a foundation is open, its least remaining gap o = min (g − u·ν) is kept. When a step begins contact, the line through the last
//! gaps, o₁ at t₁ and o₂ at t₂ < t₁, gives its time, cut to this step:
//!
//! t = t₁ + o₁ (t₁ − t₂)/(o₂ − o₁).
//!
//! The first step, and one after a gap that does not close, give the middle of the step. The error is at most the distance to the farther end.

use super::{FIRST_CONTACT, Observation, ObservedProblem, Value};
use serde::{Deserialize, Serialize};

/// The history of a foundation.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct FirstContact {
    /// The last two times before contact, s, and the least remaining gap then, m, the latest first. Empty if the first step has
    /// contact.
    open: Vec<[f64; 2]>,
    /// The figures [`FIRST_CONTACT`] with their errors from the time steps, once there is contact.
    pub(crate) found: Option<[[f64; 2]; 3]>,
}

impl FirstContact {
    /// The foundations in a state.
    pub(crate) fn of(observation: &Observation, time: f64) -> Vec<Self> {
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
            Some(before) if is_open => self.open.push(before.open[0]),
            Some(before) => {
                let [start, end] = [before.open[0][0], self.open[0][0]];
                let time = match before.open[..] {
                    [[t, o], [s, p]] if o < p => t + o * (t - s) / (p - o),
                    _ => 0.5 * (start + end),
                };
                let time = time.clamp(start, end);
                let [at, earlier, later] = [time, start, end].map(load);
                let of_load = |k: usize| {
                    let change = |of: [f64; 2]| (of[k] - at[k]).abs();
                    [at[k], change(earlier).max(change(later))]
                };
                let error = (time - start).max(end - time);
                self.found = Some([[time, error], of_load(0), of_load(1)]);
            }
        }
    }
}

impl ObservedProblem {
    /// Sets the `figures` of the `first` contacts of a step, from those `before` it; `None` for the first step. Collective.
    pub(crate) fn set_first_contact(
        &self,
        figures: &mut [Value],
        first: &mut [FirstContact],
        before: Option<&[FirstContact]>,
    ) {
        let (body, partition) = (&self.body, &self.body.nodes.partition);
        let load = |time: f64| {
            let loads = self.loads.at(body, time);
            let owned = loads.chunks_exact(2).take(partition.owned());
            let sums = owned.fold([0.0; 2], |[x, y], of| [x + of[0], y + of[1]]);
            sums.map(|sum| partition.comm().total(sum))
        };
        // The first step of a restarted run has none.
        for (i, (name, first)) in self.foundations.iter().zip(first).enumerate() {
            first.after(before.map(|of| &of[i]), load);
            for (k, kind) in FIRST_CONTACT.into_iter().enumerate() {
                let number = self.figures.number(&format!("{name}.{kind}"));
                if let (Some(number), Some(found)) = (number, first.found) {
                    figures[number] = found[k][0].into();
                }
            }
        }
    }
}
