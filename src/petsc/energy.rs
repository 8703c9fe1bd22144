//! Conjugate gradients for operators that are functions (KSP, MATSHELL).

use super::{
    PetscError, Session, Vector, check,
    error::return_code,
    handle::Handle,
    kept,
    kept::{Context, KeptPreconditioner},
    raw,
    session::world,
    vector::index,
};
use std::{
    ffi::{c_int, c_void},
    mem::transmute,
    ptr,
};

/// A symmetric positive definite operator A, its preconditioner P and a convergence test.
pub(crate) trait Operator {
    /// `y` ← A `x`, owned entries.
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError>;

    /// `z` ← P⁻¹ `r`, owned entries.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<(), PetscError>;

    /// Whether x is accurate enough. `gained` is its energy xᵀAx; `left` is rᵀP⁻¹r, about the energy that is
    /// missing.
    fn is_enough(&self, gained: f64, left: f64) -> bool;
}

/// Solves A x = `b` from 0 by conjugate gradients (KSPCG) with the natural norm √(rᵀP⁻¹r) and at most `most`
/// iterations. PETSc options begin with `estimate_`. `None` if A or P is not positive definite. Collective.
pub(crate) fn solve_by_energy(
    session: &Session,
    operator: &mut dyn Operator,
    b: &[f64],
    most: usize,
) -> Result<Option<Vec<f64>>, PetscError> {
    let local = index(b.len())?;
    let mut rhs = Vector::zeros(session, b.len())?;
    rhs.set(b)?;
    let x = Vector::zeros(session, b.len())?;
    let mut call = Call { operator, b: &rhs };
    let pointer = ptr::from_mut(&mut call).cast::<c_void>();
    let mut kept = Preconditioned { call: pointer };
    let mut context = Context { preconditioner: &mut kept };
    let mut reason = 0;
    // SAFETY: fresh handles, then live ones of one layout; the callbacks run only during the solve, one at a
    // time, and their contexts outlive it.
    unsafe {
        let matrix = Handle::new(raw::MatDestroy, |matrix| {
            raw::MatCreateShell(world(), local, local, -1, -1, pointer, matrix)
        })?;
        // PETSc casts every operation to a function without arguments.
        type Multiply = unsafe extern "C" fn(raw::Mat, raw::Vec, raw::Vec) -> raw::PetscErrorCode;
        let operation = transmute::<Multiply, unsafe extern "C" fn()>(multiply);
        check(raw::MatShellSetOperation(
            matrix.raw(),
            raw::MatOperation::MATOP_MULT,
            Some(operation),
        ))?;
        let ksp = Handle::new(raw::KSPDestroy, |ksp| raw::KSPCreate(world(), ksp))?;
        let mut pc = ptr::null_mut();
        check(raw::KSPSetOptionsPrefix(ksp.raw(), c"estimate_".as_ptr()))?;
        check(raw::KSPSetType(ksp.raw(), c"cg".as_ptr()))?;
        check(raw::KSPSetNormType(ksp.raw(), raw::KSPNormType::KSP_NORM_NATURAL))?;
        check(raw::KSPGetPC(ksp.raw(), &mut pc))?;
        check(raw::PCSetType(pc, kept::NAME.as_ptr()))?;
        check(raw::KSPSetFromOptions(ksp.raw()))?;
        check(raw::KSPSetOperators(ksp.raw(), matrix.raw(), matrix.raw()))?;
        context.set(pc)?;
        check(raw::KSPSetTolerances(ksp.raw(), 0.0, 0.0, f64::MAX, most as c_int))?;
        check(raw::KSPSetConvergenceTest(ksp.raw(), Some(is_enough), pointer, None))?;
        check(raw::KSPSolve(ksp.raw(), rhs.raw(), x.raw()))?;
        check(raw::KSPGetConvergedReason(ksp.raw(), &mut reason))?;
    }
    let definite = reason > 0 || reason == raw::KSPConvergedReason::KSP_DIVERGED_ITS;
    let x = x.read(<[f64]>::to_vec)?;
    Ok(definite.then_some(x))
}

/// The context of the callbacks during a solve.
struct Call<'a> {
    operator: &'a mut dyn Operator,
    b: &'a Vector,
}

/// P of a call, as the PC type [`kept::NAME`] needs it.
struct Preconditioned {
    call: *mut c_void,
}

impl KeptPreconditioner for Preconditioned {
    fn set_up(&mut self, _matrix: &super::Matrix) -> Result<bool, PetscError> {
        Ok(true)
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        // SAFETY: the call lives during the solve, and no other callback is running.
        let call = unsafe { &mut *self.call.cast::<Call>() };
        r.read(|r| z.write(|z| call.operator.precondition(r, z)))??
    }
}

unsafe extern "C" fn multiply(matrix: raw::Mat, x: raw::Vec, y: raw::Vec) -> raw::PetscErrorCode {
    let multiply = || {
        let mut context: *mut c_void = ptr::null_mut();
        // SAFETY: the context is a call that lives during the solve; PETSc passes two live vectors.
        let (call, x, mut y) = unsafe {
            check(raw::MatShellGetContext(matrix, (&raw mut context).cast()))?;
            (&mut *context.cast::<Call>(), Vector::borrowed(x)?, Vector::borrowed(y)?)
        };
        x.read(|x| y.write(|y| call.operator.multiply(x, y)))??
    };
    return_code(multiply())
}

unsafe extern "C" fn is_enough(
    ksp: raw::KSP,
    _iteration: c_int,
    norm: f64,
    reason: *mut raw::KSPConvergedReason::Type,
    context: *mut c_void,
) -> raw::PetscErrorCode {
    let test = || {
        let mut x = ptr::null_mut();
        // SAFETY: a KSP that is solving, which lends its x; the context is a call that lives during the solve.
        let (call, x) = unsafe {
            check(raw::KSPBuildSolution(ksp, ptr::null_mut(), &mut x))?;
            (&*context.cast::<Call>(), Vector::borrowed(x)?)
        };
        // The residual is orthogonal to x.
        let gained = call.b.dot(&x)?;
        Ok(match call.operator.is_enough(gained, norm * norm) {
            true => raw::KSPConvergedReason::KSP_CONVERGED_ATOL,
            false => raw::KSPConvergedReason::KSP_CONVERGED_ITERATING,
        })
    };
    // SAFETY: PETSc passes a valid pointer for the reason.
    return_code(test().map(|found| unsafe { *reason = found }))
}
