//! The choice of the method that factorises the matrices of a pattern.

use super::Factor;
use crate::{
    cholesky::{Precision, substructure::Substructure},
    petsc::{Matrix, Pattern, PetscError, Preconditioner, Session, has_option, set_default_option},
};
use std::iter;

/// What makes and applies the factor.
pub(super) enum Method {
    Substructure {
        factor: Box<Substructure>,
        /// Whether it can be restricted.
        condensed: bool,
    },
    Petsc(Preconditioner),
}

/// Unknowns per root of the rows up to which they are condensed. Of squares and strips up to 32 times as long as
/// high whole runs, condensed, took 0.35 to 0.9 of the time where contact moves and there are up to 4; with 5.3
/// to 6.2 it were 0.56 to 0.74, but a weightless strip that hardly touches at its ends (5.8) then ended with
/// another active set, as well certified and 24 % apart in u.
const MOST_CONDENSED: f64 = 4.0;

/// PETSC_ERR_MISSING_FACTOR: PETSc has no such package, or not for such a factor.
const MISSING_FACTOR: i32 = 92;

/// Rows above which several ranks use multigrid: the memory of factors grows faster than the rows.
/// With 2.1 million on two ranks a step with factors was six times as fast, their set-up four times
/// as slow, memory 10 % more; what is beyond was not measured.
const VERY_LARGE: usize = 2_500_000;

impl Factor {
    /// Whether PETSc options ask for a preconditioner.
    fn is_asked_for(&self) -> Result<bool, PetscError> {
        let prefix = &self.prefix;
        Ok(has_option(&format!("-{prefix}pc_type"))?
            || has_option(&format!("-{prefix}pc_factor_mat_solver_type"))?)
    }

    /// Refuses options that PETSc does not know before anything is factorised. Collective.
    ///
    /// # Errors
    /// They ask for what this PETSc does not have.
    pub fn check_options(&self, session: &Session) -> Result<(), PetscError> {
        let preconditioner = match self.comm.any(self.is_asked_for()?) {
            true => self.preconditioner(true),
            false => return Ok(()),
        };
        if self.comm.any(preconditioner.is_err()) {
            return preconditioner.map(drop);
        }
        // PETSc looks for the package of a factor when it factorises: here an identity.
        let own = Pattern::new(1, iter::once((0, self.comm.rank() as i32)));
        let identity = Matrix::with_pattern(session, 1, &own, &[1.0])?;
        match preconditioner?.set_up(&identity) {
            Err(error) if error.code == MISSING_FACTOR => Err(error),
            _ => Ok(()),
        }
    }

    /// What factorises matrices of the pattern of this one: chosen with the first of so many rows.
    pub(super) fn method(&mut self, matrix: &Matrix) -> Result<&mut Method, PetscError> {
        let rows = matrix.size()?;
        let method = match self.method.take() {
            Some((size, method)) if size == rows => method,
            _ => self.choose(matrix, rows)?,
        };
        Ok(&mut self.method.insert((rows, method)).1)
    }

    /// Substructuring with the unknowns of contact condensed, where that pays, or without, where it is possible
    /// at all; else PETSc.
    fn choose(&self, matrix: &Matrix, rows: usize) -> Result<Method, PetscError> {
        let factorised = self.comm.is_serial() || rows < VERY_LARGE;
        if factorised && !self.is_asked_for()? {
            let (of_rows, condensed) = &self.condensed;
            let unknowns = self.comm.count(condensed.len());
            let few = unknowns > 0 && unknowns as f64 <= MOST_CONDENSED * (rows as f64).sqrt();
            let pays = few && *of_rows == rows;
            let choices = [(&condensed[..], true), (&[], false)];
            for (last, condensed) in choices.into_iter().skip(usize::from(!pays)) {
                let [precision, of_schur] = self.precisions;
                // Contact forces are told by a condensed S.
                let of_schur = if condensed { Precision::Full } else { of_schur };
                let precisions = [precision, of_schur];
                if let Some(factor) = Substructure::new(self.comm, matrix, last, precisions)? {
                    return Ok(Method::Substructure { factor: Box::new(factor), condensed });
                }
            }
        }
        Ok(Method::Petsc(self.preconditioner(factorised)?))
    }

    /// What PETSc's options ask for, else PETSc's factor, or multigrid.
    fn preconditioner(&self, factorised: bool) -> Result<Preconditioner, PetscError> {
        let (prefix, serial) = (&self.prefix, self.comm.is_serial());
        // Left to itself CHOLMOD makes LDLᵀ of a small matrix, accepts negative pivots, and prints its
        // warnings into the results. MUMPS' guess of the memory it needs is now and then too small.
        let options = match serial {
            true => {
                &[("cholmod_final_asis", "0"), ("cholmod_final_ll", "1"), ("cholmod_print", "0")][..]
            }
            false => &[("mumps_icntl_14", "100")],
        };
        for (option, value) in options {
            set_default_option(&format!("-{prefix}mat_{option}"), value)?;
        }
        let kind = if factorised { c"cholesky" } else { c"gamg" };
        let package = if serial { c"cholmod" } else { c"mumps" };
        Preconditioner::new(prefix, kind, package)
    }
}
