//! Preconditioners of our own as a PC type of PETSc (PCRegister, PCSHELL): the Cholesky factor that is kept for later
//! matrices.

use super::{
    Matrix, PetscError, Vector, check,
    error::{NOT_DEFINITE, return_code},
    raw,
};
use std::{
    ffi::{CStr, c_void},
    ptr,
};

/// The name of the PC type: `-elastic_pc_type kept`.
pub(crate) const NAME: &CStr = c"kept";
/// The description that -ksp_view prints.
const DESCRIPTION: &CStr = c"Cholesky factor, kept for later matrices";

/// The preconditioner P that KSP and TAO call through the PC type [`NAME`] during a solve.
pub(crate) trait ShellPreconditioner {
    /// Makes P from a matrix that is new or has new values; false if it is not positive definite.
    fn set_up(&mut self, matrix: &Matrix) -> Result<bool, PetscError>;

    /// `z` ← P⁻¹ `r`.
    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError>;
}

/// The application context of the PC during a call.
pub(super) struct Context<'a> {
    pub(super) preconditioner: &'a mut dyn ShellPreconditioner,
}

impl Context<'_> {
    /// Makes this the context of a PC. A PC of another type ignores it.
    ///
    /// # Safety
    /// The PC is alive, and it is not used after this context is dropped.
    pub(super) unsafe fn set(&mut self, pc: raw::PC) -> Result<(), PetscError> {
        // SAFETY: the caller's promise.
        check(unsafe { raw::PCSetApplicationContext(pc, ptr::from_mut(self).cast::<c_void>()) })
    }

    /// The context of a PC in a call of its functions.
    ///
    /// # Safety
    /// The context of the PC is alive, and there is no other reference to it.
    unsafe fn of<'a>(pc: raw::PC) -> Result<&'a mut Self, PetscError> {
        let mut context: *mut c_void = ptr::null_mut();
        // SAFETY: the caller's promise.
        unsafe {
            check(raw::PCGetApplicationContext(pc, (&raw mut context).cast()))?;
            Ok(&mut *context.cast::<Self>())
        }
    }
}

/// Adds the type to PETSc's list.
pub(super) fn register() -> Result<(), PetscError> {
    // SAFETY: PETSc runs.
    check(unsafe { raw::PCRegister(NAME.as_ptr(), Some(create)) })
}

/// Gives a PC this type: PCSHELL with these functions.
unsafe extern "C" fn create(pc: raw::PC) -> raw::PetscErrorCode {
    let create = || {
        // SAFETY: PETSc passes a live PC.
        unsafe {
            check(raw::PCCreate_Shell(pc))?;
            check(raw::PCShellSetSetUp(pc, Some(set_up)))?;
            check(raw::PCShellSetApply(pc, Some(apply)))?;
            check(raw::PCShellSetName(pc, DESCRIPTION.as_ptr()))
        }
    };
    return_code(create())
}

unsafe extern "C" fn set_up(pc: raw::PC) -> raw::PetscErrorCode {
    let set_up = || {
        let mut matrix = ptr::null_mut();
        // SAFETY: PETSc passes a preconditioner with operators and a context, in a call of ours.
        let (context, matrix) = unsafe {
            check(raw::PCGetOperators(pc, ptr::null_mut(), &mut matrix))?;
            (Context::of(pc)?, Matrix::borrowed(matrix)?)
        };
        let message = || "the matrix is not positive definite".to_owned();
        let indefinite = || PetscError { code: NOT_DEFINITE, message: message() };
        context.preconditioner.set_up(&matrix)?.then_some(()).ok_or_else(indefinite)
    };
    return_code(set_up())
}

unsafe extern "C" fn apply(pc: raw::PC, r: raw::Vec, z: raw::Vec) -> raw::PetscErrorCode {
    let apply = || {
        // SAFETY: PETSc passes two live vectors, in a call of ours.
        let (context, r, mut z) =
            unsafe { (Context::of(pc)?, Vector::borrowed(r)?, Vector::borrowed(z)?) };
        context.preconditioner.apply(&r, &mut z)
    };
    return_code(apply())
}
