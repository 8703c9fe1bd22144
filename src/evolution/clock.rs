//! Time steps: uniform as in (25), or chosen from an error estimate.

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
/// … and a run whose step falls below this part has failed.
const FINEST: f64 = 1e-12;

impl Clock {
    /// `rate` is the largest |dζ/dt| at the start, 1/s: it gives the first chosen step.
    pub(super) fn new(grid: Option<TimeGrid>, rate: f64) -> Self {
        let next = match grid {
            Some(TimeGrid { end, stepping: Stepping::Auto { tolerance } }) => {
                let first = 0.1 * tolerance / rate.max(f64::MIN_POSITIVE);
                first.clamp(1e-6 * end, COARSEST * end)
            }
            _ => 0.0,
        };
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
            // A remainder below half a step is taken along.
            Stepping::Auto { .. } if self.time + 1.5 * self.next >= grid.end => {
                let step = (grid.end - self.time).min(self.next.max(0.5 * (grid.end - self.time)));
                let end = if self.time + step >= grid.end { grid.end } else { self.time + step };
                Some((end, step))
            }
            Stepping::Auto { .. } => Some((self.time + self.next, self.next)),
        }
    }

    /// The tolerance on ζ of chosen steps.
    pub(super) fn tolerance(&self) -> Option<f64> {
        match self.grid?.stepping {
            Stepping::Auto { tolerance } => Some(tolerance),
            Stepping::Uniform { .. } => None,
        }
    }

    /// The step to `time` of length `step` holds; its error in ζ was `error`.
    pub(super) fn accept(&mut self, time: f64, step: f64, error: f64) {
        self.accepted += 1;
        self.time = time;
        if let Some(tolerance) = self.tolerance() {
            self.next = step * growth(tolerance, error).min(2.0);
        }
    }

    /// The step of length `step` is undone; the next is at most `factor` times as long. False
    /// if steps are not ours to choose or have become hopelessly small.
    pub(super) fn cut(&mut self, step: f64, factor: f64) -> bool {
        let (Some(grid), Some(_)) = (self.grid, self.tolerance()) else { return false };
        self.next = step * factor;
        self.next > FINEST * grid.end
    }

    /// By what to cut a step whose error was too large.
    pub(super) fn reduction(&self, error: f64) -> f64 {
        self.tolerance().map_or(1.0, |tolerance| growth(tolerance, error).clamp(0.2, 0.9))
    }
}

/// An error of second order in the step reaches the tolerance, with a margin, at this factor.
fn growth(tolerance: f64, error: f64) -> f64 {
    0.8 * (tolerance / error.max(1e-300)).sqrt()
}
