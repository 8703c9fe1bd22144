//! Anderson acceleration of a fixed-point iteration q ← T(q).

use crate::petsc::Communicator;
use nalgebra::{DMatrix, DVector};

/// Anderson's mixing of the last few iterates (J. ACM 12, 1965; Walker and Ni, SIAM J. Numer.
/// Anal. 49, 2011, type II), in a weighted norm.
///
/// The map of a contact law is piecewise affine, so mixing can overshoot when the active set changes. If the
/// residual exceeds ten times the minimum so far, the method drops its history and continues from the mean of
/// q and T(q). For a nonexpansive map this step does not move away from a fixed point.
pub struct Anderson {
    /// Square roots of the norm's weights.
    weights: Vec<f64>,
    /// (T(q), T(q) − q) of the last iterates, oldest first.
    history: Vec<(Vec<f64>, Vec<f64>)>,
    best: f64,
    /// The ranks among which q is divided.
    comm: Communicator,
}

/// The number of mixed iterates.
///
/// Tuned on the 4 penalty-duality runs. Half: 57 % more iterations. Twice: 12 % fewer.
const DEPTH: usize = 10;
/// A residual above this multiple of the smallest one so far drops the history.
const OVERSHOOT: f64 = 10.0;
/// Differences of residuals smaller than this, relative to the largest and to the residual, are rounding. The residuals of a
/// free body that drifts towards its foundation are equal but for these.
const SAME_ITERATE: f64 = 1e-10;

impl Anderson {
    /// The norm is (Σ w_i q_i²)^½ over all ranks.
    pub fn new(comm: Communicator, weights: impl Iterator<Item = f64>) -> Self {
        let weights = weights.map(f64::sqrt).collect();
        Self { weights, history: Vec::new(), best: f64::INFINITY, comm }
    }

    /// The next iterate from `q` and its image T(q).
    pub fn next(&mut self, q: &[f64], image: Vec<f64>) -> Vec<f64> {
        let residual: Vec<f64> = image.iter().zip(q).map(|(t, q)| t - q).collect();
        let norm = self.norm(&residual);
        if norm.is_nan() || norm > OVERSHOOT * self.best {
            self.history.clear();
            self.best = norm;
            return image.iter().zip(q).map(|(t, q)| 0.5 * (t + q)).collect();
        }
        self.best = self.best.min(norm);
        self.history.push((image, residual));
        if self.history.len() > DEPTH + 1 {
            self.history.remove(0);
        }
        self.mix()
    }

    /// T(q_k) minus the combination of differences that minimises the residual.
    fn mix(&self) -> Vec<f64> {
        let Some(((image, residual), earlier)) = self.history.split_last() else {
            return Vec::new();
        };
        let mut next = image.clone();
        if earlier.is_empty() {
            return next;
        }
        let w = &self.weights;
        // The transpose, as the rows of all ranks then follow each other.
        let differences = DMatrix::from_fn(earlier.len(), w.len(), |j, i| {
            (self.history[j + 1].1[i] - self.history[j].1[i]) * w[i]
        });
        let differences = self.comm.gather(differences.as_slice());
        let target = residual.iter().zip(w).map(|(r, w)| r * w).collect::<Vec<_>>();
        let target = DVector::from(self.comm.gather(&target));
        let differences = DMatrix::from_row_slice(target.len(), earlier.len(), &differences);
        let svd = differences.svd(true, true);
        let cut = SAME_ITERATE * svd.singular_values.max().max(target.norm());
        let Ok(coefficients) = svd.solve(&target, cut) else { return next };
        for (j, factor) in coefficients.iter().enumerate() {
            let (new, old) = (&self.history[j + 1].0, &self.history[j].0);
            next.iter_mut().zip(new.iter().zip(old)).for_each(|(v, (n, o))| *v -= factor * (n - o));
        }
        next
    }

    fn norm(&self, v: &[f64]) -> f64 {
        let squares = v.iter().zip(&self.weights).map(|(v, w)| (v * w).powi(2)).sum::<f64>();
        self.comm.total(squares).sqrt()
    }
}
