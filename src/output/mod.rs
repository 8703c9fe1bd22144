//! The results of a run: `fields.pvd` with its frames, `history.csv`, `contact.csv`, `summary.json`; and the
//! common output at the terminal.
//!
//! - [`FieldWriter`] writes the fields of a state as a frame, one VTU file per rank;
//! - [`Table`] writes CSV files row by row;
//! - other files appear whole ([`write_whole`]).
//!
//! What crosses the door: `command` hands over an `ObservedProblem`, its states and the records of its steps. All names
//! of files in a folder of results are here, and so is the rule which of them a new run removes.

mod contact;
mod growing_file;
pub mod terminal;
mod vtk;
mod vtu;

pub use vtu::{FieldWriter, FieldsWritten};

use crate::{
    mesh,
    scene::{AsRun, Scene, Stepping},
    whole_file::{self, PARTIAL},
};
use growing_file::GrowingFile;
pub use growing_file::Written;
use serde::Serialize;
use std::{
    fs::{self, File, TryLockError},
    io::Read,
    path::{Path, PathBuf},
};

/// The results could not be written.
#[derive(thiserror::Error)]
#[error("cannot write {path}: {reason}")]
pub struct OutputError {
    path: PathBuf,
    reason: String,
}

debug_is_message!(OutputError);

impl OutputError {
    /// The file at `path` cannot be written.
    pub fn new(path: &Path, reason: impl ToString) -> Self {
        Self { path: path.to_owned(), reason: reason.to_string() }
    }
}

/// Creates `folder`.
///
/// # Errors
/// The folder is a link, or it cannot be created or written to.
pub fn create(folder: &Path) -> Result<(), OutputError> {
    if folder.is_symlink() {
        let problem = "a link is there; name the folder that it leads to, or move the link away";
        return Err(OutputError::new(folder, problem));
    }
    fs::create_dir_all(folder).map_err(|e| OutputError::new(folder, e))?;
    // Only writing shows whether a folder is writable.
    tempfile::tempfile_in(folder).map_err(|e| OutputError::new(folder, e))?;
    Ok(())
}

/// Checks that `folder` or the existing folder in which it would be created can be written to.
///
/// # Errors
/// It cannot.
pub fn check_is_writable(folder: &Path) -> Result<(), OutputError> {
    let absolute = std::path::absolute(folder).map_err(|e| OutputError::new(folder, e))?;
    let existing = absolute.ancestors().find(|path| path.exists()).unwrap_or(folder);
    tempfile::tempfile_in(existing).map_err(|e| OutputError::new(folder, e)).map(drop)
}

/// The scene of the run. It replaces the file of an earlier run, which may be the present scene itself.
pub const SCENE: &str = "scene.toml";

/// The first words of a checkpoint.
pub const CHECKPOINT: &str = "signorini checkpoint";

/// The adapted mesh.
pub const MESH: &str = "mesh.msh";
/// The last line of an adapted mesh.
pub const ADAPTED: &str =
    "$Comments\nAdapted by signorini for the results beside it.\n$EndComments\n";

/// Refuses a place for a file where something is that this program did not write.
///
/// # Errors
/// The message names the place.
pub fn check_is_own(path: &Path, is_own: impl FnOnce() -> bool) -> Result<(), OutputError> {
    let reason = "no run left it there; choose another folder with --out, or move it away";
    let refused = || OutputError::new(path, reason);
    whole_file::is_free(path, is_own).then_some(()).ok_or_else(refused)
}

/// Whether a file begins with these bytes.
fn begins(path: &Path, start: &str) -> bool {
    let mut first = Vec::new();
    let read = File::open(path).and_then(|f| f.take(start.len() as u64).read_to_end(&mut first));
    read.is_ok() && first == start.as_bytes()
}

/// Creates `folder` and locks it against other runs, until the returned file is dropped (flock(2); some file
/// systems have no locks).
///
/// # Errors
/// The folder cannot be created or written to, another run has locked it, or it contains a file of the user
/// with the name of a result. Folders of earlier runs contain their scene.
pub fn lock(folder: &Path) -> Result<Option<File>, OutputError> {
    create(folder)?;
    let scene = folder.join(SCENE);
    check_is_own(&scene, || begins(&scene, AsRun::FIRST_LINE))?;
    let is_own = scene.exists();
    for (name, path) in files(folder)? {
        if checkpoint(&name).is_some() {
            check_is_own(&path, || begins(&path, CHECKPOINT))?;
        } else if is_result(&name) {
            check_is_own(&path, || is_own)?;
        }
    }
    let file = File::open(folder).map_err(|e| OutputError::new(folder, e))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::Error(_)) => Ok(None),
        Err(TryLockError::WouldBlock) => {
            let problem = "another run writes there; wait for its end, or choose another --out";
            Err(OutputError::new(folder, problem))
        }
    }
}

