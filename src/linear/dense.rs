//! The Cholesky factor of a dense matrix, by LAPACK.

use super::raw;
use nalgebra::DMatrix;

/// L with A = L Lᵀ (dpotrf in LAPACK Users' Guide).
pub(super) struct DenseCholesky {
    /// L in the lower triangle; the upper one has no meaning.
    lower: DMatrix<f64>,
}

impl DenseCholesky {
    /// Factorises the symmetric matrix whose lower triangle is given. `None` if it is not positive definite.
    pub(super) fn new(mut lower: DMatrix<f64>) -> Option<Self> {
        let (size, mut status) = (lower.nrows() as i32, 0);
        let leading = size.max(1);
        // SAFETY: the matrix has `size` columns of `size` values.
        unsafe {
            raw::dpotrf_(c"L".as_ptr(), &size, lower.as_mut_ptr(), &leading, &mut status);
        }
        (status == 0).then_some(Self { lower })
    }

    /// `b` ← A⁻¹ `b` (dpotrs).
    pub(super) fn solve(&self, b: &mut [f64]) {
        assert_eq!(b.len(), self.lower.nrows());
        let (size, columns, mut status) = (b.len() as i32, 1, 0);
        let leading = size.max(1);
        let l = self.lower.as_ptr();
        // SAFETY: the factor has `size` columns of `size` values, and `b` has `size` values.
        unsafe {
            raw::dpotrs_(
                c"L".as_ptr(),
                &size,
                &columns,
                l,
                &leading,
                b.as_mut_ptr(),
                &leading,
                &mut status,
            );
        }
    }
}
