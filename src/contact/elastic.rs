//! The linear systems inside contact solvers.

use super::{ContactError, ContactProblem, ContactReport, Kkt};
use crate::{
    cholesky::{Booking, Condensed, Factor, LinearSolver, LinearSystem, Precision, SolveReport},
    petsc::{Matrix, PetscError, Session, Vector},
};

impl ContactProblem<'_> {
    /// The same with unknowns prescribed, all of them bounded.
    pub(super) fn system_with<'a>(&'a self, prescribed: &'a [usize]) -> LinearSystem<'a> {
        let prescribed = (self.bound_count() > 0).then_some(prescribed);
        LinearSystem { prescribed, ..self.system() }
    }

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

/// What PETSc options of these systems begin with.
pub(crate) const PREFIX: &str = "elastic_";

/// Half the digits are enough for a preconditioner, and half the bytes to read.
fn new_factor(session: &Session) -> Factor {
    Factor::new(session, Precision::Preconditioner)
}

/// A [`LinearSolver`] for the successive systems of a contact solver, which have the same pattern.
pub(super) struct ElasticSolver<'s> {
    /// Whose systems they are, for messages.
    pub(super) method: &'static str,
    pub(super) session: &'s Session,
    solver: Option<LinearSolver>,
    /// That of the first solve, perhaps from a checkpoint.
    first_factor: Option<Factor>,
}

impl<'s> ElasticSolver<'s> {
    pub(super) fn new(session: &'s Session, method: &'static str) -> Self {
        Self { method, session, solver: None, first_factor: Some(new_factor(session)) }
    }

    /// The factor, also before the first solve.
    pub(super) fn factor(&mut self) -> Option<&mut Factor> {
        match &mut self.solver {
            Some(solver) => Some(solver.factor()),
            None => self.first_factor.as_mut(),
        }
    }

    /// The solver, if it has solved anything.
    pub(super) fn into_linear_solver(self) -> Option<LinearSolver> {
        self.solver
    }

    /// Solves from the start `c` for the load `f` until the forces left on the free unknowns are at most
    /// `limit` in ‖·‖₂, N.
    ///
    /// # Errors
    /// They do not get there: the system is not positive definite, or too ill-conditioned for this
    /// limit. Or PETSc failed.
    pub(super) fn solve(
        &mut self,
        problem: &ContactProblem,
        system: LinearSystem,
        (f, limit): (&Vector, f64),
        c: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let solved = self.solver(problem, system.matrix)?.solve_renewing(system, f, c, limit)?;
        self.account(solved, report)
    }

    /// Adds a solve to the report; an error if it did not converge.
    fn account(&self, solved: SolveReport, report: &mut ContactReport) -> Result<(), ContactError> {
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

    /// The first of three steps of a solve with a condensed factor: takes the forces f − K c that `c` leaves;
    /// true if those on the free unknowns are small enough already. Else [`Self::condense`] follows, then
    /// [`Self::expand`].
    pub(super) fn start(
        &mut self,
        problem: &ContactProblem,
        system: LinearSystem,
        c: &Vector,
    ) -> Result<bool, ContactError> {
        let solver = self.solver(problem, system.matrix)?;
        Ok(solver.start(system, problem.load, c, problem.linear_residual())?)
    }

    /// The small problem that is left for the bounded unknowns when all others are eliminated. Collective.
    pub(super) fn condense(
        &mut self,
        problem: &ContactProblem,
        system: LinearSystem,
        report: &mut ContactReport,
    ) -> Result<Option<Condensed<'_>>, ContactError> {
        let solver = self.solver(problem, system.matrix)?;
        let before = solver.factor().factorisations();
        solver.prepare(system, problem.linear_residual())?;
        report.factorisations += solver.factor().factorisations() - before;
        Ok(solver.condense(system)?)
    }

    /// Moves `c` to the solution of the small problem and takes the forces that this leaves, as
    /// [`LinearSolver::expand`].
    pub(super) fn expand(
        &mut self,
        problem: &ContactProblem,
        system: LinearSystem,
        moved: bool,
        c: &mut Vector,
    ) -> Result<(), ContactError> {
        Ok(self.solver(problem, system.matrix)?.expand(system, moved, c)?)
    }

    /// Solves on from there, as [`Self::solve`] does.
    pub(super) fn finish(
        &mut self,
        problem: &ContactProblem,
        system: LinearSystem,
        c: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let solver = self.solver(problem, system.matrix)?;
        let solved = solver.finish(system, c, problem.linear_residual())?;
        self.account(solved, report)
    }

    /// A new factor, where the present one takes too long.
    pub(super) fn factorise(
        &mut self,
        problem: &ContactProblem,
        system: LinearSystem,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        report.factorisations += 1;
        self.solver(problem, system.matrix)?.factorise(system)?;
        Ok(())
    }

    /// Whether as many corrections were made as the factor is worth.
    pub(super) fn is_slow(&self, corrections: usize, limit: f64) -> bool {
        self.solver.as_ref().is_none_or(|solver| solver.is_slow(corrections, limit))
    }

    /// Ends a solve of so many corrections, which left forces of this norm, N.
    pub(super) fn end_solve(&mut self, corrections: usize, left: f64, limit: f64) {
        if let Some(solver) = &mut self.solver {
            solver.end_solve(corrections, left, limit);
        }
    }

    /// Whether factors of K are condensed to the bounds. Collective.
    pub(super) fn is_condensed(&mut self, problem: &ContactProblem) -> Result<bool, PetscError> {
        self.solver(problem, problem.stiffness)?.is_condensed(problem.stiffness)
    }

    fn solver(
        &mut self,
        problem: &ContactProblem,
        matrix: &Matrix,
    ) -> Result<&mut LinearSolver, PetscError> {
        let mut solver = match self.solver.take() {
            Some(solver) => solver,
            None => {
                let factor = self.first_factor.take().unwrap_or_else(|| new_factor(self.session));
                LinearSolver::with(self.session, PREFIX, factor, matrix.owned())?
            }
        };
        let bounded = problem.bounds.iter().map(|bound| bound.dof);
        solver.factor().set_condensed(matrix, bounded)?;
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
