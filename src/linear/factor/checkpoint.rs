//! The state of a factor in a checkpoint. A restart makes the same factor from it.

use super::Factor;
use crate::{
    linear::{Precision, RefactorisationPolicy},
    petsc::{Matrix, PetscError},
};
use serde::{Deserialize, Serialize};
use std::mem::take;

/// The state of a factor in a checkpoint; see the fields of [`Factor`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FactorState {
    values: Vec<f64>,
    precision: Precision,
    policy: Option<RefactorisationPolicy>,
    applications: usize,
    factorisations: usize,
}

/// The history of a factor in a checkpoint, beside its matrix.
pub(in crate::linear) struct History {
    policy: Option<RefactorisationPolicy>,
    factorisations: usize,
}

impl Factor {
    /// The state for a checkpoint.
    pub fn state(&self) -> FactorState {
        FactorState {
            values: self.values.clone(),
            precision: self.precision,
            policy: self.policy,
            applications: self.applications,
            factorisations: self.factorisations,
        }
    }

    /// Restores the state of a checkpoint. The next solve makes the factor.
    pub fn set_state(&mut self, state: FactorState) {
        let FactorState { values, precision, policy, applications, factorisations } = state;
        self.loaded = policy.is_some();
        (self.values, self.precision, self.policy) = (values, precision, policy);
        (self.applications, self.factorisations) = (applications, factorisations);
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
        copy.set_entries(&self.values)?;
        let history = History { policy: self.policy.take(), factorisations: self.factorisations };
        Ok(Some((copy, history)))
    }

    /// Restores the history of a factor that was made again.
    pub(in crate::linear) fn keep_history(&mut self, history: History) {
        (self.policy, self.factorisations) = (history.policy, history.factorisations);
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
