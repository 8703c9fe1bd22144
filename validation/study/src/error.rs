//! Why a study could not be carried out.

use signorini::{
    evolution::{RunError, SetupError},
    mesh::MeshError,
    output::OutputError,
    petsc::PetscError,
    scene::SceneError,
};

/// A study could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A scene of the study is wrong or does not fit its mesh.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A run ended in a way the study does not expect.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A mesh cannot be used.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A map of another name was asked for.
    #[error("{0}")]
    UnknownMap(String),
    /// The program under study gave wrong answers without saying so.
    #[error("{0} wrong answers went unreported; see the tables")]
    Wrong(usize),
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
    /// A file could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl StudyError {
    /// Whether the input is to blame, and no solver.
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::Run(_) | Self::Wrong(_) | Self::Petsc(_))
    }
}
