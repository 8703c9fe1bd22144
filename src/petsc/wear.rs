//! When a factor that preconditions other matrices than its own is to be renewed.

use super::Ranks;

/// What a factor and its age cost.
///
/// An ageing factor costs iterations. It is worn out when the time so lost since it was made
/// reaches the time a new one takes: where the loss per solve grows evenly, that is the cheapest
/// moment; otherwise it costs at most twice the cheapest. Ranks measure different times but decide
/// alike.
#[derive(Debug)]
pub struct Wear {
    ranks: Ranks,
    /// Seconds of the last factorisation.
    factorisation: f64,
    /// Seconds of all iterations so far, and their number.
    iterations: (f64, usize),
    /// Iterations of the best solve since the last factorisation.
    best: usize,
    /// Seconds lost to the age of the factor.
    lost: f64,
}

/// Iterations an old factor is given at least, and at most.
const FEWEST: usize = 3;
const MOST: usize = 200;
/// More than any solve takes.
const NONE: usize = usize::MAX;

impl Wear {
    /// Before the first factorisation: worn out.
    pub fn new(ranks: Ranks) -> Self {
        Self { ranks, factorisation: 0.0, iterations: (0.0, 0), best: NONE, lost: f64::INFINITY }
    }

    /// A factorisation took so many seconds.
    pub fn renewed(&mut self, seconds: f64) {
        (self.factorisation, self.lost, self.best) = (seconds, 0.0, NONE);
    }

    /// Iterations took so many seconds.
    pub fn took(&mut self, seconds: f64, iterations: usize) {
        self.iterations.0 += seconds;
        self.iterations.1 += iterations;
    }

    /// A solve took so many iterations: what the best one since the last factorisation did not need
    /// is lost. None tell nothing.
    pub fn solved(&mut self, iterations: usize) {
        if iterations == 0 {
            return;
        }
        self.best = self.best.min(iterations);
        self.lost += self.iteration() * (iterations - self.best) as f64;
    }

    /// Whether a new factor is due. Collective.
    pub fn worn(&self) -> bool {
        self.ranks.any(self.lost >= self.factorisation)
    }

    /// Iterations after which a solve has lost what a new factor costs. Collective.
    pub fn allowance(&self) -> usize {
        let affordable = (self.factorisation - self.lost) / self.iteration();
        self.best + (self.ranks.min(affordable) as usize).clamp(FEWEST, MOST)
    }

    /// Seconds of an iteration, on the mean.
    fn iteration(&self) -> f64 {
        self.iterations.0 / self.iterations.1.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_is_renewed_when_its_age_has_cost_as_much_as_a_new_one() {
        let mut wear = Wear::new(Ranks::alone());
        assert!(wear.worn(), "there is none yet");
        wear.renewed(10.0);
        wear.took(8.0, 4);
        wear.solved(4);
        assert!(!wear.worn(), "the first one tells what a new factor needs");
        wear.solved(1);
        wear.solved(0);
        wear.solved(4);
        assert!(!wear.worn(), "three iterations lost, 6 s of 10");
        assert_eq!(wear.allowance(), 1 + FEWEST);
        wear.solved(3);
        assert!(wear.worn());
    }
}
