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
/// Differences of iterates smaller than this, relative to the largest, are rounding.
const SAME_ITERATE: f64 = 1e-10;

/// Nearly equal residuals (a free body that drifts towards its foundation) would be extrapolated too far. If a
/// coefficient of the mixing is larger than this, the method takes the plain step.
///
/// Tuned on the 4 penalty-duality runs. Half: the same iterations. Infinity: some free bodies have no answer.
const FARTHEST: f64 = 1e6;

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
        let differences = DMatrix::from_fn(w.len(), earlier.len(), |i, j| {
            (self.history[j + 1].1[i] - self.history[j].1[i]) * w[i]
        });
        let target = DVector::from_fn(w.len(), |i, _| residual[i] * w[i]);
        let (differences, target) = self.condensed(differences, target);
        let svd = differences.svd(true, true);
        let cut = SAME_ITERATE * svd.singular_values.max();
        let Ok(coefficients) = svd.solve(&target, cut) else { return next };
        if coefficients.amax() > FARTHEST {
            return next;
        }
        for (j, factor) in coefficients.iter().enumerate() {
            let (new, old) = (&self.history[j + 1].0, &self.history[j].0);
            next.iter_mut().zip(new.iter().zip(old)).for_each(|(v, (n, o))| *v -= factor * (n - o));
        }
        next
    }

    /// An equivalent least squares problem with the same rows on all ranks: per rank the triangle R of the QR
    /// factorisation of its rows (Demmel, Grigori, Hoemmen and Langou, SIAM J. Sci. Comput. 34, 2012).
    fn condensed(&self, a: DMatrix<f64>, b: DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        if self.comm.is_serial() {
            return (a, b);
        }
        let columns = a.ncols() + 1;
        let mut rows = a.insert_column(columns - 1, 0.0);
        rows.set_column(columns - 1, &b);
        // At least as many rows as columns, so that all ranks have triangles of one size.
        let missing = columns.saturating_sub(rows.nrows());
        let r = rows.insert_rows(0, missing, 0.0).qr().r();
        let all = DMatrix::from_column_slice(
            columns,
            columns * self.comm.size(),
            &self.comm.gather(r.transpose().as_slice()),
        )
        .transpose();
        (all.columns(0, columns - 1).into_owned(), all.column(columns - 1).into_owned())
    }

    fn norm(&self, v: &[f64]) -> f64 {
        let squares = v.iter().zip(&self.weights).map(|(v, w)| (v * w).powi(2)).sum::<f64>();
        self.comm.total(squares).sqrt()
    }
}
