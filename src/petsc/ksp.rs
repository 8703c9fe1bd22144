//! PETSc's Krylov solvers and preconditioners (<https://petsc.org/release/manualpages/KSP/>).

use super::{
    Matrix, PetscError, Session, Vector, check,
    error::return_code,
    handle::Handle,
    kept,
    kept::{Context, KeptPreconditioner},
    options::c_string,
    raw,
    session::world,
};
use std::{
    ffi::{CStr, c_int, c_void},
    ptr,
};

/// PETSC_ERR_MAT_CH_ZRPVT: a pivot of a Cholesky factorisation is not positive.
pub(super) const NOT_DEFINITE: i32 = 81;

/// A KSP, conjugate gradients unless PETSc options with its prefix choose another type, with the
/// preconditioner of type [`kept::NAME`] unless they choose one of PETSc's.
///
/// The norm of the residual is that of the free unknowns. It is taken in the convergence test, so that
/// `-ksp_norm_type` only changes what monitors print.
pub(crate) struct Ksp {
    handle: Handle<raw::_p_KSP>,
    /// The residual of the last test, and a vector that PETSc may need to build it.
    residual: Vector,
    work: Vector,
    /// Iterations that PETSc and its options allow (`-ksp_max_it`).
    most: c_int,
}

/// A linear system as a KSP solves it from the start 0: A x = b on the unknowns that are not prescribed.
pub(crate) struct KspProblem<'a> {
    /// A, of which PETSc's own preconditioners are made.
    pub(crate) matrix: &'a Matrix,
    /// Owned unknowns that stay 0, because the preconditioner's answer is 0 there or because A has no
    /// other entry in their rows and columns than the diagonal, and b is 0; `None` where no rank has any.
    pub(crate) prescribed: Option<&'a [usize]>,
    /// The largest ‖b − A x‖₂ of the free unknowns.
    pub(crate) limit: f64,
    /// Iterations allowed; `None` as many as PETSc and its options allow.
    pub(crate) most: Option<usize>,
}

/// What a solve took.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KspReport {
    /// Iterations.
    pub(crate) iterations: usize,
    /// ‖b − A x‖₂ of the free unknowns.
    pub(crate) norm: f64,
}

/// What the convergence test needs during a solve.
struct Test<'a> {
    problem: &'a KspProblem<'a>,
    residual: &'a mut Vector,
    work: &'a mut Vector,
    /// ‖r‖₂ of the free unknowns; `None` before the first test.
    norm: Option<f64>,
}

impl Ksp {
    /// A solver for vectors of `owned` entries on this rank whose options begin with `prefix`
    /// (`-elastic_ksp_type …`).
    pub(crate) fn new(session: &Session, prefix: &str, owned: usize) -> Result<Self, PetscError> {
        let prefix = c_string(prefix)?;
        let handle = Handle::new(raw::KSPDestroy, |handle| {
            // SAFETY: a fresh handle.
            unsafe { raw::KSPCreate(world(), handle) }
        })?;
        let zeros = || Vector::zeros(session, owned);
        let this = Self { handle, residual: zeros()?, work: zeros()?, most: 0 };
        let ksp = this.handle.raw();
        // SAFETY: a live handle, strings that live during the calls.
        unsafe {
            check(raw::KSPSetOptionsPrefix(ksp, prefix.as_ptr()))?;
            check(raw::KSPSetType(ksp, c"cg".as_ptr()))?;
            check(raw::PCSetType(this.pc()?, kept::NAME.as_ptr()))?;
        }
        Ok(this)
    }

    /// Sets the type of the preconditioner, and the package of factors, before options have their say.
    pub(crate) fn set_preconditioner(&self, kind: &CStr, package: &CStr) -> Result<(), PetscError> {
        let pc = self.pc()?;
        // SAFETY: a live handle, strings that live during the calls.
        unsafe {
            check(raw::PCSetType(pc, kind.as_ptr()))?;
            check(raw::PCFactorSetMatSolverType(pc, package.as_ptr()))
        }
    }

