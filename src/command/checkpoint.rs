//! Checkpoints: the files from which `signorini run --restart` goes on.
//!
//! Each rank has a file `checkpoint_STEP_RANK`: a line that tells the format, the hash of all that
//! follows, and a [`Header`] before the state of the run. The first rank writes its file when all others
//! have theirs, and older ones are removed after that: the latest one of the first rank is complete.

use super::{Failure, ranks::agree, task::Task};
use serde::{Deserialize, Serialize};
use signorini::{
    estimate::Adapted,
    evolution::StepRecord,
    output::{self, OutputError},
    petsc::Communicator,
};
use std::{
    fs,
    hash::{DefaultHasher, Hasher},
    path::{Path, PathBuf},
    sync::LazyLock,
};

/// What a file begins with.
const FORMAT: &[u8] = b"signorini checkpoint 1\n";

/// What the results depend on, to the last bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Origin {
    ranks: usize,
    /// The version and a hash of the program's file.
    program: String,
    /// Hashes of the scene as it is run with its tables and of PETSc's options, and of the mesh.
    scene: u64,
    mesh: u64,
}

/// What stands before the state of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Header {
    origin: Origin,
    /// n and t_n, s.
    pub step: usize,
    pub time: f64,
    /// How the mesh was adapted.
    pub adapted: Option<Adapted>,
}

/// A checkpoint that was read.
pub struct Checkpoint {
    pub header: Header,
    pub state: Vec<u8>,
}

impl Origin {
    fn of(task: &Task) -> Self {
        /// Of the program that runs, also where another one has taken its place since.
        static PROGRAM: LazyLock<u64> =
            LazyLock::new(|| fs::read("/proc/self/exe").map_or(0, |file| hash(&file)));
        // A mesh that cannot be encoded has no hash to differ by.
        let mesh = postcard::to_stdvec(task.problem.mesh()).unwrap_or_default();
        let scene = format!("{}{:?}", task.as_run, task.petsc);
        Self {
            ranks: task.problem.body.nodes.partition.comm().size(),
            program: format!("{} {:016x}", env!("CARGO_PKG_VERSION"), *PROGRAM),
            scene: hash(&[scene.as_bytes(), &task.tables].concat()),
            mesh: hash(&mesh),
        }
    }

    /// What differs from the run that a checkpoint was `made` in.
    fn difference(&self, made: &Self) -> Option<&'static str> {
        let same = [self.program == made.program, self.scene == made.scene, self.mesh == made.mesh];
        match same {
            [false, ..] => Some("another build of the program wrote it"),
            [_, false, _] => Some("the scene, its tables, --set or PETSc's options are others"),
            [.., is_same] => (!is_same).then_some("the mesh is another"),
        }
    }
}

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
        let read = read.and_then(|checkpoint| match checkpoint.header.origin.ranks {
            made if made == comm.size() => Ok(checkpoint),
            made => Err(format!(
                "it was written on {made} ranks, and this is a run on {} (--ranks {made} goes on)",
                comm.size()
            )),
        });
        agree(comm, read.map(Some).map_err(|reason| refusal(&path, &reason)))
    }

    /// On how many ranks the latest checkpoint in `folder` was written, if there is one that can be read.
    pub fn ranks(folder: &Path) -> Option<usize> {
        let (_, path) = output::checkpoints(folder, 0).into_iter().max()?;
        let checkpoint = Self::parse(&fs::read(path).ok()?).ok()?;
        Some(checkpoint.header.origin.ranks)
    }

    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let rest = bytes.strip_prefix(FORMAT).ok_or("it is no checkpoint of this version")?;
        let (expected, content) = rest.split_first_chunk().ok_or("it is cut off")?;
        if *expected != hash(content).to_le_bytes() {
            return Err("it is damaged".to_owned());
        }
        let (header, state): (Header, _) =
            postcard::take_from_bytes(content).map_err(|error| error.to_string())?;
        Ok(Self { header, state: state.to_vec() })
    }

    /// Refuses a checkpoint of another run.
    pub fn check(&self, task: &Task) -> Result<(), Failure> {
        let rank = task.problem.body.nodes.partition.comm().rank();
        let path = path(&task.folder, self.header.step, rank);
        let difference = Origin::of(task).difference(&self.header.origin);
        difference.map_or(Ok(()), |what| Err(refusal(&path, what)))
    }
}

fn refusal(path: &Path, reason: &str) -> Failure {
    Failure::input(format!(
        "cannot restart from {}: {reason}; without --restart the run begins anew",
        path.display()
    ))
}

/// Writes a checkpoint in the place of the one before. Collective.
pub fn write(task: &Task, record: &StepRecord, state: &[u8]) -> Result<(), OutputError> {
    let (comm, folder) = (task.problem.body.nodes.partition.comm(), &task.folder);
    let header = Header {
        origin: Origin::of(task),
        step: record.step,
        time: record.time,
        adapted: task.adapted.clone(),
    };
    let path = path(folder, record.step, comm.rank());
    let write = || {
        let header = postcard::to_stdvec(&header).map_err(|e| OutputError::new(&path, e))?;
        let content = [&header, state].concat();
        let file = [FORMAT, &hash(&content).to_le_bytes(), &content].concat();
        output::write_synced(&path, &file)
    };
    // The first rank writes last: its file says that all others are complete.
    let mut written = if comm.is_root() { Ok(()) } else { write() };
    if comm.all(written.is_ok()) && comm.is_root() {
        written = write();
    }
    if comm.all(written.is_ok()) {
        remove(folder, comm.rank(), Some(record.step));
    }
    written
}

/// Removes the checkpoints of a rank, but for that of the step to be `kept`.
pub fn remove(folder: &Path, rank: usize, kept: Option<usize>) {
    for (step, path) in output::checkpoints(folder, rank) {
        if Some(step) != kept {
            // One too many is not worth the end of a run.
            let _ = fs::remove_file(path);
        }
    }
}
