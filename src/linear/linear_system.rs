//! Linear systems, as contact solvers and estimates of errors pose them.

use crate::{
    petsc::{Matrix, PetscError, Vector},
    phases::Phases,
};

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
    /// The phases to which the parts of a solve add their time, by the names below.
    pub phases: Option<&'a Phases>,
}

/// The names of the phases of a solve: only contact has them.
pub(super) const FACTORISATION: &str = "contact/factorisation";
/// A change of the prescribed unknowns in a condensed factor.
pub(super) const PRESCRIPTION: &str = "contact/Schur complement";
/// An application of the factor.
pub(super) const TRIANGULAR_SOLVES: &str = "contact/triangular solves";
/// A product with A.
const PRODUCT: &str = "contact/products";

impl<'a> LinearSystem<'a> {
    /// A x = b.
    pub fn of(matrix: &'a Matrix) -> Self {
        Self { matrix, prescribed: None, scale: 1.0, phases: None }
    }

    /// `y` ← A `x`.
    pub(super) fn multiply(self, x: &Vector, y: &mut Vector) -> Result<(), PetscError> {
        self.timed(PRODUCT, 1.0, || self.matrix.multiply(x, y))
    }

    /// Does `work`, which is this part of a call, and adds its time to a phase.
    pub(super) fn timed<R>(self, name: &'static str, call: f64, work: impl FnOnce() -> R) -> R {
        match self.phases {
            Some(phases) => phases.time_part(name, call, work),
            None => work(),
        }
    }
}
