//! Without an obstacle a contact problem is one linear system.

use super::{
    ContactError, ContactProblem, ContactReport, ContactSolver, Kkt, elastic::ElasticSolver,
};
use crate::petsc::{Session, Vector};

/// K c = f.
pub(super) struct Linear<'s> {
    elastic: ElasticSolver<'s>,
}

impl<'s> Linear<'s> {
    pub(super) fn new(session: &'s Session) -> Self {
        Self { elastic: ElasticSolver::new(session) }
    }
}

impl ContactSolver for Linear<'_> {
    fn name(&self) -> &'static str {
        "linear"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport { iterations: 1, ..Default::default() };
        let (system, limit) = (problem.system(), problem.linear_residual());
        match self.elastic.solve(system, problem.load, c, limit, &mut report)? {
            true => Ok(report),
            false => Err(ContactError::NotConverged {
                method: self.name().to_owned(),
                residuals: Kkt::UNKNOWN,
                report: Box::new(ContactReport { iterations: report.linear_iterations, ..report }),
                detail: "conjugate gradients on the factored stiffness did not converge: the \
                         matrix is not positive definite"
                    .into(),
            }),
        }
    }
}