/// The files of a run besides frames, and what is made from them besides pictures.
const FILES: &str = "contact.csv contact.pvd fields.pvd history.csv summary.json";
const MADE: &str = "report.html report.pdf open_in_paraview.py";
/// The pictures, in alphabetical order.
const PICTURES: &str = "contact-evolution damage damage-history deformed force-displacement \
     force-displacement-together mesh pressure pressure-together principal-stresses setting stress \
     stress-damage times";
/// Curves of fields are `CURVES_….csv` and pictures.
const CURVES: &str = "curves";
/// The name of a file without its ending, in two parts at the first `_`; and the ending.
fn parts(name: &str) -> [&str; 3] {
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
    let (kind, rest) = stem.split_once('_').unwrap_or((stem, ""));
    [kind, rest, ending]
}

/// Whether `name` is the name of a result or of what is made from results: frames are `fields_NNNN[_R].[p]vtu` and
/// `contact_NNNN.vtu`.
fn is_result(name: &str) -> bool {
    let [kind, rest, ending] = parts(name);
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    match ending {
        _ if AsRun::is_copy(name) || FILES.split(' ').any(|known| known == name) => true,
        "vtu" | "pvtu" => ["fields", "contact"].contains(&kind) && rest.split('_').all(is_number),
        _ => is_made(name),
    }
}

/// Whether `name` is the name of a report, a curve or a picture, which is `NAME[_tTIME][_zoom].png`.
fn is_made(name: &str) -> bool {
    let [kind, rest, ending] = parts(name);
    match ending {
        _ if MADE.split(' ').any(|known| known == name) => true,
        "csv" | "png" | "svg" | "pdf" if kind == CURVES => true,
        "png" | "svg" | "pdf" | "gif" | "mp4" => {
            PICTURES.split(' ').any(|known| known == kind)
                && (rest.is_empty() || rest.starts_with('t') || rest == "zoom")
        }
        _ => false,
    }
}

/// The checkpoints of a rank in `folder`, `checkpoint_STEP_RANK`, with their steps.
pub fn checkpoints(folder: &Path, rank: usize) -> Vec<(usize, PathBuf)> {
    let checkpoint = |(name, path): (String, PathBuf)| {
        let (step, of_rank) = checkpoint(&name)?;
        (of_rank == rank).then_some((step, path))
    };
    files(folder).into_iter().flatten().filter_map(checkpoint).collect()
}

/// The names and paths of the files in a folder.
fn files(folder: &Path) -> Result<Vec<(String, PathBuf)>, OutputError> {
    let entries = fs::read_dir(folder).map_err(|e| OutputError::new(folder, e))?.flatten();
    let named =
        |entry: fs::DirEntry| (entry.file_name().to_string_lossy().into_owned(), entry.path());
    Ok(entries.map(named).collect())
}

/// The step and the rank of a file, if its `name` is that of a checkpoint.
fn checkpoint(name: &str) -> Option<(usize, usize)> {
    let (step, rank) = name.strip_prefix("checkpoint_")?.split_once('_')?;
    Some((step.parse().ok()?, rank.parse().ok()?))
}

/// Removes the results of an earlier run from `folder`, with its figures, its incomplete files and its adapted
/// mesh. The files `in_use` stay.
///
/// # Errors
/// A file cannot be removed.
pub fn prepare(folder: &Path, in_use: &[&Path]) -> Result<(), OutputError> {
    let adapted = is_adapted(&folder.join(MESH));
    remove(folder, |name| {
        let is_old = is_result(name)
            || is_partial(name)
            || checkpoint(name).is_some()
            || (name == MESH && adapted);
        is_old && !in_use.iter().any(|file| is_same_file(&folder.join(name), file))
    })
}

