//! TAO on a quadratic function with bounds (<https://petsc.org/release/manualpages/Tao/>).

use super::{
    Matrix, PetscError, Session, Vector, check,
    error::return_code,
    handle::Handle,
    options::{c_string, set_default_option},
    preconditioner::NOT_DEFINITE,
    raw,
    session::world,
    vector::same_size,
};
use std::{ffi::c_void, ptr};

/// Minimises ½ xᵀKx − fᵀx over lower ≤ x ≤ upper with one of TAO's methods.
///
/// PETSc options without a prefix reach it: `-tao_type bnls`, `-tao_monitor`, `-ksp_type …`.
pub(crate) struct BoundedQuadratic {
    tao: Handle<raw::_p_Tao>,
}

/// What TAO says of a solve; whether it is true is for the KKT residuals to tell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TaoReport {
    /// Outer iterations.
    pub(crate) iterations: usize,
    /// Iterations of the linear solver inside.
    pub(crate) linear_iterations: usize,
    /// TaoConvergedReason: positive when TAO believes it has converged.
    pub(crate) reason: i32,
}

/// What TAO's Newton methods call where they would call a preconditioner of PETSc (PCSHELL).
pub(crate) trait ShellPreconditioner {
    /// Sets P up for an `operator` that TAO makes of K, which is new or has new values; false if it is
    /// not positive definite.
    fn set_up(&mut self, k: &Matrix, operator: &Matrix) -> Result<bool, PetscError>;

    /// `z` ← P⁻¹ `r`.
    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError>;
}

/// What the callbacks need, during a call of TAO.
struct Problem<'a, P> {
    k: &'a Matrix,
    f: &'a Vector,
    preconditioner: &'a mut P,
}

impl BoundedQuadratic {
    /// TAO's `method` (`tron`, `bnls`, …) for problems of one size, with preconditioners P.
    ///
    /// Its Newton systems are solved by Steihaug's conjugate gradients (KSPSTCG), which take the
    /// whole step unless the trust region cuts it.
    pub(crate) fn new<P: ShellPreconditioner>(
        _session: &Session,
        method: &str,
    ) -> Result<Self, PetscError> {
        // tron reads the first prefix, the bounded Newton family (bnls, …) the second.
        for prefix in ["-ksp_", "-tao_bnk_ksp_"] {
            set_default_option(&format!("{prefix}type"), "stcg")?;
            set_default_option(&format!("{prefix}norm_type"), "unpreconditioned")?;
        }
        // Systems of the full size whatever is active, so that a factor fits the next one.
        set_default_option("-tao_subset_type", "mask")?;
        let c_method = c_string(method)?;
        // The quasi-Newton Krylov methods' Hessian is an approximation without entries, which
        // nothing can factorise; they bring their own preconditioner.
        let quasi_newton = method.starts_with("bqnk");
        let (mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut());
        // SAFETY: a fresh handle, then live ones; the string lives during the calls.
        unsafe {
            let this = Self {
                tao: Handle::new(raw::TaoDestroy, |handle| raw::TaoCreate(world(), handle))?,
            };
            let tao = this.tao.raw();
            check(raw::TaoSetType(tao, c_method.as_ptr()))?;
            check(raw::TaoGetKSP(tao, &mut ksp))?;
            if !quasi_newton && !ksp.is_null() {
                check(raw::KSPGetPC(ksp, &mut pc))?;
                check(raw::PCSetType(pc, c"shell".as_ptr()))?;
                check(raw::PCShellSetSetUp(pc, Some(set_up::<P>)))?;
                check(raw::PCShellSetApply(pc, Some(apply::<P>)))?;
            }
            check(raw::TaoSetMaximumIterations(tao, 200))?;
            check(raw::TaoSetFromOptions(tao))?;
            Ok(this)
        }
    }

