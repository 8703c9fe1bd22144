//! The contact problem (26) in the unknowns of the nodal bases.

use super::{Bound, Kkt, Scales};
use crate::{
    linear::LinearSystem,
    maximum,
    petsc::{Communicator, Matrix, PetscError, Session, Vector},
};
use nalgebra::{DMatrix, DVector};

/// min ½ cᵀKc − fᵀc  subject to  lower_i ≤ c_i ≤ upper_i on the bounded unknowns.
///
/// The unknowns c are displacements in the nodal bases of the constraints: each bound concerns
/// one of them, prescribed ones have an identity row and load 0.
pub struct ContactProblem<'a> {
    /// PETSc.
    pub session: &'a Session,
    /// K, N/m. `LinearSystem::of` makes the linear system for [`LinearSolver`](crate::linear::LinearSolver) of it.
    pub stiffness: &'a Matrix,
    /// The size of the diagonal of K, N/m.
    pub stiffness_scale: f64,
    /// f, N: loads minus the forces of prescribed displacements.
    pub load: &'a Vector,
    /// The bounded unknowns of this rank, in increasing order of `dof`.
    pub bounds: &'a [Bound],
    /// u·ν of the null space of K, one row per bound: rigid motions that contact alone constrains. Without columns K is positive
    /// definite.
    pub rigid: &'a DMatrix<f64>,
    /// The work of the load on each of these motions.
    pub work: &'a DVector<f64>,
    /// The scales of relative residuals; larger displacements raise them.
    pub scales: Scales,
    /// KKT residuals to reach, relative.
    pub tolerance: f64,
    /// The ranks among which the unknowns are divided. The owner of an unknown knows its bound. All ranks
    /// decide together.
    pub comm: Communicator,
}

impl ContactProblem<'_> {
    /// K c = f on all unknowns.
    pub(super) fn system(&self) -> LinearSystem<'_> {
        LinearSystem { scale: self.stiffness_scale, ..LinearSystem::of(self.stiffness) }
    }

    /// The same with unknowns prescribed, all of them bounded.
    pub(super) fn system_with<'a>(&'a self, prescribed: &'a [usize]) -> LinearSystem<'a> {
        let prescribed = (self.bound_count() > 0).then_some(prescribed);
        LinearSystem { prescribed, ..self.system() }
    }

    /// The largest ‖residual‖₂ of linear systems, N: below the tolerance of the KKT residuals.
    pub(super) fn linear_residual(&self) -> f64 {
        0.3 * self.tolerance * self.scales.force
    }

    /// Is K positive definite?
    pub(super) fn definite(&self) -> bool {
        self.rigid.ncols() == 0
    }

    /// Number of bounds, of all ranks.
    pub(super) fn bound_count(&self) -> usize {
        self.comm.count(self.bounds.len())
    }

    /// ‖v‖_∞ over all ranks.
    pub(super) fn max_norm(&self, v: &Vector) -> Result<f64, PetscError> {
        Ok(self.comm.max(v.read(|v| v.iter().fold(0.0, |max, v| maximum(max, v.abs())))?))
    }

    /// v at the bounded unknowns.
    pub(super) fn at_bounds(&self, v: &Vector) -> Result<Vec<f64>, PetscError> {
        v.read(|v| self.bounds.iter().map(|bound| v[bound.dof]).collect())
    }

    /// Kc − f, N.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn residual(&self, c: &Vector) -> Result<Vector, PetscError> {
        let mut residual = Vector::zeros(self.session, c.owned())?;
        self.stiffness.multiply(c, &mut residual)?;
        residual.axpby(-1.0, self.load, 1.0)?;
        Ok(residual)
    }

    /// The KKT residuals of `c` with the assembled K; a larger displacement raises their scale. (The
    /// [`Certificate`](super::Certificate) decides about an answer.) Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn residuals(&self, c: &Vector) -> Result<Kkt, PetscError> {
        let mut residual = self.residual(c)?;
        let displacement = maximum(self.scales.displacement, self.max_norm(c)?);
        let scales = Scales { displacement, ..self.scales };
        let (mut primal, mut pull, mut complementarity) = (0.0, 0.0, 0.0);
        let at_bounds = self.at_bounds(&residual)?.into_iter().zip(self.at_bounds(c)?);
        for (bound, (r, c)) in self.bounds.iter().zip(at_bounds) {
            let (p, above, below) = (-r, bound.upper - c, c - bound.lower);
            primal = maximum(primal, maximum(-above, -below));
            complementarity = maximum(complementarity, scales.natural(p, above));
            match bound.lower.is_finite() {
                true => complementarity = maximum(complementarity, scales.natural(-p, below)),
                false => pull += maximum(-p, 0.0).powi(2),
            }
        }
        let free = residual.write(|r| {
            self.bounds.iter().for_each(|bound| r[bound.dof] = 0.0);
            r.iter().map(|r| r * r).sum()
        })?;
        let mut sums = [free, pull];
        self.comm.sum(&mut sums);
        Ok(Kkt {
            stationarity: scales.of_force(sums[0].sqrt()),
            primal: scales.of_displacement(self.comm.max(primal)),
            dual: scales.of_force(sums[1].sqrt()),
            complementarity: self.comm.max(complementarity),
        })
    }
}
