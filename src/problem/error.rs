//! Errors of a scene on its mesh.

use crate::{
    contact::{ConstraintError, DrivenMotion},
    scene::{SceneError, rounded},
};
use std::path::PathBuf;

/// Errors in the input: the scene and its mesh do not pose a problem.
#[derive(Debug, thiserror::Error)]
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
    /// A load, a prescribed displacement or a gap is not finite, and this rank does not know where.
    #[error(
        "{scene}: the body force or a value of a boundary is not finite or too large at t = {}; check its expression for divisions by zero, roots and logarithms \
         of negative numbers",
        rounded(*time)
    )]
    NotFinite {
        /// The scene file.
        scene: PathBuf,
        /// The time, s.
        time: f64,
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
