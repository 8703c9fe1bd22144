//! Time steps: uniform as in (25), or chosen from error estimates.

use crate::scene::{Stepping, TimeGrid};

/// Proposes steps and learns from their fate.
#[derive(Debug)]
pub(super) struct Clock {
    grid: Option<TimeGrid>,
    /// Accepted steps, and the time reached, s.
    accepted: usize,
    time: f64,
    /// The next step where it is chosen, s.
    next: f64,
}

/// A chosen step is at most this part of the run…
const COARSEST: f64 = 0.05;
/// … those that do not follow the loads are halved down to this part: a jump has no step short
/// enough…
const FOLLOWING: f64 = 1.0 / 2000.0;
/// … and a run whose step falls below this part has failed.
const FINEST: f64 = 1e-12;

impl Clock {
    /// `first` is the first step to try where steps are chosen, s.
    pub(super) fn new(grid: Option<TimeGrid>, first: f64) -> Self {
        let next = grid.map_or(0.0, |grid| first.min(COARSEST * grid.end));
        Self { grid, accepted: 0, time: 0.0, next }
    }

    /// The next step's end and length, s; `None` at the end of time.
    pub(super) fn propose(&self) -> Option<(f64, f64)> {
        let grid = self.grid?;
        match grid.stepping {
            Stepping::Uniform { steps } if self.accepted >= steps => None,
            Stepping::Uniform { steps } => {
                Some((grid.time(self.accepted + 1, steps), grid.end / steps as f64))
            }
            Stepping::Auto { .. } if self.time >= grid.end => None,
            Stepping::Auto { .. } => {
                let rest = grid.end - self.time;
                // The last two steps are equal rather than one of them small.
                match rest / self.next {
                    steps if steps <= 1.0 => Some((grid.end, rest)),
                    steps if steps < 2.0 => Some((self.time + 0.5 * rest, 0.5 * rest)),
                    _ => Some((self.time + self.next, self.next)),
                }
            }
        }
    }

    /// The relative tolerance of chosen steps.
    pub(super) fn tolerance(&self) -> Option<f64> {
        match self.grid?.stepping {
            Stepping::Auto { tolerance } => Some(tolerance),
            Stepping::Uniform { .. } => None,
        }
    }

    /// The step to `time` of length `step` is accepted; `error` is its error over the allowed one.
    pub(super) fn accept(&mut self, time: f64, step: f64, error: f64) {
        self.accepted += 1;
        self.time = time;
        if let Some(grid) = self.grid {
            self.next = (step * growth(error).min(2.0)).min(COARSEST * grid.end);
        }
    }

    /// The step of length `step` is undone; the next is at most `factor` times as long. False
    /// if steps are not ours to choose or have become hopelessly small.
    pub(super) fn cut(&mut self, step: f64, factor: f64) -> bool {
        let (Some(grid), Some(_)) = (self.grid, self.tolerance()) else { return false };
        self.next = step * factor;
        self.next > FINEST * grid.end
    }

    /// The loads are not followed by a step of length `step`: the next is half as long. False if it
    /// is as short as that is tried.
    pub(super) fn halve(&mut self, step: f64) -> bool {
        let long = self.grid.is_some_and(|grid| step > FOLLOWING * grid.end);
        long && self.cut(step, 0.5)
    }

    /// By what to cut a step whose error is so many times the allowed one.
    pub(super) fn reduction(error: f64) -> f64 {
        growth(error).clamp(0.2, 0.9)
    }
}

/// By this factor a step becomes one with the allowed error, of third order in its length, but for a
/// margin. In 32nds: rounding, which differs with ranks and units, then hardly ever changes steps.
fn growth(error: f64) -> f64 {
    (32.0 * 0.9 / error.max(1e-300).cbrt()).floor() / 32.0
}
