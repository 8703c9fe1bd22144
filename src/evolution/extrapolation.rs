//! Where the next solution is likely to be.

use crate::petsc::Communicator;
use std::collections::VecDeque;

/// Polynomials in time through the last accepted solutions, as starts for iterative solvers.
///
/// Which degree predicts best depends on how smooth the evolution is and on how precisely
/// the solutions are known: that of the best prediction of the last solution is used.
pub(super) struct Extrapolation {
    /// (time, solution), the latest first.
    history: VecDeque<(f64, Vec<f64>)>,
    degree: usize,
    /// The ranks among which solutions are divided.
    comm: Communicator,
}

/// Above this degree the tolerance of the solutions, magnified by 2^(degree + 1), prevails.
const HIGHEST: usize = 4;
/// Entries of a solution that tell how well it was predicted, on each rank.
const SAMPLE: usize = 4096;

impl Extrapolation {
    /// Before any solution: 0.
    pub(super) fn new(comm: Communicator, size: usize) -> Self {
        let history = VecDeque::from([(f64::NEG_INFINITY, vec![0.0; size])]);
        Self { history, degree: 0, comm }
    }

    /// The likely solution at `time`.
    pub(super) fn at(&self, time: f64) -> Vec<f64> {
        let shares = self.shares(self.degree, time);
        let mut values = vec![0.0; self.history[0].1.len()];
        for ((_, solution), share) in self.history.iter().zip(shares).take(self.degree + 1) {
            values.iter_mut().zip(solution).for_each(|(value, old)| *value += share * old);
        }
        values
    }

    /// A solution is accepted.
    pub(super) fn accept(&mut self, time: f64, solution: Vec<f64>) {
        if self.history[0].0 == f64::NEG_INFINITY {
            self.history.clear();
        }
        let misses = self.misses(time, &solution);
        let best = (0..misses.len()).min_by(|&a, &b| misses[a].total_cmp(&misses[b]));
        // One degree more than was possible so far is tried as soon as the highest was best.
        self.degree = match best {
            Some(degree) if degree + 1 == misses.len() && degree < HIGHEST => degree + 1,
            Some(degree) => degree,
            None => 0,
        };
        self.history.push_front((time, solution));
        self.history.truncate(HIGHEST + 1);
    }

    /// For every possible degree, the squared distance of its prediction from the `solution` at
    /// `time`, in a sample of the entries.
    fn misses(&self, time: f64, solution: &[f64]) -> Vec<f64> {
        let shares: Vec<_> =
            (0..self.history.len()).map(|degree| self.shares(degree, time)).collect();
        let mut misses = [0.0; HIGHEST + 1];
        let mut values = [0.0; HIGHEST + 1];
        let stride = solution.len().div_ceil(SAMPLE).max(1);
        for (i, exact) in solution.iter().enumerate().step_by(stride) {
            values.iter_mut().zip(&self.history).for_each(|(value, (_, old))| *value = old[i]);
            for (miss, shares) in misses.iter_mut().zip(&shares) {
                let predicted: f64 = shares.iter().zip(values).map(|(s, v)| s * v).sum();
                *miss += (predicted - exact).powi(2);
            }
        }
        let mut misses = misses[..self.history.len()].to_vec();
        self.comm.sum(&mut misses);
        misses
    }

    /// What each solution contributes at `time` to the polynomial through the last `degree` + 1
    /// (Lagrange); the earlier ones nothing.
    fn shares(&self, degree: usize, time: f64) -> [f64; HIGHEST + 1] {
        let mut shares = [0.0; HIGHEST + 1];
        let times = || self.history.iter().take(degree + 1).map(|(time, _)| *time).enumerate();
        for (i, own) in times() {
            let others = times().filter(|(j, _)| *j != i);
            shares[i] = others.map(|(_, other)| (time - other) / (own - other)).product();
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_evolution_is_predicted_exactly_from_uneven_times() {
        let solution = |t: f64| vec![1.0 + t * t, 3.0 * t];
        let mut extrapolation = Extrapolation::new(Communicator::serial(), 2);
        assert_eq!(extrapolation.at(0.0), [0.0, 0.0]);
        for t in [0.0, 0.1, 0.3, 0.35, 0.5, 0.6] {
            extrapolation.accept(t, solution(t));
        }
        let (found, expected) = (extrapolation.at(0.8), solution(0.8));
        assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-13), "{found:?}");
    }

    #[test]
    fn a_jump_lowers_the_degree() {
        let mut extrapolation = Extrapolation::new(Communicator::serial(), 1);
        for (t, s) in [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 2.0), (4.0, 2.0)] {
            extrapolation.accept(t, vec![s]);
        }
        assert_eq!(extrapolation.at(5.0), [2.0]);
    }
}
