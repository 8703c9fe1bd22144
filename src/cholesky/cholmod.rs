//! CHOLMOD's supernodal factors (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math. Softw. 35,
//! 2008), with the names of its user guide.

use super::{LowerTriangle, raw};
use crate::petsc::PetscError;
use std::{ffi::c_void, mem::take, ops::Range, ptr, slice};

/// A `cholmod_factor` P A Pᵀ = L Lᵀ with the `cholmod_common` it was made with.
pub(super) struct Cholmod {
    common: Box<raw::cholmod_common>,
    factor: *mut raw::cholmod_factor,
    /// The number of values of L in memory, the first ones.
    allocated: usize,
}

/// Values are freed by so many at a time, 32 MB.
const FREED: usize = 1 << 22;

impl Cholmod {
    /// Orders and analyses `a`: in the `order` given, else by CHOLMOD's choice
    /// (cholmod_l_analyze, cholmod_l_analyze_p).
    pub(super) fn analyse(
        a: &mut LowerTriangle,
        order: Option<Vec<i64>>,
    ) -> Result<Self, PetscError> {
        let mut this = Self { common: Box::default(), factor: ptr::null_mut(), allocated: 0 };
        let (common, mut view) = (&mut *this.common, a.view());
        // SAFETY: `common` stays where it is; the view describes arrays that live during the call,
        // and `order` has as many entries as there are rows.
        unsafe {
            raw::cholmod_l_start(common);
            common.print = 0;
            common.supernodal = raw::CHOLMOD_SUPERNODAL as i32;
            this.factor = match order {
                None => raw::cholmod_l_analyze(&mut view, common),
                Some(mut order) => {
                    common.nmethods = 1;
                    common.method[0].ordering = raw::CHOLMOD_GIVEN as i32;
                    let (order, none) = (order.as_mut_ptr(), ptr::null_mut());
                    raw::cholmod_l_analyze_p(&mut view, order, none, 0, common)
                }
            };
        }
        this.check(!this.factor.is_null())?;
        Ok(this)
    }

    /// Factorises `a`, which has the pattern that was analysed; false if it is not positive definite
    /// (cholmod_l_factorize).
    pub(super) fn factorise(&mut self, a: &mut LowerTriangle) -> Result<bool, PetscError> {
        let mut view = a.view();
        // SAFETY: live handles; the view describes arrays that live during the call.
        let done =
            unsafe { raw::cholmod_l_factorize(&mut view, self.factor, &mut *self.common) != 0 };
        self.check(done)?;
        // SAFETY: a live factor.
        unsafe {
            self.allocated = (*self.factor).xsize;
            Ok((*self.factor).minor == (*self.factor).n)
        }
    }

    /// Frees the values of L but for about the first `length` (cholmod_l_realloc).
    pub(super) fn truncate_values(&mut self, length: usize) {
        if self.allocated >= length + FREED {
            // SAFETY: a live factor with so many values in its block of memory.
            unsafe {
                let (l, size) = (&mut *self.factor, size_of::<f64>());
                l.x = raw::cholmod_l_realloc(
                    length,
                    size,
                    l.x,
                    &mut self.allocated,
                    &mut *self.common,
                );
            }
        }
    }

    /// Frees the values of L and keeps the analysis (cholmod_l_change_factor).
    pub(super) fn free_values(&mut self) -> Result<(), PetscError> {
        let (pattern, common) = (raw::CHOLMOD_PATTERN as i32, &mut *self.common);
        // SAFETY: live handles; CHOLMOD is told how many values there are, then again how many
        // there will be.
        let done = unsafe {
            let size = (*self.factor).xsize;
            (*self.factor).xsize = take(&mut self.allocated);
            let done = raw::cholmod_l_change_factor(pattern, 1, 1, 1, 1, self.factor, common) != 0;
            (*self.factor).xsize = size;
            done
        };
        self.check(done)
    }

    /// P: the row of A of each row of L.
    pub(super) fn order(&self) -> &[i64] {
        // SAFETY: the permutation of an analysed factor.
        unsafe { indices((*self.factor).Perm, (*self.factor).n) }
    }

    /// Of each supernode its columns, its rows (first those of the diagonal block), and where its
    /// [`Self::values`] begin.
    pub(super) fn supernodes(&self) -> impl Iterator<Item = (Range<usize>, &[i64], usize)> {
        // SAFETY: an analysed supernodal factor has these arrays of 64-bit indices.
        let [columns, rows, values, s] = unsafe {
            let (l, ends) = (&*self.factor, (*self.factor).nsuper + 1);
            let array = |start| indices(start, ends);
            [array(l.super_), array(l.pi), array(l.px), indices(l.s, l.ssize)]
        };
        let range = |ends: &[i64]| ends[0] as usize..ends[1] as usize;
        columns
            .windows(2)
            .zip(rows.windows(2))
            .zip(values)
            .map(move |((columns, rows), value)| (range(columns), &s[range(rows)], *value as usize))
    }

    /// The values of L that are in memory: of each supernode its dense columns from the diagonal block
    /// down.
    pub(super) fn values(&self) -> &[f64] {
        // SAFETY: the array x of a factor is null or has `allocated` values.
        unsafe {
            let x = (*self.factor).x.cast::<f64>();
            if x.is_null() { &[] } else { slice::from_raw_parts(x, self.allocated) }
        }
    }

    /// Floating-point operations of a factorisation, and the number of values of L.
    pub(super) fn operations_and_entries(&self) -> [f64; 2] {
        // SAFETY: an analysed supernodal factor tells how many values it will have.
        [self.common.fl, unsafe { (*self.factor).xsize } as f64]
    }

    /// The error of a call that was not `done`.
    fn check(&self, done: bool) -> Result<(), PetscError> {
        let message = || match self.common.status {
            raw::CHOLMOD_OUT_OF_MEMORY => "not enough memory for a Cholesky factor".to_owned(),
            status => format!("CHOLMOD failed with status {status}"),
        };
        done.then_some(()).ok_or_else(|| PetscError::ours(message()))
    }
}

/// An array of CHOLMOD.
///
/// # Safety
/// It has `size` 64-bit indices, and lives for 'a.
unsafe fn indices<'a>(array: *mut c_void, size: usize) -> &'a [i64] {
    // SAFETY: the caller's promise.
    unsafe { slice::from_raw_parts(array.cast::<i64>(), size) }
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
