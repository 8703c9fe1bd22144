//! The preconditioner of a [`LinearSolver`]: its choice by the size of the matrix and the PETSc options, its
//! factorisation, and the prescribed unknowns in it.

use super::LinearSolver;
use crate::{
    linear::{
        Factor, LinearSystem, Precision, factor::VERY_LARGE, linear_system::TRIANGULAR_SOLVES,
    },
    petsc::{
        Communicator, Matrix, Pattern, PetscError, Session, ShellPreconditioner, Vector,
        has_option, set_default_option, stage,
    },
};
use std::iter;

/// PETSC_ERR_MISSING_FACTOR: PETSc lacks the package, or the package lacks this kind of factor.
const MISSING_FACTOR: i32 = 92;

/// The KSP types that solve the systems of a run with at most three times the triangular solves of conjugate gradients.
const KSP_TYPES: &str = "cg, groppcg, pipecg, pipeprcg, nash, stcg, gltr, fcg, pipefcg, cr, pipecr, minres, gmres, fgmres, \
                         pipefgmres, lgmres, dgmres, pgmres, gcr, pipegcr, bcgs, bcgsl, cgs, tfqmr, lcd, richardson, preonly, none";

impl LinearSolver {
    /// Checks the PETSc options with this prefix before the first factorisation. Collective.
    ///
    /// # Errors
    /// An option names a type that this PETSc lacks.
    pub fn check_options(session: &Session, prefix: &str) -> Result<(), PetscError> {
        let mut solver = Self::new(session, prefix, 1, Precision::Full)?;
        let comm = session.comm();
        let own = Pattern::new(1, iter::once((0, comm.rank() as i32)));
        let identity = Matrix::with_pattern(session, 1, &own, &[1.0])?;
        let chosen = solver.uses_factor(&identity);
        if comm.any(chosen.is_err()) || matches!(chosen, Ok(true)) {
            return chosen.map(drop);
        }
        // PETSc looks for the package of a factor when it factorises.
        match solver.ksp.set_up(&identity, &mut solver.factor) {
            Err(error) if error.code == MISSING_FACTOR => Err(error),
            _ => Ok(()),
        }
    }

    /// Is the factor the preconditioner of matrices of this size? The first such matrix decides. Collective.
    pub(super) fn uses_factor(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let rows = matrix.size()?;
        let own = match self.chosen {
            Some((size, own)) if size == rows => own,
            _ => self.choose(matrix, rows)?,
        };
        self.chosen = Some((rows, own));
        Ok(own)
    }

    /// Chooses the factor, or the preconditioner of the PETSc options. If the matrix is too large for the
    /// factor, a factor of PETSc or multigrid replaces it.
    fn choose(&mut self, matrix: &Matrix, rows: usize) -> Result<bool, PetscError> {
        let (prefix, serial) = (&self.prefix, matrix.owned() == rows);
        let asked = has_option(&format!("-{prefix}pc_type"))?
            || has_option(&format!("-{prefix}pc_factor_mat_solver_type"))?;
        let comm = self.factor.comm();
        if comm.any(has_option(&format!("-{prefix}ksp_type"))?) {
            // Other KSPs than ours lose what single precision rounds.
            self.factor.set_full_precision();
        } else {
            self.ksp.set_residual_norm()?;
        }
        // The ranks may have different options.
        if comm.any(asked) || !self.factor.analyse(matrix)? {
            // By default CHOLMOD makes LDLᵀ of a small matrix, accepts negative pivots, and prints warnings
            // to the standard output. MUMPS sometimes estimates too little memory.
            let options = match serial {
                true => &[
                    ("cholmod_final_asis", "0"),
                    ("cholmod_final_ll", "1"),
                    ("cholmod_print", "0"),
                ][..],
                false => &[("mumps_icntl_14", "100")],
            };
            for (option, value) in options {
                set_default_option(&format!("-{prefix}mat_{option}"), value)?;
            }
            // PETSc's own factor is much slower than CHOLMOD's: it is for those who ask for it.
            let without_cholmod = serial && cfg!(petsc_without_cholmod);
            let small = if serial { !without_cholmod || asked } else { rows < VERY_LARGE };
            let package = match serial {
                true if without_cholmod => c"petsc",
                true => c"cholmod",
                false => c"mumps",
            };
            self.ksp.set_preconditioner(if small { c"cholesky" } else { c"gamg" }, package)?;
        }
        self.ksp.set_from_options()?;
        let kind = self.ksp.kind()?;
        if !KSP_TYPES.split(", ").any(|known| known == kind) {
            return Err(PetscError::ours(format!(
                "-{prefix}ksp_type {kind} does not serve here: the matrices are symmetric positive definite, and a kept factor \
                 preconditions them; take one of {KSP_TYPES}"
            )));
        }
        self.ignores_reactions = kind == "cg";
        self.ksp.uses_own_factor()
    }

