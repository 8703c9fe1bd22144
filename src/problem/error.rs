//! Errors of a scene on its mesh.

use crate::{
    contact::{ConstraintError, DrivenMotion},
    scene::{SceneError, rounded},
};
use std::path::PathBuf;

/// Errors in the input: the scene and its mesh do not pose a problem.
#[derive(thiserror::Error)]
pub enum SetupError {
    /// The scene does not fit the mesh.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Displacement conditions contradict each other.
    #[error("{scene}: {}{source}", time.map_or(String::new(), |t| format!("at t = {}, ", rounded(t))))]
    Constraint {
        /// The scene file.
        scene: PathBuf,
        /// The time, s; `None` if they contradict each other at all times.
        time: Option<f64>,
        /// The contradiction.
        source: ConstraintError,
    },
    /// The load drives a rigid motion.
    #[error("{scene}: at t = {}, {source}", rounded(*time))]
    Driven {
        /// The scene file.
        scene: PathBuf,
        /// The first such time, s.
        time: f64,
        /// The motion.
        source: DrivenMotion,
    },
}

debug_is_message!(SetupError);
