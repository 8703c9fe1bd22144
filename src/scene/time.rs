//! The time of a run and its division into steps.

use serde::Deserialize;

/// The time of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeGrid {
    /// T, s.
    pub end: f64,
    /// How [0, T] is divided.
    pub stepping: Stepping,
    /// The scheme of uniform steps; chosen ones are always two-step.
    pub scheme: Scheme,
}

/// How a time step is made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    /// Euler's backward differences with the source at the old time, as in (25): of first order.
    #[default]
    Euler,
    /// Two-step backward differences with an extrapolated source: of second order.
    Bdf2,
}

/// How a time interval is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stepping {
    /// Uniformly.
    Uniform {
        /// N, at least 1.
        steps: usize,
    },
    /// By an estimate of each step's error, with a formula of second order.
    Auto {
        /// The error of ζ over the damage done, at any node and in the mean, that the steps may cause;
        /// a run that fails must land so near ζ_*.
        tolerance: f64,
        /// The damage expected at the end, max (ζ₀ − ζ) and its mean over the body, as far as an earlier
        /// run of the scene has shown it: errors are compared with it. 0: not known; then the present
        /// rate and the loads ahead tell.
        expected: [f64; 2],
    },
}

impl TimeGrid {
    /// The uniform partition (25) of [0, `end`] closest to `step` (both positive, s)
    /// and not coarser, for Euler's scheme. A step that divides the end up to rounding is kept.
    pub fn uniform(end: f64, step: f64) -> Self {
        let steps = (end / step - 1e-9).ceil().max(1.0) as usize;
        Self { end, stepping: Stepping::Uniform { steps }, scheme: Scheme::Euler }
    }

    /// t_n of `steps` equal steps, s; the last is the end without rounding.
    pub fn time(&self, n: usize, steps: usize) -> f64 {
        if n == steps { self.end } else { n as f64 * (self.end / steps as f64) }
    }
}

/// A time without the rounding errors of its last digits, for people: 0.0248, not 0.024800000000000003.
pub fn rounded(t: f64) -> f64 {
    format!("{t:.9e}").parse().unwrap_or(t)
}
