//! CHOLMOD's Cholesky factors of matrices that one rank holds.

use super::{
    Lower,
    supernodal::{Structure, Supernodal, Supernode, Triangle},
};
use crate::petsc::{PetscError, raw};
use std::{ffi::c_void, ptr, slice};

/// A sparse symmetric positive definite matrix' factor: P A Pᵀ = L Lᵀ (supernodal).
///
/// CHOLMOD orders and factorises; the solves are ours: they read L twice as fast, in half the bytes
/// where that is enough, and their halves are apart.
pub(super) struct Cholesky {
    common: Box<raw::cholmod_common>,
    factor: *mut raw::cholmod_factor,
    precision: Precision,
    /// The columns of L that are solved with, the first ones.
    solved: usize,
    triangle: Box<dyn Triangle>,
}

/// Digits that a factor keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Seven, if that makes a good preconditioner, else sixteen.
    Preconditioner,
    /// Sixteen.
    Full,
}

/// The share of a load that a solve may leave over, for a factor of few digits to be kept: each
/// iteration then gains a digit or more. With 3e-3 (the unit square, n = 256) they were no more.
const LEFT: f64 = 1e-1;

/// Bytes that a solve reads in the time of one floating-point operation of a factorisation, and of the
/// work per entry of L that is none (assembly, copies). Seconds of a factorisation were
/// 0.065 ns · operations + 16.5 ns · entries within 10 % (square and L, 4,000 to 530,000 unknowns, one
/// core of a Xeon with AVX-512, OpenBLAS), those of an iteration 0.06 to 0.13 ns per byte.
const FLOP: f64 = 0.8;
const ENTRY: f64 = 200.0;

impl Cholesky {
    /// Orders and analyses `a`: in the `order` given (place → row), else by CHOLMOD's choice. The last
    /// `kept` rows, the last in the order too, are not eliminated in solves.
    pub(super) fn analyse(
        a: &mut Lower,
        order: Option<Vec<i64>>,
        kept: usize,
        precision: Precision,
    ) -> Result<Self, PetscError> {
        // SAFETY: plain data that cholmod_l_start fills.
        let common = unsafe { Box::new(std::mem::zeroed::<raw::cholmod_common>()) };
        let nothing = Structure { order: Vec::new(), supernodes: Vec::new(), rows: Vec::new() };
        let triangle = Box::new(Supernodal::<f64>::new(nothing));
        let (factor, solved) = (ptr::null_mut(), a.size() - kept);
        let mut this = Self { common, factor, precision, solved, triangle };
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
        if this.factor.is_null() {
            return Err(this.failure());
        }
        this.triangle = match precision {
            Precision::Preconditioner => Box::new(Supernodal::<f32>::new(this.structure())),
            Precision::Full => Box::new(Supernodal::<f64>::new(this.structure())),
        };
        Ok(this)
    }

    /// Factorises `a`, which has the pattern that was analysed: the block of L in the rows and columns
    /// that are kept, dense by columns; `None` if it is not positive definite.
    pub(super) fn factorise(&mut self, a: &mut Lower) -> Result<Option<Vec<f64>>, PetscError> {
        let mut view = a.view();
        // SAFETY: live handles; the view describes arrays that live during the call.
        unsafe {
            if raw::cholmod_l_factorize(&mut view, self.factor, &mut *self.common) == 0 {
                return Err(self.failure());
            }
            if (*self.factor).minor < (*self.factor).n {
                return Ok(None);
            }
        }
        let block = self.kept_block();
        self.take_over();
        if self.precision == Precision::Preconditioner && !self.serves(a) {
            self.precision = Precision::Full;
            self.triangle = Box::new(Supernodal::<f64>::new(self.structure()));
            self.take_over();
        }
        let pattern = raw::CHOLMOD_PATTERN as i32;
        // SAFETY: live handles; frees the values, keeps the analysis.
        let freed = unsafe {
            raw::cholmod_l_change_factor(pattern, 1, 1, 1, 1, self.factor, &mut *self.common)
        };
        if freed == 0 { Err(self.failure()) } else { Ok(Some(block)) }
    }

    /// Gives the values of L to the triangle.
    fn take_over(&mut self) {
        // SAFETY: a factorised supernodal factor holds `xsize` values.
        let values =
            unsafe { slice::from_raw_parts((*self.factor).x.cast::<f64>(), (*self.factor).xsize) };
        self.triangle.set_values(values);
    }

    /// Whether solves with the triangle come near to solves with `a`: tried with one load, smooth
    /// and rough, of which an inexact factor of an ill-conditioned matrix leaves much.
    fn serves(&mut self, a: &Lower) -> bool {
        let load: Vec<f64> = (0..a.size()).map(|i| 1.0 + (i as f64).sin()).collect();
        let mut x = vec![0.0; load.len()];
        self.triangle.forward(&load);
        self.triangle.set_last(&vec![0.0; load.len() - self.solved]);
        self.triangle.backward(&mut x);
        let load = &load[..self.solved];
        let left: f64 = a.multiply(&x).iter().zip(load).map(|(ax, b)| (b - ax).powi(2)).sum();
        left <= LEFT * LEFT * load.iter().map(|b| b * b).sum::<f64>()
    }

    /// The rows in the order of the factor: place → row.
    pub(super) fn order(&self) -> &[i64] {
        // SAFETY: an analysed factor has a permutation of its n rows.
        unsafe { slice::from_raw_parts((*self.factor).Perm.cast::<i64>(), (*self.factor).n) }
    }

    /// Where the entries of L are.
    fn structure(&self) -> Structure {
        // SAFETY: an analysed supernodal factor: CHOLMOD's guide, section "supernodal".
        let (starts, heights, rows) = unsafe {
            let l = &*self.factor;
            let array = |array: *mut c_void, size| slice::from_raw_parts(array.cast::<i64>(), size);
            (array(l.super_, l.nsuper + 1), array(l.pi, l.nsuper + 1), array(l.s, l.ssize))
        };
        let (mut supernodes, mut below) = (Vec::new(), Vec::new());
        for (columns, span) in starts.windows(2).zip(heights.windows(2)) {
            let (first, end) = (columns[0] as usize, self.solved.min(columns[1] as usize));
            if first < end {
                let rows = &rows[span[0] as usize + end - first..span[1] as usize];
                supernodes.push(Supernode { first, columns: end - first, below: rows.len() });
                below.extend(rows.iter().map(|&row| row as u32));
            }
        }
        let order = self.order().iter().map(|&row| row as u32).collect();
        Structure { order, supernodes, rows: below }
    }

    /// The block of L in the rows and columns that are kept, dense by columns.
    fn kept_block(&self) -> Vec<f64> {
        // SAFETY: a factorised supernodal factor: CHOLMOD's guide, section "supernodal".
        unsafe {
            let l = &*self.factor;
            let (first, size) = (self.solved, l.n - self.solved);
            let mut block = vec![0.0; size * size];
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
            block
        }
    }

    /// What solves with L.
    pub(super) fn triangle(&mut self) -> &mut dyn Triangle {
        &mut *self.triangle
    }

    /// The work of a factorisation, in bytes that a solve reads in the same time.
    pub(super) fn work(&self) -> f64 {
        // SAFETY: an analysed supernodal factor tells how many values it will have.
        let entries = unsafe { (*self.factor).xsize };
        FLOP * self.common.fl + ENTRY * entries as f64
    }

    /// Bytes that a solve reads.
    pub(super) fn traffic(&self) -> f64 {
        self.triangle.traffic()
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
            raw::cholmod_l_finish(&mut *self.common);
        }
    }
}

#[cfg(test)]
mod tests;
