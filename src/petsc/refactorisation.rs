//! When a factor that preconditions other matrices than its own is to be replaced.

/// Compares what the age of a factor has cost with what a new one costs, both in iterations.
///
/// A preconditioner made from an earlier matrix costs iterations. A new one is due when those lost
/// since the last factorisation reach the [`cost`](super::Factor::cost) of a factorisation: where
/// the loss per solve grows evenly, that is the cheapest moment; otherwise it costs at most twice
/// the cheapest. All is counted, nothing measured: equal runs decide alike, and all ranks do.
#[derive(Debug)]
pub struct Refactorisation {
    /// What a factorisation costs.
    cost: f64,
    /// The fewest iterations of a solve since the last factorisation.
    best: usize,
    /// Iterations lost since the last factorisation.
    lost: usize,
}

/// Iterations an old factor is given at least, and at most, above those of the best solve.
const FEWEST: usize = 3;
const MOST: usize = 200;

impl Default for Refactorisation {
    /// Before the first factorisation, or after one that failed: due.
    fn default() -> Self {
        Self { cost: 0.0, best: usize::MAX, lost: 0 }
    }
}

impl Refactorisation {
    /// A factorisation has been made whose cost is so many iterations.
    pub fn done(&mut self, cost: f64) {
        *self = Self { cost, ..Self::default() };
    }

    /// A solve took so many iterations: those that the best one since the last factorisation did
    /// not need are lost, and all beyond half a factorisation: matrices that differ so much (those
    /// of an interior-point method) need one each. A solve without iterations tells nothing.
    pub fn solved(&mut self, iterations: usize) {
        if iterations > 0 {
            self.best = self.best.min(iterations);
            self.lost += iterations - self.best.min((0.5 * self.cost) as usize);
        }
    }

    /// Whether a new factor is due.
    pub fn due(&self) -> bool {
        self.lost as f64 >= self.cost
    }

    /// Iterations after which a solve has lost what a new factor costs.
    pub fn iteration_limit(&self) -> usize {
        let left = (self.cost - self.lost as f64) as usize;
        self.best.saturating_add(left.clamp(FEWEST, MOST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_is_replaced_when_its_age_has_cost_as_much_as_a_new_one() {
        let mut policy = Refactorisation::default();
        assert!(policy.due(), "there is none yet");
        policy.done(8.0);
        policy.solved(4);
        assert!(!policy.due(), "the first solve tells what a new factor needs");
        policy.solved(1);
        policy.solved(0);
        policy.solved(4);
        assert!(!policy.due(), "3 iterations lost of 8");
        assert_eq!(policy.iteration_limit(), 1 + 5);
        policy.solved(6);
        assert!(policy.due());
        policy.done(8.0);
        policy.solved(13);
        assert!(policy.due(), "a factor that helps so little is due at once");
    }
}
