//! TAO on a quadratic function with bounds.

use super::{
    Matrix, PetscError, Session, Vector, check, raw,
    session::{Live, c_string, world},
    vec::same_size,
};
use std::{ffi::c_void, ptr};

/// Minimises ½ xᵀKx − fᵀx over lower ≤ x ≤ upper with one of TAO's methods.
///
/// PETSc options without a prefix reach it: `-tao_type bnls`, `-tao_monitor`, `-ksp_type …`.
pub struct BoundedQuadratic<'s> {
    session: &'s Session,
    method: String,
}

/// What TAO says of a solve; whether it is true is for the KKT residuals to tell.
#[derive(Debug, Clone, Copy)]
pub struct TaoReport {
    /// Outer iterations.
    pub iterations: usize,
    /// Iterations of the linear solver inside.
    pub linear_iterations: usize,
    /// TaoConvergedReason: positive when TAO believes it has converged.
    pub reason: i32,
}

/// What the callbacks need: ½ xᵀKx − fᵀx.
struct Quadratic {
    k: raw::Mat,
    f: raw::Vec,
}

/// Destroys the Tao at the end of a solve, also on an early return.
struct Handle(raw::Tao, #[allow(dead_code)] Live);

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and not used afterwards.
        unsafe { raw::TaoDestroy(&mut self.0) };
    }
}

impl<'s> BoundedQuadratic<'s> {
    /// TAO's `method` (`tron`, `bnls`, …), its inner linear solver a Cholesky factorisation.
    pub fn new(session: &'s Session, method: &str) -> Result<Self, PetscError> {
        let package = if session.ranks() == 1 { "cholmod" } else { "mumps" };
        // tron reads the first prefix, the bounded Newton family (bnls, …) the second. The
        // factor being exact, Steihaug's CG takes the Newton step unless the trust region cuts it.
        for prefix in ["-ksp_", "-tao_bnk_ksp_"] {
            session.default_option(&format!("{prefix}type"), "stcg")?;
            session.default_option(&format!("{prefix}rtol"), "1e-12")?;
        }
        for prefix in ["-", "-tao_bnk_"] {
            session.default_option(&format!("{prefix}pc_type"), "cholesky")?;
            session.default_option(&format!("{prefix}pc_factor_mat_solver_type"), package)?;
        }
        // The quasi-Newton Krylov methods read the second prefix too, but their Hessian is an
        // approximation without entries, which nothing can factorise.
        if method.starts_with("bqnk") {
            session.default_option("-tao_bnk_pc_type", "lmvm")?;
        }
        Ok(Self { session, method: method.to_owned() })
    }

    /// Minimises from the start `x` and leaves the minimiser there; bounds may be ±infinite.
    ///
    /// # Errors
    /// Sizes differ, the method's name is unknown to PETSc, or PETSc fails. That TAO did not
    /// converge is no error but a negative `reason`.
    pub fn minimise(
        &self,
        k: &Matrix,
        f: &Vector,
        lower: &Vector,
        upper: &Vector,
        x: &mut Vector,
    ) -> Result<TaoReport, PetscError> {
        for size in [f.owned(), lower.owned(), upper.owned(), x.owned()] {
            same_size(k.owned(), size)?;
        }
        let gradient = Vector::zeros(self.session, x.owned())?;
        let mut quadratic = Quadratic { k: k.raw, f: f.raw };
        let context = ptr::from_mut(&mut quadratic).cast::<c_void>();
        let method = c_string(&self.method)?;
        let mut tao = Handle(ptr::null_mut(), Live::new());
        let (mut iterations, mut linear, mut reason) = (0, 0, 0);
        let unused = ptr::null_mut();
        // SAFETY: live handles of matching layout; the context outlives the solve, in which
        // alone the callbacks run.
        unsafe {
            check(raw::TaoCreate(world(), &mut tao.0))?;
            check(raw::TaoSetType(tao.0, method.as_ptr()))?;
            check(raw::TaoSetSolution(tao.0, x.raw))?;
            check(raw::TaoSetVariableBounds(tao.0, lower.raw, upper.raw))?;
            check(raw::TaoSetObjectiveAndGradient(tao.0, gradient.raw, Some(evaluate), context))?;
            check(raw::TaoSetHessian(tao.0, k.raw, k.raw, Some(keep_hessian), unused))?;
            check(raw::TaoSetTolerances(tao.0, 1e-13, 1e-13, 0.0))?;
            check(raw::TaoSetMaximumIterations(tao.0, 200))?;
            check(raw::TaoSetFromOptions(tao.0))?;
            check(raw::TaoSolve(tao.0))?;
            check(raw::TaoGetSolutionStatus(
                tao.0,
                &mut iterations,
                ptr::null_mut(),
                ptr::null_mut(),
                ptr::null_mut(),
                ptr::null_mut(),
                &mut reason,
            ))?;
            check(raw::TaoGetLinearSolveIterations(tao.0, &mut linear))?;
        }
        Ok(TaoReport {
            iterations: iterations as usize,
            linear_iterations: linear as usize,
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
