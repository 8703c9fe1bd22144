//! The diagonal scaling between the factored matrix and a later one.

use crate::petsc::{Matrix, PetscError, Vector};

/// E^½ with E = diag(A₀)/diag(A), for the factored matrix A₀ and a later matrix A; owned rows.
#[derive(Default)]
pub(super) struct Scaling {
    /// diag(A₀).
    factored: Vec<f64>,
    /// E^½.
    root: Vec<f64>,
    /// The last scaled vector.
    scaled: Vec<f64>,
}

impl Scaling {
    /// The scaling of the factored matrix itself, E = 1.
    pub(super) fn of_factored(matrix: &Matrix) -> Result<Self, PetscError> {
        let factored = matrix.diagonal()?;
        Ok(Self { root: vec![1.0; factored.len()], factored, scaled: Vec::new() })
    }

    /// Sets E for a later matrix. E is 1 where the quotient is not positive.
    pub(super) fn set(&mut self, later: &Matrix) -> Result<(), PetscError> {
        let diagonal = later.diagonal()?;
        let root = |(old, new): (&f64, &f64)| match old * new > 0.0 {
            true => (old / new).sqrt(),
            false => 1.0,
        };
        self.root = self.factored.iter().zip(&diagonal).map(root).collect();
        Ok(())
    }

    /// The number of owned rows.
    pub(super) fn rows(&self) -> usize {
        self.root.len()
    }

    /// The entries of E^½ of these owned unknowns.
    pub(super) fn of(&self, unknowns: &[usize]) -> Vec<f64> {
        unknowns.iter().map(|&unknown| self.root[unknown]).collect()
    }

    /// E^½ r.
    pub(super) fn apply(&mut self, r: &Vector) -> Result<&[f64], PetscError> {
        let Self { root, scaled, .. } = self;
        scaled.clear();
        r.read(|r| scaled.extend(r.iter().zip(&*root).map(|(r, e)| e * r)))?;
        Ok(scaled)
    }

    /// `z` ← E^½ `z`.
    pub(super) fn apply_in_place(&self, z: &mut Vector) -> Result<(), PetscError> {
        z.write(|z| z.iter_mut().zip(&self.root).for_each(|(z, e)| *z *= e))
    }
}
