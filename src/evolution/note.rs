//! What a run found that its user should know.

use crate::contact::RigidMotion;
use std::fmt;

/// A remark on the answers of a run, for its summary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Note {
    /// The nodes that press leave a rigid motion, which the load does not drive: where none of
    /// the nodes that merely touch is in its way, there are other answers.
    Unheld {
        /// The time, s.
        time: f64,
        /// The motion.
        motion: RigidMotion,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Unheld { time, motion } => write!(
                f,
                "at t = {time}, no pressing node holds the body against {motion}: \
                 the answer may be one of many"
            ),
        }
    }
}
