//! A kept factor as the preconditioner inside one of PETSc's own solvers.

use super::{Factor, PetscError, Refactorisation, check, factor::NOT_DEFINITE, raw};
use std::ffi::c_void;

/// A PCSHELL that factorises the operators it is given: all of them, or only when a new
/// factor is due.
pub(super) struct KeptFactor {
    factor: Factor,
    policy: Option<Refactorisation>,
    /// Rows of the factored matrix.
    size: i32,
    /// Applications since the operators last changed.
    applications: usize,
    /// All factorisations so far.
    pub(super) factorisations: usize,
}

impl KeptFactor {
    /// Factorises every matrix, or only when `policy` finds it due. In a box, because PETSc keeps
    /// its address.
    pub(super) fn new(factor: Factor, policy: Option<Refactorisation>) -> Box<Self> {
        Box::new(Self { factor, policy, size: 0, applications: 0, factorisations: 0 })
    }

    /// Makes `pc` apply this factor.
    ///
    /// # Safety
    /// `pc` is a live handle that must not be used after this box is dropped.
    pub(super) unsafe fn attach(self: &mut Box<Self>, pc: raw::PC) -> Result<(), PetscError> {
        // SAFETY: the caller keeps the promise above.
        unsafe {
            check(raw::PCSetType(pc, c"shell".as_ptr()))?;
            check(raw::PCShellSetContext(pc, (&raw mut **self).cast()))?;
            check(raw::PCShellSetSetUp(pc, Some(set_up)))?;
            check(raw::PCShellSetApply(pc, Some(apply)))
        }
    }

    /// New operators: whether the factor still serves is judged by the iterations it has cost.
    unsafe fn set_up(&mut self, pc: raw::PC) -> Result<(), PetscError> {
        let (mut matrix, mut size) = (std::ptr::null_mut(), 0);
        // SAFETY: PETSc calls with a live preconditioner that has operators.
        unsafe {
            check(raw::PCGetOperators(pc, std::ptr::null_mut(), &mut matrix))?;
            check(raw::MatGetSize(matrix, &mut size, std::ptr::null_mut()))?;
        }
        let applications = std::mem::take(&mut self.applications);
        if let Some(policy) = &mut self.policy {
            policy.solved(applications);
            if size == self.size && !policy.due() {
                return Ok(());
            }
        }
        // SAFETY: a live matrix.
        if !unsafe { self.factor.factorise_raw(matrix, size != self.size)? } {
            self.policy = self.policy.is_some().then(Refactorisation::default);
            let message = "the matrix is not positive definite".to_owned();
            return Err(PetscError { code: NOT_DEFINITE, message });
        }
        self.size = size;
        self.factorisations += 1;
        if let Some(policy) = &mut self.policy {
            policy.done(self.factor.cost());
        }
        Ok(())
    }
}

/// The context PETSc keeps for `pc`.
unsafe fn context<'a>(pc: raw::PC) -> Result<&'a mut KeptFactor, PetscError> {
    let mut context: *mut c_void = std::ptr::null_mut();
    // SAFETY: `attach` set it to a KeptFactor that lives as long as `pc` is used.
    unsafe {
        check(raw::PCShellGetContext(pc, (&raw mut context).cast()))?;
        Ok(&mut *context.cast::<KeptFactor>())
    }
}

unsafe extern "C" fn set_up(pc: raw::PC) -> raw::PetscErrorCode {
    // SAFETY: PETSc passes the preconditioner this was attached to.
    match unsafe { context(pc).and_then(|kept| kept.set_up(pc)) } {
        Ok(()) => 0,
        Err(error) => error.pass_on(),
    }
}

unsafe extern "C" fn apply(pc: raw::PC, r: raw::Vec, z: raw::Vec) -> raw::PetscErrorCode {
    // SAFETY: PETSc passes the preconditioner this was attached to and live vectors.
    let applied =
        unsafe { context(pc).and_then(|kept| kept.factor.apply_raw(r, z).map(|()| kept)) };
    match applied {
        Ok(kept) => {
            kept.applications += 1;
            0
        }
        Err(error) => error.pass_on(),
    }
}
