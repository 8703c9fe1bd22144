//! What a contact solver is given and what it answers.

use super::{Bound, Kkt};
use crate::{
    petsc::{Matrix, PetscError, Ranks, Session, Vector},
    phases::Phases,
};
use nalgebra::{DMatrix, DVector};

/// min ½ cᵀKc − fᵀc  subject to  c_i ≤ g_i on the bounded unknowns.
///
/// The unknowns c are displacements in the frames of the constraints: each bound concerns
/// one of them, prescribed ones have an identity row and load 0.
pub struct ContactProblem<'a> {
    /// K, N/m.
    pub stiffness: &'a Matrix,
    /// The size of K's diagonal, N/m.
    pub stiffness_scale: f64,
    /// f, N: loads less the forces of prescribed displacements.
    pub load: &'a Vector,
    /// g_i and its node's share of Γ_C for each bounded unknown.
    pub bounds: &'a [Bound],
    /// u·ν of the rigid motions that only contact holds, one row per bound; no columns where
    /// K is positive definite.
    pub rigid: &'a DMatrix<f64>,
    /// The work of the load on each of these motions.
    pub work: &'a DVector<f64>,
    /// ‖·‖₂ of the forces that count as 1 in relative residuals, N.
    pub force_scale: f64,
    /// KKT residuals to reach, relative.
    pub tolerance: f64,
    /// The ranks among which the unknowns are divided: bounds are their owners', what is
    /// decided is decided by all.
    pub ranks: Ranks,
    /// Where the parts of the solve book their time, as `contact/…`.
    pub phases: &'a Phases,
}

impl ContactProblem<'_> {
    /// ‖residual‖₂ that linear systems are solved to, N: well below what the KKT residuals may be.
    pub fn linear_residual(&self) -> f64 {
        0.1 * self.tolerance * self.force_scale
    }

    /// The KKT residuals of `c` by the assembled K (the final word has
    /// [`Kkt`] by element-wise forces).
    pub fn residuals(&self, session: &Session, c: &Vector) -> Result<Kkt, PetscError> {
        let residual = self.residual(session, c)?;
        let size = self.size(c)?;
        let kkt = |r: &[f64], c: &[f64]| {
            Kkt::of(r, c, self.bounds, |_| false, self.force_scale, size, self.ranks)
        };
        residual.read(|r| c.read(|c| kkt(r, c)))?
    }

    /// The largest entry in absolute value.
    pub fn size(&self, c: &Vector) -> Result<f64, PetscError> {
        Ok(self.ranks.max(c.read(|c| c.iter().fold(0.0_f64, |m, v| m.max(v.abs())))?))
    }

    /// Number of bounds, of all ranks.
    pub fn all_bounds(&self) -> usize {
        self.ranks.count(self.bounds.len())
    }

    /// Kc − f.
    pub fn residual(&self, session: &Session, c: &Vector) -> Result<Vector, PetscError> {
        let mut residual = Vector::zeros(session, c.owned())?;
        self.stiffness.multiply(c, &mut residual)?;
        self.load
            .read(|f| residual.write(|r| r.iter_mut().zip(f).for_each(|(r, f)| *r -= f)))??;
        Ok(residual)
    }

    /// Whether K is positive definite.
    pub fn definite(&self) -> bool {
        self.rigid.ncols() == 0
    }
}

/// The combinations (orthonormal) of the motions `rigid`, u·ν at the bounds, a column each, that
/// are left when u_ν is prescribed on the `pressing` bounds.
pub(crate) fn unheld(ranks: Ranks, rigid: &DMatrix<f64>, pressing: &[bool]) -> Vec<DVector<f64>> {
    let motions = rigid.ncols();
    if motions == 0 {
        return Vec::new();
    }
    let rows = rigid.row_iter().zip(pressing).filter(|(_, on)| **on);
    let mut gram =
        rows.fold(DMatrix::zeros(motions, motions), |sum, (row, _)| sum + row.transpose() * row);
    ranks.sum(gram.as_mut_slice());
    let eigen = gram.symmetric_eigen();
    let cut = 1e-10 * ranks.total(rigid.norm_squared());
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs.filter(|(value, _)| **value <= cut).map(|(_, vector)| vector.into_owned()).collect()
}

/// A method for the contact problem.
pub trait ContactSolver {
    /// The name a scene or `--solver` calls it by.
    fn name(&self) -> &'static str;

    /// What the method keeps for the next solve besides `c` (a set, a multiplier), as numbers.
    fn warm_start(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Goes back to an earlier [`Self::warm_start`]: the solves since then have not happened.
    fn set_warm_start(&mut self, _kept: &[f64]) {}

    /// Solves from the start `c` and leaves the solution there.
    ///
    /// # Errors
    /// The method stopped short of the tolerance, or PETSc failed.
    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError>;
}

/// What a contact solve took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactReport {
    /// Iterations of the method itself.
    pub iterations: usize,
    /// Iterations of linear solvers inside, each a pair of triangular solves.
    pub linear_iterations: usize,
    /// Factorisations (not those of a preconditioner chosen by PETSc options).
    pub factorisations: usize,
    /// Times the method had to leave its fast path for a slower one that always ends.
    pub fallbacks: usize,
    /// Mean factor by which an iteration shrank the change of the multiplier, where the method
    /// is a fixed-point iteration.
    pub contraction: Option<f64>,
    /// ω of penalty-duality, Pa/m.
    pub omega: Option<f64>,
    /// Calls of TAO that claimed convergence to an answer which the KKT residuals rejected.
    pub false_claims: usize,
}

/// A contact solve that did not end well.
#[derive(Debug, thiserror::Error)]
pub enum ContactError {
    /// The method ended above the tolerance.
    #[error("{method} stopped after {iterations} iterations: {detail}")]
    NotConverged {
        /// The solver's name.
        method: &'static str,
        /// Iterations done.
        iterations: usize,
        /// Why it stopped and where it stood.
        detail: String,
    },
    /// The answer does not satisfy the KKT conditions.
    #[error("{method} gave an answer, but {}", residuals.missed(*tolerance))]
    NotCertified {
        /// The solver's name.
        method: &'static str,
        /// The tolerance missed.
        tolerance: f64,
        /// The residuals found.
        residuals: Kkt,
    },
    /// The answer satisfies the KKT conditions of a stiffness that is not positive definite.
    #[error(
        "{method} gave an answer that stores negative energy: the stiffness is not positive definite"
    )]
    NotDefinite {
        /// The solver's name.
        method: &'static str,
    },
    /// One of TAO's types ended above the tolerance.
    #[error(
        "tao:{kind} stopped after {iterations} iterations: {} (TaoConvergedReason {reason}, \
        {false_claims} false claims of convergence)", residuals.missed(*tolerance)
    )]
    TaoStopped {
        /// TAO's type.
        kind: String,
        /// Iterations done, all calls together.
        iterations: usize,
        /// Iterations of the linear solver inside.
        linear_iterations: usize,
        /// TaoConvergedReason of the last call.
        reason: i32,
        /// Calls that claimed convergence although the KKT residuals reject the answer.
        false_claims: usize,
        /// The tolerance missed.
        tolerance: f64,
        /// The residuals where it stood.
        residuals: Kkt,
    },
    /// PETSc failed inside one of TAO's types.
    #[error("tao:{kind} cannot solve this: {source}")]
    TaoFailed {
        /// TAO's type.
        kind: String,
        /// What PETSc said.
        source: PetscError,
    },
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
}
