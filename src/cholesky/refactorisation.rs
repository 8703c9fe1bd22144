//! When the factor of an earlier matrix is replaced.

use serde::{Deserialize, Serialize};

/// Compares what the age of a factor has cost with what a new one costs, both in iterations.
///
/// Let a solve with the factor of an earlier matrix take mᵢ iterations, the best one since the last
/// factorisation m. A new factor is due as soon as Σ (mᵢ − m) ≥ C, the cost of a factorisation. Where
/// the loss per solve grows evenly that is the cheapest moment, otherwise it costs at most twice the
/// cheapest. All is counted, nothing measured: equal runs decide alike, and so do all ranks.
#[derive(Debug, Serialize, Deserialize)]
pub struct RefactorisationPolicy {
    /// C: iterations that take as long as a factorisation.
    cost: f64,
    /// m: the fewest iterations of a solve since the last factorisation.
    best: usize,
    /// Σ (mᵢ − m): iterations lost since the last factorisation.
    lost: usize,
}

/// Iterations that a solve with an old factor may take beyond the best one: at least, at most.
const EXTRA_ITERATIONS: [usize; 2] = [3, 200];

impl RefactorisationPolicy {
    /// For a factor just made, at the `cost` of so many iterations.
    pub fn new(cost: f64) -> Self {
        Self { cost, best: usize::MAX, lost: 0 }
    }

    /// Counts a solve of so many iterations; one without any tells nothing.
    ///
    /// Iterations beyond ½ C count as lost even in the best solve: successive matrices that differ so
    /// much, as those of an interior-point method, need a factor each.
    pub fn solved(&mut self, iterations: usize) {
        if iterations > 0 {
            self.best = self.best.min(iterations);
            self.lost += iterations - self.best.min((0.5 * self.cost) as usize);
        }
    }

    /// Iterations after which a solve has lost what a new factor costs; `None` if one is due.
    pub fn iteration_limit(&self) -> Option<usize> {
        let left = self.cost - self.lost as f64;
        let [least, most] = EXTRA_ITERATIONS;
        (left > 0.0).then(|| self.best.saturating_add((left as usize).clamp(least, most)))
    }
}
