//! The task of a run.

use signorini::{
    estimate::{Adapted, Measured},
    interrupt::Interrupts,
    problem::DiscreteProblem,
    scene::AsRun,
};
use std::{fs::File, path::PathBuf, time::Instant};

/// A run with checked input.
pub struct Task<'a> {
    /// The problem on this rank's subdomain.
    pub problem: DiscreteProblem,
    /// The numbers of triangles and of nodes with a gap condition of the whole body.
    pub triangles: usize,
    pub contact_nodes: usize,
    /// The folder of the results.
    pub folder: PathBuf,
    /// The scene file in this folder.
    pub as_run: AsRun,
    /// The adapted mesh, if there is one.
    pub adapted: Option<Adapted>,
    /// The measured errors of the mesh; empty if they were not measured.
    pub measured: Measured,
    /// Is a proved bound on the error of u asked for?
    pub bound: bool,
    /// Is this a repetition with shorter steps?
    pub repeats: bool,
    /// Notes on the arguments and on the error bars.
    pub notes: Vec<String>,
    /// The lock of the folder against other runs.
    pub _lock: Option<File>,
    /// Signals are deferred from the first run on, whichever follows.
    pub _interrupts: Interrupts,
    pub petsc: &'a [String],
    pub started: Instant,
}
