//! Errors that prevent a run or end it early.

use super::{DiscreteProblem, SetupError};
use crate::{
    contact::{ContactError, SolverError},
    fem::WrongSource,
    interrupt::Signal,
    petsc::PetscError,
    scene::rounded,
};

/// Why a run ended early.
#[derive(thiserror::Error)]
pub enum RunError {
    /// A contact step failed; the steps before it are accepted.
    #[error("{}{source}{advice}", time.map_or(String::new(), |t| format!("step {step} (t = {}): ", rounded(t))))]
    Contact {
        /// The step.
        step: usize,
        /// Its time, s; `None` for a static problem.
        time: Option<f64>,
        /// The failure.
        source: Box<ContactError>,
        /// Advice that follows the source; empty without one.
        advice: String,
    },
    /// Another part of a step failed; the steps before it are accepted.
    #[error("step {step} (t = {}): {source}", rounded(*time))]
    Step {
        /// The step.
        step: usize,
        /// Its time, s.
        time: f64,
        /// The failure.
        source: StepFailure,
    },
    /// The contact solver does not exist, or it cannot solve this problem.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// A damage source of another author has nothing to do.
    #[error(
        "a damage law is given, but the scene has no evolving damage: it needs [damage] and [time]"
    )]
    NoDamage,
    /// The scene contradicts itself at some time.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// Another rank failed, but this one did not.
    #[error("another rank failed")]
    OnAnotherRank,
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
    /// A signal has ended the run after an accepted step.
    #[error("ended by {0}")]
    Interrupted(Signal),
    /// An observer failed (its results cannot be written).
    #[error(transparent)]
    Observer(Box<dyn std::error::Error + Send + Sync>),
}

debug_is_message!(RunError);

/// The part of a step that failed, other than contact.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StepFailure {
    /// The damage system has no finite solution.
    #[error(
        "the damage equation has no finite answer: its source overflows or its matrix is not \
         positive definite; look for extreme numbers in [damage], the loads and the mesh, and for PETSc \
         options that begin with -damage_"
    )]
    Damage,
    /// The relative residual of the damage system is above its tolerance.
    #[error(
        "the damage equation was solved only to a residual of {0:.1e} of its right-hand side; look \
         for extreme numbers in [damage], for slivers in the mesh, and for PETSc options that \
         begin with -damage_pc_"
    )]
    DamageResidual(f64),
    /// The damage source is positive or no number.
    #[error(transparent)]
    Source(#[from] WrongSource),
    /// The energy of the displacements would overflow.
    #[error(
        "the largest displacement is {0:.1e}, which is too large; check the units and look for extreme \
         numbers in [material] and the loads"
    )]
    TooLarge(f64),
    /// The squares of the forces or of the displacements over- or underflow.
    #[error(
        "forces of {force:.1e} with displacements of {displacement:.1e} in the units of the scene: double precision cannot \
         hold their squares; choose other units, and look for extreme numbers in material.young, the loads, the \
         displacements and the mesh"
    )]
    Unrepresentable {
        /// The sum of all forces, N per metre of thickness.
        force: f64,
        /// The scale of the displacements, m.
        displacement: f64,
    },
    /// The error of an adaptive step is above the tolerance, however short the step is.
    #[error(
        "the damage changes too fast for time.tolerance, however short the step (does a load \
         jump?); set time.step to a number and remove accuracy"
    )]
    TooShort,
}

impl RunError {
    /// The contact solve of a step failed. The advice depends on the scene: another solver helps only with
    /// contact, and shorter steps help only after the first solve. Neither helps if rounding keeps the answer from the tolerance;
    /// it then allows about the tolerance `attainable`.
    pub(super) fn contact(
        problem: &DiscreteProblem,
        step: usize,
        time: f64,
        (source, attainable): (ContactError, Option<f64>),
    ) -> Self {
        let solver = if problem.has_contact() { ", another contact.solver" } else { "" };
        let steps = if step > 0 { ", shorter time steps" } else { "" };
        let reached = "; double precision reaches only about";
        let advice = match (attainable, problem.contrast()) {
            (Some(attainable), Some(contrast)) => format!(
                "{reached} {attainable:.0e} here because {contrast}: check the units of both, or if they are meant, set \
                 contact.tolerance to that or more"
            ),
            (Some(attainable), None) => format!(
                "{reached} {attainable:.0e} here (triangles or parts much longer than wide, nearly incompressible or almost \
                 broken material): set contact.tolerance to that or more, or mend the mesh"
            ),
            (None, _) if source.is_missed() => {
                format!("; try a larger contact.tolerance{solver}{steps}")
            }
            (None, _) => String::new(),
        };
        let time = problem.scene().time.map(|_| time);
        Self::Contact { step, time, source: Box::new(source), advice }
    }
}
