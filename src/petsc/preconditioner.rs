//! PETSc's own preconditioners (<https://petsc.org/release/manualpages/PC/>).

use super::{
    Matrix, PetscError, Vector, check, handle::Handle, options::c_string, raw, session::world,
};
use std::{
    ffi::{CStr, c_int},
    ptr,
};

/// PETSC_ERR_MAT_CH_ZRPVT: a pivot of a Cholesky factorisation is not positive.
pub(super) const NOT_DEFINITE: i32 = 81;

/// A PC of PETSc.
pub(crate) struct Preconditioner {
    handle: Handle<raw::_p_PC>,
}

impl Preconditioner {
    /// Of the type `kind` (PCCHOLESKY, with factors by `package`, or PCGAMG), unless options that
    /// begin with `prefix` ask for another (`-elastic_pc_type …`).
    pub(crate) fn new(prefix: &str, kind: &CStr, package: &CStr) -> Result<Self, PetscError> {
        let prefix = c_string(prefix)?;
        // SAFETY: a fresh handle, strings that live during the calls.
        unsafe {
            let handle = Handle::new(raw::PCDestroy, |handle| raw::PCCreate(world(), handle))?;
            check(raw::PCSetOptionsPrefix(handle.raw(), prefix.as_ptr()))?;
            check(raw::PCSetType(handle.raw(), kind.as_ptr()))?;
            check(raw::PCFactorSetMatSolverType(handle.raw(), package.as_ptr()))?;
            check(raw::PCSetFromOptions(handle.raw()))?;
            Ok(Self { handle })
        }
    }

    /// Makes the preconditioner of `matrix` (PCSetUp), which keeps a reference to the matrix but not
    /// to its values; false if it found that the matrix is not positive definite.
    pub(crate) fn set_up(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let pc = self.handle.raw();
        // SAFETY: live handles. Without PCSetReusePreconditioner the next application would
        // factorise again when the values of the matrix have changed.
        unsafe {
            check(raw::PCSetReusePreconditioner(pc, raw::PetscBool::PETSC_FALSE))?;
            check(raw::PCSetOperators(pc, matrix.raw(), matrix.raw()))?;
            match check(raw::PCSetUp(pc)) {
                Err(error) if error.code == NOT_DEFINITE => return Ok(false),
                set_up => set_up?,
            }
            check(raw::PCSetReusePreconditioner(pc, raw::PetscBool::PETSC_TRUE))?;
        }
        self.is_definite()
    }

    /// Whether the factorisation found only positive pivots, as far as the package tells.
    fn is_definite(&self) -> Result<bool, PetscError> {
        /// Where MUMPS counts negative pivots, INFOG(12): it makes LDLᵀ and does not mind them.
        const NEGATIVE_PIVOTS: c_int = 12;
        let pc = self.handle.raw();
        let mut reason = raw::PCFailedReason::PC_NOERROR;
        let (mut factor, mut package, mut negative) = (ptr::null_mut(), ptr::null(), 0);
        // SAFETY: a live handle; the package's name is a constant of PETSc.
        unsafe {
            check(raw::PCGetFailedReason(pc, &mut reason))?;
            if reason != raw::PCFailedReason::PC_NOERROR {
                return Ok(false);
            }
            // Other preconditioners than factors leave the name null.
            check(raw::PCFactorGetMatSolverType(pc, &mut package))?;
            if !package.is_null() && CStr::from_ptr(package) == c"mumps" {
                check(raw::PCFactorGetMatrix(pc, &mut factor))?;
                check(raw::MatMumpsGetInfog(factor, NEGATIVE_PIVOTS, &mut negative))?;
            }
        }
        Ok(negative == 0)
    }

    /// `z` ← P⁻¹ `r` (PCApply).
    pub(crate) fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        // SAFETY: live handles, distinct by borrowing; PETSc compares their sizes.
        check(unsafe { raw::PCApply(self.handle.raw(), r.raw(), z.raw()) })
    }
}
