//! The state of a factor in a checkpoint. A restart makes the same factor from it.

use super::Factor;
use crate::{
    linear::{Precision, RefactorisationPolicy},
    petsc::{Matrix, PetscError},
};
use serde::{Deserialize, Serialize};
use std::mem::take;

/// The state of a factor that checkpoints keep.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FactorState {
    /// The values of the last factored matrix. A restart makes the same factor from them.
    pub(super) values: Vec<f64>,
    /// The precision of the factor of a substructure.
    pub(super) precision: Precision,
    /// `None` before the first factorisation and after a failed one.
    pub(super) policy: Option<RefactorisationPolicy>,
    /// Applications in the present solve.
    pub(super) applications: usize,
    /// Factorisations that succeeded.
    pub(super) factorisations: usize,
}

/// The history of a factor in a checkpoint, beside its matrix: the refactorisation policy and the number of
/// factorisations.
pub(in crate::linear) type History = (Option<RefactorisationPolicy>, usize);

impl FactorState {
    /// The state before the first factorisation.
    pub(super) fn new(precision: Precision) -> Self {
        Self { values: Vec::new(), precision, policy: None, applications: 0, factorisations: 0 }
    }
}

impl Factor {
    /// The state for a checkpoint.
    pub fn state(&self) -> FactorState {
        self.state.clone()
    }

    /// Restores the state of a checkpoint. The next solve makes the factor.
    pub fn set_state(&mut self, state: FactorState) {
        self.loaded = state.policy.is_some();
        self.state = state;
    }

    /// The matrix of a loaded factor that must still be made, with the pattern of `matrix`, and its history
    /// for [`Self::keep_history`].
    pub(in crate::linear) fn take_loaded(
        &mut self,
        matrix: &Matrix,
    ) -> Result<Option<(Matrix, History)>, PetscError> {
        if !take(&mut self.loaded) {
            return Ok(None);
        }
        let mut copy = matrix.duplicate()?;
        copy.set_entries(&self.state.values)?;
        Ok(Some((copy, (self.state.policy.take(), self.state.factorisations))))
    }

    /// Restores the history of a factor that was made again.
    pub(in crate::linear) fn keep_history(&mut self, history: History) {
        (self.state.policy, self.state.factorisations) = history;
    }

    /// Makes a loaded factor again, of a matrix with the pattern of this one. Collective.
    ///
    /// # Errors
    /// The pattern differs, or as in [`Self::factorise`].
    pub(crate) fn remake(&mut self, matrix: &Matrix) -> Result<(), PetscError> {
        if let Some((loaded, history)) = self.take_loaded(matrix)?
            && self.factorise(&loaded)?
        {
            self.keep_history(history);
        }
        Ok(())
    }
}
