//! The time of a run and its division into steps.

use serde::Deserialize;

/// Times that differ by less than this fraction of the run count as one.
pub const APART: f64 = 1e-9;

/// The time of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeGrid {
    /// T, s.
    pub end: f64,
    /// The given length of uniform steps, s. They are shorter if it does not divide the end.
    pub step: Option<f64>,
    /// The division of [0, T].
    pub stepping: Stepping,
    /// The scheme of uniform steps. Adaptive steps always use the two-step scheme.
    pub scheme: Scheme,
}

/// The time discretisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    /// Euler's backward differences with the source at the old time, as in (25); first order.
    Euler,
    /// Two-step backward differences with an extrapolated source; second order.
    Bdf2,
}

/// The division of a time interval into steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stepping {
    /// Equal steps.
    Uniform {
        /// N, at least 1.
        steps: usize,
    },
    /// Adaptive steps of the two-step scheme, from an estimate of each step's error.
    Auto {
        /// The allowed time error of ζ over the damage, at any node and in the mean. A run that reaches ζ_*
        /// must stop within this tolerance of it.
        tolerance: f64,
        /// The expected damage at the end, max (ζ₀ − ζ) and its mean over the body, from an earlier run of
        /// the scene. Errors are relative to it. 0 if not known; then the present rate and the future loads
        /// give an estimate.
        expected: [f64; 2],
    },
}

impl TimeGrid {
    /// The uniform partition (25) of [0, `end`] with the largest steps up to `step` (both positive, s). A step that
    /// divides the end up to rounding is kept.
    pub fn uniform(end: f64, step: f64, scheme: Scheme) -> Self {
        let steps = (end / step - 1e-9).ceil().max(1.0) as usize;
        Self { end, step: Some(step), stepping: Stepping::Uniform { steps }, scheme }
    }

    /// Can a step end at `time`? With an accuracy the program chooses the steps.
    pub(super) fn reaches(&self, time: f64, is_accurate: bool) -> bool {
        let steps = match self.stepping {
            Stepping::Uniform { steps } if !is_accurate => time / self.end * steps as f64,
            _ => 0.0,
        };
        time <= self.end && (steps - steps.round()).abs() <= APART * steps
    }

    /// A note if the given step does not divide the end.
    pub(crate) fn note(&self) -> Option<String> {
        let (Stepping::Uniform { steps }, asked) = (self.stepping, self.step?) else { return None };
        let (end, step) = (self.end, self.end / steps as f64);
        (asked - step > 1e-6 * step).then(|| {
            format!(
                "time.step = {asked} does not divide time.end = {end}: {steps} steps of {} are made",
                rounded(step)
            )
        })
    }

    /// t_n of `steps` equal steps, s. The last one is exactly the end.
    pub fn time(&self, n: usize, steps: usize) -> f64 {
        if n == steps { self.end } else { n as f64 * (self.end / steps as f64) }
    }
}

/// A time without rounding errors in its last digits, for messages: 0.0248, not 0.024800000000000003.
pub fn rounded(t: f64) -> f64 {
    format!("{t:.9e}").parse().unwrap_or(t)
}
