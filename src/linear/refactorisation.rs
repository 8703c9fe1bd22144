//! When the factor of an earlier matrix is replaced.

use crate::ROUNDING;
use serde::{Deserialize, Serialize};

/// Compares the iterations lost to the age of a factor with the cost of a new factor.
///
/// Let solve i with the kept factor divide the residual by e^aᵢ in mᵢ iterations. Let ρ be the largest ln of
/// the mean reduction per iteration in a solve since the factor was new. A new factor would need about ⌈aᵢ/ρ⌉
/// iterations. It is due when Σ (mᵢ − ⌈aᵢ/ρ⌉) ≥ C, the cost of a factorisation. If the loss per solve grows
/// evenly, this is the cheapest moment; otherwise the cost is at most twice the minimum. The policy counts
/// iterations and reads no clock, so that equal runs and all ranks decide alike.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct RefactorisationPolicy {
    /// C: iterations that take as long as a factorisation.
    cost: f64,
    /// ρ; `None` before the first solve.
    rate: Option<f64>,
    /// Σ (mᵢ − ⌈aᵢ/ρ⌉): iterations lost since the last factorisation.
    lost: usize,
}

/// The reductions of the residual in a solve, as logarithms. They are equal if the reached one is not known.
#[derive(Debug, Clone, Copy)]
pub struct Reduction {
    /// a, the reduction that the solve needs.
    pub asked: f64,
    /// The reduction that it reached.
    pub reached: f64,
}

impl RefactorisationPolicy {
    /// For a new factor whose `cost` is given in iterations.
    pub fn new(cost: f64) -> Self {
        Self { cost, rate: None, lost: 0 }
    }

    /// Counts a solve with this number of iterations; a solve without iterations does not count.
    ///
    /// Iterations beyond ½ C count as lost even in the best solve. The matrices of an interior-point method
    /// differ so much that each needs a factor.
    pub fn solved(&mut self, iterations: usize, reduction: Reduction) {
        if iterations > 0 {
            let rate = reduction.reached / iterations as f64;
            self.rate = Some(self.rate.map_or(0.0, |best| best.max(rate)));
            let fewest = self.fewest(reduction.asked).min((0.5 * self.cost) as usize);
            self.lost += iterations.saturating_sub(fewest);
        }
    }

    /// The number of iterations after which a solve has lost the cost of a new factor. `None` if a new factor
    /// is due.
    pub fn iteration_limit(&self, asked: f64) -> Option<usize> {
        let left = self.cost - self.lost as f64;
        (left > 0.0).then(|| self.fewest(asked).saturating_add(left.ceil() as usize))
    }

    /// ⌈a/ρ⌉; a quotient above a whole number by rounding counts as that number.
    fn fewest(&self, asked: f64) -> usize {
        ((asked / self.rate.unwrap_or(0.0) - ROUNDING).ceil() as usize).max(1)
    }
}
