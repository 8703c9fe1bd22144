//! When the factor of an earlier matrix is replaced.

use serde::{Deserialize, Serialize};

/// Compares what the age of a factor has cost with what a new one costs, both in iterations.
///
/// Let a solve with the factor of an earlier matrix take mᵢ iterations to divide the residual by e^aᵢ or
/// more, and let e^ρ be the most by which an iteration has divided it in the mean of a solve since the
/// first with the factor, which is that of its own matrix: a new factor would soon take about ⌈aᵢ/ρ⌉. One
/// is due as soon as Σ (mᵢ − ⌈aᵢ/ρ⌉) ≥ C, the cost of a factorisation. Where the loss per solve grows
/// evenly that is the cheapest moment, otherwise it costs at most twice the cheapest. All is counted,
/// nothing measured by the clock: equal runs decide alike, and so do all ranks.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct RefactorisationPolicy {
    /// C: iterations that take as long as a factorisation.
    cost: f64,
    /// ρ; `None` before the first solve.
    rate: Option<f64>,
    /// Σ (mᵢ − ⌈aᵢ/ρ⌉): iterations lost since the last factorisation.
    lost: usize,
}

/// By what a solve divides the residual, as logarithms; equal ones where that is not known.
#[derive(Debug, Clone, Copy)]
pub struct Reduction {
    /// a: what it was asked to.
    pub asked: f64,
    /// What it did.
    pub reached: f64,
}

/// Iterations that a solve with an old factor may take beyond those with a new one: at least, at most.
const EXTRA_ITERATIONS: [usize; 2] = [3, 200];
/// A quotient of logarithms so little above a whole number is that.
const ROUNDING: f64 = 1e-9;

impl RefactorisationPolicy {
    /// For a factor just made, at the `cost` of so many iterations.
    pub fn new(cost: f64) -> Self {
        Self { cost, rate: None, lost: 0 }
    }

    /// Counts a solve of so many iterations; one without any tells nothing.
    ///
    /// Iterations beyond ½ C count as lost even in the best solve: successive matrices that differ so
    /// much, as those of an interior-point method, need a factor each.
    pub fn solved(&mut self, iterations: usize, reduction: Reduction) {
        if iterations > 0 {
            let rate = reduction.reached / iterations as f64;
            self.rate = Some(self.rate.map_or(0.0, |best| best.max(rate)));
            let fewest = self.fewest(reduction.asked).min((0.5 * self.cost) as usize);
            self.lost += iterations.saturating_sub(fewest);
        }
    }

    /// Iterations after which a solve that is `asked` for this has lost what a new factor costs; `None` if
    /// one is due.
    pub fn iteration_limit(&self, asked: f64) -> Option<usize> {
        let left = self.cost - self.lost as f64;
        let [least, most] = EXTRA_ITERATIONS;
        (left > 0.0).then(|| self.fewest(asked).saturating_add((left as usize).clamp(least, most)))
    }

    /// ⌈a/ρ⌉.
    fn fewest(&self, asked: f64) -> usize {
        ((asked / self.rate.unwrap_or(0.0) - ROUNDING).ceil() as usize).max(1)
    }
}
