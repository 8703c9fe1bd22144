//! Other solvers for steps in which the chosen solver stops short of the tolerance.

use super::ContactStep;
use crate::evolution::{RunError, Step};
use std::mem;

impl ContactStep<'_> {
    /// u_n at `time` for the nodal damage `zeta`, from the solver. If it stops short, its rescuers try the step, one after
    /// the other, and the step's report names the one that solves it. Every solve starts from the accepted steps; a
    /// rescuer's without the solver's warm start, which it cannot use.
    ///
    /// # Errors
    /// The solver failed, or neither its answers nor its rescuers' met the KKT tolerance.
    pub fn solve(&mut self, step: usize, time: f64, zeta: &[f64]) -> Result<Step, RunError> {
        let comm = self.problem.body.nodes.partition.comm();
        let mut failed = match self.solve_by_one(step, time, zeta, true) {
            Ok(step) => return Ok(step),
            Err(error) => error,
        };
        for i in 0..self.rescuers.len() {
            let RunError::Contact { source, .. } = &failed else { return Err(failed) };
            if !source.may_be_rescued(comm) {
                return Err(failed);
            }
            mem::swap(&mut self.solver, &mut self.rescuers[i]);
            let rescued = self.solve_by_one(step, time, zeta, false);
            let name = self.solver.name();
            mem::swap(&mut self.solver, &mut self.rescuers[i]);
            // Nor can the solver use the rescuer's in the next step.
            self.next.warm_start.clear();
            match rescued {
                // The first error is reported, unless only a rescuer's error states the limit by rounding.
                Err(RunError::Contact { source: further, .. })
                    if source.is_limited() || !further.is_limited() => {}
                Err(other) => failed = other,
                Ok(mut step) => {
                    step.report.rescued_by = Some(name);
                    step.report.fallbacks += 1;
                    step.record.fallbacks += 1;
                    return Ok(step);
                }
            }
        }
        Err(failed)
    }
}
