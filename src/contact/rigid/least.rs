//! The answer with the minimum ∫|u|² among many.

use super::nonnegative::nonnegative;
use crate::{contact::Bound, petsc::Communicator};
use nalgebra::{DMatrix, DVector};

/// u·ν below this fraction of the largest u·ν of a motion is rounding.
const TANGENTIAL: f64 = 1e-9;

/// The amplitude of each rigid motion m_j that moves the answer u, at the bounds `c`, such that
///
/// Σ (t_j + a_j)² is minimal over lower ≤ c + Ra ≤ upper and a = Zy.
///
/// Here t_j = ∫u·m_j/|Ω| are the `amplitudes` of u. The columns of R, `rigid`, are u·ν of the motions at the
/// bounds. The orthonormal columns of Z, `left`, are the combinations without resistance by contact forces.
/// With x = y + Zᵀt the function minimises |x| over Gx ≥ h. The solution follows from the residual of a
/// nonnegative least squares problem (Lawson and Hanson, Solving Least Squares Problems, ch. 23.4).
/// Collective.
pub(crate) fn least_motion(
    comm: Communicator,
    (rigid, left): (&DMatrix<f64>, &[DVector<f64>]),
    amplitudes: &DVector<f64>,
    bounds: &[Bound],
    c: &[f64],
) -> Option<DVector<f64>> {
    let z = DMatrix::from_columns(left);
    let start = z.transpose() * amplitudes;
    let normal = rigid * &z;
    let cut = TANGENTIAL * comm.max(normal.amax());
    // Per row: G and h of a bound; for the upper bound −u·ν ≥ c − upper.
    let mut rows = Vec::new();
    for ((row, bound), c) in normal.row_iter().zip(bounds).zip(c) {
        for (side, room) in [(1.0, bound.upper - c), (-1.0, c - bound.lower)] {
            if room.is_finite() && row.amax() > cut {
                rows.extend(row.iter().map(|v| -side * v));
                rows.push(-room.max(0.0) - side * row.transpose().dot(&start));
            }
        }
    }
    let rows = comm.gather(&rows);
    let size = start.len() + 1;
    let mut rows = DMatrix::from_row_slice(rows.len() / size, size, &rows);
    let scale = rows.column(size - 1).amax();
    let mut x = DVector::zeros(size - 1);
    if scale > 0.0 {
        rows.column_mut(size - 1).scale_mut(1.0 / scale);
        let last = DVector::from_fn(size, |i, _| f64::from(i + 1 == size));
        let residual = rows.transpose() * nonnegative(&rows, &last) - last;
        if residual[size - 1] >= 0.0 {
            return None;
        }
        x = residual.rows(0, size - 1) * (-scale / residual[size - 1]);
    }
    Some(z * (x - start))
}
