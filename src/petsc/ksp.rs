//! PETSc's Krylov solvers and preconditioners (<https://petsc.org/release/manualpages/KSP/>).

use super::{
    Matrix, PetscError, Session, Vector, check,
    error::{NOT_DEFINITE, return_code},
    handle::Handle,
    options::{c_string, is_true, petsc_bool},
    raw,
    session::world,
    shell_preconditioner::{self, Context, ShellPreconditioner},
};
use std::{
    ffi::{CStr, c_int, c_void},
    ptr,
};

/// A KSP: conjugate gradients with the preconditioner [`shell_preconditioner::NAME`], unless PETSc options with its prefix
/// choose other types.
///
/// The convergence test computes the norm of the residual on the free unknowns. So `-ksp_norm_type` changes
/// only the numbers that monitors print.
pub(crate) struct Ksp {
    handle: Handle<raw::_p_KSP>,
    /// The residual of the last test, and work space for it.
    residual: Vector,
    work: Vector,
    /// PETSc's limit of iterations (`-ksp_max_it`).
    most: c_int,
}

/// A linear system as a KSP solves it from the start 0: A x = b on the unknowns that are not prescribed.
pub(crate) struct KspProblem<'a> {
    /// A; PETSc's own preconditioners are made from it.
    pub(crate) matrix: &'a Matrix,
    /// The owned unknowns with prescribed values, whose correction x is 0. The caller sets b to 0 there. P⁻¹r must be 0
    /// there too, or the rows and columns of these unknowns in A must have no entry but the diagonal one. `None` if no
    /// rank prescribes unknowns.
    pub(crate) prescribed: Option<&'a [usize]>,
    /// The largest accepted ‖b − A x‖₂ of the free unknowns.
    pub(crate) limit: f64,
    /// The limit of iterations; `None` for PETSc's limit.
    pub(crate) most: Option<usize>,
}

/// The outcome of a solve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KspReport {
    /// The number of iterations.
    pub(crate) iterations: usize,
    /// ‖b − A x‖₂ of the free unknowns.
    pub(crate) norm: f64,
    /// PETSc's reason for the end, as `DIVERGED_ITS`; `None` with the preconditioner [`shell_preconditioner::NAME`].
    pub(crate) reason: Option<&'static str>,
}

