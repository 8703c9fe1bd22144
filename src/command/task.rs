//! The task of a run.

use signorini::{
    accuracy::LoopState, interrupt::Interrupts, observe::ObservedProblem, scene::AsRun,
};
use std::{fs::File, path::PathBuf, time::Instant};

/// A run with checked input.
pub struct Task<'a> {
    /// The problem on this rank's subdomain.
    pub problem: ObservedProblem,
    /// The numbers of triangles and of nodes with a gap condition of the whole body.
    pub triangles: usize,
    pub contact_nodes: usize,
    /// The folder of the results.
    pub folder: PathBuf,
    /// The scene file in this folder.
    pub as_run: AsRun,
    /// The adapted mesh and the measured errors.
    pub accuracy: LoopState,
    /// Is a proved bound on the error of u asked for?
    pub bound: bool,
    /// Does the user want one line, or what an expert wants?
    pub quiet: bool,
    pub verbose: bool,
    /// Notes on the arguments.
    pub notes: Vec<String>,
    /// The lock of the folder against other runs.
    pub _lock: Option<File>,
    /// Signals are deferred from the first run on, whichever follows.
    pub _interrupts: Interrupts,
    pub petsc: &'a [String],
    pub started: Instant,
}
