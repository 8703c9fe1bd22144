//! TAO on a quadratic function with bounds (<https://petsc.org/release/manualpages/Tao/>).

use super::{
    Matrix, PetscError, Session, Vector, check,
    error::return_code,
    handle::Handle,
    options::{c_string, has_option, set_default_option},
    raw,
    session::world,
    shell_preconditioner::{self, Context, ShellPreconditioner},
    vector::same_size,
};
use std::{ffi::c_void, ptr};

/// Minimises ½ xᵀKx − fᵀx over lower ≤ x ≤ upper with one of TAO's methods.
///
/// PETSc options without a prefix reach it: `-tao_type bnls`, `-tao_monitor`, `-ksp_type …`.
pub(crate) struct BoundedQuadratic {
    tao: Handle<raw::_p_Tao>,
}

/// TAO's own report of a solve. The certificate checks the answer by its KKT residuals.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TaoReport {
    /// Outer iterations.
    pub(crate) iterations: usize,
    /// Iterations of the linear solver inside.
    pub(crate) linear_iterations: usize,
    /// TaoConvergedReason: positive if TAO's convergence test was passed.
    pub(crate) reason: i32,
}

/// The context of the callbacks during a solve.
struct Problem<'a> {
    k: &'a Matrix,
    f: &'a Vector,
}

impl BoundedQuadratic {
    /// TAO's `method` (`tron`, `bnls`, …), with the PC type `kept` unless PETSc options choose
    /// another.
    ///
    /// Steihaug's conjugate gradients (KSPSTCG) solve the Newton systems. They take the whole step unless
    /// the trust region cuts it.
    pub(crate) fn new(_session: &Session, method: &str) -> Result<Self, PetscError> {
        // tron reads the first prefix, the bounded Newton family (bnls, …) the second.
        for prefix in ["-ksp_", "-tao_bnk_ksp_"] {
            set_default_option(&format!("{prefix}type"), "stcg")?;
            set_default_option(&format!("{prefix}norm_type"), "unpreconditioned")?;
        }
        // All systems have the full size, whatever the active set, so that a factor can be used again.
        set_default_option("-tao_subset_type", "mask")?;
        let c_method = c_string(method)?;
        let (mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut());
        // SAFETY: a fresh handle, then live ones; the string lives during the calls.
        unsafe {
            let this = Self {
                tao: Handle::new(raw::TaoDestroy, |handle| raw::TaoCreate(world(), handle))?,
            };
            let tao = this.tao.raw();
            check(raw::TaoSetType(tao, c_method.as_ptr()))?;
            check(raw::TaoGetKSP(tao, &mut ksp))?;
            if !ksp.is_null() {
                check(raw::KSPGetPC(ksp, &mut pc))?;
                check(raw::PCSetType(pc, shell_preconditioner::NAME.as_ptr()))?;
            }
            check(raw::TaoSetFromOptions(tao))?;
            Ok(this)
        }
    }

    /// Minimises from the start `x` until ‖gradient‖₂ is about `limit`, with at most `most` iterations, and
    /// replaces `x` by the minimiser. Bounds may be ±∞. If TAO does not converge, `reason` is negative.
    pub(crate) fn minimise(
        &mut self,
        k: &Matrix,
        f: &Vector,
        [lower, upper]: [&Vector; 2],
        x: &mut Vector,
        (limit, most): (f64, usize),
        preconditioner: &mut dyn ShellPreconditioner,
    ) -> Result<TaoReport, PetscError> {
        for size in [k.owned(), f.owned(), lower.owned(), upper.owned()] {
            same_size(x.owned(), size)?;
        }
        // Null: TAO makes the vector for the gradient itself.
        let (tao, own) = (self.tao.raw(), ptr::null_mut());
        let mut context_of_pc = Context { preconditioner };
        let problem = Problem { k, f };
        let context = ptr::from_ref(&problem).cast_mut().cast::<c_void>();
        let (mut iterations, mut linear, mut reason) = (0, 0, 0);
        let hessian = k.assembled()?;
        let (mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut());
        // SAFETY: live handles of matching layout; the callbacks run only during the solve, and their
        // context outlives it.
        unsafe {
            check(raw::TaoSetSolution(tao, x.raw()))?;
            check(raw::TaoSetVariableBounds(tao, lower.raw(), upper.raw()))?;
            check(raw::TaoSetObjectiveAndGradient(tao, own, Some(evaluate), context))?;
            check(raw::TaoSetHessian(tao, hessian, hessian, Some(keep_hessian), context))?;
            check(raw::TaoSetTolerances(tao, limit, 1e-13, 0.0))?;
            if !has_option("-tao_max_it")? {
                check(raw::TaoSetMaximumIterations(tao, most as i32))?;
            }
            check(raw::TaoGetKSP(tao, &mut ksp))?;
            if !ksp.is_null() {
                check(raw::KSPSetTolerances(ksp, 1e-12, 0.5 * limit, f64::MAX, 200))?;
                check(raw::KSPGetPC(ksp, &mut pc))?;
                // A preconditioner of another type, chosen by options, ignores this.
                context_of_pc.set(pc)?;
            }
            check(raw::TaoSolve(tao))?;
            check(raw::TaoGetIterationNumber(tao, &mut iterations))?;
            check(raw::TaoGetConvergedReason(tao, &mut reason))?;
            check(raw::TaoGetLinearSolveIterations(tao, &mut linear))?;
        }
        let (iterations, linear_iterations) = (iterations as usize, linear as usize);
        Ok(TaoReport { iterations, linear_iterations, reason })
    }
}

/// Value ½ xᵀKx − fᵀx and gradient Kx − f; with g the gradient, the value is ½ (g − f)ᵀx.
unsafe extern "C" fn evaluate(
    _tao: raw::Tao,
    x: raw::Vec,
    value: *mut f64,
    gradient: raw::Vec,
    context: *mut c_void,
) -> raw::PetscErrorCode {
    let evaluate = || {
        // SAFETY: `minimise` passed a problem that lives during the solve; PETSc passes live vectors.
        let (Problem { k, f }, x, mut gradient) = unsafe {
            (&*context.cast::<Problem>(), Vector::borrowed(x)?, Vector::borrowed(gradient)?)
        };
        k.multiply(&x, &mut gradient)?;
        gradient.axpby(-1.0, f, 1.0)?;
        Ok(0.5 * (gradient.dot(&x)? - f.dot(&x)?))
    };
    // SAFETY: PETSc passes a valid pointer for the value.
    return_code(evaluate().map(|found| unsafe { *value = found }))
}

/// The Hessian is K and does not change.
unsafe extern "C" fn keep_hessian(
    _tao: raw::Tao,
    _x: raw::Vec,
    _hessian: raw::Mat,
    _preconditioner: raw::Mat,
    _context: *mut c_void,
) -> raw::PetscErrorCode {
    0
}