/// The context of the convergence test during a solve.
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
            check(raw::PCSetType(this.pc()?, shell_preconditioner::NAME.as_ptr()))?;
        }
        Ok(this)
    }

    /// Sets the type of the preconditioner and the package of its factor. Options may change both.
    pub(crate) fn set_preconditioner(&self, kind: &CStr, package: &CStr) -> Result<(), PetscError> {
        let pc = self.pc()?;
        // SAFETY: a live handle, strings that live during the calls.
        unsafe {
            check(raw::PCSetType(pc, kind.as_ptr()))?;
            check(raw::PCFactorSetMatSolverType(pc, package.as_ptr()))
        }
    }

    /// Makes CG test ‖r‖₂ (KSPSetNormType). With PETSc's default norm CG would apply the preconditioner once
    /// more per solve. Other types keep their own norms.
    pub(crate) fn set_residual_norm(&self) -> Result<(), PetscError> {
        let norm = raw::KSPNormType::KSP_NORM_UNPRECONDITIONED;
        // SAFETY: a live handle.
        check(unsafe { raw::KSPSetNormType(self.handle.raw(), norm) })
    }

    /// Reads the options (KSPSetFromOptions).
    pub(crate) fn set_from_options(&mut self) -> Result<(), PetscError> {
        let (ksp, unused) = (self.handle.raw(), ptr::null_mut());
        // SAFETY: a live handle; null means that a value is not wanted.
        unsafe {
            check(raw::KSPSetFromOptions(ksp))?;
            check(raw::KSPGetTolerances(ksp, unused, unused, unused, &mut self.most))
        }
    }

    /// The type (KSPGetType), as "cg".
    pub(crate) fn kind(&self) -> Result<String, PetscError> {
        let mut kind = ptr::null();
        // SAFETY: a live handle with a type, whose name PETSc keeps.
        unsafe {
            check(raw::KSPGetType(self.handle.raw(), &mut kind))?;
            Ok(CStr::from_ptr(kind).to_string_lossy().into_owned())
        }
    }

    /// Whether the preconditioner is of the type [`shell_preconditioner::NAME`].
    pub(crate) fn uses_own_factor(&self) -> Result<bool, PetscError> {
        let mut same = petsc_bool(false);
        let object = self.pc()?.cast::<raw::_p_PetscObject>();
        // SAFETY: a live handle, whose type is compared with a string.
        check(unsafe {
            raw::PetscObjectTypeCompare(object, shell_preconditioner::NAME.as_ptr(), &mut same)
        })?;
        Ok(is_true(same))
    }

    fn pc(&self) -> Result<raw::PC, PetscError> {
        let mut pc = ptr::null_mut();
        // SAFETY: a live handle.
        check(unsafe { raw::KSPGetPC(self.handle.raw(), &mut pc) })?;
        Ok(pc)
    }

    /// Makes the preconditioner from `matrix` (PCSetUp); false if the matrix is not positive definite. (MUMPS accepts negative
    /// pivots; conjugate gradients then end above the limit.)
    /// PETSc keeps a reference to the matrix, but later values of it do not change the preconditioner.
    pub(crate) fn set_up(
        &self,
        matrix: &Matrix,
        own: &mut dyn ShellPreconditioner,
    ) -> Result<bool, PetscError> {
        let (ksp, pc) = (self.handle.raw(), self.pc()?);
        let mut context = Context { preconditioner: own };
        let stored = matrix.assembled()?;
        let mut reason = raw::PCFailedReason::PC_NOERROR;
        // SAFETY: live handles; the context outlives the set-up. Without PCSetReusePreconditioner the
        // next solve would factorise again when the values of the matrix have changed.
        unsafe {
            check(raw::PCSetReusePreconditioner(pc, petsc_bool(false)))?;
            check(raw::KSPSetOperators(ksp, matrix.product(), stored))?;
            context.set(pc)?;
            match check(raw::PCSetUp(pc)) {
                Err(error) if error.code == NOT_DEFINITE => return Ok(false),
                set_up => set_up?,
            }
            check(raw::PCSetReusePreconditioner(pc, petsc_bool(true)))?;
            check(raw::PCGetFailedReason(pc, &mut reason))?;
        }
        Ok(reason == raw::PCFailedReason::PC_NOERROR)
    }

    /// Solves for `x` with the present preconditioner (KSPSolve), until the residual of the free unknowns is
    /// below the limit or PETSc gives up. Afterwards [`Self::residual`] is b − A x.
    pub(crate) fn solve(
        &mut self,
        problem: &KspProblem,
        own: &mut dyn ShellPreconditioner,
        b: &Vector,
        x: &mut Vector,
    ) -> Result<KspReport, PetscError> {
        let (ksp, pc) = (self.handle.raw(), self.pc()?);
        // Some of PETSc's preconditioners read the entries in every application.
        let matrix = problem.matrix;
        let uses_own_factor = self.uses_own_factor()?;
        let stored = if uses_own_factor { matrix.stored() } else { matrix.assembled()? };
        let mut context = Context { preconditioner: own };
        let Self { residual, work, .. } = self;
        let mut test = Test { problem, residual, work, norm: None };
        let pointer = ptr::from_mut(&mut test).cast::<c_void>();
        let most = problem.most.and_then(|most| most.try_into().ok()).unwrap_or(self.most);
        let (mut iterations, mut reason) = (0, ptr::null());
        // SAFETY: live handles of matching layout; the callbacks run only during the solve, and their
        // contexts outlive it.
        unsafe {
            check(raw::KSPSetOperators(ksp, matrix.product(), stored))?;
            context.set(pc)?;
            check(raw::KSPSetTolerances(ksp, 1e-14, 0.0, f64::MAX, most))?;
            check(raw::KSPSetConvergenceTest(ksp, Some(is_converged), pointer, None))?;
            check(raw::KSPSolve(ksp, b.raw(), x.raw()))?;
            check(raw::KSPGetIterationNumber(ksp, &mut iterations))?;
            check(raw::KSPGetConvergedReasonString(ksp, &mut reason))?;
        }
        // SAFETY: a name in PETSc's constant table.
        let reason = unsafe { CStr::from_ptr(reason) }.to_str().ok();
        let reason = reason.filter(|_| !uses_own_factor);
        let norm = match test.norm {
            Some(norm) => norm,
            // Types such as preonly have no convergence test.
            None => {
                problem.matrix.multiply(x, &mut self.residual)?;
                self.residual.axpby(1.0, b, -1.0)?;
                self.residual.free_norm(problem.prescribed)?
            }
        };
        Ok(KspReport { iterations: iterations as usize, norm, reason })
    }

    /// b − A x of the last solve, on all unknowns.
    pub(crate) fn residual(&self) -> &Vector {
        &self.residual
    }
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
        let found = *norm.insert(residual.free_norm(problem.prescribed)?);
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
    // SAFETY: PETSc passes a valid pointer for the reason.
    return_code(test().map(|found| unsafe { *reason = found }))
}
