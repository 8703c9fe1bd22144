//! CHOLMOD's Cholesky factors of matrices that one rank has (Chen, Davis, Hager and Rajamanickam,
//! ACM Trans. Math. Softw. 35, 2008; names as in its user guide).

use super::{
    LowerTriangle, TriangularSolver, raw,
    supernodal::{Structure, Supernodal, Supernode},
};
use crate::petsc::PetscError;
use nalgebra::DMatrix;
use std::{ffi::c_void, ptr, slice};

/// The factor P A Pᵀ = L Lᵀ of a sparse symmetric positive definite matrix, supernodal.
///
/// CHOLMOD orders and factorises. The triangular solves are our own: they read L twice as fast, in
/// half the bytes where single precision is enough, and the forward and the backward solve are apart,
/// which the Schur complement of an interface needs.
pub struct Cholesky {
    common: Box<raw::cholmod_common>,
    factor: *mut raw::cholmod_factor,
    precision: Precision,
    /// The number of interior rows, the first in the order of L.
    interior: usize,
    solver: Box<dyn TriangularSolver>,
}

/// Digits of the entries of L.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Seven (`f32`) if that makes a good preconditioner, else sixteen.
    Preconditioner,
    /// Sixteen (`f64`).
    Full,
}

/// The largest residual ‖b − A x‖₂/‖b‖₂ of a solve in single precision for which the factor is kept
/// in that precision: each iteration then gains a digit or more. With 3e-3 (the unit square, n = 256)
/// they were no more than in double precision.
const LARGEST_RESIDUAL: f64 = 1e-1;

/// Bytes that a solve reads in the time of one floating-point operation of a factorisation, and of the
/// work per entry of L that is none (assembly, copies). Seconds of a factorisation were
/// 0.065 ns · operations + 16.5 ns · entries within 10 % (square and L, 4,000 to 530,000 unknowns, one
/// core of a Xeon with AVX-512, OpenBLAS), those of an iteration 0.06 to 0.13 ns per byte.
const BYTES_PER_OPERATION: f64 = 0.8;
const BYTES_PER_ENTRY: f64 = 200.0;

/// The arrays of a supernodal `cholmod_factor`; the supernode s has the columns
/// `starts[s]..starts[s + 1]`.
struct FactorArrays<'a> {
    starts: &'a [i64],
    /// Where the rows of each supernode begin in `rows`.
    row_starts: &'a [i64],
    /// Where the values of each supernode begin.
    value_starts: &'a [i64],
    rows: &'a [i64],
}

