//! A solver with another one behind it.

use super::{ContactReport, ContactSolver};
use crate::{
    contact::{ContactError, ContactProblem},
    petsc::{Session, Vector},
};

/// Asks the first solver, and where that stops short of the tolerance, the second one.
pub(super) struct Rescued<'s> {
    session: &'s Session,
    first: Box<dyn ContactSolver + 's>,
    second: Box<dyn ContactSolver + 's>,
}

impl<'s> Rescued<'s> {
    pub(super) fn new(
        session: &'s Session,
        first: Box<dyn ContactSolver + 's>,
        second: Box<dyn ContactSolver + 's>,
    ) -> Self {
        Self { session, first, second }
    }

    /// The second solver's answer where the first ended with `failure`. It starts from nothing, so
    /// that it does not depend on how the first one lost its way. If it stops short too, the answer
    /// with the smaller KKT residuals is left in c: the certificate may yet accept that.
    fn rescue(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        failure: ContactError,
    ) -> Result<ContactReport, ContactError> {
        let mut left = Vector::zeros(self.session, c.owned())?;
        left.copy(c)?;
        c.write(|c| c.fill(0.0))?;
        self.first.set_warm_start(&[]);
        self.second.set_warm_start(&[]);
        match self.second.solve(problem, c) {
            Ok(rescue) => {
                let mut report = match failure {
                    ContactError::NotConverged { report, .. } => *report,
                    _ => ContactReport::default(),
                };
                report.add(&rescue);
                report.fallbacks += 1;
                report.rescued_by = Some(self.second.name());
                Ok(report)
            }
            Err(second) if second.stopped_short() => {
                let worst = |c: &Vector| problem.residuals(self.session, c).map(|kkt| kkt.worst());
                if worst(&left)? <= worst(c)? {
                    c.copy(&left)?;
                }
                Err(ContactError::NotRescued { first: Box::new(failure), second: Box::new(second) })
            }
            Err(other) => Err(other),
        }
    }
}

impl ContactSolver for Rescued<'_> {
    fn name(&self) -> &'static str {
        self.first.name()
    }

    fn warm_start(&self) -> Vec<f64> {
        self.first.warm_start()
    }

    fn set_warm_start(&mut self, kept: &[f64]) {
        self.first.set_warm_start(kept);
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        match self.first.solve(problem, c) {
            Err(error) if error.stopped_short() => self.rescue(problem, c, error),
            // Of an error inside PETSc other ranks may know nothing.
            Err(error @ ContactError::Failed { .. }) if problem.comm.is_serial() => {
                self.rescue(problem, c, error)
            }
            ended => ended,
        }
    }
}
