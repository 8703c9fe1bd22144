//! A second solver for steps in which the chosen solver stops short of the tolerance.

use super::ContactStep;
use crate::{
    contact::ContactError,
    evolution::{RunError, Step},
};
use std::mem;

impl ContactStep<'_> {
    /// u_n at `time` for the nodal damage `zeta`, from the solver. If it stops short, its rescuer solves the step,
    /// and the step's report names it. Every solve starts from the accepted steps; the rescuer's without the
    /// solver's warm start, which it cannot use.
    ///
    /// # Errors
    /// The solver failed, or neither its answers nor its rescuer's met the KKT tolerance.
    pub fn solve(&mut self, step: usize, time: f64, zeta: &[f64]) -> Result<Step, RunError> {
        let comm = self.problem.body.nodes.partition.comm();
        let solved = self.solve_by_one(step, time, zeta, true);
        let Err(RunError::Contact { source, .. }) = &solved else { return solved };
        let Some(rescuer) = self.rescuer.as_mut().filter(|_| source.may_be_rescued(comm)) else {
            return solved;
        };
        mem::swap(&mut self.solver, rescuer);
        let rescued = self.solve_by_one(step, time, zeta, false);
        let name = self.solver.name();
        self.rescuer.iter_mut().for_each(|other| mem::swap(&mut self.solver, other));
        // Nor can the solver use the rescuer's warm start in the next step.
        self.next.warm_start.clear();
        let is_limited = |error: &ContactError| matches!(error, ContactError::Limited { .. });
        match rescued {
            // The first error is reported, unless only the rescuer's error states the limit by rounding.
            Err(RunError::Contact { source: further, .. })
                if is_limited(source) || !is_limited(&further) =>
            {
                solved
            }
            Err(other) => Err(other),
            Ok(mut step) => {
                step.report.rescued_by = Some(name);
                step.report.fallbacks += 1;
                step.record.fallbacks += 1;
                Ok(step)
            }
        }
    }
}
