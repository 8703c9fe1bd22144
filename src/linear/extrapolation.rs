//! Predicts the next solution from the last ones.

use crate::petsc::Communicator;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Extrapolates the last accepted solutions by polynomials in time, as initial guesses for iterative solvers.
///
/// The best degree depends on how smooth the evolution is and how precise the solutions are. The degree that
/// predicted the last solution best is used.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Extrapolation {
    /// (time, solution), the latest first.
    history: VecDeque<(f64, Vec<f64>)>,
    degree: usize,
}

/// Maximum degree. Above it the tolerance of the solutions, magnified by 2^(degree + 1), dominates.
///
/// Tuned on the 6 plain runs. Half: 29 % more pairs of triangular solves. Twice: 6 % fewer.
const MAX_DEGREE: usize = 4;
/// Number of entries per rank by which predictions are compared.
const SAMPLE: usize = 4096;

impl Extrapolation {
    /// The predicted solution at `time`; `None` before any solution.
    pub fn at(&self, time: f64) -> Option<Vec<f64>> {
        let mut values = vec![0.0; self.history.front()?.1.len()];
        for ((_, solution), weight) in self.history.iter().zip(self.weights(self.degree, time)) {
            values.iter_mut().zip(solution).for_each(|(value, old)| *value += weight * old);
        }
        Some(values)
    }

    /// Adds this rank's part of an accepted solution. Collective.
    pub fn accept(&mut self, comm: Communicator, time: f64, solution: Vec<f64>) {
        let errors = self.errors(comm, time, &solution);
        let best = (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        // If the highest possible degree was best, the next prediction uses one degree more.
        self.degree = match best {
            Some(degree) if degree + 1 == errors.len() && degree < MAX_DEGREE => degree + 1,
            Some(degree) => degree,
            None => 0,
        };
        self.history.push_front((time, solution));
        self.history.truncate(MAX_DEGREE + 1);
    }

    /// Per possible degree: its squared error for `solution` at `time`, over some entries. Collective.
    fn errors(&self, comm: Communicator, time: f64, solution: &[f64]) -> Vec<f64> {
        let weights: Vec<_> = (0..self.history.len()).map(|d| self.weights(d, time)).collect();
        let mut errors = vec![0.0; weights.len()];
        let stride = solution.len().div_ceil(SAMPLE).max(1);
        for (i, exact) in solution.iter().enumerate().step_by(stride) {
            for (error, weights) in errors.iter_mut().zip(&weights) {
                let terms = weights.iter().zip(&self.history).map(|(w, (_, old))| w * old[i]);
                *error += (terms.sum::<f64>() - exact).powi(2);
            }
        }
        comm.sum(&mut errors);
        errors
    }

    /// The weights (Lagrange) of the last `degree` + 1 solutions in the polynomial through them, at `time`.
    fn weights(&self, degree: usize, time: f64) -> Vec<f64> {
        let times = || self.history.iter().take(degree + 1).map(|(time, _)| *time).enumerate();
        let weight = |(i, own): (usize, f64)| -> f64 {
            let others = times().filter(|(j, _)| *j != i);
            others.map(|(_, other)| (time - other) / (own - other)).product()
        };
        times().map(weight).collect()
    }
}
