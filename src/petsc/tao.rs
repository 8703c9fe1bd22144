//! TAO on a quadratic function with bounds (<https://petsc.org/release/manualpages/Tao/>).

use super::{
    Matrix, PetscError, Session, ShellPreconditioner, Vector, check,
    handle::Handle,
    options::{c_string, set_default_option},
    raw,
    session::world,
    shell,
    vector::same_size,
};
use std::{ffi::c_void, ptr};

/// Minimises ½ xᵀKx − fᵀx over lower ≤ x ≤ upper with one of TAO's methods.
///
/// PETSc options without a prefix reach it: `-tao_type bnls`, `-tao_monitor`, `-ksp_type …`.
pub(crate) struct BoundedQuadratic<P> {
    // Destroyed in this order: the Tao uses the preconditioner.
    tao: Handle<raw::_p_Tao>,
    preconditioner: Option<Box<P>>,
    gradient: Vector,
}

/// What TAO says of a solve; whether it is true is for the KKT residuals to tell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TaoReport {
    /// Outer iterations.
    pub(crate) iterations: usize,
    /// Iterations of the linear solver inside.
    pub(crate) linear_iterations: usize,
    /// Factorisations inside; methods with another preconditioner do none.
    pub(crate) factorisations: usize,
    /// TaoConvergedReason: positive when TAO believes it has converged.
    pub(crate) reason: i32,
}

/// What the callbacks need: ½ xᵀKx − fᵀx.
struct Quadratic {
    k: raw::Mat,
    f: raw::Vec,
}

impl<P: ShellPreconditioner> BoundedQuadratic<P> {
    /// TAO's `method` (`tron`, `bnls`, …) for `size` unknowns on this rank.
    ///
    /// Its Newton systems are solved by Steihaug's conjugate gradients (KSPSTCG), which take the
    /// whole step unless the trust region cuts it, with the preconditioner that `precondition` makes.
    pub(crate) fn new(
        session: &Session,
        method: &str,
        size: usize,
        precondition: impl FnOnce() -> P,
    ) -> Result<Self, PetscError> {
        // tron reads the first prefix, the bounded Newton family (bnls, …) the second.
        for prefix in ["-ksp_", "-tao_bnk_ksp_"] {
            set_default_option(&format!("{prefix}type"), "stcg")?;
            set_default_option(&format!("{prefix}norm_type"), "unpreconditioned")?;
        }
        // Systems of the full size whatever is active, so that a factor fits the next one.
        set_default_option("-tao_subset_type", "mask")?;
        let c_method = c_string(method)?;
        // SAFETY: a fresh handle.
        let create = |handle| unsafe { raw::TaoCreate(world(), handle) };
        let tao = Handle::new(raw::TaoDestroy, create)?;
        // The quasi-Newton Krylov methods' Hessian is an approximation without entries, which
        // nothing can factorise; they bring their own preconditioner.
        let quasi_newton = method.starts_with("bqnk");
        let preconditioner = (!quasi_newton).then(|| Box::new(precondition()));
        let gradient = Vector::zeros(session, size)?;
        let mut this = Self { tao, preconditioner, gradient };
        let tao = this.tao.raw();
        let (mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut());
        // SAFETY: live handles; the preconditioner lives as long as the Tao.
        unsafe {
            check(raw::TaoSetType(tao, c_method.as_ptr()))?;
            check(raw::TaoGetKSP(tao, &mut ksp))?;
            if let (Some(preconditioner), false) = (&mut this.preconditioner, ksp.is_null()) {
                check(raw::KSPGetPC(ksp, &mut pc))?;
                shell::attach(preconditioner, pc)?;
            }
            check(raw::TaoSetMaximumIterations(tao, 200))?;
            check(raw::TaoSetFromOptions(tao))?;
        }
        Ok(this)
    }

    /// Minimises from the start `x` until the gradient is about `limit` in ‖·‖₂, and leaves the
    /// minimiser there; bounds may be ±infinite. That TAO did not converge is no error but a negative
    /// `reason`.
    pub(crate) fn minimise(
        &mut self,
        k: &Matrix,
        f: &Vector,
        [lower, upper]: [&Vector; 2],
        x: &mut Vector,
        limit: f64,
    ) -> Result<TaoReport, PetscError> {
        let own = self.gradient.owned();
        for size in [k.owned(), f.owned(), lower.owned(), upper.owned(), x.owned()] {
            same_size(own, size)?;
        }
        let tao = self.tao.raw();
        let mut quadratic = Quadratic { k: k.raw(), f: f.raw() };
        let context = ptr::from_mut(&mut quadratic).cast::<c_void>();
        let (mut iterations, mut linear, mut reason) = (0, 0, 0);
        let mut ksp = ptr::null_mut();
        let factorisations = || self.preconditioner.as_ref().map_or(0, |p| p.factorisations());
        let before = factorisations();
        let unused = ptr::null_mut();
        // SAFETY: live handles of matching layout; the context outlives the solve, in which
        // alone the callbacks run.
        unsafe {
            check(raw::TaoSetSolution(tao, x.raw()))?;
            check(raw::TaoSetVariableBounds(tao, lower.raw(), upper.raw()))?;
            let gradient = self.gradient.raw();
            check(raw::TaoSetObjectiveAndGradient(tao, gradient, Some(evaluate), context))?;
            check(raw::TaoSetHessian(tao, k.raw(), k.raw(), Some(keep_hessian), unused))?;
            check(raw::TaoSetTolerances(tao, limit, 1e-13, 0.0))?;
            check(raw::TaoGetKSP(tao, &mut ksp))?;
            if !ksp.is_null() {
                check(raw::KSPSetTolerances(ksp, 1e-12, 0.5 * limit, f64::MAX, 200))?;
            }
            check(raw::TaoSolve(tao))?;
            check(raw::TaoGetIterationNumber(tao, &mut iterations))?;
            check(raw::TaoGetConvergedReason(tao, &mut reason))?;
            check(raw::TaoGetLinearSolveIterations(tao, &mut linear))?;
        }
        Ok(TaoReport {
            iterations: iterations as usize,
            linear_iterations: linear as usize,
            factorisations: factorisations() - before,
            reason,
        })
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
    // SAFETY: `minimise` passed a Quadratic that lives during the solve; PETSc passes live vectors.
    unsafe {
        let quadratic = &*context.cast::<Quadratic>();
        let (mut gx, mut fx) = (0.0, 0.0);
        let mut code = raw::MatMult(quadratic.k, x, gradient);
        if code == 0 {
            code = raw::VecAXPY(gradient, -1.0, quadratic.f);
        }
        if code == 0 {
            code = raw::VecDot(gradient, x, &mut gx);
        }
        if code == 0 {
            code = raw::VecDot(quadratic.f, x, &mut fx);
        }
        *value = 0.5 * (gx - fx);
        code
    }
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