impl Cholesky {
    /// Orders and analyses `a`: in the `order` given (the row of A of each row of L), else by CHOLMOD's
    /// choice. The last `interface` rows, also the last in the order, are not solved for.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn analyse(
        a: &mut LowerTriangle,
        order: Option<Vec<i64>>,
        interface: usize,
        precision: Precision,
    ) -> Result<Self, PetscError> {
        // SAFETY: plain data that cholmod_l_start fills.
        let common = unsafe { Box::new(std::mem::zeroed::<raw::cholmod_common>()) };
        let nothing = Structure { order: Vec::new(), supernodes: Vec::new(), rows: Vec::new() };
        let solver = Box::new(Supernodal::<f64>::new(nothing));
        let (factor, interior) = (ptr::null_mut(), a.size() - interface);
        let mut this = Self { common, factor, precision, interior, solver };
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
        this.new_solver();
        Ok(this)
    }

    /// Factorises `a`, which has the pattern that was analysed: L₂₂, the block of the interface rows,
    /// with L₂₂ L₂₂ᵀ = A₂₂ − A₂₁ A₁₁⁻¹ A₁₂. `None` if `a` is not positive definite.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn factorise(&mut self, a: &mut LowerTriangle) -> Result<Option<DMatrix<f64>>, PetscError> {
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
        let interface_block = self.interface_block();
        self.copy_values();
        if self.precision == Precision::Preconditioner && !self.is_accurate_enough(a) {
            self.precision = Precision::Full;
            self.new_solver();
            self.copy_values();
        }
        let pattern = raw::CHOLMOD_PATTERN as i32;
        // SAFETY: live handles; frees the values, keeps the analysis.
        let freed = unsafe {
            raw::cholmod_l_change_factor(pattern, 1, 1, 1, 1, self.factor, &mut *self.common)
        };
        if freed == 0 { Err(self.failure()) } else { Ok(Some(interface_block)) }
    }

    fn new_solver(&mut self) {
        let structure = self.structure();
        self.solver = match self.precision {
            Precision::Preconditioner => Box::new(Supernodal::<f32>::new(structure)),
            Precision::Full => Box::new(Supernodal::<f64>::new(structure)),
        };
    }

    /// Copies the values of L into the triangular solver.
    fn copy_values(&mut self) {
        // SAFETY: the factor is ours, and the solver does not refer to it.
        let values = unsafe { values(self.factor) };
        self.solver.set_values(values);
    }

    /// Whether solves come near to those with `a`: tried with a load both smooth and rough, of which an
    /// inexact factor of an ill-conditioned matrix leaves much.
    fn is_accurate_enough(&mut self, a: &LowerTriangle) -> bool {
        let load: Vec<f64> = (0..a.size()).map(|i| 1.0 + (i as f64).sin()).collect();
        let mut x = vec![0.0; load.len()];
        self.solver.forward(&load);
        self.solver.set_interface(&vec![0.0; load.len() - self.interior]);
        self.solver.backward(&mut x);
        let load = &load[..self.interior];
        let left: f64 = a.multiply(&x).iter().zip(load).map(|(ax, b)| (b - ax).powi(2)).sum();
        left <= LARGEST_RESIDUAL * LARGEST_RESIDUAL * load.iter().map(|b| b * b).sum::<f64>()
    }

    /// P: the row of A of each row of L.
    pub fn order(&self) -> &[i64] {
        // SAFETY: an analysed factor has a permutation of its n rows.
        unsafe { slice::from_raw_parts((*self.factor).Perm.cast::<i64>(), (*self.factor).n) }
    }

    fn arrays(&self) -> FactorArrays<'_> {
        // SAFETY: an analysed supernodal factor has these arrays of 64-bit indices.
        unsafe {
            let l = &*self.factor;
            let array = |array: *mut c_void, size| slice::from_raw_parts(array.cast::<i64>(), size);
            FactorArrays {
                starts: array(l.super_, l.nsuper + 1),
                row_starts: array(l.pi, l.nsuper + 1),
                value_starts: array(l.px, l.nsuper + 1),
                rows: array(l.s, l.ssize),
            }
        }
    }

    /// Where the entries of L₁₁ and L₂₁ are.
    fn structure(&self) -> Structure {
        let arrays = self.arrays();
        let (mut supernodes, mut below) = (Vec::new(), Vec::new());
        for (columns, span) in arrays.starts.windows(2).zip(arrays.row_starts.windows(2)) {
            let (first, end) = (columns[0] as usize, self.interior.min(columns[1] as usize));
            if first < end {
                let rows = &arrays.rows[span[0] as usize + end - first..span[1] as usize];
                supernodes.push(Supernode { first, columns: end - first, below: rows.len() });
                below.extend(rows.iter().map(|&row| row as u32));
            }
        }
        let order = self.order().iter().map(|&row| row as u32).collect();
        Structure { order, supernodes, rows: below }
    }

    /// L₂₂ of a factor that has values.
    fn interface_block(&self) -> DMatrix<f64> {
        let (arrays, first) = (self.arrays(), self.interior);
        // SAFETY: the factor lives as long as `self`.
        let values = unsafe { values(self.factor) };
        let size = self.order().len() - first;
        let mut block = DMatrix::zeros(size, size);
        for (s, columns) in arrays.starts.windows(2).enumerate() {
            let (start, end) = (columns[0] as usize, columns[1] as usize);
            let rows =
                &arrays.rows[arrays.row_starts[s] as usize..arrays.row_starts[s + 1] as usize];
            for column in start.max(first)..end {
                let values =
                    &values[arrays.value_starts[s] as usize + (column - start) * rows.len()..];
                for (&row, value) in rows.iter().zip(values).skip(column - start) {
                    block[(row as usize - first, column - first)] = *value;
                }
            }
        }
        block
    }

    /// The triangular solves with L₁₁ and L₂₁.
    pub fn solver(&mut self) -> &mut dyn TriangularSolver {
        &mut *self.solver
    }

    /// The work of a factorisation, in bytes that a solve reads in the same time.
    pub(super) fn work(&self) -> f64 {
        // SAFETY: an analysed supernodal factor tells how many values it will have.
        let entries = unsafe { (*self.factor).xsize };
        BYTES_PER_OPERATION * self.common.fl + BYTES_PER_ENTRY * entries as f64
    }

    /// Bytes that a forward and a backward solve read.
    pub fn bytes(&self) -> f64 {
        self.solver.bytes()
    }

    fn failure(&self) -> PetscError {
        PetscError::ours(match self.common.status {
            raw::CHOLMOD_OUT_OF_MEMORY => "not enough memory for a Cholesky factor".to_owned(),
            status => format!("CHOLMOD failed with status {status}"),
        })
    }
}

/// The values of a factorised supernodal factor.
///
/// # Safety
/// `factor` is such a factor and keeps its values while they are used.
unsafe fn values<'a>(factor: *const raw::cholmod_factor) -> &'a [f64] {
    // SAFETY: the caller's promise.
    unsafe { slice::from_raw_parts((*factor).x.cast::<f64>(), (*factor).xsize) }
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
