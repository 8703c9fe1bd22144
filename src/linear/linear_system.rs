//! Linear systems, as contact solvers and estimates of errors pose them.

use crate::petsc::{Matrix, PetscError, Vector, stage};

/// A x = b on the unknowns that are not prescribed, A positive definite there.
#[derive(Clone, Copy)]
pub struct LinearSystem<'a> {
    /// A.
    pub matrix: &'a Matrix,
    /// The unknowns that keep their values in x (Dirichlet conditions); `None` where no rank has any.
    pub prescribed: Option<&'a [usize]>,
    /// The size of the diagonal entries of A. Prescribed unknowns get this diagonal entry in the factored
    /// matrix.
    pub scale: f64,
}

/// The stage of solves with the factor.
pub(super) const TRIANGULAR_SOLVES: &str = "triangular solves";

impl<'a> LinearSystem<'a> {
    /// A x = b.
    pub fn of(matrix: &'a Matrix) -> Self {
        Self { matrix, prescribed: None, scale: 1.0 }
    }

    /// `y` ← A `x`.
    pub(super) fn multiply(self, x: &Vector, y: &mut Vector) -> Result<(), PetscError> {
        stage("products", || self.matrix.multiply(x, y))
    }
}
