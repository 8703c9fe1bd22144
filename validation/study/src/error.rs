//! Why a study could not be carried out.

use super::ReferenceError;
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
    /// The scene or the options do not suit the study: what is wrong, and what to do.
    #[error("{0}")]
    Unsuitable(String),
    /// A run that was to reach T did not.
    #[error(
        "{scene}: on {nodes} nodes the run stops at ζ_* at t = {time}; a study compares runs that \
         reach the end: choose a scene, a time.end or a step that does"
    )]
    Stopped {
        /// The scene file.
        scene: String,
        /// Nodes of its mesh.
        nodes: usize,
        /// When, s.
        time: f64,
    },
    /// The reference solution cannot be used.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
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
        !matches!(self, Self::Run(_) | Self::Stopped { .. } | Self::Wrong(_) | Self::Petsc(_))
    }
}
