//! The condensed unknowns of a [`Factor`]: those that may be prescribed without a new factor.

use super::Factor;
use crate::petsc::{Matrix, PetscError};

impl Factor {
    /// Condenses factors of matrices of this size: these owned unknowns may be prescribed. A change of these
    /// unknowns discards the factor. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn set_condensed(
        &mut self,
        matrix: &Matrix,
        unknowns: impl Iterator<Item = usize>,
    ) -> Result<(), PetscError> {
        let condensed = (matrix.size()?, unknowns.collect());
        if self.comm.any(condensed != self.condensed) {
            (self.condensed, self.substructure) = (condensed, None);
            self.state.policy = self.state.policy.take().filter(|_| self.loaded);
        }
        Ok(())
    }

    /// Is the factor for matrices with this number of rows?
    pub(crate) fn is_for(&self, rows: usize) -> bool {
        self.substructure.as_ref().is_some_and(|(size, _)| *size == rows)
    }

    /// The condensed unknowns that are coupled with others in `k` but not in `operator`. Collective.
    pub(crate) fn prescribed_in(
        &self,
        k: &Matrix,
        operator: &Matrix,
    ) -> Result<Vec<usize>, PetscError> {
        let (mut prescribed, first) = (Vec::new(), k.rows().start);
        let [k, operator] = [k.assembled_rows()?, operator.assembled_rows()?];
        for &unknown in &self.condensed.1 {
            let row = first + unknown as i32;
            let coupled = |columns: &[i32], values: &[f64]| {
                columns.iter().zip(values).any(|(column, value)| *column != row && *value != 0.0)
            };
            if k.read(row, coupled)? && !operator.read(row, coupled)? {
                prescribed.push(unknown);
            }
        }
        Ok(prescribed)
    }

    /// Does the factor have condensed unknowns?
    pub(crate) fn is_condensed(&self) -> bool {
        match &self.substructure {
            Some((rows, Some(_))) => {
                *rows == self.condensed.0 && self.comm.any(!self.condensed.1.is_empty())
            }
            _ => false,
        }
    }

    /// Prescribes some of the condensed unknowns of the factored matrix. It returns false if the rest is not
    /// positive definite. Collective.
    ///
    /// # Errors
    /// There is no memory for it.
    pub(crate) fn prescribe(&mut self, prescribed: &[usize]) -> Result<bool, PetscError> {
        let Some(factor) = self.substructure() else { return Ok(true) };
        factor.prescribe(prescribed)
    }
}
