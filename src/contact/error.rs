//! Errors in contact conditions and in the answers of solvers.

use super::{ContactReport, Kkt};
use crate::mesh::SAME_DIRECTION;
use crate::petsc::{Communicator, PetscError};

/// Displacement conditions at a node that contradict each other.
#[derive(Debug, Clone, thiserror::Error)]
#[error("at node ({}, {}), {conflict}", at[0], at[1])]
pub struct ConstraintError {
    /// Coordinates of the node, m.
    pub at: [f64; 2],
    /// The contradiction.
    pub conflict: Conflict,
}

/// How displacement conditions contradict each other.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Conflict {
    /// A prescribed displacement goes through the obstacle; the depth, m.
    #[error(
        "the prescribed displacement goes {0:.3e} through the obstacle: a node that is both \
         prescribed and in contact keeps its prescribed value, which must respect the gap"
    )]
    Penetrates(f64),
    /// Two prescribed values contradict each other.
    #[error(
        "two boundaries prescribe different displacements: {} and {} along ({:.3}, {:.3})",
        values[0], values[1], direction[0], direction[1]
    )]
    Contradicts {
        /// The value implied by the other conditions, and the prescribed one, m.
        values: [f64; 2],
        /// The common direction.
        direction: [f64; 2],
    },
    /// Two obstacles overlap at a node; by how much, m.
    #[error(
        "the obstacles on both sides leave no room: the node would have to be {0:.3e} inside one \
         of them; widen a gap or change the displacement prescribed there"
    )]
    NoRoom(f64),
    /// Two directions are nearly parallel; the angle between their lines, rad.
    #[error(
        "two conditions (prescribed directions or contact normals) differ from one line by an angle \
         of only {0:.1e}: double precision cannot tell their effects apart; open the wedge there \
         beyond {SAME_DIRECTION:e} rad, or let one boundary end before the node"
    )]
    Dependent(f64),
    /// More independent conditions than the two unknowns of a node.
    #[error(
        "more than two independent conditions (prescribed directions and contact normals) meet: a \
         node of the plane has two unknowns; free one of them or separate the boundaries"
    )]
    TooMany,
}

/// A failed contact solve.
///
/// [`RunError`](crate::evolution::RunError) adds advice, which depends on the scene.
#[derive(Debug, thiserror::Error)]
pub enum ContactError {
    /// The method ended above the tolerance. It leaves its best answer in c.
    #[error("{method} stopped after {} iterations: {detail}", report.iterations)]
    NotConverged {
        /// The solver's name, with its variant.
        method: String,
        /// The cost of the solve.
        report: Box<ContactReport>,
        /// The residuals at the end, if known.
        residuals: Kkt,
        /// The reason.
        detail: String,
    },
    /// PETSc failed inside the method.
    #[error("{method} cannot solve this: {source}")]
    Failed {
        /// The solver's name, with its variant.
        method: String,
        /// The error of PETSc.
        source: PetscError,
    },
    /// The answer does not satisfy the KKT conditions.
    #[error("{method} gave an answer, but {}", residuals.missed(*tolerance))]
    NotCertified {
        /// The solver's name.
        method: &'static str,
        /// The tolerance missed.
        tolerance: f64,
        /// The residuals found.
        residuals: Kkt,
    },
    /// The answer satisfies the KKT conditions of a stiffness that is not positive definite.
    #[error(
        "{method} gave an answer that stores negative energy: the stiffness is not positive definite"
    )]
    NotDefinite {
        /// The solver's name.
        method: &'static str,
    },
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
}

impl ContactError {
    /// A method ended above the tolerance.
    pub fn stopped(
        method: &str,
        report: ContactReport,
        residuals: Kkt,
        detail: impl Into<String>,
    ) -> Self {
        let (method, report) = (method.to_owned(), Box::new(report));
        Self::NotConverged { method, report, residuals, detail: detail.into() }
    }

    /// Did the method miss the tolerance?
    pub fn is_missed(&self) -> bool {
        matches!(self, Self::NotConverged { .. } | Self::NotCertified { .. })
    }

    /// May another method succeed? All ranks return the same, so an error inside PETSc counts only on one
    /// rank.
    pub fn may_be_rescued(&self, comm: Communicator) -> bool {
        match self {
            Self::Failed { .. } => comm.is_serial(),
            error => error.is_missed(),
        }
    }
}
