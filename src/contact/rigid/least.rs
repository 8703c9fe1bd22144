//! Of many answers the one of least ∫|u|².

use super::nonnegative::nonnegative;
use crate::{contact::Bound, petsc::Communicator};
use nalgebra::{DMatrix, DVector};

/// u·ν below this part of the largest of a motion is rounding.
const ROUNDING: f64 = 1e-9;

/// How far to move along each rigid motion m_j from u, given at the bounds as `c`, so that
///
/// Σ (t_j + a_j)² is least over lower ≤ c + Ra ≤ upper and a = Zy,
///
/// where t_j = ∫u·m_j/|Ω| are the `amplitudes` of u, the columns of R the u·ν of the motions at the
/// bounds, `rigid`, and the orthonormal columns of Z the combinations that no contact force resists, `left`.
/// With x = y + Zᵀt this is the least |x| over Gx ≥ h, which the residual of a nonnegative least
/// squares problem gives (Lawson and Hanson, Solving Least Squares Problems, ch. 23.4). Collective.
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
    let cut = ROUNDING * comm.max(normal.amax());
    // Each row: G and h of a bound, on its upper side −u·ν ≥ c − upper.
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
