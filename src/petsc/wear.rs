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
    /// Iterations that a solve with a new factor takes.
    fresh: usize,
    /// Seconds lost to the age of the factor.
    lost: f64,
}

/// Iterations an old factor is given at least, and at most.
const FEWEST: usize = 3;
const MOST: usize = 200;

impl Wear {
    /// Before the first factorisation: worn out.
    pub fn new(ranks: Ranks) -> Self {
        Self { ranks, factorisation: 0.0, iterations: (0.0, 0), fresh: 1, lost: f64::INFINITY }
    }

    /// A factorisation took so many seconds.
    pub fn renewed(&mut self, seconds: f64) {
        (self.factorisation, self.lost) = (seconds, 0.0);
    }

    /// Iterations took so many seconds.
    pub fn took(&mut self, seconds: f64, iterations: usize) {
        self.iterations.0 += seconds;
        self.iterations.1 += iterations;
    }

    /// A solve with a new factor takes so many iterations; one, unless this is told.
    pub fn expect(&mut self, iterations: usize) {
        self.fresh = iterations;
    }

    /// A solve with an old factor took so many iterations.
    pub fn lose(&mut self, iterations: usize) {
        self.lost += self.iteration() * iterations.saturating_sub(self.fresh) as f64;
    }

    /// Whether a new factor is due. Collective.
    pub fn worn(&self) -> bool {
        self.ranks.any(self.lost >= self.factorisation)
    }

    /// Iterations after which a solve has lost what a new factor costs. Collective.
    pub fn allowance(&self) -> usize {
        let affordable = (self.factorisation - self.lost) / self.iteration();
        self.fresh + (self.ranks.min(affordable) as usize).clamp(FEWEST, MOST)
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
        assert_eq!(wear.allowance(), 6);
        wear.lose(1);
        assert!(!wear.worn(), "one iteration is what a new factor needs too");
        wear.lose(4);
        assert!(!wear.worn());
        wear.lose(3);
        assert!(wear.worn());
    }
}
