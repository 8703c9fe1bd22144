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
    /// that it does not depend on how the first one lost its way. Where it does no better, all is
    /// as if it had not been asked.
    fn rescue(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        failure: ContactError,
    ) -> Result<ContactReport, ContactError> {
        let worst = |c: &Vector| problem.residuals(self.session, c).map(|kkt| kkt.worst());
        let mut left = Vector::zeros(self.session, c.owned())?;
        left.copy(c)?;
        c.write(|c| c.fill(0.0))?;
        self.second.set_warm_start(&[]);
        let ended = self.second.solve(problem, c);
        if ended.as_ref().is_err_and(|error| !error.stopped_short()) {
            return ended;
        }
        if worst(&left)? <= worst(c)? {
            c.copy(&left)?;
            return Err(failure);
        }
        self.first.set_warm_start(&[]);
        match (failure, ended) {
            (first, Err(second)) => {
                Err(ContactError::NotRescued { first: Box::new(first), second: Box::new(second) })
            }
            (first, Ok(rescue)) => {
                let mut report = match first {
                    ContactError::NotConverged { report, .. } => *report,
                    _ => ContactReport::default(),
                };
                report.add(&rescue);
                report.fallbacks += 1;
                report.rescued_by = Some(self.second.name());
                Ok(report)
            }
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