    /// Makes CG test ‖r‖₂ (KSPSetNormType). With PETSc's default norm it would apply the preconditioner once
    /// more per solve; other types need not know ‖r‖₂.
    pub(crate) fn set_residual_norm(&self) -> Result<(), PetscError> {
        let norm = raw::KSPNormType::KSP_NORM_UNPRECONDITIONED;
        // SAFETY: a live handle.
        check(unsafe { raw::KSPSetNormType(self.handle.raw(), norm) })
    }

    /// Reads the options (KSPSetFromOptions).
    pub(crate) fn set_from_options(&mut self) -> Result<(), PetscError> {
        let (ksp, unused) = (self.handle.raw(), ptr::null_mut());
        // SAFETY: a live handle; PETSc takes null for what is not asked.
        unsafe {
            check(raw::KSPSetFromOptions(ksp))?;
            check(raw::KSPGetTolerances(ksp, unused, unused, unused, &mut self.most))
        }
    }

    /// Whether the preconditioner is of the type [`kept::NAME`].
    pub(crate) fn is_kept(&self) -> Result<bool, PetscError> {
        let mut kept = raw::PetscBool::PETSC_FALSE;
        let object = self.pc()?.cast::<raw::_p_PetscObject>();
        // SAFETY: a live handle, whose type is compared with a string.
        check(unsafe { raw::PetscObjectTypeCompare(object, kept::NAME.as_ptr(), &mut kept) })?;
        Ok(kept == raw::PetscBool::PETSC_TRUE)
    }

    fn pc(&self) -> Result<raw::PC, PetscError> {
        let mut pc = ptr::null_mut();
        // SAFETY: a live handle.
        check(unsafe { raw::KSPGetPC(self.handle.raw(), &mut pc) })?;
        Ok(pc)
    }

    /// Makes the preconditioner of `matrix` (PCSetUp), which keeps a reference to the matrix but not
    /// to its values; false if it found that the matrix is not positive definite.
    pub(crate) fn set_up(
        &self,
        matrix: &Matrix,
        kept: &mut dyn KeptPreconditioner,
    ) -> Result<bool, PetscError> {
        let (ksp, pc) = (self.handle.raw(), self.pc()?);
        let mut context = Context { preconditioner: kept };
        // SAFETY: live handles; the context outlives the set-up. Without PCSetReusePreconditioner the
        // next solve would factorise again when the values of the matrix have changed.
        unsafe {
            check(raw::PCSetReusePreconditioner(pc, raw::PetscBool::PETSC_FALSE))?;
            check(raw::KSPSetOperators(ksp, matrix.raw(), matrix.raw()))?;
            context.set(pc)?;
            match check(raw::PCSetUp(pc)) {
                Err(error) if error.code == NOT_DEFINITE => return Ok(false),
                set_up => set_up?,
            }
            check(raw::PCSetReusePreconditioner(pc, raw::PetscBool::PETSC_TRUE))?;
        }
        self.is_definite()
    }

