//! CHOLMOD's supernodal factors (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math. Softw. 35,
//! 2008), with the names of its user guide.

use super::{LowerTriangle, raw};
use crate::{memory::REMEDY, petsc::PetscError};
use std::{ffi::c_void, mem::take, ops::Range, ptr, slice};

/// A `cholmod_factor` P A Pᵀ = L Lᵀ with the `cholmod_common` it was made with.
pub(super) struct Cholmod {
    common: Box<raw::cholmod_common>,
    factor: *mut raw::cholmod_factor,
    /// The number of values of L in memory, the first ones.
    allocated: usize,
}

/// Values are freed in blocks of 32 MB; this is the number of values.
const FREED: usize = 1 << 22;

impl Cholmod {
    /// Orders `a` by minimum degree, with the last `interface` rows at the end (cholmod_l_camd), and analyses it
    /// (cholmod_l_analyze_p). Nested dissection saves less time on triangle meshes than it takes (SPEED.md, section 1).
    pub(super) fn ordered(a: &mut LowerTriangle, interface: usize) -> Result<Self, PetscError> {
        let (mut this, size, mut view, none) = (Self::start(), a.size(), a.view(), ptr::null_mut());
        let common = &mut *this.common;
        let mut permutation = vec![0; size];
        let mut sets: Vec<i64> = (0..size).map(|i| i64::from(i + interface >= size)).collect();
        let (permuted, sets) = (permutation.as_mut_ptr(), sets.as_mut_ptr());
        // SAFETY: a live handle; the view describes arrays that live during the call, and the permutation
        // and the sets have as many entries as there are rows.
        let done = unsafe { raw::cholmod_l_camd(&mut view, none, 0, sets, permuted, common) != 0 };
        this.check(done)?;
        permutation.retain(|&row| (row as usize) < size - interface);
        permutation.extend((size - interface) as i64..size as i64);
        let common = &mut *this.common;
        common.nmethods = 1;
        common.method[0].ordering = raw::CHOLMOD_GIVEN as i32;
        // SAFETY: a live handle, the view of arrays that live during the call, and a permutation of all rows.
        this.factor = unsafe {
            raw::cholmod_l_analyze_p(&mut view, permutation.as_mut_ptr(), none, 0, common)
        };
        this.check(!this.factor.is_null())?;
        if this.permutation().iter().copied().eq(0..size as i64) {
            // With the identity CHOLMOD factorises the matrix as it is, not a copy.
            // SAFETY: an analysed factor.
            unsafe { (*this.factor).ordering = raw::CHOLMOD_NATURAL as i32 };
        }
        Ok(this)
    }

    /// Without a factor.
    fn start() -> Self {
        let mut this = Self { common: Box::default(), factor: ptr::null_mut(), allocated: 0 };
        // SAFETY: `common` stays where it is.
        unsafe { raw::cholmod_l_start(&mut *this.common) };
        this.common.print = 0;
        this.common.supernodal = raw::CHOLMOD_SUPERNODAL as i32;
        this
    }

    /// Factorises `a`, which has the analysed pattern (cholmod_l_factorize). It returns false if `a` is not
    /// positive definite.
    pub(super) fn factorise(&mut self, a: &mut LowerTriangle) -> Result<bool, PetscError> {
        let (mut view, common) = (a.view(), &mut *self.common);
        let real = raw::CHOLMOD_REAL as i32;
        // SAFETY: live handles; the view describes arrays that live during the call, and x as many values
        // as the factor reports.
        let done = unsafe {
            // CHOLMOD allocates L if it has no memory yet.
            raw::cholmod_l_change_factor(real, 1, 1, 1, 1, self.factor, common) != 0
                && raw::cholmod_l_factorize(&mut view, self.factor, common) != 0
        };
        self.check(done)?;
        // SAFETY: a live factor.
        unsafe {
            self.allocated = (*self.factor).xsize;
            Ok((*self.factor).minor == (*self.factor).n)
        }
    }

    /// Frees the values of L except about the first `length` (cholmod_l_realloc).
    pub(super) fn truncate_values(&mut self, length: usize) {
        if self.allocated >= length + FREED {
            // SAFETY: the factor is live, and its block of memory holds `allocated` values, more than `length`.
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
        // SAFETY: live handles; CHOLMOD gets the present number of values, then again the number that
        // L will have.
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
    pub(super) fn permutation(&self) -> &[i64] {
        // SAFETY: the permutation of an analysed factor.
        unsafe { indices((*self.factor).Perm, (*self.factor).n) }
    }

    /// Per supernode: its columns, its rows (those of the diagonal block first), and the beginning of its
    /// [`Self::values`].
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

    /// The values of L in memory: per supernode, its dense columns from the diagonal block down.
    pub(super) fn values(&self) -> &[f64] {
        // SAFETY: the array x of a factor is null or has `allocated` values.
        unsafe {
            let x = (*self.factor).x.cast::<f64>();
            if x.is_null() { &[] } else { slice::from_raw_parts(x, self.allocated) }
        }
    }

    /// Floating-point operations of a factorisation, and the number of values of L.
    pub(super) fn operations_and_entries(&self) -> [f64; 2] {
        // SAFETY: an analysed supernodal factor knows the number of its values.
        [self.common.fl, unsafe { (*self.factor).xsize } as f64]
    }

    /// The error of a call that was not `done`.
    fn check(&self, done: bool) -> Result<(), PetscError> {
        let message = || match self.common.status {
            raw::CHOLMOD_OUT_OF_MEMORY => {
                format!("there is not enough memory for a Cholesky factor; {REMEDY}")
            }
            raw::CHOLMOD_TOO_LARGE => {
                format!("the mesh is too large for a Cholesky factor (32-bit indices); {REMEDY}")
            }
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
