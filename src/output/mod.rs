//! What a run leaves behind: `fields.pvd` with its frames, `history.csv`, `summary.json`.

mod array;
mod history;
mod pieces;
mod summary;
mod vtu;

pub use history::History;
pub use summary::Summary;
pub use vtu::FieldWriter;

use std::{
    io::Write,
    path::{Path, PathBuf},
};

/// The results could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {reason}")]
pub struct OutputError {
    path: PathBuf,
    reason: String,
}

impl OutputError {
    pub(crate) fn new(path: &Path, reason: impl ToString) -> Self {
        Self { path: path.to_owned(), reason: reason.to_string() }
    }
}

/// Creates `folder`.
///
/// # Errors
/// The folder cannot be created or written to.
pub fn create(folder: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(folder).map_err(|e| OutputError::new(folder, e))?;
    // Whether it can be written to shows only by writing.
    tempfile::tempfile_in(folder).map_err(|e| OutputError::new(folder, e))?;
    Ok(())
}

/// Creates `folder` and removes the results of an earlier run, so that none are mistaken for new.
///
/// # Errors
/// The folder cannot be created or written to.
pub fn prepare(folder: &Path) -> Result<(), OutputError> {
    create(folder)?;
    let entries = std::fs::read_dir(folder).map_err(|e| OutputError::new(folder, e))?;
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let frame = name.ends_with(".vtu") || name.ends_with(".pvtu");
        let ours = (name.starts_with("fields_") && frame)
            || ["fields.pvd", "history.csv", "summary.json"].contains(&name.as_ref());
        if ours {
            std::fs::remove_file(&path).map_err(|e| OutputError::new(&path, e))?;
        }
    }
    Ok(())
}

/// Writes a CSV file with a row per element, whole or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write_table<T: serde::Serialize>(path: &Path, rows: &[T]) -> Result<(), OutputError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|e| OutputError::new(path, e))?;
    }
    let content = writer.into_inner().map_err(|e| OutputError::new(path, e))?;
    write_whole(path, &content)
}

/// Writes a file whole or not at all: a temporary neighbour is renamed when complete.
///
/// # Errors
/// The file cannot be written.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<(), OutputError> {
    let failed = |e: &dyn ToString| OutputError::new(path, e.to_string());
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut file = tempfile::Builder::new()
        .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644))
        .tempfile_in(folder)
        .map_err(|e| failed(&e))?;
    file.write_all(content).map_err(|e| failed(&e))?;
    file.persist(path).map_err(|e| failed(&e))?;
    Ok(())
}