    /// Whether the factorisation found only positive pivots, as far as the package reports them.
    fn is_definite(&self) -> Result<bool, PetscError> {
        /// Where MUMPS counts negative pivots, INFOG(12): it makes LDLᵀ and accepts them.
        const NEGATIVE_PIVOTS: c_int = 12;
        let pc = self.pc()?;
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
    pub(crate) fn precondition(
        &self,
        kept: &mut dyn KeptPreconditioner,
        r: &Vector,
        z: &mut Vector,
    ) -> Result<(), PetscError> {
        let pc = self.pc()?;
        let mut context = Context { preconditioner: kept };
        // SAFETY: live handles, distinct by borrowing; the context outlives the call.
        unsafe {
            context.set(pc)?;
            check(raw::PCApply(pc, r.raw(), z.raw()))
        }
    }

    /// Solves for `x` (KSPSolve) with the preconditioner that there is, until the residual of the free
    /// unknowns is small enough or the type of KSP gives up. [`Self::residual`] is then b − A x.
    pub(crate) fn solve(
        &mut self,
        problem: &KspProblem,
        kept: &mut dyn KeptPreconditioner,
        b: &Vector,
        x: &mut Vector,
    ) -> Result<KspReport, PetscError> {
        let (ksp, pc) = (self.handle.raw(), self.pc()?);
        let mut context = Context { preconditioner: kept };
        let Self { residual, work, .. } = self;
        let mut test = Test { problem, residual, work, norm: None };
        let pointer = ptr::from_mut(&mut test).cast::<c_void>();
        let a = problem.matrix.raw();
        let most = problem.most.and_then(|most| most.try_into().ok()).unwrap_or(self.most);
        let mut iterations = 0;
        // SAFETY: live handles of matching layout; what the callbacks point to outlives the solve, in which
        // alone they run.
        unsafe {
            check(raw::KSPSetOperators(ksp, a, a))?;
            context.set(pc)?;
            check(raw::KSPSetTolerances(ksp, 1e-14, 0.0, f64::MAX, most))?;
            check(raw::KSPSetConvergenceTest(ksp, Some(is_converged), pointer, None))?;
            check(raw::KSPSolve(ksp, b.raw(), x.raw()))?;
            check(raw::KSPGetIterationNumber(ksp, &mut iterations))?;
        }
        let tested = test.norm;
        let norm = match tested {
            Some(norm) => norm,
            // Types such as preonly test nothing.
            None => {
                problem.matrix.multiply(x, &mut self.residual)?;
                self.residual.axpby(1.0, b, -1.0)?;
                free_norm(&self.residual, &mut self.work, problem.prescribed)?
            }
        };
        Ok(KspReport { iterations: iterations as usize, norm })
    }

    /// b − A x of the last solve on all unknowns.
    pub(crate) fn residual(&self) -> &Vector {
        &self.residual
    }
}

/// ‖r‖₂ of the unknowns that are not `prescribed`. Collective.
fn free_norm(
    r: &Vector,
    work: &mut Vector,
    prescribed: Option<&[usize]>,
) -> Result<f64, PetscError> {
    let Some(prescribed) = prescribed else { return r.norm() };
    work.axpby(1.0, r, 0.0)?;
    work.write(|r| prescribed.iter().for_each(|&i| r[i] = 0.0))?;
    work.norm()
}

unsafe extern "C" fn is_converged(
    ksp: raw::KSP,
    iteration: c_int,
    _norm: f64,
    reason: *mut raw::KSPConvergedReason::Type,
    context: *mut c_void,
) -> raw::PetscErrorCode {
    // SAFETY: `solve` passed a test that lives during the solve.
    let Test { problem, residual, work, norm } = unsafe { &mut *context.cast::<Test>() };
    let mut built = ptr::null_mut();
    let mut test = || {
        // SAFETY: a KSP that is solving; two vectors of the layout of its own.
        check(unsafe { raw::KSPBuildResidual(ksp, work.raw(), residual.raw(), &mut built) })?;
        let found = *norm.insert(free_norm(residual, work, problem.prescribed)?);
        Ok(if found <= problem.limit {
            raw::KSPConvergedReason::KSP_CONVERGED_ATOL
        } else if !found.is_finite() {
            raw::KSPConvergedReason::KSP_DIVERGED_NANORINF
        } else if problem.most.is_some_and(|most| iteration as usize >= most) {
            raw::KSPConvergedReason::KSP_DIVERGED_ITS
        } else {
            raw::KSPConvergedReason::KSP_CONVERGED_ITERATING
        })
    };
    // SAFETY: PETSc passes where it wants the reason.
    return_code(test().map(|found| unsafe { *reason = found }))
}
