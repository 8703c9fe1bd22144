//! Why a study could not be carried out.

use super::ReferenceError;
use crate::{
    evolution::{RunError, SetupError},
    mesh::MeshError,
    output::OutputError,
    petsc::PetscError,
    scene::SceneError,
};
use std::path::PathBuf;

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
    /// The scene or the options do not suit a study.
    #[error("{path}: {problem}")]
    Unsuitable {
        /// The scene file.
        path: PathBuf,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// A run that was to reach T did not.
    #[error(
        "{path}: on {nodes} nodes the run stops at ζ_* at t = {time}; a study compares runs that \
         reach the end: choose a scene, a time.end or a step that does"
    )]
    Stopped {
        /// The scene file.
        path: PathBuf,
        /// Nodes of its mesh.
        nodes: usize,
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
