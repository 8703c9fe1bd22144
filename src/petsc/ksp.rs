//! Linear systems by a Cholesky factor, polished by conjugate gradients.

use super::{
    Factor, Matrix, PetscError, Precision, Session, Vector, check,
    factor::NOT_DEFINITE,
    raw,
    session::{Live, c_string, world},
    shell::KeptFactor,
    vec::same_size,
};
use std::ptr;

/// Conjugate gradients preconditioned by a Cholesky factor (KSPCG).
///
/// With a fresh factor CG needs one or two iterations: it removes the factor's rounding
/// error. A matrix that is not positive definite has no factor LLᵀ: solves with it do not converge.
pub struct LinearSolver {
    raw: raw::KSP,
    /// Whether the last factorisation found only positive pivots.
    definite: bool,
    /// Its address is PETSc's preconditioner.
    _factor: Box<KeptFactor>,
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
    /// A solver of systems with `unknowns` rows on all ranks together, whose PETSc options carry
    /// `prefix` (`-damage_ksp_type …`).
    ///
    /// What factorises is told at [`Factor`].
    pub fn cholesky(session: &Session, prefix: &str, unknowns: usize) -> Result<Self, PetscError> {
        // One iteration with all digits costs less than two with half of them.
        let factor = Factor::new(session, prefix, unknowns, Precision::Full)?;
        let factor = KeptFactor::new(factor, None);
        let mut solver =
            Self { raw: ptr::null_mut(), definite: false, _factor: factor, _live: Live::new() };
        let prefix = c_string(prefix)?;
        let mut pc = ptr::null_mut();
        // SAFETY: a fresh handle, a string that lives during the calls, a factor that lives as long.
        unsafe {
            check(raw::KSPCreate(world(), &mut solver.raw))?;
            check(raw::KSPSetOptionsPrefix(solver.raw, prefix.as_ptr()))?;
            check(raw::KSPSetType(solver.raw, c"cg".as_ptr()))?;
            check(raw::KSPSetNormType(solver.raw, raw::KSPNormType::KSP_NORM_UNPRECONDITIONED))?;
            check(raw::KSPSetInitialGuessNonzero(solver.raw, raw::PetscBool::PETSC_TRUE))?;
            check(raw::KSPSetFromOptions(solver.raw))?;
            check(raw::KSPGetPC(solver.raw, &mut pc))?;
            solver._factor.attach(pc)?;
        }
        Ok(solver)
    }

    /// Factorises `matrix` now; the solver keeps a reference to it. A matrix that is not positive
    /// definite is no error here: the solves tell.
    pub fn factorise(&mut self, matrix: &Matrix) -> Result<(), PetscError> {
        // SAFETY: live handles. KSPSetOperators marks the values as new, else the
        // factorisation would wait for the next solve.
        let set_up = unsafe {
            check(raw::KSPSetOperators(self.raw, matrix.raw, matrix.raw))?;
            check(raw::KSPSetUp(self.raw))
        };
        self.definite = match set_up {
            Ok(()) => true,
            Err(error) if error.code == NOT_DEFINITE => false,
            Err(other) => return Err(other),
        };
        Ok(())
    }

    /// Solves from the start `x` until ‖b − Ax‖₂ ≤ `residual`; without a factor `x` is left alone.
    pub fn solve(
        &mut self,
        b: &Vector,
        x: &mut Vector,
        residual: f64,
    ) -> Result<Krylov, PetscError> {
        same_size(b.owned(), x.owned())?;
        if !self.definite {
            return Ok(Krylov { iterations: 0, converged: false });
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagonal of these blocks [[a, b], [b, a]]: eigenvalues a ± b.
    fn blocks(session: &Session, blocks: &[[f64; 2]]) -> Matrix {
        let (mut rows, mut columns, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for (i, &[a, b]) in blocks.iter().enumerate() {
            let i = 2 * i as i32;
            rows.extend([i, i, i + 1, i + 1]);
            columns.extend([i, i + 1, i, i + 1]);
            values.extend([a, b, b, a]);
        }
        let size = 2 * blocks.len();
        let mut matrix = Matrix::with_pattern(session, size, 1, rows, columns).unwrap();
        matrix.set_values(&values).unwrap();
        matrix
    }

    /// Whether the solve with right-hand side 1 converges, and the first unknown.
    fn solve(session: &Session, solver: &mut LinearSolver, size: usize) -> (bool, f64) {
        let mut b = Vector::zeros(session, size).unwrap();
        let mut x = Vector::zeros(session, size).unwrap();
        b.write(|b| b.fill(1.0)).unwrap();
        let krylov = solver.solve(&b, &mut x, 1e-12).unwrap();
        (krylov.converged, x.read(|x| x[0]).unwrap())
    }

    #[test]
    fn what_is_not_positive_definite_does_not_converge_and_does_no_harm() {
        let session = Session::start(&[]).unwrap();
        let good = [[2.0, 1.0]; 3];
        let mut solver = LinearSolver::cholesky(&session, "test_", 6).unwrap();
        for bad in [[1.0, 2.0], [-2.0, 1.0], [1.0, 1.0], [0.0, 0.0], [f64::NAN, 0.0]] {
            // First of all, and after a factorisation that went well.
            for _ in 0..2 {
                let matrix = blocks(&session, &[good[0], bad, good[2]]);
                solver.factorise(&matrix).unwrap();
                assert!(!solve(&session, &mut solver, 6).0, "{bad:?}");
                solver.factorise(&blocks(&session, &good)).unwrap();
                let (converged, x) = solve(&session, &mut solver, 6);
                assert!(converged && (x - 1.0 / 3.0).abs() < 1e-15, "after {bad:?}: {x}");
            }
        }
    }

    #[test]
    fn all_pivots_negative_are_noticed_too() {
        // CG alone would not notice: r·z and p·Ap keep their sign.
        let session = Session::start(&[]).unwrap();
        let mut solver = LinearSolver::cholesky(&session, "test_", 6).unwrap();
        solver.factorise(&blocks(&session, &[[-2.0, 1.0]; 3])).unwrap();
        assert!(!solve(&session, &mut solver, 6).0);
    }
}
