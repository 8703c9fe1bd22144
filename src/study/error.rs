//! Why a study could not be carried out.

use super::ReferenceError;
use crate::{
    evolution::{RunError, SetupError},
    mesh::MeshError,
    output::OutputError,
    petsc::PetscError,
    scene::SceneError,
};

/// A study could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A scene of the study is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A mesh of the study is wrong.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A scene of the study does not fit its mesh.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A run ended in a way the study does not expect.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A run that was to reach T = 1 did not.
    #[error("a run of the study stopped at ζ_* at t = {time}; it was to reach T = 1")]
    Stopped {
        /// When, s.
        time: f64,
    },
    /// The reference solution cannot be used.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
    /// The table could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
