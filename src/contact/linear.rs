//! No obstacle: one linear solve.

use super::{ContactError, ContactProblem, ContactReport, ContactSolver};
use crate::petsc::{LinearSolver, Session, Vector};

/// K c = f by a Cholesky factor that is kept while K does not change.
pub(super) struct Linear<'s> {
    session: &'s Session,
    factor: Option<(usize, LinearSolver)>,
}

impl<'s> Linear<'s> {
    pub(super) fn new(session: &'s Session) -> Self {
        Self { session, factor: None }
    }
}

impl ContactSolver for Linear<'_> {
    fn name(&self) -> &'static str {
        "linear"
    }

    fn warm_start(&self) -> Vec<f64> {
        Vec::new()
    }

    fn set_warm_start(&mut self, _kept: &[f64]) {}

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport { iterations: 1, ..Default::default() };
        if self.factor.as_ref().is_none_or(|(revision, _)| *revision != problem.revision) {
            let mut solver = match self.factor.take() {
                Some((_, solver)) => solver,
                None => LinearSolver::cholesky(self.session, "elastic_")?,
            };
            solver.factorise(problem.stiffness)?;
            report.factorisations = 1;
            self.factor = Some((problem.revision, solver));
        }
        if let Some((_, solver)) = &mut self.factor {
            let krylov = solver.solve(problem.load, c, problem.linear_residual())?;
            report.linear_iterations = krylov.iterations;
            if !krylov.converged {
                return Err(ContactError::NotConverged {
                    method: self.name(),
                    iterations: krylov.iterations,
                    detail: "conjugate gradients on the factored stiffness did not converge: \
                             the matrix is not positive definite"
                        .into(),
                });
            }
        }
        Ok(report)
    }
}
