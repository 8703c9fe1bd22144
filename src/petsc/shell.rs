//! A preconditioner of ours inside one of PETSc's solvers
//! (<https://petsc.org/release/manualpages/PC/PCSHELL/>).

use super::{Matrix, PetscError, Vector, check, preconditioner::NOT_DEFINITE, raw};
use std::{ffi::c_void, ptr};

/// What PETSc's solvers call where they would call a preconditioner of their own.
pub(crate) trait ShellPreconditioner {
    /// The operator is now `matrix`, or has other values; false if it is not positive definite.
    fn set_up(&mut self, matrix: &Matrix) -> Result<bool, PetscError>;

    /// `z` ← P⁻¹ `r`.
    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError>;

    /// Factorisations made so far.
    fn factorisations(&self) -> usize;
}

/// Makes `pc` apply `shell`, of which PETSc keeps the address (PCShellSetContext).
///
/// # Safety
/// `pc` is a live handle that is not used after `shell` is dropped.
pub(super) unsafe fn attach<P: ShellPreconditioner>(
    shell: &mut Box<P>,
    pc: raw::PC,
) -> Result<(), PetscError> {
    // SAFETY: the caller's promise; a box does not move what it owns.
    unsafe {
        check(raw::PCSetType(pc, c"shell".as_ptr()))?;
        check(raw::PCShellSetContext(pc, (&raw mut **shell).cast()))?;
        check(raw::PCShellSetSetUp(pc, Some(set_up::<P>)))?;
        check(raw::PCShellSetApply(pc, Some(apply::<P>)))
    }
}

/// The preconditioner that `attach` made the context of `pc`.
unsafe fn context<'a, P>(pc: raw::PC) -> Result<&'a mut P, PetscError> {
    let mut context: *mut c_void = ptr::null_mut();
    // SAFETY: `attach` set it to a P that lives as long as `pc` is used.
    unsafe {
        check(raw::PCShellGetContext(pc, (&raw mut context).cast()))?;
        Ok(&mut *context.cast::<P>())
    }
}

unsafe extern "C" fn set_up<P: ShellPreconditioner>(pc: raw::PC) -> raw::PetscErrorCode {
    let set_up = || {
        let mut matrix = ptr::null_mut();
        // SAFETY: PETSc passes the preconditioner this was attached to, with operators.
        let (shell, matrix) = unsafe {
            check(raw::PCGetOperators(pc, ptr::null_mut(), &mut matrix))?;
            (context::<P>(pc)?, Matrix::shared(matrix)?)
        };
        match shell.set_up(&matrix)? {
            true => Ok(()),
            false => Err(PetscError {
                code: NOT_DEFINITE,
                message: "the matrix is not positive definite".to_owned(),
            }),
        }
    };
    set_up().map_or_else(PetscError::into_code, |()| 0)
}

unsafe extern "C" fn apply<P: ShellPreconditioner>(
    pc: raw::PC,
    r: raw::Vec,
    z: raw::Vec,
) -> raw::PetscErrorCode {
    let apply = || {
        // SAFETY: PETSc passes the preconditioner this was attached to and two live vectors.
        let (shell, r, mut z) =
            unsafe { (context::<P>(pc)?, Vector::shared(r)?, Vector::shared(z)?) };
        shell.apply(&r, &mut z)
    };
    apply().map_or_else(PetscError::into_code, |()| 0)
}
