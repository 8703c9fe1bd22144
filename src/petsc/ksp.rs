//! Linear systems by a Cholesky factor, polished by conjugate gradients.

use super::{
    Matrix, PetscError, Session, Vector, check, raw,
    session::{Live, c_string, world},
    vec::same_size,
};
use std::ptr;

/// Conjugate gradients preconditioned by a Cholesky factor (KSPCG, PCCHOLESKY).
///
/// With a fresh factor CG needs one or two iterations: it removes the factor's rounding
/// error and notices an indefinite matrix, which the factorisation alone does not.
pub struct LinearSolver {
    raw: raw::KSP,
    _live: Live,
}

/// More than a factor of the matrix itself needs.
const CG_ITERATIONS: i32 = 200;

/// What a linear solve took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Krylov {
    /// CG iterations, each a product and a pair of triangular solves.
    pub iterations: usize,
    /// Whether the tolerance was reached.
    pub converged: bool,
}

impl LinearSolver {
    /// A solver whose PETSc options carry `prefix` (`-damage_ksp_type …`).
    ///
    /// The factorisation is CHOLMOD's on one rank and MUMPS' on several.
    pub fn cholesky(session: &Session, prefix: &str) -> Result<Self, PetscError> {
        let mut solver = Self { raw: ptr::null_mut(), _live: Live::new() };
        let prefix = c_string(prefix)?;
        let package = if session.ranks() == 1 { c"cholmod" } else { c"mumps" };
        let mut pc = ptr::null_mut();
        // SAFETY: a fresh handle, strings that live during the calls.
        unsafe {
            check(raw::KSPCreate(world(), &mut solver.raw))?;
            check(raw::KSPSetOptionsPrefix(solver.raw, prefix.as_ptr()))?;
            check(raw::KSPSetType(solver.raw, c"cg".as_ptr()))?;
            check(raw::KSPSetNormType(solver.raw, raw::KSPNormType::KSP_NORM_UNPRECONDITIONED))?;
            check(raw::KSPSetInitialGuessNonzero(solver.raw, raw::PetscBool::PETSC_TRUE))?;
            check(raw::KSPGetPC(solver.raw, &mut pc))?;
            check(raw::PCSetType(pc, c"cholesky".as_ptr()))?;
            check(raw::PCFactorSetMatSolverType(pc, package.as_ptr()))?;
            check(raw::KSPSetFromOptions(solver.raw))?;
        }
        Ok(solver)
    }

    /// Factorises `matrix` now; the solver keeps a reference to it.
    pub fn factorise(&mut self, matrix: &Matrix) -> Result<(), PetscError> {
        // SAFETY: live handles. KSPSetOperators marks the values as new, else the
        // factorisation would wait for the next solve.
        unsafe {
            check(raw::KSPSetOperators(self.raw, matrix.raw, matrix.raw))?;
            check(raw::KSPSetUp(self.raw))
        }
    }

    /// Solves from the start `x` until ‖b − Ax‖₂ ≤ `residual`.
    pub fn solve(
        &mut self,
        b: &Vector,
        x: &mut Vector,
        residual: f64,
    ) -> Result<Krylov, PetscError> {
        same_size(b.owned(), x.owned())?;
        let (mut reason, mut iterations) = (0, 0);
        let limit = residual.max(f64::MIN_POSITIVE);
        // SAFETY: live handles of matching layout.
        unsafe {
            // No divergence test: it compares with ‖b‖, and a start from elsewhere may be far off.
            check(raw::KSPSetTolerances(self.raw, 1e-300, limit, f64::MAX, CG_ITERATIONS))?;
            check(raw::KSPSolve(self.raw, b.raw, x.raw))?;
            check(raw::KSPGetConvergedReason(self.raw, &mut reason))?;
            check(raw::KSPGetIterationNumber(self.raw, &mut iterations))?;
        }
        Ok(Krylov { iterations: iterations as usize, converged: reason > 0 })
    }
}

impl Drop for LinearSolver {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and not used afterwards.
        unsafe { raw::KSPDestroy(&mut self.raw) };
    }
}
