//! CHOLMOD's supernodal factors (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math. Softw. 35,
//! 2008), with the names of its user guide.

use super::{LowerTriangle, raw};
use crate::petsc::PetscError;
use std::{ffi::c_void, ptr, slice};

/// A `cholmod_factor` P A Pᵀ = L Lᵀ with the `cholmod_common` it was made with.
pub(super) struct Cholmod {
    common: Box<raw::cholmod_common>,
    factor: *mut raw::cholmod_factor,
}

/// Where the entries of L are; the supernode s has the columns `starts[s]..starts[s + 1]`.
pub(super) struct FactorArrays<'a> {
    /// P: the row of A of each row of L.
    pub(super) order: &'a [i64],
    pub(super) starts: &'a [i64],
    /// Where the rows of each supernode begin in `rows`.
    pub(super) row_starts: &'a [i64],
    /// Where the values of each supernode begin.
    pub(super) value_starts: &'a [i64],
    pub(super) rows: &'a [i64],
}

impl Cholmod {
    /// Orders and analyses `a`: in the `order` given, else by CHOLMOD's choice
    /// (cholmod_l_analyze, cholmod_l_analyze_p).
    pub(super) fn analyse(
        a: &mut LowerTriangle,
        order: Option<Vec<i64>>,
    ) -> Result<Self, PetscError> {
        // SAFETY: plain data that cholmod_l_start fills.
        let common = unsafe { Box::new(std::mem::zeroed::<raw::cholmod_common>()) };
        let mut this = Self { common, factor: ptr::null_mut() };
        let mut view = a.view();
        // SAFETY: `common` stays where it is; the view describes arrays that live during the call,
        // and `order` has as many entries as there are rows.
        unsafe {
            raw::cholmod_l_start(&mut *this.common);
            this.common.print = 0;
            this.common.supernodal = raw::CHOLMOD_SUPERNODAL as i32;
            this.factor = match order {
                None => raw::cholmod_l_analyze(&mut view, &mut *this.common),
                Some(mut order) => {
                    this.common.nmethods = 1;
                    this.common.method[0].ordering = raw::CHOLMOD_GIVEN as i32;
                    let (order, none) = (order.as_mut_ptr(), ptr::null_mut());
                    raw::cholmod_l_analyze_p(&mut view, order, none, 0, &mut *this.common)
                }
            };
        }
        if this.factor.is_null() { Err(this.failure()) } else { Ok(this) }
    }

    /// Factorises `a`, which has the pattern that was analysed; false if it is not positive definite
    /// (cholmod_l_factorize).
    pub(super) fn factorise(&mut self, a: &mut LowerTriangle) -> Result<bool, PetscError> {
        let mut view = a.view();
        // SAFETY: live handles; the view describes arrays that live during the call.
        unsafe {
            match raw::cholmod_l_factorize(&mut view, self.factor, &mut *self.common) {
                0 => Err(self.failure()),
                _ => Ok((*self.factor).minor == (*self.factor).n),
            }
        }
    }

    /// Frees the values of L and keeps the analysis (cholmod_l_change_factor).
    pub(super) fn free_values(&mut self) -> Result<(), PetscError> {
        let (pattern, common) = (raw::CHOLMOD_PATTERN as i32, &mut *self.common);
        // SAFETY: live handles.
        match unsafe { raw::cholmod_l_change_factor(pattern, 1, 1, 1, 1, self.factor, common) } {
            0 => Err(self.failure()),
            _ => Ok(()),
        }
    }

    pub(super) fn arrays(&self) -> FactorArrays<'_> {
        // SAFETY: an analysed supernodal factor has these arrays of 64-bit indices.
        unsafe {
            let l = &*self.factor;
            let array = |array: *mut c_void, size| slice::from_raw_parts(array.cast::<i64>(), size);
            FactorArrays {
                order: array(l.Perm, l.n),
                starts: array(l.super_, l.nsuper + 1),
                row_starts: array(l.pi, l.nsuper + 1),
                value_starts: array(l.px, l.nsuper + 1),
                rows: array(l.s, l.ssize),
            }
        }
    }

    /// The values of L: of each supernode its columns from the diagonal block down; none before a
    /// factorisation.
    pub(super) fn values(&self) -> &[f64] {
        // SAFETY: the array x of a factor is null or has `xsize` values.
        unsafe {
            let l = &*self.factor;
            if l.x.is_null() { &[] } else { slice::from_raw_parts(l.x.cast::<f64>(), l.xsize) }
        }
    }

    /// Floating-point operations of a factorisation, and the number of values of L.
    pub(super) fn operations_and_entries(&self) -> [f64; 2] {
        // SAFETY: an analysed supernodal factor tells how many values it will have.
        [self.common.fl, unsafe { (*self.factor).xsize } as f64]
    }

    fn failure(&self) -> PetscError {
        PetscError::ours(match self.common.status {
            raw::CHOLMOD_OUT_OF_MEMORY => "not enough memory for a Cholesky factor".to_owned(),
            status => format!("CHOLMOD failed with status {status}"),
        })
    }
}

impl Drop for Cholmod {
    fn drop(&mut self) {
        // SAFETY: handles of our own; freeing null does nothing.
        unsafe {
            raw::cholmod_l_free_factor(&mut self.factor, &mut *self.common);
            raw::cholmod_l_finish(&mut *self.common);
        }
    }
}
