//! The factor inside TAO's methods.

use super::{Factor, Reduction};
use crate::petsc::{Matrix, PetscError, ShellPreconditioner, Vector};

/// Every new operator begins a solve. Where bounds are active it is K with the rows and columns of their
/// unknowns set to 0 but for the diagonal; or, of some types, without them: then it has a factor of its own.
impl ShellPreconditioner for Factor {
    fn set_up(&mut self, k: &Matrix, operator: &Matrix) -> Result<bool, PetscError> {
        let rows = operator.size()?;
        let condensed = rows == k.size()? && self.is_condensed(k)?;
        let factored = if condensed { k } else { operator };
        self.remake(factored)?;
        // All its solves are asked for about as much.
        self.end_solve(Reduction { asked: 1.0, reached: 1.0 });
        let prescribed = if condensed { self.masked(k, operator)? } else { Vec::new() };
        let restrict = |this: &mut Self| match condensed {
            true => this.restrict(&prescribed),
            false => Ok(true),
        };
        let fits = self.method.as_ref().is_some_and(|(size, _)| *size == rows);
        let usable = fits && self.iteration_limit(1.0).is_some() && restrict(self)?;
        Ok(usable || (self.factorise(factored)? && restrict(self)?))
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        Self::apply(self, r, z)
    }
}

impl Factor {
    /// The condensed unknowns that are coupled with others in `k` but not in `operator`.
    fn masked(&self, k: &Matrix, operator: &Matrix) -> Result<Vec<usize>, PetscError> {
        let mut masked = Vec::new();
        for &unknown in &self.condensed.1 {
            let row = k.rows().start + unknown as i32;
            let coupled = |columns: &[i32], values: &[f64]| {
                columns.iter().zip(values).any(|(column, value)| *column != row && *value != 0.0)
            };
            if k.read_row(row, coupled)? && !operator.read_row(row, coupled)? {
                masked.push(unknown);
            }
        }
        Ok(masked)
    }
}
