//! What a run works on.

use signorini::{
    estimate::{Adapted, Bar},
    evolution::Phases,
    problem::DiscreteProblem,
};
use std::{fs::File, path::PathBuf, time::Instant};

/// A run whose input is good.
pub struct Task<'a> {
    /// This rank's subdomain of it.
    pub problem: DiscreteProblem,
    /// Triangles of the whole body, and its nodes with a gap condition.
    pub triangles: usize,
    pub contact_nodes: usize,
    /// The name of the contact solver.
    pub solver: String,
    /// Where the results go.
    pub folder: PathBuf,
    /// The scene as it is run, as a file.
    pub as_run: String,
    /// What the files of its tables hold.
    pub tables: Vec<u8>,
    /// The mesh, where it was adapted.
    pub adapted: Option<Adapted>,
    /// The error bars of the figures that the mesh makes, where they were measured.
    pub bars: Vec<Bar>,
    /// Keeps other runs out of the folder.
    pub _lock: Option<File>,
    pub petsc: &'a [String],
    /// Whether the closing table has all that was timed.
    pub profile: bool,
    pub phases: &'a Phases,
    pub started: Instant,
}
