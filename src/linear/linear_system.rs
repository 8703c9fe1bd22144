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
    /// The phases to which the parts of a solve add their time.
    pub phase_names: Option<PhaseNames<'a>>,
}

/// The names of the phases of a solve.
#[derive(Clone, Copy)]
pub struct PhaseNames<'a> {
    /// The record of phases.
    pub phases: &'a Phases,
    /// A new factor.
    pub factorisation: &'static str,
    /// A change of the prescribed unknowns in a condensed factor.
    pub prescription: &'static str,
    /// An application of the factor.
    pub triangular_solves: &'static str,
    /// A product with A.
    pub product: &'static str,
}

impl<'a> LinearSystem<'a> {
    /// A x = b.
    pub fn of(matrix: &'a Matrix) -> Self {
        Self { matrix, prescribed: None, scale: 1.0, phase_names: None }
    }

    /// `y` ← A `x`.
    pub(super) fn multiply(self, x: &Vector, y: &mut Vector) -> Result<(), PetscError> {
        let bytes = self.matrix.bytes_per_product();
        self.timed(|phase_names| phase_names.product, (1.0, bytes), || self.matrix.multiply(x, y))
    }

    /// Does `work`, which is this part of a call and reads and writes these bytes, and adds its time to a phase.
    pub(super) fn timed<R>(
        self,
        name: impl FnOnce(&PhaseNames) -> &'static str,
        moved: (f64, f64),
        work: impl FnOnce() -> R,
    ) -> R {
        match self.phase_names {
            Some(phase_names) => phase_names.phases.time_moving(name(&phase_names), moved, work),
            None => work(),
        }
    }
}
