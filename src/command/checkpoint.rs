//! Checkpoints: the files with which `signorini run --restart` continues a run.
//!
//! Each rank has a file `checkpoint_STEP_RANK`: a line with the format, the hash of the rest, and a
//! [`Checkpoint`]. The first rank writes its file after all other ranks; then all ranks remove older files.
//! So the latest file of the first rank belongs to a complete checkpoint.

use super::{Failure, ranks::agree, task::Task};
use serde::{Deserialize, Serialize};
use signorini::{
    accuracy::LoopState,
    evolution::RunState,
    output::{self, FieldsWritten, OutputError, Written},
    petsc::Communicator,
    scene::AsRun,
};
use std::{
    fs,
    hash::{DefaultHasher, Hasher},
    path::{Path, PathBuf},
    sync::LazyLock,
};

/// The first line of a file.
const FORMAT: &[u8] = b"signorini checkpoint 7\n";

/// The state of a run between two steps.
#[derive(Serialize, Deserialize)]
pub struct Checkpoint {
    ranks: usize,
    origin: [u64; 3],
    pub accuracy: LoopState,
    pub recorded: Recorded,
    pub run: RunState,
}

/// The state of a recorder in a checkpoint.
#[derive(Serialize, Deserialize)]
pub struct Recorded {
    pub fields: FieldsWritten,
    /// Length and checksum of `history.csv`.
    pub history: Option<Written>,
}

/// Hashes of everything on which the results depend; see [`DIFFERENCES`].
fn origin(task: &Task) -> [u64; 3] {
    /// The hash of the running program, even if its file has been replaced since.
    static PROGRAM: LazyLock<u64> =
        LazyLock::new(|| fs::read("/proc/self/exe").map_or(0, |file| hash(&file)));
    // A mesh that cannot be encoded counts as empty.
    let mesh = postcard::to_stdvec(task.problem.mesh()).unwrap_or_default();
    let AsRun { text, tables, .. } = &task.as_run;
    let scene = format!("{text}{:?}", task.petsc);
    [*PROGRAM, hash(&[scene.as_bytes(), tables].concat()), hash(&mesh)]
}

/// Per hash: the message if it differs.
const DIFFERENCES: [&str; 3] = [
    "another build of the program wrote it",
    "the scene, its tables, --set, --solver or PETSc's options have changed",
    "the mesh has changed",
];

fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    hasher.finish()
}

fn path(folder: &Path, step: usize, rank: usize) -> PathBuf {
    folder.join(format!("checkpoint_{step}_{rank}"))
}

impl Checkpoint {
    /// The latest checkpoint in `folder`, if there is one. Collective.
    pub fn read(comm: Communicator, folder: &Path) -> Result<Option<Self>, Failure> {
        let steps = output::checkpoints(folder, comm.rank()).into_iter().map(|(step, _)| step);
        let step = comm.broadcast(0, steps.max().map_or(-1.0, |step| step as f64));
        if step < 0.0 {
            return Ok(None);
        }
        let path = path(folder, step as usize, comm.rank());
        let read = fs::read(&path).map_err(|error| error.to_string());
        let read = read.and_then(|bytes| Self::parse(&bytes));
        let read = read.and_then(|checkpoint| match checkpoint.ranks {
            made if made == comm.size() => Ok(checkpoint),
            made => Err(format!(
                "it was written on {made} ranks, and this run is on {} (use mpiexec -n {made})",
                comm.size()
            )),
        });
        agree(comm, read.map(Some).map_err(|reason| refusal(&path, &reason)))
    }

    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let rest = bytes.strip_prefix(FORMAT).ok_or("it is no checkpoint of this version")?;
        let (expected, content) = rest.split_first_chunk().ok_or("the file is cut off")?;
        if *expected != hash(content).to_le_bytes() {
            return Err("it is damaged".to_owned());
        }
        postcard::from_bytes(content).map_err(|_| DIFFERENCES[0].to_owned())
    }

    /// Checks that this is a checkpoint of the same run.
    pub fn check(&self, task: &Task) -> Result<(), Failure> {
        let mut origins = self.origin.into_iter().zip(origin(task));
        let Some(difference) = origins.position(|(made, own)| made != own) else { return Ok(()) };
        let rank = task.problem.body.comm().rank();
        let path = path(&task.folder, self.run.last().record.step, rank);
        Err(refusal(&path, DIFFERENCES[difference]))
    }
}

fn refusal(path: &Path, reason: &str) -> Failure {
    Failure::input(format!(
        "cannot restart from {}: {reason}; without --restart the run begins anew",
        path.display()
    ))
}

/// Writes a checkpoint that replaces the previous one. Collective.
pub fn write(task: &Task, recorded: Recorded, run: RunState) -> Result<(), OutputError> {
    let (comm, folder) = (task.problem.body.comm(), &task.folder);
    let step = run.last().record.step;
    let path = path(folder, step, comm.rank());
    let (accuracy, origin) = (task.accuracy.clone(), origin(task));
    let checkpoint = Checkpoint { ranks: comm.size(), origin, accuracy, recorded, run };
    let write = || {
        let content = postcard::to_stdvec(&checkpoint).map_err(|e| OutputError::new(&path, e))?;
        let file = [FORMAT, &hash(&content).to_le_bytes(), &content].concat();
        output::write_synced(&path, &file)
    };
    // The first rank writes last. Its file shows that the other files are complete.
    let mut written = if comm.is_root() { Ok(()) } else { write() };
    if comm.all(written.is_ok()) && comm.is_root() {
        written = write();
    }
    if comm.all(written.is_ok()) {
        remove(folder, comm.rank(), Some(step));
    }
    written
}

/// Removes the checkpoints of a rank except the one of the step `kept`.
pub fn remove(folder: &Path, rank: usize, kept: Option<usize>) {
    for (step, path) in output::checkpoints(folder, rank) {
        if Some(step) != kept {
            // A file too many is no reason to end the run.
            let _ = fs::remove_file(path);
        }
    }
}
