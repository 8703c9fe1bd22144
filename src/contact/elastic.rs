//! The linear systems inside contact solvers.

use super::{Bound, ContactError, ContactProblem, ContactReport, Kkt};
use crate::{
    archive::{Archive, ArchiveError},
    cholesky::{Booking, Choose, Factor, LinearSolver, LinearSystem, Precision},
    petsc::{Matrix, PetscError, Session, Vector},
};

impl ContactProblem<'_> {
    /// K c = f on all unknowns.
    pub(super) fn system(&self) -> LinearSystem<'_> {
        let booking = Booking {
            phases: self.phases,
            factorisation: "contact/factorisation",
            restriction: "contact/Schur complement",
            triangular_solves: "contact/triangular solves",
            product: "contact/products",
        };
        LinearSystem {
            scale: self.stiffness_scale,
            booking: Some(booking),
            ..LinearSystem::of(self.stiffness)
        }
    }
}

/// A [`LinearSolver`] for the successive systems of a contact solver, which have the same pattern.
pub(super) struct ElasticSolver<'s> {
    /// Whose systems they are, for messages.
    pub(super) method: &'static str,
    pub(super) session: &'s Session,
    solver: Option<LinearSolver>,
    /// The factor of a checkpoint, before the first solve.
    loaded: Option<Factor>,
}

impl<'s> ElasticSolver<'s> {
    pub(super) fn new(session: &'s Session, method: &'static str) -> Self {
        Self { method, session, solver: None, loaded: None }
    }

    /// Saves or loads the factor.
    pub(super) fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        if let Some(solver) = &mut self.solver {
            return solver.factor().archive(archive);
        }
        let mut factor = self.loaded.take().unwrap_or_else(|| self.new_factor());
        factor.archive(archive)?;
        self.loaded = Some(factor);
        Ok(())
    }

    /// The factor, if there is one.
    pub(super) fn into_factor(self) -> Option<Factor> {
        self.solver.map(LinearSolver::into_factor).or(self.loaded)
    }

    fn new_factor(&self) -> Factor {
        // Half the digits are enough for a preconditioner, and half the bytes to read.
        Factor::new(self.session, "elastic_", Precision::Preconditioner)
    }

    /// Solves, with all that is prescribed at the `bounds`, from the start `c` for the load `f`
    /// until the forces left on the free unknowns are at most `limit` in ‖·‖₂, N.
    ///
    /// # Errors
    /// They do not get there: the system is not positive definite, or too ill-conditioned for this
    /// limit. Or PETSc failed.
    pub(super) fn solve(
        &mut self,
        bounds: &[Bound],
        system: LinearSystem,
        (f, limit): (&Vector, f64),
        c: &mut Vector,
        choose: Option<Choose<ContactError>>,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let solved =
            self.solver(bounds, system.matrix)?.solve_choosing(system, f, c, limit, choose)?;
        report.linear_iterations += solved.iterations;
        report.factorisations += solved.factorisations;
        match solved.converged {
            true => Ok(()),
            false => {
                let detail = "the stiffness of its linear system is not positive definite, or too \
                              ill-conditioned for the tolerance";
                Err(ContactError::stopped(self.method, *report, Kkt::UNKNOWN, detail))
            }
        }
    }

    /// Whether factors of K are condensed to the `bounds`. Collective.
    pub(super) fn is_condensed(&mut self, problem: &ContactProblem) -> Result<bool, PetscError> {
        let solver = self.solver(problem.bounds, problem.stiffness)?;
        solver.factor().is_condensed(problem.stiffness)
    }

    fn solver(
        &mut self,
        bounds: &[Bound],
        matrix: &Matrix,
    ) -> Result<&mut LinearSolver, PetscError> {
        let mut solver = match self.solver.take() {
            Some(solver) => solver,
            None => {
                let factor = self.loaded.take().unwrap_or_else(|| self.new_factor());
                LinearSolver::with(self.session, factor, matrix.owned())?
            }
        };
        solver.factor().condense(matrix, bounds.iter().map(|bound| bound.dof))?;
        Ok(self.solver.insert(solver))
    }

    /// f − (K + D) c of the last solve, N, on all unknowns: on prescribed ones the contact forces.
    pub(super) fn forces<R>(&self, reader: impl FnOnce(&[f64]) -> R) -> Result<R, PetscError> {
        match &self.solver {
            Some(solver) => solver.residual().read(reader),
            None => Ok(reader(&[])),
        }
    }
}
