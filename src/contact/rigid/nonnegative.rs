//! Nonnegative least squares.

use nalgebra::{DMatrix, DVector};

/// A row is dependent if its part outside the span of the others is below this, relative; and a gradient is zero below
/// it. Larger values leave motions that contact does not resist.
const DEPENDENT: f64 = 1e-13;

/// The p ≥ 0 that minimises ‖Aᵀp − b‖ (Lawson and Hanson, Solving Least Squares Problems, ch. 23). A has few
/// columns; at most this number of p_i is positive.
pub fn nonnegative(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let rows = a.nrows();
    let mut p = DVector::zeros(rows);
    let mut positive: Vec<usize> = Vec::new();
    let cut = DEPENDENT * b.norm() * a.amax();
    for _ in 0..10 * (rows + 1) {
        let gradient = a * (b - a.transpose() * &p);
        let entering = (0..rows)
            .filter(|i| !positive.contains(i))
            .max_by(|&i, &j| gradient[i].total_cmp(&gradient[j]));
        match entering {
            Some(i) if gradient[i] > cut && positive.len() < a.ncols() => positive.push(i),
            _ => break,
        }
        loop {
            let columns = a.select_rows(&positive).transpose();
            // A row enters only if it is independent of the others. QR decides this: with nalgebra's singular
            // values, which err by up to 1e-4 here, the iteration can cycle.
            let independent = DEPENDENT * columns.amax();
            let qr = columns.qr();
            let r = qr.r();
            if !r.diagonal().iter().all(|pivot| pivot.abs() > independent) {
                return p;
            }
            let Some(z) = r.solve_upper_triangular(&(qr.q().transpose() * b)) else { return p };
            if z.iter().all(|&v| v > 0.0) {
                p.fill(0.0);
                positive.iter().zip(z.iter()).for_each(|(&i, &v)| p[i] = v);
                break;
            }
            // Go towards z until the first p_i vanishes, and drop it.
            let reach = |(&i, &v): (&usize, &f64)| if v <= 0.0 { p[i] / (p[i] - v) } else { 1.0 };
            let step = positive.iter().zip(z.iter()).map(reach).fold(1.0, f64::min);
            positive.iter().zip(z.iter()).for_each(|(&i, &v)| p[i] += step * (v - p[i]));
            positive.retain(|&i| p[i] > 1e-14 * p.amax().max(f64::MIN_POSITIVE));
            if positive.is_empty() {
                break;
            }
        }
    }
    p
}
