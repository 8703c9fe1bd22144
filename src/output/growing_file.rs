//! A growing file that is complete at any time, even if the program is killed.

use super::{OutputError, write_whole};
use crate::whole_file;
use serde::{Deserialize, Serialize};
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
    /// The content before the ending; `None` until the first piece creates the file.
    pub(super) written: Option<Written>,
}

/// The length and the checksum of a file without its ending. A checkpoint keeps them, so that a restart notices a changed file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// The number of bytes.
    length: u64,
    /// Their CRC-32.
    checksum: u32,
}

impl Written {
    fn and(self, piece: &[u8]) -> Self {
        let mut hasher = crc32fast::Hasher::new_with_initial(self.checksum);
        hasher.update(piece);
        Self { length: self.length + piece.len() as u64, checksum: hasher.finalize() }
    }
}

impl GrowingFile {
    pub(super) fn new(path: PathBuf, beginning: String, ending: &'static str) -> Self {
        Self { path, beginning, ending, written: None }
    }

    /// Continues after what was `written` at a checkpoint.
    ///
    /// # Errors
    /// The file does not begin with it.
    pub(super) fn resume(&mut self, written: Option<Written>) -> Result<(), OutputError> {
        self.written = written;
        let Some(written) = written else { return Ok(()) };
        let there = fs::read(&self.path).map_err(|error| OutputError::new(&self.path, error))?;
        let before = there.get(..written.length as usize);
        let is_same = before.is_some_and(|text| Written::default().and(text) == written);
        let problem = "it was changed after the checkpoint; restore it, or run without --restart";
        is_same.then_some(()).ok_or_else(|| OutputError::new(&self.path, problem))
    }

    /// Adds a piece.
    pub(super) fn add(&mut self, piece: &[u8]) -> Result<(), OutputError> {
        let before = match self.written {
            Some(before) => before,
            None => {
                write_whole(&self.path, [&self.beginning, self.ending].concat().as_bytes())?;
                Written::default().and(self.beginning.as_bytes())
            }
        };
        let failed = |error: io::Error| OutputError::new(&self.path, error);
        let file = open(&self.path, before.length).map_err(failed)?;
        let text = [piece, self.ending.as_bytes()].concat();
        let taken = file.write_all_at(&text, before.length);
        // A full disk may take a part of the piece. Then the old ending is written again.
        let after = if taken.is_ok() { before.and(piece) } else { before };
        let restored = match &taken {
            Ok(()) => Ok(()),
            Err(_) => file.write_all_at(self.ending.as_bytes(), after.length),
        };
        let ended = restored.and_then(|()| file.set_len(after.length + self.ending.len() as u64));
        taken.and(ended).map_err(failed)?;
        self.written = Some(after);
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
        true => Err(io::Error::other("another program has cut it")),
        false => Ok(file),
    }
}
