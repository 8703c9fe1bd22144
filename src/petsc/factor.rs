//! A factorisation that outlives the matrix values it was made from.

use super::{
    Matrix, PetscError, Session, Vector, check,
    mat::entries,
    raw,
    session::{Live, c_string, world},
    vec::same_size,
};
use std::ptr;

/// A Cholesky factor (PCCHOLESKY): CHOLMOD's on one rank, MUMPS' on several.
///
/// Fill-reducing ordering and symbolic factorisation are done once, with the first values.
pub struct Factor {
    raw: raw::PC,
    /// Entries of the triangle, where its package tells.
    entries: f64,
    _live: Live,
}

impl Factor {
    /// A factor whose PETSc options carry `prefix` (`-elastic_pc_type …`).
    pub fn new(session: &Session, prefix: &str) -> Result<Self, PetscError> {
        cholesky_options(session, prefix)?;
        let mut factor = Self { raw: ptr::null_mut(), entries: 0.0, _live: Live::new() };
        let prefix = c_string(prefix)?;
        let package = if session.ranks() == 1 { c"cholmod" } else { c"mumps" };
        // SAFETY: a fresh handle, strings that live during the calls.
        unsafe {
            check(raw::PCCreate(world(), &mut factor.raw))?;
            check(raw::PCSetOptionsPrefix(factor.raw, prefix.as_ptr()))?;
            check(raw::PCSetType(factor.raw, c"cholesky".as_ptr()))?;
            check(raw::PCFactorSetMatSolverType(factor.raw, package.as_ptr()))?;
            check(raw::PCSetFromOptions(factor.raw))?;
        }
        Ok(factor)
    }

    /// Factorises the present values of `matrix`; false if it is not positive definite.
    pub fn factorise(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        // SAFETY: a live handle.
        definite(unsafe { self.factorise_raw(matrix.raw, false) })
    }

    /// As `factorise`; a matrix of another `pattern` than the last needs a new ordering.
    ///
    /// # Safety
    /// `matrix` is a live handle.
    pub(super) unsafe fn factorise_raw(
        &mut self,
        matrix: raw::Mat,
        pattern: bool,
    ) -> Result<(), PetscError> {
        // SAFETY: live handles; PETSc keeps a reference to the matrix. Without the last call it
        // would factorise again when that matrix changes.
        unsafe {
            if pattern {
                check(raw::PCReset(self.raw))?;
            }
            check(raw::PCSetReusePreconditioner(self.raw, raw::PetscBool::PETSC_FALSE))?;
            check(raw::PCSetOperators(self.raw, matrix, matrix))?;
            check(raw::PCSetUp(self.raw))?;
            check(raw::PCSetReusePreconditioner(self.raw, raw::PetscBool::PETSC_TRUE))?;
            // A preconditioner that PETSc options put in its place has no triangle.
            let mut triangle = ptr::null_mut();
            self.entries = match check(raw::PCFactorGetMatrix(self.raw, &mut triangle)) {
                Ok(()) => entries(triangle),
                Err(_) => 0.0,
            };
        }
        Ok(())
    }

    /// Bytes of values that a pair of triangular solves reads on this rank; 0 where unknown.
    pub fn traffic(&self) -> f64 {
        2.0 * 8.0 * self.entries
    }

    /// `z` ← the factored matrix' inverse · `r`.
    pub fn apply(&self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        same_size(r.owned(), z.owned())?;
        // SAFETY: live handles of matching layout, distinct by borrowing.
        unsafe { self.apply_raw(r.raw, z.raw) }
    }

    /// # Safety
    /// Live handles of the factored matrix' layout.
    pub(super) unsafe fn apply_raw(&self, r: raw::Vec, z: raw::Vec) -> Result<(), PetscError> {
        // SAFETY: the caller's promise.
        check(unsafe { raw::PCApply(self.raw, r, z) })
    }
}

/// Left to itself CHOLMOD makes LDLᵀ of a small matrix, accepts negative pivots, and prints its
/// warnings into the results.
pub(super) fn cholesky_options(session: &Session, prefix: &str) -> Result<(), PetscError> {
    for (option, value) in [("final_asis", "0"), ("final_ll", "1"), ("print", "0")] {
        session.default_option(&format!("-{prefix}mat_cholmod_{option}"), value)?;
    }
    Ok(())
}

/// Tells a matrix that is not positive definite from other failures of its factorisation.
pub(super) fn definite(factorised: Result<(), PetscError>) -> Result<bool, PetscError> {
    /// PETSC_ERR_MAT_CH_ZRPVT: a pivot of the Cholesky factorisation is not positive.
    const NOT_DEFINITE: i32 = 81;
    match factorised {
        Ok(()) => Ok(true),
        Err(error) if error.code == NOT_DEFINITE => Ok(false),
        Err(other) => Err(other),
    }
}

impl Drop for Factor {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and not used afterwards.
        unsafe { raw::PCDestroy(&mut self.raw) };
    }
}
