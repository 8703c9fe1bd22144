//! CHOLMOD's Cholesky factors of matrices that one rank holds, with the halves of a solve apart.

use super::{PetscError, raw};
use std::{ffi::c_void, ptr, slice};

/// A sparse symmetric positive definite matrix' factor: P A Pᵀ = L Lᵀ (supernodal).
///
/// PETSc's own interface to CHOLMOD only solves as a whole.
pub(super) struct Cholesky {
    common: Box<raw::cholmod_common>,
    factor: *mut raw::cholmod_factor,
    /// Workspace of the solves.
    work: [*mut raw::cholmod_dense; 3],
}

/// The lower triangle by columns: rows `rows[starts[j]..starts[j + 1]]`, all at least j.
#[derive(Default)]
pub(super) struct Lower {
    pub(super) starts: Vec<i64>,
    pub(super) rows: Vec<i64>,
    pub(super) values: Vec<f64>,
}

/// Which system a solve solves.
#[derive(Clone, Copy)]
pub(super) enum Half {
    /// L y = b.
    Forward,
    /// Lᵀ y = b.
    Backward,
    /// A y = b.
    Whole,
}

impl Lower {
    /// Of `size` rows, to be filled column by column.
    pub(super) fn new() -> Self {
        Self { starts: vec![0], ..Self::default() }
    }

    pub(super) fn push(&mut self, row: usize, value: f64) {
        self.rows.push(row as i64);
        self.values.push(value);
    }

    pub(super) fn end_column(&mut self) {
        self.starts.push(self.rows.len() as i64);
    }

    fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// What CHOLMOD reads; valid while this is not changed.
    fn view(&mut self) -> raw::cholmod_sparse {
        raw::cholmod_sparse {
            nrow: self.size(),
            ncol: self.size(),
            nzmax: self.rows.len(),
            p: self.starts.as_mut_ptr().cast::<c_void>(),
            i: self.rows.as_mut_ptr().cast::<c_void>(),
            nz: ptr::null_mut(),
            x: self.values.as_mut_ptr().cast::<c_void>(),
            z: ptr::null_mut(),
            stype: -1,
            itype: raw::CHOLMOD_LONG as i32,
            xtype: raw::CHOLMOD_REAL as i32,
            dtype: raw::CHOLMOD_DOUBLE as i32,
            sorted: 0,
            packed: 1,
        }
    }
}

impl Cholesky {
    /// Orders and analyses `a`: in the `order` given (place → row), else by CHOLMOD's choice.
    pub(super) fn analyse(a: &mut Lower, order: Option<Vec<i64>>) -> Result<Self, PetscError> {
        // SAFETY: plain data that cholmod_l_start fills.
        let common = unsafe { Box::new(std::mem::zeroed::<raw::cholmod_common>()) };
        let mut this = Self { common, factor: ptr::null_mut(), work: [ptr::null_mut(); 3] };
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
        match this.factor.is_null() {
            true => Err(this.failure()),
            false => Ok(this),
        }
    }

    /// Factorises `a`, which has the pattern that was analysed; false if it is not positive definite.
    pub(super) fn factorise(&mut self, a: &mut Lower) -> Result<bool, PetscError> {
        let mut view = a.view();
        // SAFETY: live handles; the view describes arrays that live during the call.
        unsafe {
            if raw::cholmod_l_factorize(&mut view, self.factor, &mut *self.common) == 0 {
                return Err(self.failure());
            }
            Ok((*self.factor).minor == (*self.factor).n)
        }
    }

    /// The rows in the order of the factor: place → row.
    pub(super) fn order(&self) -> &[i64] {
        // SAFETY: an analysed factor has a permutation of its n rows.
        unsafe { slice::from_raw_parts((*self.factor).Perm.cast::<i64>(), (*self.factor).n) }
    }

    /// The last `size` rows and columns of L, dense by columns.
    pub(super) fn trailing(&self, size: usize) -> Vec<f64> {
        let mut block = vec![0.0; size * size];
        // SAFETY: a factorised supernodal factor: CHOLMOD's guide, section "supernodal".
        unsafe {
            let l = &*self.factor;
            let first = l.n - size;
            let at = |array: *mut c_void, i: usize| *array.cast::<i64>().add(i) as usize;
            for s in 0..l.nsuper {
                let (start, end) = (at(l.super_, s), at(l.super_, s + 1));
                let (rows, height) = (at(l.pi, s), at(l.pi, s + 1) - at(l.pi, s));
                for column in start.max(first)..end {
                    for t in column - start..height {
                        let row = at(l.s, rows + t);
                        let place = at(l.px, s) + t + (column - start) * height;
                        block[row - first + (column - first) * size] =
                            *l.x.cast::<f64>().add(place);
                    }
                }
            }
        }
        block
    }

    /// Replaces `b` by the solution; halves are in the order of the factor.
    pub(super) fn solve(&mut self, half: Half, b: &mut [f64]) -> Result<(), PetscError> {
        let system = match half {
            Half::Forward => raw::CHOLMOD_L,
            Half::Backward => raw::CHOLMOD_Lt,
            Half::Whole => raw::CHOLMOD_A,
        };
        let mut view = raw::cholmod_dense {
            nrow: b.len(),
            ncol: 1,
            nzmax: b.len(),
            d: b.len(),
            x: b.as_mut_ptr().cast::<c_void>(),
            z: ptr::null_mut(),
            xtype: raw::CHOLMOD_REAL as i32,
            dtype: raw::CHOLMOD_DOUBLE as i32,
        };
        let [x, y, e] = &mut self.work;
        // SAFETY: live handles; the view has the factor's size, else CHOLMOD refuses it.
        unsafe {
            let done = raw::cholmod_l_solve2(
                system as i32,
                self.factor,
                &mut view,
                ptr::null_mut(),
                x,
                ptr::null_mut(),
                y,
                e,
                &mut *self.common,
            );
            if done == 0 {
                return Err(self.failure());
            }
            b.copy_from_slice(slice::from_raw_parts((**x).x.cast::<f64>(), b.len()));
        }
        Ok(())
    }

    fn failure(&self) -> PetscError {
        PetscError::ours(match self.common.status {
            -2 => "not enough memory for a Cholesky factor".to_owned(),
            status => format!("CHOLMOD failed with status {status}"),
        })
    }
}

impl Drop for Cholesky {
    fn drop(&mut self) {
        // SAFETY: handles of our own; freeing null does nothing.
        unsafe {
            raw::cholmod_l_free_factor(&mut self.factor, &mut *self.common);
            for work in &mut self.work {
                raw::cholmod_l_free_dense(work, &mut *self.common);
            }
            raw::cholmod_l_finish(&mut *self.common);
        }
    }
}