    /// Can [`Self::condense`] reduce a system with this matrix to the condensed unknowns? Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn is_condensed(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        Ok(self.uses_factor(matrix)? && self.factor.analyse(matrix)? && self.factor.is_condensed())
    }

    /// Makes a new preconditioner of the system. It returns false if the system is not positive definite.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn factorise(&mut self, system: LinearSystem) -> Result<bool, PetscError> {
        stage("factorisation", || self.set_up(system))
    }

    fn set_up(&mut self, system: LinearSystem) -> Result<bool, PetscError> {
        self.prepared = false;
        let own = self.uses_factor(system.matrix)?;
        self.prescribe_in_copy(system)?;
        let condensed = self.is_condensed(system.matrix)?;
        let modified = self.modified.as_ref().filter(|_| !condensed);
        let matrix = modified.unwrap_or(system.matrix);
        let definite = self.ksp.set_up(matrix, &mut self.factor)?;
        if !own {
            self.factor.record(matrix, definite, None)?;
        }
        Ok(definite && self.is_ready(system)?)
    }

    /// Prescribes unknowns in a copy of the matrix. Conjugate gradients with a condensed factor need no copy: the factor prescribes
    /// them itself.
    pub(super) fn prescribe_in_copy(&mut self, system: LinearSystem) -> Result<(), PetscError> {
        let before = self.modified.take();
        let Some(prescribed) = system.prescribed else { return Ok(()) };
        if self.is_condensed(system.matrix)? && self.ignores_reactions {
            return Ok(());
        }
        let mut matrix = match before {
            Some(matrix) => matrix,
            None => system.matrix.duplicate()?,
        };
        matrix.copy(system.matrix)?;
        matrix.zero_rows_columns(prescribed, system.scale)?;
        self.modified = Some(matrix);
        Ok(())
    }

    /// Is there a preconditioner for the system? Prescribes the unknowns of the system in a condensed factor.
    pub(super) fn is_ready(&mut self, system: LinearSystem) -> Result<bool, PetscError> {
        let prescribe = || self.prescribe(system.prescribed.unwrap_or(&[]));
        // A change of the prescribed unknowns in a condensed factor.
        stage("Schur complement", prescribe)
    }

    /// Makes the preconditioner of a checkpoint again.
    pub(super) fn remake(&mut self, system: LinearSystem) -> Result<(), PetscError> {
        if let Some((matrix, history)) = self.factor.take_loaded(system.matrix)? {
            let loaded = LinearSystem { matrix: &matrix, ..system };
            if self.factorise(loaded)? {
                self.factor.keep_history(history);
            }
        }
        Ok(())
    }

    /// Has a solve used all iterations that the preconditioner is worth?
    pub fn is_slow(&self, iterations: usize, limit: f64) -> bool {
        self.factor
            .iteration_limit(self.needed_reduction(limit))
            .is_none_or(|most| iterations >= most)
    }

    /// Prescribes unknowns in a condensed factor. It returns false if there is no preconditioner afterwards.
    /// Collective.
    pub(crate) fn prescribe(&mut self, unknowns: &[usize]) -> Result<bool, PetscError> {
        let exists = self.factor.exists();
        Ok(exists && (!self.factor.is_condensed() || self.factor.prescribe(unknowns)?))
    }
}

/// The factor during a solve, whose applications are timed.
pub(super) struct TimedFactor<'a> {
    pub(super) factor: &'a mut Factor,
    /// P⁻¹ r of the first residual, if it is known, and this residual, if the KSP may begin with another vector.
    pub(super) first: Option<&'a Vector>,
    pub(super) of: Option<&'a Vector>,
}

impl ShellPreconditioner for TimedFactor<'_> {
    /// The linear solver decides when to factorise.
    fn set_up(&mut self, _matrix: &Matrix) -> Result<bool, PetscError> {
        Ok(self.factor.exists())
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        if let Some(first) = self.first.take()
            && self.of.is_none_or(|of| is_same(self.factor.comm(), of, r))
        {
            return z.axpby(1.0, first, 0.0);
        }
        stage(TRIANGULAR_SOLVES, || self.factor.apply(r, z))
    }
}

/// Are the vectors equal on all ranks? Collective.
fn is_same(comm: Communicator, a: &Vector, b: &Vector) -> bool {
    let same = a.read(|a| b.read(|b| a == b));
    comm.all(matches!(same, Ok(Ok(true))))
}