/// Copies a file into the results, if it is not there already. It names the files that it reads as their `copies`.
///
/// # Errors
/// It cannot be read or written.
pub fn copy(from: &Path, to: &Path, copies: &[(String, PathBuf)]) -> Result<(), OutputError> {
    if is_same_file(from, to) {
        return Ok(());
    }
    let content = mesh::renamed(from, copies).map_err(|error| OutputError::new(to, error))?;
    write_whole(to, &content)
}

/// Whether `file` is the adapted mesh of a run.
pub fn is_adapted(file: &Path) -> bool {
    fs::symlink_metadata(file).is_ok_and(|there| there.is_file())
        && fs::read_to_string(file).is_ok_and(|text| text.ends_with(ADAPTED))
}

/// Whether both paths lead to one file.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Removes the incomplete files of a killed run from `folder`, and the pictures and reports that show it as it was.
///
/// # Errors
/// A file cannot be removed.
pub fn remove_outdated(folder: &Path) -> Result<(), OutputError> {
    remove(folder, |name| is_partial(name) || is_made(name))
}

fn is_partial(name: &str) -> bool {
    name.starts_with(PARTIAL)
}

fn remove(folder: &Path, is_old: impl Fn(&str) -> bool) -> Result<(), OutputError> {
    let mut old = files(folder)?.into_iter().filter(|(name, _)| is_old(name));
    old.try_for_each(|(_, path)| fs::remove_file(&path).map_err(|e| OutputError::new(&path, e)))
}

/// The number of digits in the numbers of all frames, so that their names sort: four, or more for more frames.
fn digits(scene: &Scene) -> usize {
    let stepping = scene.time.map(|grid| grid.stepping);
    let frames = match (scene.output.every, stepping) {
        (Some(every @ 1..), Some(Stepping::Uniform { steps })) => steps / every + 2,
        (Some(1..), Some(Stepping::Auto { .. })) => 999_999,
        _ => 1,
    };
    4.max(frames.ilog10() as usize + 1)
}

/// A CSV file that grows by rows. Each row is written at once, so that one can follow the run.
#[derive(Debug)]
pub struct Table(GrowingFile);

impl Table {
    /// The table at `path`. Its first columns are the fields of a row like `example`, its other columns `more`.
    /// The first rows create the file.
    ///
    /// # Errors
    /// The names of the columns cannot be written.
    pub fn new(
        path: PathBuf,
        example: &impl Serialize,
        more: &[&str],
    ) -> Result<Self, OutputError> {
        let header = csv_text(true, [example]).and_then(|example| {
            let mut example = csv::Reader::from_reader(&example[..]);
            let columns = example.headers()?.iter().chain(more.iter().copied());
            csv_text(false, [columns.collect::<Vec<_>>()])
        });
        let header = header.map_err(|e| OutputError::new(&path, e))?;
        Ok(Self(GrowingFile::new(path, String::from_utf8_lossy(&header).into_owned(), "")))
    }

    /// Length and checksum of the file, for a checkpoint; `None` until the first rows create it.
    pub fn written(&self) -> Option<Written> {
        self.0.written
    }

    /// Continues the existing file after what was `written` at a checkpoint.
    ///
    /// # Errors
    /// The file was changed since.
    pub fn resume(&mut self, written: Option<Written>) -> Result<(), OutputError> {
        self.0.resume(written)
    }

    /// Appends rows.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add<T: Serialize>(&mut self, rows: &[T]) -> Result<(), OutputError> {
        let text = csv_text(false, rows).map_err(|e| OutputError::new(&self.0.path, e))?;
        self.0.add(&text)
    }
}

/// Rows as text, with a header of the names of their fields if wanted.
fn csv_text<T: Serialize>(
    headers: bool,
    rows: impl IntoIterator<Item = T>,
) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::WriterBuilder::new().has_headers(headers).from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| writer.serialize(row))?;
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// Writes a file that appears complete or not at all: a complete temporary file beside it is renamed.
///
/// # Errors
/// The file cannot be written.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<(), OutputError> {
    whole_file::write(path, content, |_| Ok(())).map_err(|e| OutputError::new(path, e))
}

/// As [`write_whole`]; the file is on the disk before it replaces another one.
///
/// # Errors
/// The file cannot be written.
pub fn write_synced(path: &Path, content: &[u8]) -> Result<(), OutputError> {
    whole_file::write(path, content, File::sync_all).map_err(|e| OutputError::new(path, e))
}
