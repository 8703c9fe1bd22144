//! A growing file that is complete at any time, even if the program is killed.

use super::{OutputError, write_whole};
use crate::whole_file;
use std::{
    fs::{self, File},
    io,
    os::unix::fs::{FileExt, MetadataExt},
    path::{Path, PathBuf},
};

/// A file of pieces between a beginning and an ending. The first piece creates the file with both. Each further
/// piece and a new ending replace the old ending in one write.
#[derive(Debug)]
pub(super) struct GrowingFile {
    pub(super) path: PathBuf,
    beginning: String,
    ending: &'static str,
    /// The number of bytes before the ending; `None` before the file exists. A restart sets the number of its
    /// checkpoint.
    pub(super) length: Option<u64>,
}

impl GrowingFile {
    pub(super) fn new(path: PathBuf, beginning: String, ending: &'static str) -> Self {
        Self { path, beginning, ending, length: None }
    }

    /// Adds a piece.
    pub(super) fn add(&mut self, piece: &[u8]) -> Result<(), OutputError> {
        let length = match self.length {
            Some(length) => length,
            None => {
                write_whole(&self.path, [&self.beginning, self.ending].concat().as_bytes())?;
                self.beginning.len() as u64
            }
        };
        let failed = |error: io::Error| OutputError::new(&self.path, error);
        let file = open(&self.path, length).map_err(failed)?;
        let text = [piece, self.ending.as_bytes()].concat();
        let written = file.write_all_at(&text, length);
        // A full disk may take a part of the piece. Then the old ending is written again.
        let length = length + if written.is_ok() { piece.len() as u64 } else { 0 };
        let restored = match &written {
            Ok(()) => Ok(()),
            Err(_) => file.write_all_at(self.ending.as_bytes(), length),
        };
        let ended = restored.and_then(|()| file.set_len(length + self.ending.len() as u64));
        written.and(ended).map_err(failed)?;
        self.length = Some(length);
        Ok(())
    }
}

fn open(path: &Path, length: u64) -> io::Result<File> {
    // Another name of the file keeps its contents.
    if fs::metadata(path)?.nlink() > 1 {
        whole_file::write(path, &fs::read(path)?, |_| Ok(()))?;
    }
    let file = File::options().write(true).open(path)?;
    match file.metadata()?.len() < length {
        true => Err(io::Error::other("it is shorter than when the checkpoint was written")),
        false => Ok(file),
    }
}
