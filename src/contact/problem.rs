//! What a contact solver is given and what it answers.

use super::{Bound, Kkt, Scales};
use crate::{
    petsc::{Communicator, Matrix, PetscError, Session, Vector},
    phases::Phases,
};
use nalgebra::{DMatrix, DVector};

/// min ½ cᵀKc − fᵀc  subject to  lower_i ≤ c_i ≤ upper_i on the bounded unknowns.
///
/// The unknowns c are displacements in the nodal bases of the constraints: each bound concerns
/// one of them, prescribed ones have an identity row and load 0.
pub struct ContactProblem<'a> {
    /// K, N/m.
    pub stiffness: &'a Matrix,
    /// The size of K's diagonal, N/m.
    pub stiffness_scale: f64,
    /// f, N: loads less the forces of prescribed displacements.
    pub load: &'a Vector,
    /// The bounded unknowns.
    pub bounds: &'a [Bound],
    /// u·ν of the rigid motions that only contact holds, one row per bound; no columns where
    /// K is positive definite.
    pub rigid: &'a DMatrix<f64>,
    /// The work of the load on each of these motions.
    pub work: &'a DVector<f64>,
    /// What counts as 1 in relative residuals; displacements larger than its own raise it.
    pub scales: Scales,
    /// KKT residuals to reach, relative.
    pub tolerance: f64,
    /// The ranks among which the unknowns are divided: bounds are their owners', what is
    /// decided is decided by all.
    pub comm: Communicator,
    /// Where the parts of the solve book their time, as `contact/…`.
    pub phases: &'a Phases,
}

impl ContactProblem<'_> {
    /// ‖residual‖₂ that linear systems are solved to, N: well below what the KKT residuals may be.
    pub fn linear_residual(&self) -> f64 {
        0.1 * self.tolerance * self.scales.force
    }

    /// The scales for an iterate.
    pub fn scales(&self, c: &Vector) -> Result<Scales, PetscError> {
        let displacement = self.scales.displacement.max(self.size(c)?);
        Ok(Scales { displacement, ..self.scales })
    }

    /// The KKT residuals of `c` by the assembled K (the final word has the
    /// [`Certificate`](super::Certificate)).
    pub fn residuals(&self, session: &Session, c: &Vector) -> Result<Kkt, PetscError> {
        let residual = self.residual(session, c)?;
        let scales = self.scales(c)?;
        residual.read(|r| {
            c.read(|c| {
                let at = |bound: &Bound| (-r[bound.dof], c[bound.dof]);
                let mut free = r.to_vec();
                self.bounds.iter().for_each(|bound| free[bound.dof] = 0.0);
                let free = free.iter().map(|r| r * r).sum();
                self.kkt(free, self.bounds.iter().map(at), scales)
            })
        })?
    }

    /// The KKT residuals when |r|² of the unbounded unknowns of this rank is `free`, N², and the
    /// contact force and the unknown of each bound are (p, c). Collective.
    pub fn kkt(&self, free: f64, bounded: impl Iterator<Item = (f64, f64)>, scales: Scales) -> Kkt {
        let (mut primal, mut pull, mut complementarity) = (0.0_f64, 0.0, 0.0_f64);
        for (bound, (p, c)) in self.bounds.iter().zip(bounded) {
            let (above, below) = (bound.upper - c, c - bound.lower);
            primal = primal.max(-above.min(below));
            complementarity = complementarity.max(scales.natural(p, above));
            match bound.lower.is_finite() {
                true => complementarity = complementarity.max(scales.natural(-p, below)),
                false => pull += p.min(0.0).powi(2),
            }
        }
        let mut sums = [free, pull];
        self.comm.sum(&mut sums);
        Kkt {
            stationarity: scales.of_force(sums[0].sqrt()),
            primal: scales.of_displacement(self.comm.max(primal)),
            dual: scales.of_force(sums[1].sqrt()),
            complementarity: self.comm.max(complementarity),
        }
    }

    /// The largest entry in absolute value.
    pub fn size(&self, c: &Vector) -> Result<f64, PetscError> {
        Ok(self.comm.max(c.read(|c| c.iter().fold(0.0_f64, |m, v| m.max(v.abs())))?))
    }

    /// Number of bounds, of all ranks.
    pub fn all_bounds(&self) -> usize {
        self.comm.count(self.bounds.len())
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
pub(crate) fn unheld(
    comm: Communicator,
    rigid: &DMatrix<f64>,
    pressing: &[bool],
) -> Vec<DVector<f64>> {
    let motions = rigid.ncols();
    if motions == 0 {
        return Vec::new();
    }
    let rows = rigid.row_iter().zip(pressing).filter(|(_, on)| **on);
    let mut gram =
        rows.fold(DMatrix::zeros(motions, motions), |sum, (row, _)| sum + row.transpose() * row);
    comm.sum(gram.as_mut_slice());
    let eigen = gram.symmetric_eigen();
    let cut = 1e-10 * comm.total(rigid.norm_squared());
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
    /// Of these, the times TAO gave the answer in the place of the active set.
    pub rescues: usize,
    /// Mean factor by which an iteration shrank the change of the multiplier, where the method
    /// is a fixed-point iteration.
    pub contraction: Option<f64>,
    /// ω of penalty-duality, Pa/m.
    pub omega: Option<f64>,
    /// Calls of TAO that claimed convergence to an answer which the KKT residuals rejected.
    pub false_claims: usize,
}

impl ContactReport {
    /// Adds what a further solve of the same problem took.
    pub fn add(&mut self, further: &Self) {
        self.iterations += further.iterations;
        self.linear_iterations += further.linear_iterations;
        self.factorisations += further.factorisations;
        self.fallbacks += further.fallbacks;
        self.rescues += further.rescues;
        self.contraction = further.contraction;
        self.omega = further.omega;
        self.false_claims += further.false_claims;
    }
}

/// A contact solve that did not end well.
///
/// [`RunError`](crate::evolution::RunError) adds what to try, which depends on the scene.
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
    /// Rounding keeps the answer from the tolerance.
    #[error(
        "{source}; double precision reaches only about {attainable:.0e} here (triangles or parts much \
         longer than wide, nearly incompressible or almost broken material): set contact.tolerance \
         to that or more, or mend the mesh"
    )]
    Limited {
        /// How the solve ended.
        source: Box<Self>,
        /// The tolerance that rounding allows, about.
        attainable: f64,
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

impl ContactError {
    /// Whether the method has missed a tolerance that may not be out of reach.
    pub fn is_missed(&self) -> bool {
        matches!(
            self,
            Self::NotConverged { .. } | Self::NotCertified { .. } | Self::TaoStopped { .. }
        )
    }
}