    /// Minimises from the start `x` until the gradient is about `limit` in ‖·‖₂, and leaves the
    /// minimiser there; bounds may be ±infinite. That TAO did not converge is no error but a negative
    /// `reason`.
    pub(crate) fn minimise<P: ShellPreconditioner>(
        &mut self,
        k: &Matrix,
        f: &Vector,
        [lower, upper]: [&Vector; 2],
        x: &mut Vector,
        limit: f64,
        preconditioner: &mut P,
    ) -> Result<TaoReport, PetscError> {
        for size in [k.owned(), f.owned(), lower.owned(), upper.owned()] {
            same_size(x.owned(), size)?;
        }
        // TAO has a vector of its own for the gradient.
        let (tao, own) = (self.tao.raw(), ptr::null_mut());
        let mut problem = Problem { k, f, preconditioner };
        let context = ptr::from_mut(&mut problem).cast::<c_void>();
        let (mut iterations, mut linear, mut reason) = (0, 0, 0);
        let (mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut());
        // SAFETY: live handles of matching layout; the context outlives the solve, in which
        // alone the callbacks run.
        unsafe {
            check(raw::TaoSetSolution(tao, x.raw()))?;
            check(raw::TaoSetVariableBounds(tao, lower.raw(), upper.raw()))?;
            check(raw::TaoSetObjectiveAndGradient(tao, own, Some(evaluate::<P>), context))?;
            check(raw::TaoSetHessian(tao, k.raw(), k.raw(), Some(keep_hessian), context))?;
            check(raw::TaoSetTolerances(tao, limit, 1e-13, 0.0))?;
            check(raw::TaoGetKSP(tao, &mut ksp))?;
            if !ksp.is_null() {
                check(raw::KSPSetTolerances(ksp, 1e-12, 0.5 * limit, f64::MAX, 200))?;
                check(raw::KSPGetPC(ksp, &mut pc))?;
                // Options may have asked for another preconditioner, which ignores this.
                check(raw::PCShellSetContext(pc, context))?;
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
unsafe extern "C" fn evaluate<P>(
    _tao: raw::Tao,
    x: raw::Vec,
    value: *mut f64,
    gradient: raw::Vec,
    context: *mut c_void,
) -> raw::PetscErrorCode {
    let evaluate = || {
        // SAFETY: `minimise` passed a problem that lives during the solve; PETSc passes live vectors.
        let (Problem { k, f, .. }, x, mut gradient) = unsafe {
            (&*context.cast::<Problem<P>>(), Vector::borrowed(x)?, Vector::borrowed(gradient)?)
        };
        k.multiply(&x, &mut gradient)?;
        gradient.axpby(-1.0, f, 1.0)?;
        Ok(0.5 * (gradient.dot(&x)? - f.dot(&x)?))
    };
    // SAFETY: PETSc passes where it wants the value.
    return_code(evaluate().map(|found| unsafe { *value = found }))
}

/// The Hessian is K itself, already in place.
unsafe extern "C" fn keep_hessian(
    _tao: raw::Tao,
    _x: raw::Vec,
    _hessian: raw::Mat,
    _preconditioner: raw::Mat,
    _context: *mut c_void,
) -> raw::PetscErrorCode {
    0
}

/// The problem that `minimise` made the context of `pc`.
///
/// # Safety
/// `pc` is in a solve of `minimise`, and of its preconditioner there is no other reference.
unsafe fn problem<'a, P>(pc: raw::PC) -> Result<&'a mut Problem<'a, P>, PetscError> {
    let mut context: *mut c_void = ptr::null_mut();
    // SAFETY: the caller's promise.
    unsafe {
        check(raw::PCShellGetContext(pc, (&raw mut context).cast()))?;
        Ok(&mut *context.cast::<Problem<P>>())
    }
}

unsafe extern "C" fn set_up<P: ShellPreconditioner>(pc: raw::PC) -> raw::PetscErrorCode {
    let set_up = || {
        let mut matrix = ptr::null_mut();
        // SAFETY: PETSc passes a preconditioner with operators, in a solve.
        let (Problem { k, preconditioner, .. }, operator) = unsafe {
            check(raw::PCGetOperators(pc, ptr::null_mut(), &mut matrix))?;
            (problem::<P>(pc)?, Matrix::borrowed(matrix)?)
        };
        let message = || "the matrix is not positive definite".to_owned();
        let indefinite = || PetscError { code: NOT_DEFINITE, message: message() };
        preconditioner.set_up(k, &operator)?.then_some(()).ok_or_else(indefinite)
    };
    return_code(set_up())
}

unsafe extern "C" fn apply<P: ShellPreconditioner>(
    pc: raw::PC,
    r: raw::Vec,
    z: raw::Vec,
) -> raw::PetscErrorCode {
    let apply = || {
        // SAFETY: PETSc passes two live vectors, in a solve.
        let (problem, r, mut z) =
            unsafe { (problem::<P>(pc)?, Vector::borrowed(r)?, Vector::borrowed(z)?) };
        problem.preconditioner.apply(&r, &mut z)
    };
    return_code(apply())
}
